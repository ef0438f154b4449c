//! Direct light at vertices against closed forms (docs/method/closed-forms.md).

use crate::support::by_hand::{Mirror, both_sides, engine, light, material, patch, solve, triangle};
use glam::Vec3;
use penombre::bsdf::phong::lobe;
use penombre::scene::light::LightKind;
use penombre::scene::material::{MaterialId, Model};
use penombre::scene::{FaceId, Scene, TriangleId};
use std::f32::consts::PI;

/// A floor [-2, 2]² at y = 0 facing up, 8 × 8 cells.
fn floor(scene: &mut Scene) -> Vec<TriangleId> {
    let grey = material(scene, |_| {});
    patch(scene, Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0, 8, grey)
}

/// Irradiance at every vertex of the front faces, with its position.
fn irradiances(mirror: &Mirror, triangles: &[TriangleId]) -> Vec<(Vec3, Vec3)> {
    let faces = triangles.iter().map(|&t| FaceId::new(t, false));
    faces.flat_map(|f| mirror.face(f)).map(|slot| (slot.position, slot.diffuse * PI)).collect()
}

/// To what part of its brightest channel a slot keeps D.
const KEPT: f32 = 7e-5;

fn close(a: f32, b: f32, relative: f32) -> bool {
    (a - b).abs() <= relative * b.abs().max(1e-6)
}

#[test]
fn point_light_over_a_plane() {
    let mut scene = Scene::default();
    let ids = floor(&mut scene);
    light(&mut scene, LightKind::Point { position: Vec3::new(0.3, 1.5, -0.2), intensity: Vec3::new(5.0, 3.0, 1.0) });
    let mirror = solve(&mut engine(scene, 1, 0), &both_sides(&ids), Vec3::Y);
    for (p, e) in irradiances(&mirror, &ids) {
        let (h, r2) = (1.5_f32, (p.x - 0.3).powi(2) + (p.z + 0.2).powi(2));
        let expected = h / (h * h + r2).powf(1.5);
        assert!(close(e.x, 5.0 * expected, KEPT) && close(e.z, expected, 5.0 * KEPT), "{p}: {e} {expected}");
    }
    // The other side of the floor sees nothing.
    for &t in &ids {
        assert!(mirror.face(FaceId::new(t, true)).iter().all(|s| s.diffuse == Vec3::ZERO && s.weight == 1.0));
    }
}

#[test]
fn spot_light_falls_off_between_its_angles() {
    let mut scene = Scene::default();
    let ids = floor(&mut scene);
    let (inner, outer) = (20.0_f32.to_radians(), 40.0_f32.to_radians());
    light(
        &mut scene,
        LightKind::Spot {
            position: Vec3::Y * 2.0,
            direction: Vec3::NEG_Y,
            intensity: Vec3::splat(4.0),
            cos_inner: inner.cos(),
            cos_outer: outer.cos(),
        },
    );
    let mirror = solve(&mut engine(scene, 1, 0), &both_sides(&ids), Vec3::Y);
    let (mut full, mut partial, mut dark) = (0, 0, 0);
    for (p, e) in irradiances(&mirror, &ids) {
        let d2 = p.length_squared() + 4.0;
        let cosine = 2.0 / d2.sqrt();
        let t = ((cosine - outer.cos()) / (inner.cos() - outer.cos())).clamp(0.0, 1.0);
        let expected = 4.0 / d2 * cosine * t * t * (3.0 - 2.0 * t);
        assert!((e.x - expected).abs() < 1e-5 + KEPT * expected, "{p}: {e} {expected}");
        match t {
            1.0 => full += 1,
            0.0 => dark += 1,
            _ => partial += 1,
        }
    }
    assert!(full > 0 && partial > 0 && dark > 0);
}

