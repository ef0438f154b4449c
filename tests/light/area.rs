//! Area lights: closed forms against textbook values, quadrature and each other; sampling against closed forms.

use crate::support::by_hand::{light, material, patch, triangle};
use crate::support::shapes;
use glam::{DVec3, Vec3};
use penombre::bsdf::Gloss;
use penombre::bsdf::phong::lobe;
use penombre::light::area::AreaSource;
use penombre::light::lights::Lights;
use penombre::light::receiver::Receiver;
use penombre::light::source::Source;
use penombre::math::sequence::Sequence;
use penombre::scene::light::LightKind;
use penombre::scene::{EmissionSide, Scene};
use proptest::prelude::*;
use std::f64::consts::{PI, TAU};

fn area(scene: &Scene) -> AreaSource {
    match &Lights::new(scene).sources[0] {
        Source::Area(source) => source.clone(),
        other => panic!("{other:?}"),
    }
}

/// A scene with one emitter of radiance 1: the parallelogram `origin + s·u + t·v` facing u × v in n × n cells.
fn lamp(origin: Vec3, u: Vec3, v: Vec3, n: u32) -> Scene {
    let mut scene = Scene::default();
    let bright = material(&mut scene, |m| m.ke = Vec3::ONE);
    let triangles = patch(&mut scene, origin, u, v, n, bright);
    light(&mut scene, LightKind::Area { triangles });
    scene
}

fn closed(scene: &Scene, x: Vec3, normal: Vec3) -> f64 {
    let source = area(scene);
    let Some(form) = source.closed_form(x) else { panic!("too many triangles") };
    f64::from(form.irradiance(normal).x)
}

fn seen(x: Vec3, normal: Vec3, to_eye: Vec3, shininess: f32) -> Receiver {
    Receiver { x, normal, to_eye, lobe: Gloss::Phong { shininess, mirror: false }.seen(normal, to_eye) }
}

fn close(value: f64, expected: f64, relative: f64) -> bool {
    (value - expected).abs() <= relative * expected.abs()
}

#[test]
fn rectangles_match_their_form_factors() {
    for (a, b, expected) in [(1.0, 1.0, 0.138_531_6), (0.5, 2.0, 0.106_837_9)] {
        let e = closed(&lamp(Vec3::Y, Vec3::X * a, Vec3::Z * b, 1), Vec3::ZERO, Vec3::Y) / PI;
        assert!(close(e, expected, 1e-6), "{e} {expected}");
    }
    for (a, b, c, expected) in [(1.0, 1.0, 1.0, 0.055_734_2), (2.0, 1.5, 0.7, 0.148_121_0)] {
        // A wall, foot at distance c, half of it below the horizon.
        for below in [0.0, a] {
            let origin = Vec3::new(c, -below, 0.0);
            let e = closed(&lamp(origin, Vec3::Z * b, Vec3::Y * (a + below), 1), Vec3::ZERO, Vec3::Y) / PI;
            assert!(close(e, expected, 1e-6), "{below}: {e} {expected}");
        }
    }
}

/// A disc of the given area-true radius facing down, as a fan around its centre.
fn disc(centre: Vec3, radius: f32, n: i32) -> Scene {
    let mut scene = Scene::default();
    let bright = material(&mut scene, |m| m.ke = Vec3::ONE);
    let step = std::f32::consts::TAU / n as f32;
    let radius = radius * (step / step.sin()).sqrt();
    let at = |i: i32| {
        let angle = i.rem_euclid(n) as f32 * step;
        centre + Vec3::new(angle.cos(), 0.0, angle.sin()) * radius
    };
    let triangles = (0..n).map(|i| triangle(&mut scene, [centre, at(i), at(i + 1)], bright)).collect();
    light(&mut scene, LightKind::Area { triangles });
    scene
}

#[test]
fn discs_match_their_form_factors() {
    for (height, off_axis, radius, expected) in [(1.0, 0.0, 1.0, 0.5), (1.0, 0.8, 0.5, 0.094_122_1)] {
        let scene = disc(Vec3::new(off_axis, height, 0.0), radius, 64);
        let e = closed(&scene, Vec3::ZERO, Vec3::Y) / PI;
        assert!(close(e, expected, 1e-5), "{e} {expected}");
    }
}

