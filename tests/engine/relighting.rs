//! Relighting without a GPU: direct light exactly and without a ray, indirect light in the limit; what a change of the view
//! keeps.
#![allow(clippy::expect_used, reason = "a failed expectation fails the test")]

use crate::support::by_hand::{Mirror, drawn, engine_with, light, material, options, patch};
use glam::Vec3;
use penombre::refine::engine::{Budget, Engine, Visible};
use penombre::refine::options::Options;
use penombre::scene::light::{LightKind, LightState};
use penombre::scene::material::Model;
use penombre::scene::{FaceId, Scene, TriangleId};
use std::collections::BTreeMap;

const EYE: Vec3 = Vec3::new(0.5, 1.0, -0.6);
const LAMP: Vec3 = Vec3::new(6.0, 5.0, 4.0);
const POINT: Vec3 = Vec3::new(0.4, 0.5, 0.8);
/// Where the point light is.
const PLACE: Vec3 = Vec3::new(0.6, 1.2, -0.5);

/// A closed room of side 2 about (0, 1, 0) with a glossy floor, a block in it, an area lamp under the ceiling and a point
/// light; what both emit is multiplied by `factors`.
fn room(factors: [Vec3; 2]) -> (Scene, Vec<TriangleId>) {
    room_with(factors, PLACE)
}

/// The same with the point light at a place.
pub(crate) fn room_with(factors: [Vec3; 2], position: Vec3) -> (Scene, Vec<TriangleId>) {
    let mut scene = Scene::default();
    let white = material(&mut scene, |m| m.kd = Vec3::splat(0.6));
    let glossy = material(&mut scene, |m| {
        m.kd = Vec3::splat(0.4);
        m.model = Model::phong(Vec3::splat(0.3), 20.0);
    });
    let bright = material(&mut scene, |m| m.ke = LAMP * factors[0]);
    let (x, y, z) = (Vec3::X * 2.0, Vec3::Y * 2.0, Vec3::Z * 2.0);
    let (lo, hi) = (Vec3::new(-1.0, 0.0, -1.0), Vec3::new(1.0, 2.0, 1.0));
    let mut ids = patch(&mut scene, lo, z, x, 2, glossy);
    for (origin, u, v) in [(hi, -x, -z), (lo, x, y), (hi, -y, -x), (lo, y, z), (hi, -z, -y)] {
        ids.extend(patch(&mut scene, origin, u, v, 2, white));
    }
    ids.extend(patch(&mut scene, Vec3::new(-0.3, 0.5, -0.3), Vec3::Z * 0.6, Vec3::X * 0.6, 1, white));
    let triangles = patch(&mut scene, Vec3::new(-0.3, 1.9, -0.3), Vec3::X * 0.6, Vec3::Z * 0.6, 1, bright);
    light(&mut scene, LightKind::Point { position, intensity: POINT * factors[1] });
    light(&mut scene, LightKind::Area { triangles });
    (scene, ids)
}

/// In the order of the scene's lights.
fn in_order([lamp, point]: [Vec3; 2]) -> Vec<LightState> {
    [point, lamp].map(LightState::times).to_vec()
}

pub(crate) fn view(generation: u32, ids: &[TriangleId]) -> Visible {
    Visible { generation, eye: EYE, image: None, faces: ids.iter().map(|&t| (FaceId::new(t, false), 2000)).collect() }
}

/// Steps until nothing is left or so many rays are traced.
pub(crate) fn finish(engine: &mut Engine, mirror: &mut Mirror, rays: u64) {
    let limit = mirror.last.stats.rays.saturating_add(rays);
    while !mirror.last.stats.converged && mirror.last.stats.rays < limit {
        mirror.apply(engine.step(Budget::Rays(50_000)));
        engine.counted(&drawn(mirror));
    }
}

pub(crate) fn solved(scene: Scene, ids: &[TriangleId], options: Options, rays: u64) -> (Engine, Mirror) {
    let mut engine = engine_with(scene, 1, options);
    let mut mirror = Mirror::default();
    mirror.apply(engine.set_visible(&view(1, ids)));
    finish(&mut engine, &mut mirror, rays);
    (engine, mirror)
}

/// D and S by position and face at the corners of what is drawn.
pub(crate) type Shown = BTreeMap<(u32, [u32; 3]), [Vec3; 2]>;

pub(crate) fn shown(mirror: &Mirror) -> Shown {
    let corners = mirror.mesh.drawn().flat_map(|(_, drawn, corners)| corners.map(|slot| (drawn.face, slot)));
    corners.map(|(face, s)| ((face.0, s.position.to_array().map(f32::to_bits)), [s.diffuse, s.specular])).collect()
}