#[test]
fn directional_light_follows_the_cosine_and_casts_a_shadow() {
    let mut scene = Scene::default();
    let ids = floor(&mut scene);
    // A blocker over x > 0: its shadow at 45° falls on x in (-1.1, 0.9) for height 1.
    let blocker = patch(&mut scene, Vec3::new(0.1, 1.0, -3.0), Vec3::X * 2.0, Vec3::Z * 6.0, 1, MaterialId(0));
    let direction = Vec3::new(-1.0, -1.0, 0.0).normalize();
    light(&mut scene, LightKind::Directional { direction, irradiance: Vec3::splat(2.0) });
    let mut faces = both_sides(&ids);
    faces.extend(both_sides(&blocker));
    let mirror = solve(&mut engine(scene, 1, 0), &faces, Vec3::Y);
    for (p, e) in irradiances(&mirror, &ids) {
        let shadowed = p.x > -0.9 && p.x < 1.1;
        let expected = if shadowed { 0.0 } else { 2.0 * 0.5_f32.sqrt() };
        assert!((e.x - expected).abs() < 1e-5 + KEPT * expected, "{p}: {e} {expected}");
    }
    let above: Vec<FaceId> = blocker.iter().map(|&t| FaceId::new(t, true)).collect();
    assert!(above.iter().flat_map(|&f| mirror.face(f)).all(|s| close(s.diffuse.x * PI, 2.0 * 0.5_f32.sqrt(), KEPT)));
}

/// E/(πL) of a lamp at a small receiver, from the mean over seeds, with the standard error of that mean.
fn form_factor(build: impl Fn(&mut Scene) -> TriangleId, seeds: u64) -> (f64, f64) {
    let values: Vec<f64> = (0..seeds)
        .map(|seed| {
            let mut scene = Scene::default();
            let receiver = FaceId::new(build(&mut scene), false);
            let mirror = solve(&mut engine(scene, 1, seed), &[receiver], Vec3::Y);
            f64::from(mirror.face(receiver)[0].diffuse.x)
        })
        .collect();
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, (variance / n).sqrt())
}

/// A tiny receiver whose first corner is the origin, facing up, away from it.
fn receiver(scene: &mut Scene) -> TriangleId {
    let grey = material(scene, |_| {});
    triangle(scene, [Vec3::ZERO, Vec3::Z * -1e-3, Vec3::X * -1e-3], grey)
}

/// Adds an emitter of radiance 1 facing u × v and registers its light.
pub fn lamp(scene: &mut Scene, origin: Vec3, u: Vec3, v: Vec3) {
    let bright = material(scene, |m| m.ke = Vec3::ONE);
    let triangles = patch(scene, origin, u, v, 1, bright);
    light(scene, LightKind::Area { triangles });
}

fn assert_factor((mean, error): (f64, f64), expected: f64) {
    assert!(error < expected * 0.003, "too noisy to test: {mean} ± {error}");
    assert!((mean - expected).abs() < 4.0 * error + expected * 2e-4, "{mean} ± {error}, expected {expected}");
}

#[test]
fn form_factors_of_parallel_rectangles() {
    for (a, b, expected) in [(1.0, 1.0, 0.138_531_6), (0.5, 2.0, 0.106_837_9)] {
        let build = |scene: &mut Scene| {
            let id = receiver(scene);
            lamp(scene, Vec3::Y, Vec3::X * a, Vec3::Z * b);
            id
        };
        assert_factor(form_factor(build, 24), expected);
    }
}

#[test]
fn form_factors_of_perpendicular_rectangles() {
    // Foot at distance c along x, width b along z, height a.
    for (a, b, c, expected) in [(1.0, 1.0, 1.0, 0.055_734_2), (2.0, 1.5, 0.7, 0.148_121_0)] {
        let build = |scene: &mut Scene| {
            let id = receiver(scene);
            lamp(scene, Vec3::X * c, Vec3::Z * b, Vec3::Y * a);
            id
        };
        assert_factor(form_factor(build, 24), expected);
    }
}