/// ∫ f(direction) cosθ_l / d² dA over the fronts (seen from `x`) of all triangles, by midpoints of n² parts each.
fn quadrature(scene: &Scene, x: Vec3, n: u32, f: impl Fn(DVec3) -> f64) -> f64 {
    let x = x.as_dvec3();
    let mut sum = 0.0;
    for t in &scene.triangles {
        let [a, b, c] = t.map(|i| scene.positions[i as usize].as_dvec3());
        let vector = (b - a).cross(c - a) * 0.5 / f64::from(n * n);
        let mut add = |u: f64, v: f64| {
            let offset = a - x + (b - a) * (u / f64::from(n)) + (c - a) * (v / f64::from(n));
            let squared = offset.length_squared();
            let direction = offset / squared.sqrt();
            sum += f(direction) * (-vector.dot(direction)).max(0.0) / squared;
        };
        for (i, j) in (0..n).flat_map(|i| (0..n - i).map(move |j| (i, j))) {
            add(f64::from(i) + 1.0 / 3.0, f64::from(j) + 1.0 / 3.0);
            if i + j + 1 < n {
                add(f64::from(i) + 2.0 / 3.0, f64::from(j) + 2.0 / 3.0);
            }
        }
    }
    sum
}

fn numeric_irradiance(scene: &Scene, x: Vec3, normal: Vec3, n: u32) -> f64 {
    quadrature(scene, x, n, |d| d.dot(normal.as_dvec3()).max(0.0))
}

/// Normals from facing the lamp to below its horizon.
fn tilted() -> impl Iterator<Item = Vec3> {
    (0..24).map(|i| {
        let (tilt, turn) = (i as f32 / 23.0 * 3.0, i as f32 * 2.4);
        Vec3::new(tilt.sin() * turn.cos(), tilt.cos(), tilt.sin() * turn.sin())
    })
}

#[test]
fn tilted_receivers_match_quadrature_across_the_horizon() {
    let scenes = [
        lamp(Vec3::new(-0.5, 1.0, -0.5), Vec3::X, Vec3::Z, 1),
        lamp(Vec3::new(0.2, 0.3, -1.0), Vec3::new(0.9, 0.4, 0.1), Vec3::new(-0.1, 0.3, 1.5), 3),
        disc(Vec3::new(0.3, 0.5, 0.1), 0.8, 22),
    ];
    for (k, scene) in scenes.iter().enumerate() {
        let whole = numeric_irradiance(scene, Vec3::ZERO, Vec3::Y, 200);
        for normal in tilted() {
            let (e, expected) = (closed(scene, Vec3::ZERO, normal), numeric_irradiance(scene, Vec3::ZERO, normal, 200));
            assert!((e - expected).abs() < 1e-4 * expected.max(whole * 0.02), "{k}, {normal}: {e} {expected}");
        }
        let vector = area(scene).closed_form(Vec3::ZERO).unwrap().vector().as_dvec3();
        for axis in DVec3::AXES {
            let expected = quadrature(scene, Vec3::ZERO, 200, |d| d.dot(axis));
            assert!((vector.dot(axis) - expected).abs() < 1e-4 * whole, "{k}: {vector} {expected}");
        }
    }
}

/// Down to 1e-14 sr, at any distance and in any place: against A cosθ cosθ_l / d², which such sizes make exact.
#[test]
fn small_lights_keep_their_digits() {
    let towards = Vec3::new(0.48, 0.6, 0.64);
    for distance in [1e-3_f32, 0.1, 1.0, 30.0, 1e4] {
        for angle in [1e-3_f32, 1e-4, 1e-5, 1e-6, 1e-7] {
            let size = distance * angle;
            let scene = lamp(towards * distance, Vec3::new(0.0, 0.8, 0.6) * size, Vec3::new(0.9, -0.3, 0.0) * size, 1);
            for normal in [towards, Vec3::Y, Vec3::new(0.8, 0.0, -0.6), Vec3::new(-0.6, 0.8, 0.0)] {
                let normal = normal.normalize();
                let n = normal.as_dvec3();
                let corners: Vec<DVec3> = scene.positions.iter().map(|p| p.as_dvec3()).collect();
                let above = corners.iter().all(|p| p.dot(n) > 0.0);
                let expected: f64 = (0..2)
                    .map(|k| {
                        let [a, b, c] = scene.triangles[k].map(|i| corners[i as usize]);
                        let (middle, vector) = ((a + b + c) / 3.0, (b - a).cross(c - a) * 0.5);
                        middle.dot(n) * -vector.dot(middle) / middle.length_squared().powi(2)
                    })
                    .sum();
                let e = closed(&scene, Vec3::ZERO, normal);
                if above && expected > 0.0 {
                    assert!(close(e, expected, 1e-4), "{distance} {angle} {normal}: {e} {expected}");
                } else {
                    assert!(e >= 0.0 && e < f64::from(angle * angle), "{e}");
                }
            }
        }
    }
}

