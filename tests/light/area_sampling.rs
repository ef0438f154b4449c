//! Sampling of area lights: unbiased against closed forms, calm beside the lamp, uniform in solid angle.

use crate::support::by_hand::{light, material, patch, triangle};
use glam::{DVec3, Vec2, Vec3};
use penombre::bsdf::Gloss;
use penombre::bsdf::phong::lobe;
use penombre::light::area::AreaSource;
use penombre::light::arrival::Arrival;
use penombre::light::lights::Lights;
use penombre::light::receiver::Receiver;
use penombre::light::source::Source;
use penombre::math::mix;
use penombre::math::spherical_triangle::solid_angle;
use penombre::scene::light::LightKind;
use penombre::scene::material::MaterialId;
use penombre::scene::texture::{Texture, TextureId};
use penombre::scene::{EmissionSide, FaceId, Scene, TriangleId};
use std::f64::consts::PI;

fn area(scene: &Scene) -> AreaSource {
    match &Lights::new(scene).sources[0] {
        Source::Area(source) => source.clone(),
        other => panic!("{other:?}"),
    }
}

/// A scene with one emitter: the parallelogram `origin + s·u + t·v` facing u × v in n × n cells.
fn lamp(origin: Vec3, u: Vec3, v: Vec3, n: u32) -> Scene {
    let mut scene = Scene::default();
    let bright = material(&mut scene, |m| m.ke = Vec3::new(1.0, 0.5, 0.25));
    let triangles = patch(&mut scene, origin, u, v, n, bright);
    light(&mut scene, LightKind::Area { triangles });
    scene
}