#[test]
fn form_factor_of_a_disc_off_its_axis() {
    let build = |scene: &mut Scene| {
        let id = receiver(scene);
        let bright = material(scene, |m| m.ke = Vec3::ONE);
        let n = 256;
        // A polygon of the disc's area, facing down.
        let radius = 0.5 * (std::f32::consts::TAU / n as f32 / (std::f32::consts::TAU / n as f32).sin()).sqrt();
        let centre = Vec3::new(0.8, 1.0, 0.0);
        let at = |i: i32| {
            let angle = i.rem_euclid(n) as f32 / n as f32 * std::f32::consts::TAU;
            centre + Vec3::new(angle.cos(), 0.0, angle.sin()) * radius
        };
        let triangles = (0..n).map(|i| triangle(scene, [centre, at(i), at(i + 1)], bright)).collect();
        light(scene, LightKind::Area { triangles });
        id
    };
    assert_factor(form_factor(build, 12), 0.094_122_1);
}

fn two_lights(scale: f32, gains: [f32; 2]) -> Vec<Vec3> {
    let mut scene = Scene::default();
    let grey = material(&mut scene, |_| {});
    let ids =
        patch(&mut scene, Vec3::new(-2.0, 0.0, -2.0) * scale, Vec3::Z * 4.0 * scale, Vec3::X * 4.0 * scale, 8, grey);
    let up = Vec3::new(0.3, 1.5, -0.2) * scale;
    light(&mut scene, LightKind::Point { position: up, intensity: Vec3::new(5.0, 3.0, 1.0) * gains[0] });
    let bright = material(&mut scene, |m| m.ke = Vec3::ONE * gains[1]);
    let triangles = patch(&mut scene, Vec3::Y * scale, Vec3::X * scale, Vec3::Z * scale, 1, bright);
    light(&mut scene, LightKind::Area { triangles });
    let mirror = solve(&mut engine(scene, 1, 3), &both_sides(&ids), Vec3::Y);
    irradiances(&mirror, &ids).into_iter().map(|(_, e)| e).collect()
}

#[test]
fn light_is_linear_and_scales() {
    let both = two_lights(1.0, [1.0, 1.0]);
    let (first, second) = (two_lights(1.0, [1.0, 0.0]), two_lights(1.0, [0.0, 1.0]));
    let (doubled, large) = (two_lights(1.0, [2.0, 2.0]), two_lights(4.0, [16.0, 1.0]));
    for i in 0..both.len() {
        // Area lights are sampled: the rounds taken may differ, so they agree within the tolerance of the noise.
        assert!(close(both[i].x, first[i].x + second[i].x, 0.01), "{i}: {} {} {}", both[i], first[i], second[i]);
        assert!(close(doubled[i].x, 2.0 * both[i].x, 0.01));
        // Area lights do not depend on the scale; point lights fall with its square.
        assert!(close(large[i].x, both[i].x, 0.01), "{i}: {} {}", large[i], both[i]);
    }
}

#[test]
fn threads_do_not_change_a_bit() {
    let run = |threads| {
        let mut scene = Scene::default();
        let ids = floor(&mut scene);
        lamp(&mut scene, Vec3::new(-0.5, 1.0, -0.5), Vec3::X, Vec3::Z);
        patch(&mut scene, Vec3::new(0.0, 0.4, 0.0), Vec3::Z, Vec3::X, 1, MaterialId(0));
        light(&mut scene, LightKind::Point { position: Vec3::new(1.0, 1.0, 0.0), intensity: Vec3::ONE });
        let mirror = solve(&mut engine(scene, threads, 11), &both_sides(&ids), Vec3::Y);
        let bits: Vec<[u32; 3]> =
            irradiances(&mirror, &ids).iter().map(|(_, e)| e.to_array().map(f32::to_bits)).collect();
        (bits, mirror.last.stats.rays)
    };
    let one = run(1);
    assert_eq!(one, run(2));
    assert_eq!(one, run(3));
}