/// Largest difference where both have a value, against the largest value; how many there are.
pub(crate) fn difference(a: &Shown, b: &Shown) -> (f32, usize) {
    let most = b.values().flatten().map(|v| v.max_element()).fold(0.0, f32::max);
    let pairs = || a.iter().filter_map(|(key, a)| Some((a, b.get(key)?)));
    let worst =
        pairs().flat_map(|(a, b)| [a[0] - b[0], a[1] - b[1]]).map(|d| d.abs().max_element()).fold(0.0, f32::max);
    (worst / most, pairs().count())
}

const CHANGES: [[Vec3; 2]; 4] = [
    [Vec3::splat(0.25), Vec3::ONE],
    [Vec3::new(0.2, 1.0, 3.0), Vec3::new(2.0, 0.5, 0.7)],
    [Vec3::ZERO, Vec3::splat(1.5)],
    [Vec3::ONE, Vec3::ZERO],
];

pub(crate) fn direct(seed: u64) -> Options {
    Options { min_pixels: 30.0, shadow_size: 0.1, ..options(seed) }
}

/// Light of a scene that says so, and of one changed to it, agree to rounding at every vertex that both have traced; and no ray
/// is traced for the change.
#[test]
fn direct_light_is_exact_at_once() {
    for factors in CHANGES {
        let (scene, ids) = room([Vec3::ONE; 2]);
        let (mut engine, mut mirror) =
            solved(scene, &ids, Options { min_pixels: f32::INFINITY, ..direct(1) }, u64::MAX);
        let rays = mirror.last.stats.rays;
        mirror.apply(engine.relight(&in_order(factors), &view(2, &ids)));
        assert_eq!(mirror.last.stats.rays, rays, "no ray");
        let changed = shown(&mirror);
        // A source that emits nothing is none for the loader; here it stays in place.
        let (scene, ids) = room(factors);
        let (_, fresh) = solved(scene, &ids, Options { min_pixels: f32::INFINITY, ..direct(1) }, u64::MAX);
        let (worst, count) = difference(&changed, &shown(&fresh));
        assert!(count > 100 && worst < 1e-5, "{factors:?}: {worst} at {count} corners");
    }
}

/// Dark at once, bright again at once: bit for bit, indirect light included, though other changes come between.
#[test]
fn switching_off_and_on_leaves_no_trace() {
    let (scene, ids) = room([Vec3::ONE; 2]);
    // The filter of what is shown depends on when neighbours were looked at last.
    let options = Options { indirect: true, filter: false, ..direct(2) };
    let (mut engine, mut mirror) = solved(scene, &ids, options, 300_000);
    mirror.apply(engine.settle());
    let (before, rays) = (shown(&mirror), mirror.last.stats.rays);
    for (generation, factors) in (2..).zip([[Vec3::ZERO; 2], [Vec3::ONE; 2], [Vec3::ZERO, Vec3::ONE], [Vec3::ONE; 2]]) {
        mirror.apply(engine.relight(&in_order(factors), &view(generation, &ids)));
        if factors == [Vec3::ZERO; 2] {
            assert!(shown(&mirror).values().flatten().all(|&v| v == Vec3::ZERO), "dark at once");
        }
    }
    assert_eq!(mirror.last.stats.rays, rays);
    let after = shown(&mirror);
    let changed = after.iter().filter(|(key, value)| before.get(key) != Some(value)).count();
    assert_eq!((changed, after.len()), (0, before.len()));
}

/// All lights at a fraction: indirect light is that fraction of what it was, at once.
#[test]
fn a_common_factor_scales_indirect_light() {
    let (scene, ids) = room([Vec3::ONE; 2]);
    let (mut engine, mut mirror) = solved(scene, &ids, Options { indirect: true, filter: false, ..direct(3) }, 300_000);
    mirror.apply(engine.settle());
    let (before, rays) = (shown(&mirror), mirror.last.stats.rays);
    let factor = Vec3::new(0.5, 0.25, 0.125);
    mirror.apply(engine.relight(&in_order([factor; 2]), &view(2, &ids)));
    assert_eq!(mirror.last.stats.rays, rays);
    for (key, [diffuse, _]) in shown(&mirror) {
        let expected = before[&key][0] * factor;
        // A slot keeps D to 6·10⁻⁵, and so do those that predict it; before and after.
        let kept = 4.0 * 6.2e-5 * expected.max_element();
        assert!((diffuse - expected).abs().max_element() <= kept, "{diffuse} {expected}");
    }
}

