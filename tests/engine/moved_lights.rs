//! Lights that move, without a GPU: direct light of the new place by one ray a vertex, indirect light in the limit.

use crate::relighting::{Shown, difference, direct, finish, mean, room_with, shown, solved, view};
use crate::support::by_hand::{Mirror, engine_with, light, material, options, patch};
use glam::Vec3;
use penombre::refine::engine::{Budget, Engine};
use penombre::refine::options::Options;
use penombre::refine::update::Shown as Showing;
use penombre::scene::light::{LightKind, LightState};
use penombre::scene::{Scene, TriangleId};

const FROM: Vec3 = Vec3::new(0.6, 1.2, -0.5);
/// On the other side of the block, below it.
const TO: Vec3 = Vec3::new(-0.7, 0.3, 0.4);

fn room(position: Vec3) -> (Scene, Vec<TriangleId>) {
    room_with([Vec3::ONE; 2], position)
}

/// The point light elsewhere, the lamp as it was.
fn at(position: Vec3) -> Vec<LightState> {
    vec![LightState { position: Some(position), ..LightState::default() }]
}

fn unrefined(seed: u64) -> Options {
    Options { min_pixels: f32::INFINITY, ..direct(seed) }
}

/// Steps until every vertex in view has been visited.
fn visit(engine: &mut Engine, mirror: &mut Mirror) {
    while !mirror.last.stats.complete {
        mirror.apply(engine.step(Budget::Rays(1)));
    }
}

/// Moves the light of a solved room; the room then.
fn moved(options: Options, threads: usize, rays: u64) -> (Engine, Mirror, Vec<TriangleId>) {
    let (scene, ids) = room(FROM);
    let mut engine = engine_with(scene, threads, options);
    let mut mirror = Mirror::default();
    mirror.apply(engine.set_visible(&view(1, &ids)));
    finish(&mut engine, &mut mirror, rays);
    mirror.apply(engine.relight(&at(TO), &view(2, &ids)));
    (engine, mirror, ids)
}

/// A ray a vertex at most, none for the lamp that stays, and direct light is that of a room that has the light there.
#[test]
fn direct_light_is_that_of_the_new_place_after_one_ray_a_vertex() {
    let (mut engine, mut mirror, _) = moved(unrefined(1), 1, u64::MAX);
    let (rays, guess) = (mirror.last.stats.rays, shown(&mirror));
    assert!(!mirror.last.stats.complete && mirror.last.stats.estimated_error.is_none());
    visit(&mut engine, &mut mirror);
    let taken = mirror.last.stats.rays - rays;
    assert!(taken > 40 && taken <= engine.cache().vertices.live() as u64, "{taken} rays");
    let (scene, ids) = room(TO);
    let (_, fresh) = solved(scene, &ids, unrefined(1), u64::MAX);
    let (worst, count) = difference(&shown(&mirror), &shown(&fresh));
    assert!(count > 100 && worst < 1e-5, "{worst} at {count} corners");
    let (guessed, _) = difference(&guess, &shown(&fresh));
    assert!(guessed > 0.05, "the block's shadow has moved: {guessed}");
    engine.cache().validate();
}

/// Root of the mean square difference of D, against the mean.
fn off(a: &Shown, b: &Shown) -> f32 {
    let pairs = || a.iter().filter_map(|(key, a)| Some((a[0], b.get(key)?[0])));
    let (count, sum) = (pairs().count() as f32, pairs().map(|(_, b)| b.element_sum() / 3.0).sum::<f32>());
    let square = pairs().map(|(a, b)| (a - b).length_squared() / 3.0).sum::<f32>();
    (square / count).sqrt() / (sum / count)
}

/// What was visible, with the light of the new place, is nearer to the truth than what was shown before; for a step of a drag by far.
#[test]
fn the_guess_is_what_was_visible_in_the_light_of_the_new_place() {
    for (to, least) in [(TO, 0.8), (FROM + Vec3::new(-0.05, 0.05, 0.0), 0.35)] {
        let (scene, ids) = room(FROM);
        let (mut engine, mut mirror) = solved(scene, &ids, unrefined(1), u64::MAX);
        let before = shown(&mirror);
        mirror.apply(engine.relight(&at(to), &view(2, &ids)));
        let guess = shown(&mirror);
        visit(&mut engine, &mut mirror);
        let truth = shown(&mirror);
        let (before, guess) = (off(&before, &truth), off(&guess, &truth));
        println!("{to}: {before:.3} before, {guess:.3} guessed");
        assert!(guess < least * before, "{to}: {before} before, {guess} guessed");
    }
}

#[test]
fn vertices_are_guessed_until_they_are_visited() {
    let (mut engine, mut mirror, _) = moved(unrefined(1), 1, u64::MAX);
    let guessed = |mirror: &Mirror| shown(mirror).values().filter(|v| v[0].y > 0.0).count();
    mirror.apply(engine.show(Showing::Knowledge));
    let (all, count) = (shown(&mirror).len(), guessed(&mirror));
    assert_eq!(count, all);
    visit(&mut engine, &mut mirror);
    assert_eq!(guessed(&mirror), 0);
}

