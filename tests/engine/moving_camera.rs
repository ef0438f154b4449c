//! A camera that moves: what it costs is what came into view, and the light is what it would be had the camera always been there.
#![allow(clippy::expect_used, reason = "a failed expectation fails the test")]

use crate::corridor::{Run, difference};
use glam::Vec3;
use penombre::refine::engine::Visible;
use penombre::scene::FaceId;
use std::collections::{BTreeMap, BTreeSet};

#[test]
fn a_move_tells_what_came_into_view_and_a_way_back_nothing() {
    let mut run = Run::new(2);
    let first = run.look(-1.0);
    run.work(40);
    let moved = run.look(-0.9);
    let known: Vec<FaceId> = first.faces.iter().map(|(face, _)| *face).collect();
    let new = moved.faces.iter().filter(|(face, _)| !known.contains(face)).count();
    assert!(new > 0 && new * 4 < moved.faces.len(), "{new} of {}", moved.faces.len());
    let told = &run.mirror.last;
    let revealed = told.patches.iter().filter(|patch| patch.old.is_empty());
    let revealed: BTreeSet<FaceId> = revealed.map(|patch| patch.face).collect();
    assert_eq!(revealed.len(), new, "each face that was never seen is drawn");
    let matt = |run: &Run| {
        let slots = run.mirror.last.slots.iter();
        slots.filter(|(slot, _)| run.engine.cache().slots[*slot].gloss().is_none()).count()
    };
    assert!(matt(&run) <= 6 * new, "{} slots for {new} faces", matt(&run));
    run.work(20);
    let rays = run.mirror.last.stats.rays;
    run.look(-1.0);
    let back = &run.mirror.last;
    assert!(back.patches.iter().all(|patch| patch.old == patch.new), "nothing is drawn that was not");
    assert_eq!((matt(&run), back.stats.rays), (0, rays), "highlights change, and nothing else does");
    assert!(back.stats.complete, "all of it was visited");
}

/// Where a lamp was found to shine, what comes into view beside it is shown lit before a ray is traced there.
#[test]
fn what_comes_into_view_shows_a_guess_at_once() {
    let mut run = Run::new(1);
    let first = run.look(-1.0);
    assert!(run.shown(&first).iter().all(|d| d.is_nan()), "nothing is known yet");
    run.work(40);
    let moved = run.look(-0.9);
    let unlit = run.mirror.last.stats.unlit;
    assert!(unlit > 0, "vertices wait to be visited");
    let guessed = run.shown(&moved);
    assert!(guessed.iter().all(|d| d.x.is_finite()), "every pixel shows something");
    run.work(60);
    let found = run.shown(&moved);
    let off = difference(&guessed, &found);
    assert!(off < 0.1, "{off}");
}

/// A camera that turns towards glossy faces that it saw from elsewhere shows highlights as they are from here.
#[test]
fn highlights_are_those_of_the_eye_wherever_faces_were_seen_from() {
    let mut run = Run::new(1);
    run.turn(-1.0, 0.6);
    run.work(40);
    run.turn(-0.4, 1.6);
    run.work(40);
    for ahead in [1.2, 0.8, 0.4, 0.0, -0.4] {
        run.turn(-0.4, ahead);
    }
    let of_faces = |run: &Run, visible: &Visible| {
        let seen = run.mirror.mesh.drawn().filter(|(_, drawn, _)| visible.faces.iter().any(|(f, _)| *f == drawn.face));
        let slots = seen.flat_map(|(_, drawn, corners)| drawn.slots.into_iter().zip(corners));
        slots.map(|(id, slot)| (id.0, slot.specular)).collect::<BTreeMap<u32, Vec3>>()
    };
    let visible = run.turn(-0.4, -0.4);
    let shown = of_faces(&run, &visible);
    // The eye moves, by nothing that could be seen: all is evaluated anew.
    run.turn(-0.400_01, -0.4);
    let anew = of_faces(&run, &visible);
    let most = anew.values().map(|s| s.x).fold(0.0, f32::max);
    assert!(most > 0.05 && anew.len() > 100, "{most} of {}", anew.len());
    for (slot, s) in &anew {
        assert!((shown[slot].x - s.x).abs() < 0.01 * most, "slot {slot}: {} for {}", shown[slot].x, s.x);
    }
}