#[test]
fn splitting_scaling_and_mirroring_change_nothing() {
    let (origin, u, v) = (Vec3::new(0.25, 0.5, -0.75), Vec3::new(1.0, 0.25, 0.0), Vec3::new(-0.25, 0.125, 1.5));
    let x = Vec3::new(0.125, 0.0, 0.25);
    for normal in tilted() {
        let whole = closed(&lamp(origin, u, v, 1), x, normal);
        let parts = closed(&lamp(origin, u, v, 10), x, normal);
        assert!((parts - whole).abs() < 1e-6, "{normal}: {whole} {parts}");
        for scale in [1.0 / 1024.0, 4096.0] {
            let scaled = closed(&lamp(origin * scale, u * scale, v * scale, 1), x * scale, normal);
            assert!((scaled - whole).abs() < 1e-6, "{scale} {normal}: {whole} {scaled}");
        }
        let flip = Vec3::new(-1.0, 1.0, 1.0);
        let mirrored = closed(&lamp(origin * flip, v * flip, u * flip, 1), x * flip, normal * flip);
        assert!((mirrored - whole).abs() < 1e-6, "{normal}: {whole} {mirrored}");
    }
}

#[test]
fn receivers_on_the_edge_and_in_the_plane_of_the_lamp() {
    // Facing down.
    let mut scene = lamp(Vec3::Y, Vec3::X, Vec3::Z, 1);
    let wall = |scene: &Scene, at: Vec3| closed(scene, at, Vec3::X) / PI;
    let places = [(0.0, 0.5), (0.0, 0.0), (1.0, 1.0), (0.5, 0.5), (0.5, 0.0), (-1.0, 0.5), (0.0, -3.0), (2.0, 1.0)];
    for (x, z) in places {
        for normal in tilted().chain([Vec3::X, Vec3::NEG_Y, Vec3::Z]) {
            assert!(closed(&scene, Vec3::new(x, 1.0, z), normal) == 0.0, "in the plane");
            assert!(closed(&scene, Vec3::new(x, 1.0 + 1e-6, z), normal) == 0.0, "behind");
            let e = closed(&scene, Vec3::new(x, 1.0 - 1e-6, z), normal);
            assert!((0.0..PI * 1.0001).contains(&e), "in front: {e}");
        }
    }
    // A wall that ends at the lamp's edge: half of its hemisphere is lamp, a quarter at the corner, none past it.
    for (z, expected) in [(0.5, 0.5), (0.0, 0.25), (1.0, 0.25), (1.5, 0.0)] {
        let e = wall(&scene, Vec3::new(0.0, 1.0 - 1e-6, z));
        assert!((e - expected).abs() < 1e-4, "{z}: {e} {expected}");
    }
    // The lamp as seen by a surface that touches it face to face.
    assert!(close(closed(&scene, Vec3::new(0.3, 1.0 - 1e-6, 0.4), Vec3::Y), PI, 1e-4));
    let below = wall(&scene, Vec3::new(0.0, 0.7, 0.5));
    assert!(wall(&scene, Vec3::new(0.0, 1.3, 0.5)) == 0.0);
    scene.emission_side = EmissionSide::Both;
    assert!(close(wall(&scene, Vec3::new(0.0, 1.3, 0.5)), below, 1e-6));
    assert!(close(wall(&scene, Vec3::new(0.0, 0.7, 0.5)), below, 1e-12));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, rng_seed: proptest::test_runner::RngSeed::Fixed(5), ..Default::default() })]

    #[test]
    fn random_triangles_match_quadrature(p in prop::array::uniform12(-1.0_f32..1.0), sliver in prop::bool::ANY) {
        let mut scene = Scene::default();
        let bright = material(&mut scene, |m| m.ke = Vec3::ONE);
        let [a, b, mut c] = [0, 3, 6].map(|i| Vec3::new(p[i], p[i + 1], p[i + 2]) + Vec3::Y * 1.5);
        if sliver {
            c = (a + b) * 0.5 + (c - a) * 1e-3;
        }
        // Facing the origin.
        let corners = if (b - a).cross(c - a).dot(a) < 0.0 { [a, b, c] } else { [a, c, b] };
        let triangles = vec![triangle(&mut scene, corners, bright)];
        light(&mut scene, LightKind::Area { triangles });
        let normal = Vec3::new(p[9], p[10], p[11]).normalize_or(Vec3::Y);
        let expected = numeric_irradiance(&scene, Vec3::ZERO, normal, 60);
        let whole = quadrature(&scene, Vec3::ZERO, 60, |_| 1.0);
        let e = closed(&scene, Vec3::ZERO, normal);
        prop_assert!((e - expected).abs() <= 1e-3 * expected.max(0.2 * whole) + 1e-12, "{} {}", e, expected);
    }
}