/// There and back: what was traced is traced again, what was gathered is taken up again, bit for bit.
#[test]
fn back_again_all_is_as_it_was() {
    let (scene, ids) = room(FROM);
    let options = Options { indirect: true, filter: false, ..direct(2) };
    let (mut engine, mut mirror) = solved(scene, &ids, options, 300_000);
    mirror.apply(engine.settle());
    let before = shown(&mirror);
    for (generation, states) in (2..).zip([at(TO), Vec::new()]) {
        mirror.apply(engine.relight(&states, &view(generation, &ids)));
    }
    visit(&mut engine, &mut mirror);
    let after = shown(&mirror);
    let changed = |of: usize| after.iter().filter(|(key, value)| before[key][of].distance(value[of]) > 1e-4).count();
    assert_eq!((changed(0), changed(1), after.len()), (0, 0, before.len()));
}

/// Faces that were out of view when the light moved, and lit before that.
#[test]
fn what_comes_into_view_later_is_lit_from_the_new_place() {
    let (mut engine, mut mirror, ids) = moved(unrefined(1), 1, u64::MAX);
    visit(&mut engine, &mut mirror);
    // Fewer pixels than would make it another place, where all is revealed anew.
    let (part, rest) = ids.split_at(30);
    let fresh = shown(&mirror);
    mirror.apply(engine.set_visible(&view(3, part)));
    mirror.apply(engine.relight(&at(FROM), &view(4, part)));
    visit(&mut engine, &mut mirror);
    mirror.apply(engine.relight(&at(TO), &view(5, part)));
    visit(&mut engine, &mut mirror);
    mirror.apply(engine.set_visible(&view(6, &[part, rest].concat())));
    assert!(!mirror.last.stats.complete, "the rest is due");
    visit(&mut engine, &mut mirror);
    assert_eq!(difference(&shown(&mirror), &fresh), (0.0, fresh.len()));
}

/// After moves that are not waited for, what is shown goes to what a fresh run shows, indirect light included.
#[test]
fn the_picture_goes_to_that_of_a_fresh_run() {
    let refine = Options { indirect: true, ..direct(4) };
    let (scene, ids) = room(TO);
    let (_, fresh) = solved(scene, &ids, refine, 1_500_000);
    let (scene, _) = room(FROM);
    let (mut engine, mut mirror) = solved(scene, &ids, refine, 500_000);
    for step in 1..=4 {
        let to = FROM.lerp(TO, step as f32 / 4.0);
        let to = if step == 4 { TO } else { to };
        mirror.apply(engine.relight(&at(to), &view(step + 1, &ids)));
        mirror.apply(engine.step(Budget::Rays(100)));
    }
    let off = |mirror: &Mirror| -> f32 {
        let of_part = |part: &[TriangleId]| (mean(mirror, part) / mean(&fresh, part) - 1.0).abs().max_element();
        ids.chunks(2).map(of_part).fold(0.0, f32::max)
    };
    let guess = off(&mirror);
    finish(&mut engine, &mut mirror, 1_500_000);
    engine.cache().validate();
    let off = off(&mirror);
    println!("{off}; just after the moves {guess}");
    assert!(off < 0.025 && off < guess, "{off}; just after the moves {guess}");
}

#[test]
fn threads_do_not_change_what_a_move_shows() {
    let of = |threads| {
        let (mut engine, mut mirror, _) = moved(Options { indirect: true, ..direct(3) }, threads, 100_000);
        finish(&mut engine, &mut mirror, 100_000);
        shown(&mirror)
    };
    assert!(of(1) == of(3));
}

/// A floor under a row of lights that share light groups, one of which is elsewhere.
fn row(last: Vec3) -> (Scene, Vec<TriangleId>) {
    let mut scene = Scene::default();
    let grey = material(&mut scene, |m| m.kd = Vec3::splat(0.5));
    let ids = patch(&mut scene, Vec3::ZERO, Vec3::Z * 2.0, Vec3::X * 2.0, 4, grey);
    patch(&mut scene, Vec3::new(0.4, 0.5, 0.4), Vec3::Z * 0.8, Vec3::X * 0.8, 1, grey);
    let places = (0..7).map(|i| Vec3::new(0.3 * i as f32, 1.0, 1.0)).chain([last]);
    places.for_each(|position| light(&mut scene, LightKind::Point { position, intensity: Vec3::ONE }));
    (scene, ids)
}

#[test]
fn a_member_of_a_light_group_moves_alone() {
    let [from, to] = [2.1, 0.1].map(|x| Vec3::new(x, 1.0, 0.2));
    let options = Options { max_light_groups: 2, min_pixels: 100.0, shadow_size: 0.1, ..options(1) };
    let (scene, ids) = row(to);
    let (_, fresh) = solved(scene, &ids, options, 400_000);
    let (scene, _) = row(from);
    let (mut engine, mut mirror) = solved(scene, &ids, options, 400_000);
    let mut states = vec![LightState::default(); 8];
    states[7].position = Some(to);
    mirror.apply(engine.relight(&states, &view(2, &ids)));
    finish(&mut engine, &mut mirror, 400_000);
    let off = off(&shown(&mirror), &shown(&fresh));
    println!("{off}");
    assert!(off < 0.02, "{off}");
}