/// An octahedron of emitters, each face in n² parts on the sphere around `centre`.
fn sphere(centre: Vec3, radius: f32, n: i32) -> Scene {
    let mut scene = Scene::default();
    let bright = material(&mut scene, |m| m.ke = Vec3::new(1.0, 0.5, 0.25));
    let mut triangles = Vec::new();
    for octant in 0..8 {
        let sign = |bit: i32| if octant >> bit & 1 == 1 { -1.0 } else { 1.0 };
        let signs = Vec3::new(sign(0), sign(1), sign(2));
        let at = |i: i32, j: i32| {
            let p = Vec3::new(i as f32, j as f32, (n - i - j) as f32) * signs;
            centre + p.normalize() * radius
        };
        let mut add = |[a, b, c]: [Vec3; 3]| {
            let corners = if signs.x * signs.y * signs.z > 0.0 { [a, b, c] } else { [a, c, b] };
            triangles.push(triangle(&mut scene, corners, bright));
        };
        for (i, j) in (0..n).flat_map(|i| (0..n - i).map(move |j| (i, j))) {
            add([at(i + 1, j), at(i, j + 1), at(i, j)]);
            if i + j + 1 < n {
                add([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
    }
    light(&mut scene, LightKind::Area { triangles });
    scene
}

/// A window of 4 × 4 cells with a texture of strong contrast.
fn window() -> Scene {
    let mut scene = lamp(Vec3::new(-0.5, 0.4, -0.5), Vec3::X, Vec3::Z, 4);
    let texels =
        (0..8 * 16_u64).map(|i| [0, 8, 16].map(|shift| (mix(i) >> shift) as u8)).map(|[r, g, b]| [r, g, b, 255]);
    scene.textures.push(Texture::new("noise".into(), [8, 16], texels.collect()));
    scene.materials[0].map_ke = Some(TextureId(0).into());
    for (uvs, corners) in scene.uvs.iter_mut().zip(&scene.triangles) {
        *uvs = corners.map(|i| Vec2::new(scene.positions[i as usize].x, scene.positions[i as usize].z) * 1.3);
    }
    scene
}

fn random(seed: u64, index: u64) -> [f32; 2] {
    let bits = mix(seed << 32 ^ index.wrapping_mul(0x9e37_79b9_7f4a_7c15));
    [bits >> 40, bits >> 16 & 0xff_ffff].map(|x| x as f32 / (1 << 24) as f32)
}

/// Mean of a value over random samples, with its standard error.
fn mean(n: u64, value: impl Fn([f32; 2]) -> f64) -> (f64, f64) {
    let (mut sum, mut square) = (0.0, 0.0);
    for i in 0..n {
        let x = value(random(3, i));
        (sum, square) = (sum + x, square + x * x);
    }
    let m = sum / n as f64;
    (m, ((square / n as f64 - m * m) / (n - 1) as f64).max(0.0).sqrt())
}

fn red(arrival: Option<Arrival>, normal: Vec3) -> f64 {
    arrival.map_or(0.0, |a| f64::from(a.facing.x * a.direction.dot(normal).max(0.0)))
}

fn agree((a, ea): (f64, f64), (b, eb): (f64, f64)) -> bool {
    (a - b).abs() <= 4.5 * ea.hypot(eb) + 2e-5 * a.abs().max(b.abs())
}

const NORMALS: [Vec3; 3] = [Vec3::Y, Vec3::new(0.6, 0.8, 0.0), Vec3::new(0.0, -0.28, 0.96)];

#[test]
fn samples_are_unbiased_against_the_closed_form() {
    let mut both = lamp(Vec3::new(0.1, 0.5, 0.0), Vec3::Z, Vec3::X, 1);
    both.emission_side = EmissionSide::Both;
    let scenes = [
        lamp(Vec3::new(-0.5, 1.0, -0.5), Vec3::X, Vec3::Z, 1),
        // Reaching below the horizon; a sliver; far; tiny, on both sides of where the solid angle is given up.
        lamp(Vec3::new(0.2, -0.6, -1.0), Vec3::new(0.4, 1.4, 0.1), Vec3::new(-0.1, 0.3, 1.5), 1),
        lamp(Vec3::new(-0.5, 0.3, 0.2), Vec3::X, Vec3::Z * 1e-3, 1),
        lamp(Vec3::new(-0.5, 30.0, -0.5), Vec3::X, Vec3::Z, 1),
        lamp(Vec3::new(0.3, 0.5, 0.0), Vec3::X * 2e-3, Vec3::Z * 1e-3, 1),
        lamp(Vec3::new(0.3, 0.5, 0.0), Vec3::X * 5e-4, Vec3::Z * 1e-3, 1),
        both,
        sphere(Vec3::new(0.2, 0.9, 0.1), 0.5, 3),
        // Seen in part, and cut by the horizon of some normal, from both sides of where its corners say enough.
        lamp(Vec3::new(0.3, -0.4, -0.5), Vec3::new(0.0, 0.2, 1.0), Vec3::new(0.1, 0.9, 0.0), 1),
        lamp(Vec3::new(0.9, -0.4, -0.5), Vec3::new(0.0, 0.2, 1.0), Vec3::new(0.7, 0.9, 0.0), 1),
    ];
    for (k, scene) in scenes.iter().enumerate() {
        let source = area(scene);
        let (form, sampler) = (source.closed_form(Vec3::ZERO).unwrap(), source.at(Vec3::ZERO));
        for normal in NORMALS {
            let expected = f64::from(form.irradiance(normal).x);
            let found = mean(20_000, |u| red(sampler.sample(scene, u), normal));
            assert!(agree(found, (expected, 0.0)), "{k} {normal}: {found:?} {expected}");
            let found = mean(20_000, |u| red(source.sample_for(scene, (Vec3::ZERO, normal), u), normal));
            assert!(agree(found, (expected, 0.0)), "{k} {normal}, for the surface: {found:?} {expected}");
            // By area too, which is what there was before.
            let found = mean(20_000, |u| red(source.sample(scene, Vec3::ZERO, u), normal));
            assert!(agree(found, (expected, 0.0)), "{k} {normal}, by area: {found:?} {expected}");
        }
    }
}

/// A lamp of 1,152 triangles is sampled by groups, which waste few samples and add up to what its silhouette sends.
#[test]
fn many_triangles_are_sampled_by_groups() {
    let scene = sphere(Vec3::new(0.4, 2.0, 0.0), 0.5, 12);
    let source = area(&scene);
    for x in [Vec3::ZERO, Vec3::new(0.4, 1.45, 0.0), Vec3::new(0.9, 1.5, 0.4)] {
        for normal in NORMALS {
            let by_area = mean(100_000, |u| red(source.sample(&scene, x, u), normal));
            let by_group = mean(20_000, |u| red(source.at(x).sample(&scene, u), normal));
            assert!(agree(by_area, by_group), "{x} {normal}: {by_area:?} {by_group:?}");
            let exact = f64::from(source.closed_form(x).unwrap().irradiance(normal).x);
            assert!(agree(by_group, (exact, 0.0)), "{x} {normal}: {by_group:?} {exact}");
        }
        let wasted = mean(4_000, |u| f64::from(u8::from(source.at(x).sample(&scene, u).is_none()))).0;
        let before = mean(4_000, |u| f64::from(u8::from(source.sample(&scene, x, u).is_none()))).0;
        assert!(wasted < before * 0.5, "{x}: {wasted}, by area {before}");
    }
}

/// π L (R/d)² for a ball: the triangles' own area and place are a little inside.
#[test]
fn a_sampled_ball_shines_like_a_sphere() {
    let scene = sphere(Vec3::Y * 2.0, 0.5, 12);
    let source = area(&scene);
    let (found, error) = mean(20_000, |u| red(source.at(Vec3::ZERO).sample(&scene, u), Vec3::Y));
    let expected = PI / 16.0;
    assert!((found - expected).abs() < 4.0 * error + 0.01 * expected, "{found} ± {error}, {expected}");
}

#[test]
fn samples_beside_the_lamp_do_not_outshine_it() {
    let scene = lamp(Vec3::Y, Vec3::X, Vec3::Z, 1);
    let source = area(&scene);
    // A wall that ends 1 mm beside the lamp, just below its plane.
    let x = Vec3::new(-1e-3, 1.0 - 1e-3, 0.4);
    let expected = f64::from(source.closed_form(x).unwrap().irradiance(Vec3::X).x);
    let n = 4_000;
    let (found, error) = mean(n, |u| red(source.at(x).sample(&scene, u), Vec3::X));
    assert!(agree((found, error), (expected, 0.0)), "{found} ± {error}, {expected}");
    let deviation = |error: f64, mean: f64| error * (n as f64).sqrt() / mean;
    assert!(deviation(error, found) < 1.0, "{}", deviation(error, found));
    let (by_area, error) = mean(n, |u| red(source.sample(&scene, x, u), Vec3::X));
    assert!(deviation(error, by_area) > 5.0, "this place is no trial: {}", deviation(error, by_area));
}

/// Samples fall into the cells of a lamp as their solid angles are, and these add up to the whole's.
#[test]
fn samples_are_uniform_in_solid_angle() {
    let (origin, u, v) = (Vec3::new(-0.2, 0.15, -0.3), Vec3::new(1.0, 0.1, 0.0), Vec3::Z);
    let cells = lamp(origin, u, v, 4);
    let omega = |scene: &Scene, t: usize| {
        let [a, b, c] = scene.corners(TriangleId(t as u32)).map(|p| p.as_dvec3());
        solid_angle(a, [b - a, c - a])
    };
    let expected: Vec<f64> = (0..16).map(|k| omega(&cells, 2 * k) + omega(&cells, 2 * k + 1)).collect();
    let whole = lamp(origin, u, v, 1);
    let total = omega(&whole, 0) + omega(&whole, 1);
    assert!((expected.iter().sum::<f64>() - total).abs() < 1e-6 * total);
    // π/6 for a face of a cube seen from its middle's eighth part: 4π/24 a corner square.
    let square = lamp(Vec3::Y, Vec3::X, Vec3::Z, 1);
    assert!((omega(&square, 0) + omega(&square, 1) - PI / 6.0).abs() < 1e-12);

    let source = area(&whole);
    let n = 64_000;
    let mut counts = [0_u32; 16];
    for i in 0..n {
        let a = source.at(Vec3::ZERO).sample(&whole, random(9, i)).expect("faces the lamp");
        assert!((f64::from(a.facing.x) - total).abs() < 1e-5 * total, "every sample stands for the whole solid angle");
        let p = a.direction * a.distance - origin;
        let (s, t) = (p.dot(u) / u.length_squared(), p.z);
        counts[((s * 4.0).clamp(0.0, 3.0) as usize) * 4 + (t * 4.0).clamp(0.0, 3.0) as usize] += 1;
    }
    let chi_squared: f64 = counts
        .iter()
        .zip(&expected)
        .map(|(&count, omega)| {
            let mean = n as f64 * omega / total;
            (f64::from(count) - mean).powi(2) / mean
        })
        .sum();
    assert!(chi_squared < 45.0, "15 degrees of freedom: {chi_squared}, {counts:?}");
}

#[test]
fn textured_emitters_have_a_mean_and_samples_their_own_radiance() {
    let scene = window();
    let source = area(&scene);
    let mean_radiance = f64::from(source.mean_radiance().x);
    // Uniform by area, a sample's own radiance over the mean one has mean 1.
    let own = mean(200_000, |u| {
        let a = source.sample(&scene, Vec3::ZERO, u).expect("faces the lamp");
        f64::from(a.facing.x / a.measure) / mean_radiance
    });
    assert!(own.1 < 0.002 && (own.0 - 1.0).abs() < 4.0 * own.1, "{own:?}");
    let deviation = own.1 * 200_000_f64.sqrt();
    assert!(deviation > 0.3, "the texture has contrast: {deviation}");
    for normal in NORMALS {
        let closed = source.closed_form(Vec3::ZERO).unwrap();
        let form = f64::from(closed.irradiance(normal).x);
        let sampler = source.at(Vec3::ZERO);
        let plain = |a: Option<Arrival>| {
            a.map_or(0.0, |a| mean_radiance * f64::from(a.measure * a.direction.dot(normal).max(0.0)))
        };
        let denominator = mean(40_000, |u| plain(sampler.sample(&scene, u)));
        assert!(agree(denominator, (form, 0.0)), "{normal}: {denominator:?} {form}");
        let by_area = mean(200_000, |u| red(source.sample(&scene, Vec3::ZERO, u), normal));
        let by_angle = mean(40_000, |u| red(sampler.sample(&scene, u), normal));
        assert!(agree(by_area, by_angle), "{normal}: {by_area:?} {by_angle:?}");
        // In the colours that show from here.
        let seen = f64::from(source.irradiance(&closed, Vec3::ZERO, normal).x);
        assert!((seen / by_angle.0 - 1.0).abs() < 0.01, "{normal}: {seen}, sampled {by_angle:?}");
    }
    assert!(mean_radiance > 0.0 && mean_radiance < 1.0);
}

/// Highlight at the origin by brute force: midpoints of n² parts of every triangle, with their own radiance.
/// A surface at the origin.
fn seen(normal: Vec3, to_eye: Vec3, shininess: f32) -> Receiver {
    Receiver { x: Vec3::ZERO, normal, to_eye, lobe: Gloss::Phong { shininess, mirror: false }.seen(normal, to_eye) }
}

fn numeric_highlight(scene: &Scene, normal: Vec3, to_eye: Vec3, shininess: f32, n: u32) -> Vec3 {
    let mut sum = DVec3::ZERO;
    for t in (0..scene.triangles.len() as u32).map(TriangleId) {
        let ([a, b, c], vector) = (scene.corners(t), scene.area_vector(t) * 0.5);
        let upright = (0..n).flat_map(|i| (0..n - i).map(move |j| (i, j, 1.0 / 3.0)));
        let inverted = (0..n - 1).flat_map(|i| (0..n - 1 - i).map(move |j| (i, j, 2.0 / 3.0)));
        for (i, j, shift) in upright.chain(inverted) {
            let [u, v] = [i, j].map(|k| (k as f32 + shift) / n as f32);
            let p = a + (b - a) * u + (c - a) * v;
            let d = p.normalize();
            let measure = (-vector.dot(d)).max(0.0) / p.length_squared() / (n * n) as f32;
            let value = measure * normal.dot(d).max(0.0) * lobe(shininess, normal, d, to_eye);
            sum += (scene.emitted_at(FaceId::new(t, false), u, v) * value).as_dvec3();
        }
    }
    sum.as_vec3()
}

/// A lamp of many small triangles.
#[test]
fn highlights_of_many_triangles_match_quadrature() {
    let normal = Vec3::new(0.1, 0.99, 0.0).normalize();
    let to_eye = Vec3::new(-0.1, 1.0, 0.1).normalize();
    // 256 facing triangles are integrated one by one; more are sampled, which is good for dull lobes only.
    for (n, shininess, tolerance) in
        [(8, 1.0, 5e-3), (8, 30.0, 5e-3), (8, 1000.0, 0.01), (16, 1.0, 0.02), (16, 30.0, 0.1)]
    {
        let scene = sphere(Vec3::new(0.2, 1.0, 0.0), 0.4, n);
        let expected = numeric_highlight(&scene, normal, to_eye, shininess, 8).x;
        let value = area(&scene).specular(&scene, &seen(normal, to_eye, shininess), 0.0).x;
        assert!((value - expected).abs() < tolerance * expected, "{n} {shininess}: {value} {expected}");
    }
}

/// A window whose texture has a contrast of one to several from texel to texel.
#[test]
fn textured_highlights_match_quadrature() {
    let scene = window();
    let source = area(&scene);
    let normal = Vec3::new(0.1, 0.99, 0.0).normalize();
    for shininess in [1.0, 10.0, 100.0, 1000.0] {
        for mirrored in [Vec3::new(0.1, 1.0, 0.0), Vec3::new(0.6, 0.8, -0.3), Vec3::new(-0.7, 0.4, 0.8)] {
            let mirrored = mirrored.normalize();
            let to_eye = 2.0 * normal.dot(mirrored) * normal - mirrored;
            let expected = numeric_highlight(&scene, normal, to_eye, shininess, 80);
            let value = source.specular(&scene, &seen(normal, to_eye, shininess), 0.0);
            let error = (value - expected).abs().max_element();
            let scale = expected.max_element().max(0.1 * source.mean_radiance().x);
            assert!(error < 0.05 * scale, "{shininess} {mirrored}: {value} {expected}");
        }
    }
}

/// Two points of each half of u[0] and of u[1]: strata of u stay apart on the light.
#[test]
fn strata_stay_apart() {
    let scene = lamp(Vec3::new(-0.5, 0.4, -0.5), Vec3::X, Vec3::Z, 1);
    let source = area(&scene);
    let at = |u: [f32; 2]| source.at(Vec3::ZERO).sample(&scene, u).expect("faces the lamp");
    let point = |u| at(u).direction * at(u).distance;
    for i in 0..50 {
        let [u, v] = random(1, i);
        let near = |du: f32, dv: f32| point([u, v]).distance(point([(u + du).min(0.999), (v + dv).min(0.999)]));
        // Continuous in both, like a square root at corners, but where one triangle ends (u[0] = 1/2).
        assert!(near(0.0, 1e-3) < 0.06, "{u} {v}: {}", near(0.0, 1e-3));
        assert!(near(1e-3, 0.0) < 0.06 || (0.498..0.502).contains(&u), "{u} {v}: {}", near(1e-3, 0.0));
    }
    let both: Vec<DVec3> = [0.25, 0.75].map(|u| point([u, 0.5]).as_dvec3()).to_vec();
    assert!(both[0].distance(both[1]) > 0.2);
}

#[test]
fn the_density_of_a_sample_is_the_inverse_of_its_measure() {
    let mut both = lamp(Vec3::new(0.1, 0.5, 0.0), Vec3::Z, Vec3::X, 1);
    both.emission_side = EmissionSide::Both;
    let scenes = [
        lamp(Vec3::new(-0.5, 1.0, -0.5), Vec3::X, Vec3::Z, 1),
        lamp(Vec3::new(-0.5, 30.0, -0.5), Vec3::X, Vec3::Z, 1),
        // Facets near and far in one source; both sides; textured; in groups.
        lamp(Vec3::new(0.02, 0.05, 0.0), Vec3::X * 9.0, Vec3::Z * 0.01, 1),
        sphere(Vec3::new(0.2, 1.5, 0.0), 1.0, 3),
        both,
        window(),
        sphere(Vec3::new(0.2, 1.5, 0.0), 1.0, 12),
    ];
    for (k, scene) in scenes.iter().enumerate() {
        let source = area(scene);
        let sampler = source.at(Vec3::new(0.01, 0.02, -0.03));
        let mut samples = 0;
        for i in 0..2000 {
            let Some(arrival) = sampler.sample(scene, random(5, i)) else { continue };
            let product = sampler.density(arrival.direction * arrival.distance) * arrival.measure;
            assert!((product - 1.0).abs() < 1e-3, "scene {k}, sample {i}: {product}");
            samples += 1;
        }
        assert!(samples > 500, "scene {k}");
        for normal in NORMALS {
            let surface = (Vec3::new(0.01, 0.02, -0.03), normal);
            for i in 0..2000 {
                let Some(arrival) = source.sample_for(scene, surface, random(5, i)) else { continue };
                let product = source.density_for(surface, arrival.direction * arrival.distance) * arrival.measure;
                assert!((product - 1.0).abs() < 1e-3, "scene {k}, sample {i} for {normal}: {product}");
            }
        }
    }
}

/// A parallelogram is sampled nearly in proportion to what a surface gets from each point, also where solid angles are not.
#[test]
fn a_panel_is_sampled_by_what_the_surface_gets() {
    let scene = lamp(Vec3::new(1.5, -0.2, -0.5), Vec3::Z, Vec3::Y * 1.2, 1);
    let source = area(&scene);
    // The lamp hangs on a wall and goes down to below the floor's horizon.
    let form = f64::from(source.closed_form(Vec3::ZERO).unwrap().irradiance(Vec3::Y).x);
    let n = 20_000;
    let deviation = |(found, error): (f64, f64)| {
        assert!(agree((found, error), (form, 0.0)), "{found} ± {error}, {form}");
        error * (n as f64).sqrt() / found
    };
    let for_surface = deviation(mean(n, |u| red(source.sample_for(&scene, (Vec3::ZERO, Vec3::Y), u), Vec3::Y)));
    let by_angle = deviation(mean(n, |u| red(source.at(Vec3::ZERO).sample(&scene, u), Vec3::Y)));
    assert!(for_surface < 0.4 && for_surface < 0.6 * by_angle, "{for_surface} {by_angle}");
    assert_eq!(source.sample_for(&scene, (Vec3::ZERO, Vec3::NEG_X), [0.5; 2]), None, "nothing from behind");
    let behind = (Vec3::X * 4.0, Vec3::NEG_X);
    assert_eq!(source.sample_for(&scene, behind, [0.5; 2]), None, "nothing from its back");
    assert!((0..50).all(|i| source.density_for(behind, Vec3::new(-2.5, 0.0, random(1, i)[0] - 0.5)) == 0.0));
}

#[test]
fn every_triangle_knows_its_light() {
    let mut scene = lamp(Vec3::Y, Vec3::X, Vec3::Z, 2);
    let wall = material(&mut scene, |_| {});
    let wall = patch(&mut scene, Vec3::ZERO, Vec3::X, Vec3::Z, 1, wall);
    light(&mut scene, LightKind::Point { position: Vec3::Y, intensity: Vec3::ONE });
    let other = patch(&mut scene, Vec3::X, Vec3::X, Vec3::Z, 1, MaterialId(0));
    light(&mut scene, LightKind::Area { triangles: other.clone() });
    let lights = Lights::new(&scene);
    assert_eq!(lights.of_triangle(TriangleId(3)), Some(0));
    assert_eq!(lights.of_triangle(other[1]), Some(2));
    assert_eq!(lights.of_triangle(wall[0]), None);
}