#[test]
fn specular_of_a_point_light_is_exact_and_follows_the_eye() {
    use penombre::refine::engine::Visible;
    let mut scene = Scene::default();
    let shiny = material(&mut scene, |m| {
        m.model = Model::phong(Vec3::splat(0.5), 20.0);
    });
    let ids = patch(&mut scene, Vec3::new(-1.0, 0.0, -1.0), Vec3::Z * 2.0, Vec3::X * 2.0, 4, shiny);
    let position = Vec3::new(0.5, 1.0, 0.0);
    light(&mut scene, LightKind::Point { position, intensity: Vec3::splat(3.0) });
    let mut engine = engine(scene, 1, 0);
    let mut mirror = solve(&mut engine, &both_sides(&ids), Vec3::new(-1.0, 1.0, 0.3));
    let rays = mirror.last.stats.rays;
    for (generation, eye) in [(2, Vec3::new(-1.0, 1.0, 0.3)), (3, Vec3::new(-0.5, 2.0, -0.7))] {
        let faces = ids.iter().map(|&t| (FaceId::new(t, false), 5)).collect();
        mirror.apply(engine.set_visible(&Visible { generation, eye, image: None, faces }));
        for slot in ids.iter().flat_map(|&t| mirror.face(FaceId::new(t, false))) {
            let to_light = position - slot.position;
            let (d2, l) = (to_light.length_squared(), to_light.normalize());
            let mirrored = Vec3::new(-l.x, l.y, -l.z);
            let cosine = mirrored.dot((eye - slot.position).normalize()).max(0.0);
            let expected = 22.0 / std::f32::consts::TAU * cosine.powi(20) * 3.0 / d2 * l.y;
            assert!((slot.specular.x - expected).abs() < 1e-4 * expected.max(0.01), "{} {expected}", slot.specular);
        }
    }
    assert_eq!(mirror.last.stats.rays, rays, "a moved camera must not trace rays");
}

/// Highlight at `x` of a lamp of radiance 1 that faces down, `side` wide about (0, `height`, 0), behind what `hides`: n² points of it.
fn highlight(x: Vec3, eye: Vec3, s: f32, (side, height): (f32, f32), hides: impl Fn(Vec3) -> bool) -> f32 {
    let n = 128;
    let place = |i: i32| ((i as f32 + 0.5) / n as f32 - 0.5) * side;
    let points = (0..n * n).map(|i| Vec3::new(place(i % n), height, place(i / n)));
    let arrives = points.filter(|&p| !hides(p)).map(|p| {
        let (d, square) = ((p - x).normalize(), (p - x).length_squared());
        lobe(s, Vec3::Y, d, (eye - x).normalize()) * d.y * d.y / square
    });
    arrives.sum::<f32>() * (side / n as f32).powi(2)
}

/// The light of a lamp that is large and near comes from all round, but a highlight from a small part of it: the visible share of
/// one is not that of the other where the lamp is half hidden.
#[test]
fn half_hidden_highlights_of_a_large_lamp() {
    let (s, eye, size) = (30.0, Vec3::new(0.0, 0.9, 3.0), (3.0, 1.0));
    let mut scene = Scene::default();
    let glossy = material(&mut scene, |m| m.model = Model::phong(Vec3::splat(0.5), s));
    let ids = patch(&mut scene, Vec3::splat(-1.0) * (Vec3::X + Vec3::Z), Vec3::Z * 2.0, Vec3::X * 2.0, 24, glossy);
    lamp(&mut scene, Vec3::new(-1.5, 1.0, -1.5), Vec3::X * 3.0, Vec3::Z * 3.0);
    // A sheet over the left half.
    let dark = material(&mut scene, |_| {});
    patch(&mut scene, Vec3::new(-9.0, 0.5, -9.0), Vec3::Z * 18.0, Vec3::X * 9.0, 1, dark);
    let mirror = solve(&mut engine(scene, 2, 0), &ids.iter().map(|&t| FaceId::new(t, false)).collect::<Vec<_>>(), eye);
    let (mut square, mut mean, mut count) = (0.0, 0.0, 0.0);
    for slot in ids.iter().flat_map(|&t| mirror.face(FaceId::new(t, false))).filter(|slot| slot.position.x.abs() < 0.6)
    {
        let x = slot.position;
        let expected = highlight(x, eye, s, size, |p| x.x + (p.x - x.x) * 0.5 < 0.0);
        square += (slot.specular.x - expected).powi(2);
        mean += expected;
        count += 1.0;
    }
    let error = (square / count).sqrt() / (mean / count);
    // 64 points are remembered one by one, of which the lobe sees three or so: 0.21; of 16, 0.60.
    assert!(error < 0.3, "{error}");
}