#[test]
fn highlights_match_quadrature() {
    let scenes = [
        lamp(Vec3::new(-0.5, 1.0, -0.5), Vec3::X, Vec3::Z, 1),
        lamp(Vec3::new(0.3, 1.0, 0.2), Vec3::X * 0.01, Vec3::Z * 0.03, 1),
        lamp(Vec3::new(-0.2, 0.1, -2.0), Vec3::new(0.4, 1.9, 0.1), Vec3::new(-0.1, 0.3, 4.0), 1),
        disc(Vec3::new(0.3, 0.5, 0.1), 0.2, 22),
    ];
    let normal = Vec3::new(0.2, 0.97, -0.1).normalize();
    let directions =
        [Vec3::new(0.1, 1.0, 0.1), Vec3::new(0.3, 1.0, 0.2), Vec3::new(0.5, 0.5, 0.1), Vec3::new(0.1, 0.02, 0.9)];
    for (k, scene) in scenes.iter().enumerate() {
        let source = area(scene);
        for mirrored in directions.map(Vec3::normalize) {
            let to_eye = 2.0 * normal.dot(mirrored) * normal - mirrored;
            for shininess in [0.0_f32, 0.5, 1.0, 7.3, 50.0, 1000.0] {
                let value = f64::from(source.specular(scene, &seen(Vec3::ZERO, normal, to_eye, shininess), 0.0).x);
                let expected = quadrature(scene, Vec3::ZERO, 400, |d| {
                    let d = d.as_vec3();
                    f64::from(lobe(shininess, normal, d, to_eye) * normal.dot(d).max(0.0))
                });
                // What the lamp would show in the middle of the lobe.
                let peak = (f64::from(shininess) + 2.0) / TAU * closed(scene, Vec3::ZERO, normal);
                let tolerance = 2e-3 * expected + 1e-5 * peak.min(1.0);
                assert!((value - expected).abs() < tolerance, "{k} {mirrored} {shininess}: {value} {expected}");
            }
        }
    }
}

/// A lamp that fills the hemisphere shows its radiance in a mirror of any gloss.
#[test]
fn an_endless_lamp_fills_the_highlight() {
    let scene = lamp(Vec3::new(-5e3, 1.0, -5e3), Vec3::X * 1e4, Vec3::Z * 1e4, 1);
    for shininess in [0.1, 1.0, 10.0, 100.0, 1e3, 1e5] {
        let value = area(&scene).specular(&scene, &seen(Vec3::ZERO, Vec3::Y, Vec3::Y, shininess), 0.0).x;
        assert!((value - 1.0).abs() < 1e-3, "{shininess}: {value}");
    }
}