/// Moves, cuts and returns at once, with little work between: updates fit the mesh, and nothing in view waits for ever.
#[test]
fn whatever_way_the_camera_takes_all_that_it_sees_is_visited() {
    let mut run = Run::new(1);
    for step in 0..60_u64 {
        let random = penombre::math::mix(step);
        let x = if random.is_multiple_of(3) {
            (random >> 8) as f32 % 7.0 - 3.5
        } else {
            -1.0 + 0.1 * (random >> 8) as f32 % 5.0
        };
        run.turn(x, if random.is_multiple_of(2) { 0.6 } else { -0.5 });
        run.work((random >> 40) as usize % 3);
    }
    let visible = run.look(-1.0);
    run.work(80);
    assert!(run.mirror.last.stats.complete && run.mirror.last.stats.estimated_error.is_some());
    let (cache, view) = (run.engine.cache(), run.engine.view());
    let leaves = view.visible_leaves(cache);
    assert!(leaves.len() >= visible.faces.len());
    for leaf in leaves {
        for vertex in cache.corner_vertices(leaf) {
            assert!(cache.vertices[vertex].progress.visited, "{vertex:?} at a corner of {leaf:?}");
        }
    }
    cache.validate();
}

#[test]
fn leaves_have_the_pixels_of_the_view_once_that_is_worked_out() {
    let mut run = Run::new(1);
    run.look(-1.2);
    run.work(20);
    run.look(-0.9);
    run.work(3);
    let visible = run.look(-0.6);
    run.work(60);
    let (cache, view) = (run.engine.cache(), run.engine.view());
    let pixels: BTreeMap<FaceId, u32> = visible.faces.iter().copied().collect();
    let mut counted: BTreeMap<FaceId, f32> = BTreeMap::new();
    for node in cache.topology.nodes.ids().filter(|&node| cache.topology.is_leaf(node)) {
        let face = cache.topology.nodes[node].face;
        assert_eq!(view.sees(node), pixels.contains_key(&face), "{face:?}");
        *counted.entry(face).or_default() += view.leaves[node].pixels;
    }
    for (face, sum) in counted {
        assert_eq!(sum, pixels.get(&face).copied().unwrap_or(0) as f32, "{face:?}");
    }
    cache.validate();
}

#[test]
fn nothing_rests_on_vertices_whose_faces_have_left_the_view() {
    let mut run = Run::new(1);
    run.look(-1.2);
    run.work(30);
    run.look(1.0);
    run.work(30);
    let (cache, view) = (run.engine.cache(), run.engine.view());
    let mut checked = 0;
    for vertex in cache.vertices.ids() {
        let around = cache.slots_of(vertex).flat_map(|slot| cache.drawn.with_slot(slot));
        let mut leaves = around.map(|drawn| cache.drawn.triangles[drawn].node).peekable();
        if leaves.peek().is_some() && leaves.all(|leaf| !view.sees(leaf)) {
            let importance = view.vertices[vertex].importance;
            assert!(importance < 1e-3, "{vertex:?}: {importance}");
            checked += 1;
        }
    }
    assert!(checked > 50, "{checked}");
}

#[test]
fn light_that_was_walked_to_is_that_of_a_camera_that_stood_there() {
    let mut walked = Run::new(2);
    for step in 0..8 {
        walked.look(-1.6 + 0.2 * step as f32);
        walked.work(4);
    }
    let visible = walked.look(0.0);
    walked.work(150);
    let mut stood = Run::new(2);
    stood.look(0.0);
    stood.work(150);
    let off = difference(&walked.shown(&visible), &stood.shown(&visible));
    assert!(off < 0.02, "{off}");
    let [a, b] = [&walked, &stood].map(|run| run.mirror.last.stats.estimated_error.expect("known"));
    assert!((0.4..2.5).contains(&(a / b)), "{a} {b}");
}

#[test]
fn a_walk_gives_the_same_bits_on_one_thread_and_on_several() {
    let walk = |threads: usize| {
        let mut run = Run::new(threads);
        for step in 0..4 {
            run.look(-1.0 + 0.3 * step as f32);
            run.work(5);
        }
        run.mirror.mesh.slots().map(|(id, slot)| (id, slot.diffuse.to_array().map(f32::to_bits))).collect::<Vec<_>>()
    };
    assert!(walk(1) == walk(5));
}
