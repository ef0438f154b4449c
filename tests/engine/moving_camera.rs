//! A camera that moves: what it costs is what came into view, and the light is what it would be had the camera always been there.
#![allow(clippy::expect_used, reason = "a failed expectation fails the test")]

use crate::support::by_hand::{Mirror, drawn, engine_with, light, material, options, patch};
use glam::Vec3;
use penombre::geom::Ray;
use penombre::geom::bvh::Bvh;
use penombre::refine::engine::{Budget, Engine, Visible};
use penombre::refine::options::Options;
use penombre::refine::pixel_lists::FaceImage;
use penombre::scene::camera::{Camera, ImageSize, View};
use penombre::scene::light::LightKind;
use penombre::scene::material::Model;
use penombre::scene::{FaceId, Scene};
use std::collections::{BTreeMap, BTreeSet};

const SIZE: ImageSize = ImageSize { width: 64, height: 48 };

/// A long floor of small squares between two walls, one of them glossy, half in the shadow of a board.
fn corridor() -> Scene {
    let mut scene = Scene::default();
    let grey = material(&mut scene, |m| m.kd = Vec3::splat(0.6));
    let glossy = material(&mut scene, |m| {
        (m.kd, m.model) = (Vec3::splat(0.4), Model::phong(Vec3::splat(0.3), 12.0));
    });
    for (origin, u, v, material) in [
        (Vec3::new(-4.0, 0.0, -0.5), Vec3::Z, Vec3::X * 8.0, grey),
        (Vec3::new(-4.0, 0.0, -0.5), Vec3::X * 8.0, Vec3::Y, glossy),
        (Vec3::new(-4.0, 0.0, 0.5), Vec3::Y, Vec3::X * 8.0, grey),
    ] {
        patch(&mut scene, origin, u, v, 24, material);
    }
    patch(&mut scene, Vec3::new(-1.0, 0.6, -0.2), Vec3::Z * 0.4, Vec3::X * 2.0, 1, grey);
    light(&mut scene, LightKind::Point { position: Vec3::new(0.3, 1.6, 0.1), intensity: Vec3::ONE });
    light(&mut scene, LightKind::Point { position: Vec3::new(-2.5, 1.1, -0.2), intensity: Vec3::splat(0.5) });
    scene
}

/// What the camera sees from a place along the corridor, as the visibility pass tells it; `ahead` is where it looks.
fn look(scene: &Scene, bvh: &Bvh, (x, ahead): (f32, f32), generation: u32) -> Visible {
    let camera = Camera {
        position: Vec3::new(x, 1.2, 0.3),
        look_at: Vec3::new(x + ahead, 0.2, -0.1),
        up: Vec3::Y,
        vertical_fov: 50.0,
    };
    let view = scene.view(&camera, SIZE);
    let seen = |pixel: usize| {
        let direction = view.direction(SIZE.centre_of(pixel)).normalize();
        let hit = bvh.closest(scene, &Ray { origin: view.eye, direction, t_max: f32::INFINITY });
        hit.map_or(0, |hit| FaceId::new(hit.triangle, hit.back).0 + 1)
    };
    let faces: Vec<u32> = (0..SIZE.pixels()).map(seen).collect();
    let mut counts: BTreeMap<FaceId, u32> = BTreeMap::new();
    faces.iter().filter(|id| **id > 0).for_each(|id| *counts.entry(FaceId(id - 1)).or_default() += 1);
    let image = Some(FaceImage { view, faces: faces.into() });
    Visible { generation, eye: view.eye, image, faces: counts.into_iter().collect() }
}

/// An engine and what it has told the GPU, which draws each update at once.
struct Run {
    scene: Scene,
    bvh: Bvh,
    engine: Engine,
    mirror: Mirror,
    generation: u32,
}

impl Run {
    fn new(threads: usize) -> Self {
        let scene = corridor();
        let options = Options { min_pixels: 1.0, listed: true, indirect: true, tolerance: 4e-3, ..options(3) };
        let engine = engine_with(scene.clone(), threads, options);
        Self { bvh: Bvh::build(&scene), scene, engine, mirror: Mirror::default(), generation: 0 }
    }

    fn look(&mut self, x: f32) -> Visible {
        self.turn(x, 0.6)
    }

    fn turn(&mut self, x: f32, ahead: f32) -> Visible {
        self.generation += 1;
        let visible = look(&self.scene, &self.bvh, (x, ahead), self.generation);
        self.mirror.apply(self.engine.set_visible(&visible));
        visible
    }

    fn work(&mut self, batches: usize) {
        for _ in 0..batches {
            self.engine.counted(&drawn(&self.mirror));
            self.mirror.apply(self.engine.step(Budget::Rays(2_000)));
        }
    }

    /// D under each pixel of a view.
    fn shown(&self, visible: &Visible) -> Vec<Vec3> {
        let image = visible.image.as_ref().expect("an image");
        let of_face = |face: FaceId| {
            let triangles = self.mirror.mesh.drawn().filter(move |(_, drawn, _)| drawn.face == face);
            triangles.map(|(.., corners)| corners).collect::<Vec<_>>()
        };
        let faces: BTreeMap<FaceId, _> = visible.faces.iter().map(|&(face, _)| (face, of_face(face))).collect();
        let point = |view: &View, pixel: usize, face: FaceId| {
            let direction = view.direction(SIZE.centre_of(pixel));
            let normal = self.scene.area_vector(face.triangle());
            let from_eye = self.scene.corners(face.triangle())[0] - view.eye;
            view.eye + direction * (from_eye.dot(normal) / direction.dot(normal))
        };
        let seen = image.faces.iter().enumerate().filter(|(_, id)| **id > 0);
        let diffuse = seen.filter_map(|(pixel, id)| {
            let face = FaceId(id - 1);
            let place = point(&image.view, pixel, face);
            faces[&face].iter().find_map(|corners| crate::support::by_hand::interpolated(corners, place))
        });
        diffuse.collect()
    }
}

/// Mean difference against the mean.
fn difference(a: &[Vec3], b: &[Vec3]) -> f32 {
    assert_eq!(a.len(), b.len());
    let off: f32 = a.iter().zip(b).map(|(a, b)| (*a - *b).abs().x).sum();
    off / b.iter().map(|b| b.x).sum::<f32>()
}

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