/// Prints the time of an evaluation: `cargo test --release --test area_lights -- --ignored --nocapture`.
#[test]
#[ignore = "a measurement, not a test"]
fn nanoseconds_an_evaluation() {
    let scenes = [("quad", lamp(Vec3::new(-0.5, 1.0, -0.5), Vec3::X, Vec3::Z, 1)), ("22-gon", disc(Vec3::Y, 0.5, 22))];
    let time = |name: &str, f: &mut dyn FnMut(Vec3) -> f32| {
        let (start, n) = (std::time::Instant::now(), 200_000);
        let sum: f32 = (0..n).map(|i| f(Vec3::new(i as f32 * 1e-6, 0.0, 0.3))).sum();
        println!("{name}: {:.0} ns ({sum})", start.elapsed().as_nanos() as f64 / f64::from(n));
    };
    let side = Vec3::new(1.0, 0.1, 0.0).normalize();
    for (name, scene) in &scenes {
        let source = area(scene);
        let far = Vec3::new(0.0, -20.0, 0.0);
        time(&format!("{name} far highlight"), &mut |x| {
            source.specular(scene, &seen(x + far, Vec3::Y, Vec3::Y, 100.0), 0.0).x
        });
        time(&format!("{name} far sampler + 4"), &mut |x| {
            let sampler = source.at(x + far);
            (0..4).map(|i| sampler.sample(scene, [i as f32 * 0.25, 0.3]).unwrap().distance).sum()
        });
        time(&format!("{name} closed form"), &mut |x| source.closed_form(x).unwrap().vector().x);
        time(&format!("{name} form + irradiance"), &mut |x| source.closed_form(x).unwrap().irradiance(Vec3::Y).x);
        time(&format!("{name} form + clipped"), &mut |x| source.closed_form(x).unwrap().irradiance(side).x);
        time(&format!("{name} sampler + 4"), &mut |x| {
            let sampler = source.at(x);
            (0..4).map(|i| sampler.sample(scene, [i as f32 * 0.25, 0.3]).unwrap().distance).sum()
        });
        time(&format!("{name} area sample"), &mut |x| source.sample(scene, x, [0.2, 0.3]).unwrap().distance);
        for s in [10.0, 1000.0] {
            let highlight = |x| source.specular(scene, &seen(x, Vec3::Y, Vec3::new(0.6, 0.8, 0.0), s), 0.0).x;
            time(&format!("{name} highlight {s}"), &mut { highlight });
        }
    }
}

/// Places around a lamp from where it just counts as distant, with normals all round.
fn distant_views(source: &AreaSource, centre: Vec3, mut see: impl FnMut(Vec3, Vec3)) {
    let direction = |i: u32, stride: f32| {
        let (z, turn) = (1.0 - (i as f32 * stride).fract() * 2.0, i as f32 * 2.4);
        Vec3::new(turn.cos() * (1.0 - z * z).sqrt(), turn.sin() * (1.0 - z * z).sqrt(), z)
    };
    for i in 0..200 {
        let away = direction(i, 0.618_034);
        // The shortest distance from which any normal finds it distant: doubled until it does, then bisected.
        let distant = |d: f32| source.is_distant(centre + away * d, -away);
        let mut far = 1.0;
        while !distant(far) {
            far *= 2.0;
        }
        let (mut near, mut far) = (far * 0.5, far);
        for _ in 0..20 {
            let middle = (near + far) * 0.5;
            if distant(middle) { far = middle } else { near = middle }
        }
        let x = centre + away * far;
        for normal in (0..100).map(|k| direction(k, 0.754_878)).filter(|&n| source.is_distant(x, n)) {
            see(x, normal);
        }
    }
}

/// Polygons as points: relative to what a receiver facing the lamp gets, and relative to the value where it is not grazing.
#[test]
fn distant_lamps_match_their_closed_form() {
    let at = Vec3::new(0.3, 0.5, -0.2);
    let lamps = [
        lamp(at - Vec3::new(0.5, 0.0, 0.5), Vec3::X, Vec3::Z, 1),
        lamp(at - Vec3::new(0.05, 0.0, 0.5), Vec3::new(0.1, 0.0, 0.02), Vec3::new(0.0, 0.3, 1.0), 1),
        disc(at, 0.5, 22),
        bowl(at, 0.5, 5),
    ];
    let (mut of_facing, mut of_itself, mut seen) = (0.0_f32, 0.0_f32, 0);
    for scene in &lamps {
        let source = area(scene);
        distant_views(&source, at, |x, normal| {
            let form = source.closed_form(x).expect("few triangles");
            let (exact, found) = (form.irradiance(normal).x, source.distant_irradiance(x, normal).x);
            let error = (found - exact).abs();
            // The light vector's length; the lamps are white. Seen edge-on they send nothing to be relative to.
            let facing = form.vector().length();
            if facing * (x - at).length_squared() < 0.02 {
                return;
            }
            of_facing = of_facing.max(error / facing);
            if exact > 0.3 * facing {
                of_itself = of_itself.max(error / exact);
            }
            seen += u32::from(exact > 0.0);
        });
    }
    println!("{seen} views, error against the facing irradiance {of_facing:.1e}, against its own {of_itself:.1e}");
    assert!(seen > 10_000, "{seen}");
    assert!(of_facing < 1.2e-4 && of_itself < 2e-4, "{of_facing} {of_itself}");
}