/// Until it is gathered again, indirect light is what it was times how much more the lights emit in all: nearer to what it will
/// be than what it was.
#[test]
fn the_first_guess_is_better_than_none() {
    let indirect = |engine: &Engine| -> Vec<Vec3> {
        let slots = &engine.cache().slots;
        slots.ids().map(|slot| slots[slot].indirect().diffuse).collect()
    };
    for factors in CHANGES {
        let (scene, ids) = room([Vec3::ONE; 2]);
        let (mut engine, mut mirror) = solved(scene, &ids, Options { indirect: true, ..direct(6) }, 300_000);
        let before = indirect(&engine);
        mirror.apply(engine.relight(&in_order(factors), &view(2, &ids)));
        let guess = indirect(&engine);
        finish(&mut engine, &mut mirror, 500_000);
        let after = indirect(&engine);
        let off = |a: &[Vec3]| a.iter().zip(&after).map(|(a, b)| (*a - *b).length_squared()).sum::<f32>().sqrt();
        let value = after.iter().map(|v| v.length_squared()).sum::<f32>().sqrt();
        println!("{factors:?}: {:.3} without, {:.3} with", off(&before) / value, off(&guess) / value);
        assert!(off(&guess) < 0.75 * off(&before), "{factors:?}: {} {}", off(&guess), off(&before));
    }
}

/// Mean over the drawn triangles, by area and by face.
pub(crate) fn mean(mirror: &Mirror, ids: &[TriangleId]) -> Vec3 {
    let mut sums = (Vec3::ZERO, 0.0);
    for [a, b, c] in ids.iter().flat_map(|&t| mirror.triangles(FaceId::new(t, false))) {
        let area = (b.position - a.position).cross(c.position - a.position).length();
        sums.0 += (a.diffuse + b.diffuse + c.diffuse) * (area / 3.0);
        sums.1 += area;
    }
    sums.0 / sums.1
}

/// After a change the solution goes to that of a fresh run, through several changes that are not waited for as well, and no value
/// on the way is black where light arrives.
#[test]
fn indirect_light_goes_to_that_of_a_fresh_run() {
    let refine = Options { indirect: true, ..direct(4) };
    let last = [Vec3::new(0.3, 0.6, 0.9), Vec3::splat(2.0)];
    let (scene, ids) = room(last);
    let (_, fresh) = solved(scene, &ids, refine, 1_500_000);
    let (scene, _) = room([Vec3::ONE; 2]);
    let (mut engine, mut mirror) = solved(scene, &ids, refine, 500_000);
    for (generation, factors) in (2..).zip(CHANGES.into_iter().chain([last])) {
        mirror.apply(engine.relight(&in_order(factors), &view(generation, &ids)));
        let lit = |v: &[Vec3; 2]| v[0].min_element() > 0.0;
        let (dark, all) = (shown(&mirror).values().filter(|v| !lit(v)).count(), shown(&mirror).len());
        assert!(dark * 50 < all, "{dark} of {all} values are black");
        mirror.apply(engine.step(Budget::Rays(3000)));
        engine.counted(&drawn(&mirror));
    }
    // The quarter of a wall that is furthest from what it should be.
    let off = |mirror: &Mirror| -> f32 {
        let of_part = |part: &[TriangleId]| (mean(mirror, part) / mean(&fresh, part) - 1.0).abs().max_element();
        ids.chunks(2).map(of_part).fold(0.0, f32::max)
    };
    let guess = off(&mirror);
    finish(&mut engine, &mut mirror, 1_500_000);
    engine.cache().validate();
    let off = off(&mirror);
    println!("{off}; just after the change {guess}");
    // Four seeds: 0.8 to 1.7 %, and 7 to 11 % before.
    assert!(off < 0.025 && off < guess, "{off}; just after the change {guess}");
}

/// A second look from the same place traces no direct ray, and another eye leaves D as it is.
#[test]
fn a_new_view_of_the_same_faces_traces_nothing() {
    let (scene, ids) = room([Vec3::ONE; 2]);
    let (mut engine, mut mirror) = solved(scene, &ids, direct(5), u64::MAX);
    let (before, stats) = (shown(&mirror), mirror.last.stats);
    mirror.apply(engine.set_visible(&view(2, &ids)));
    assert_eq!(shown(&mirror), before);
    mirror.apply(engine.set_visible(&Visible { eye: EYE + Vec3::X * 0.3, ..view(3, &ids) }));
    let moved = shown(&mirror);
    assert!(moved.iter().all(|(key, [d, _])| before[key][0] == *d), "D does not depend on the eye");
    assert!(moved.iter().any(|(key, [_, s])| before[key][1] != *s), "S does");
    assert_eq!((mirror.last.stats.rays, mirror.last.stats.vertices), (stats.rays, stats.vertices));
}