/// What lights are chosen and ordered by: never less than what arrives, and from afar that itself.
#[test]
fn bounds_hold() {
    let at = Vec3::new(0.3, 0.5, -0.2);
    let flat = lamp(at - Vec3::new(0.5, 0.0, 0.5), Vec3::X, Vec3::Z, 1);
    for scene in [flat, disc(at, 0.5, 22), bowl(at, 0.5, 5)] {
        let (source, light) = (area(&scene), Lights::new(&scene).sources.remove(0));
        let (mut loosest, mut seen) = (0.0_f32, 0);
        for i in 0..4000_u32 {
            let spread = |k: u32| penombre::math::mix(u64::from(i * 8 + k)) as f32 / u64::MAX as f32 * 2.0 - 1.0;
            let Some(normal) = Vec3::new(spread(0), spread(1), spread(2)).try_normalize() else { continue };
            let x = at + Vec3::new(spread(3), spread(4), spread(5)) * if i % 2 == 0 { 1.0 } else { 30.0 };
            let exact = source.closed_form(x).expect("few triangles").irradiance(normal).x;
            assert!(light.bound(x, normal) >= exact * 0.9999, "{x} {normal}: {} {exact}", light.bound(x, normal));
            // Farther than twelve radii, and not cut by the horizon or seen edge-on.
            let clear = x.distance(at) > 10.0 && normal.dot(at - x) > 0.8;
            if clear && exact > 1e-2 / x.distance_squared(at) {
                loosest = loosest.max((light.strength(x, normal) / exact).ln().abs());
                seen += 1;
            }
        }
        assert!(seen > 100 && loosest < 0.05, "{seen} {}", loosest.exp());
    }
}

/// A dome of triangles of radiance 1, which shows its inside to nobody: (n+1)² points on half a sphere.
fn bowl(centre: Vec3, radius: f32, n: u32) -> Scene {
    let mut scene = Scene::default();
    let bright = material(&mut scene, |m| m.ke = Vec3::ONE);
    let at = |i: u32, j: u32| {
        let (s, t) = (i as f32 / n as f32 * 2.0 - 1.0, j as f32 / n as f32 * 2.0 - 1.0);
        centre + Vec3::new(s, 1.0, t).normalize() * radius
    };
    let mut triangles = Vec::new();
    for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
        triangles.push(triangle(&mut scene, [at(i, j), at(i + 1, j + 1), at(i + 1, j)], bright));
        triangles.push(triangle(&mut scene, [at(i, j), at(i, j + 1), at(i + 1, j + 1)], bright));
    }
    light(&mut scene, LightKind::Area { triangles });
    scene
}

/// The silhouette of a sphere of 1,280 triangles sends what its facing triangles send one by one, above and across the
/// horizon, near and far; a sphere that faces inwards has none.
#[test]
fn silhouettes_equal_the_sum_of_facing_triangles() {
    let mut scene = Scene::default();
    let bright = material(&mut scene, |m| m.ke = Vec3::ONE);
    let triangles = shapes::icosphere(&mut scene, Vec3::new(0.3, -0.2, 0.1), 0.7, 3, false, bright);
    let sphere = AreaSource::new(&scene, &triangles);
    assert!(sphere.has_closed_form());
    let single: Vec<AreaSource> = triangles.iter().map(|&t| AreaSource::new(&scene, &[t])).collect();
    let sequence = Sequence::new(3);
    let mut crossed = 0;
    for i in 0..200 {
        let [a, b, c, d] = sequence.point(2 * i);
        let [e, ..] = sequence.point(2 * i + 1);
        let towards = |u: f32, v: f32| {
            let (z, turn) = (2.0 * u - 1.0, v * std::f32::consts::TAU);
            Vec3::new((1.0 - z * z).sqrt() * turn.cos(), (1.0 - z * z).sqrt() * turn.sin(), z)
        };
        let (offset, normal) = (towards(a, b) * (0.701 + 4.0 * c * c), towards(d, e));
        let x = sphere.sphere().0 + offset;
        crossed += u32::from(normal.dot(offset).abs() < 0.7);
        let of = |source: &AreaSource| f64::from(source.closed_form(x).expect("closed form").irradiance(normal).x);
        let (whole, sum) = (of(&sphere), single.iter().map(of).sum::<f64>());
        assert!((whole - sum).abs() < 1e-4 * sum + 1e-6, "{x} {normal}: {whole} {sum}");
    }
    assert!(crossed > 50, "{crossed} horizons");
    let inwards = shapes::icosphere(&mut scene, Vec3::ZERO, 0.7, 3, true, bright);
    assert!(!AreaSource::new(&scene, &inwards).has_closed_form());
}
