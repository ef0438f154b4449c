//! The path tracer against closed forms (docs/method/closed-forms.md), and its own strategies against each other.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use crate::support::by_hand::{light, material, patch};
use crate::support::shapes::{icosphere, room};
use glam::Vec3;
use penombre::geom::bvh::Bvh;
use penombre::light::context::SceneContext;
use penombre::light::lights::Lights;
use penombre::reference::{Accumulator, Filter, ReferenceImage, Settings, Strategy, Transport, random_pixels};
use penombre::scene::camera::{Camera, ImageSize};
use penombre::scene::coplanar::Coplanar;
use penombre::scene::light::LightKind;
use penombre::scene::material::{MetallicRoughness, Model, Phong};
use penombre::scene::{Scene, load};
use std::f32::consts::PI;
use std::path::Path;

pub const FULL: Settings = Settings { filter: Filter::Box, transport: Transport::Full, strategy: Strategy::Both };
const STRATEGIES: [Strategy; 3] = [Strategy::Both, Strategy::Lights, Strategy::Reflection];

pub fn camera(position: Vec3, look_at: Vec3, vertical_fov: f32) -> Camera {
    let up = if (look_at - position).cross(Vec3::Y).length() > 1e-3 { Vec3::Y } else { Vec3::Z };
    Camera { position, look_at, up, vertical_fov }
}

fn render(scene: &Scene, camera: &Camera, settings: Settings, passes: u32, seed: u64) -> ReferenceImage {
    let (bvh, lights) = (Bvh::build(scene), Lights::new(scene));
    let context = SceneContext::new(scene, &bvh, &lights, seed, scene.scale());
    let view = scene.view(camera, ImageSize { width: 16, height: 16 });
    let mut accumulator = Accumulator::new(&view);
    for _ in 0..passes {
        assert!(accumulator.pass(&context, &view, settings, || false).finished);
    }
    accumulator.image()
}

/// Mean over the pixels, and its standard error.
#[derive(Clone, Copy, Debug)]
pub struct Estimate {
    mean: Vec3,
    error: Vec3,
}

pub fn estimate(scene: &Scene, camera: &Camera, settings: Settings, passes: u32, seed: u64) -> Estimate {
    let image = render(scene, camera, settings, passes, seed);
    let n = image.mean.len() as f32;
    let sum: Vec3 = image.mean.iter().map(|m| m.truncate()).sum();
    let variance: Vec3 = image.variance.iter().sum();
    Estimate { mean: sum / n, error: (variance / (n * n)).map(f32::sqrt) }
}

impl Estimate {
    /// Within four standard errors and `relative`; and sure enough that this says something.
    #[track_caller]
    pub fn assert_is(self, expected: Vec3, relative: f32) {
        let Self { mean, error } = self;
        assert!(error.cmple(expected * 0.01 + 1e-9).all(), "too noisy to test: {mean} ± {error}, expected {expected}");
        let off = (mean - expected).abs();
        assert!(off.cmple(error * 4.0 + expected * relative).all(), "{mean} ± {error}, expected {expected}");
    }

    #[track_caller]
    fn assert_agrees(self, other: Self) {
        let error = (self.error * self.error + other.error * other.error).map(f32::sqrt);
        assert!(error.cmple(self.mean * 0.02).all(), "too noisy to test: {self:?}");
        assert!((self.mean - other.mean).abs().cmple(error * 4.0).all(), "{self:?} {other:?}");
    }
}

#[test]
fn furnace() {
    let (emitted, albedo) = (Vec3::new(1.0, 0.5, 2.0), Vec3::new(0.5, 0.8, 0.2));
    let expected = emitted / (1.0 - albedo);
    // One light of six walls, and more lights than are sampled at once: six of one wall each.
    for one_light in [true, false] {
        let mut scene = Scene::default();
        let walls = material(&mut scene, |m| (m.kd, m.ke) = (albedo, emitted));
        room(&mut scene, [walls; 6], one_light);
        let camera = camera(Vec3::new(0.3, 0.4, 0.35), Vec3::new(0.9, 0.5, 0.6), 70.0);
        for strategy in STRATEGIES {
            estimate(&scene, &camera, Settings { strategy, ..FULL }, 256, 1).assert_is(expected, 1e-4);
        }
        let direct = Settings { transport: Transport::Direct, ..FULL };
        estimate(&scene, &camera, direct, 64, 1).assert_is(emitted * (1.0 + albedo), 1e-4);
    }
}

/// A room of emission 1 and reflectance 1/2, with a small dark glossy patch under the camera, seen along its normal: there
/// the lobe reflects k_s exactly.
fn glossy_patch(shininess: f32, mirror: bool) -> (Scene, Camera) {
    let mut scene = Scene::default();
    let walls = material(&mut scene, |m| (m.kd, m.ke) = (Vec3::splat(0.5), Vec3::ONE));
    room(&mut scene, [walls; 6], true);
    let glossy = material(&mut scene, |m| {
        m.kd = Vec3::new(0.2, 0.1, 0.0);
        m.model = Model::Phong(Phong { ks: Vec3::new(0.3, 0.2, 0.5), shininess, mirror });
    });
    let corner = Vec3::new(0.499, 0.5, 0.499);
    patch(&mut scene, corner, Vec3::Z * 0.002, Vec3::X * 0.002, 1, glossy);
    (scene, camera(Vec3::new(0.5, 0.9, 0.5), Vec3::new(0.5, 0.5, 0.5), 0.1))
}

#[test]
fn glossy_furnace() {
    let (kd, ks) = (Vec3::new(0.2, 0.1, 0.0), Vec3::new(0.3, 0.2, 0.5));
    for shininess in [0.0, 0.5, 8.0, 300.0, 50_000.0] {
        let (scene, camera) = glossy_patch(shininess, false);
        for strategy in [Strategy::Both, Strategy::Reflection] {
            let settings = Settings { strategy, ..FULL };
            estimate(&scene, &camera, settings, 512, 2).assert_is((kd + ks) * 2.0, 1e-3);
            // What is emitted is mirrored, what bounced before is not.
            let (scene, camera) = glossy_patch(shininess, true);
            estimate(&scene, &camera, settings, 512, 2).assert_is(ks + kd * 2.0, 1e-3);
        }
    }
}

/// In a furnace a white surface is as bright as its walls, whatever its roughness, metal or not.
#[test]
fn white_surfaces_of_any_roughness_vanish_in_a_furnace() {
    for (metallic, roughness) in [(1.0, 0.1), (1.0, 0.5), (1.0, 1.0), (0.0, 0.1), (0.0, 0.6), (0.5, 0.3)] {
        let (mut scene, camera) = glossy_patch(1.0, false);
        let model = MetallicRoughness { metallic, roughness, map_metallic: None, map_roughness: None };
        (scene.materials[1].kd, scene.materials[1].model) = (Vec3::ONE, Model::MetallicRoughness(model));
        for strategy in [Strategy::Both, Strategy::Reflection] {
            // Walls of emission 1 and reflectance 1/2; the tables are right to half a percent.
            estimate(&scene, &camera, Settings { strategy, ..FULL }, 512, 2).assert_is(Vec3::splat(2.0), 5e-3);
        }
    }
}

#[test]
fn beyond_the_first_hit_the_method_reflects_diffusely() {
    let (kd, ks) = (Vec3::new(0.2, 0.4, 0.5), Vec3::new(0.6, 0.3, 0.1));
    let mut scene = Scene::default();
    let walls = material(&mut scene, |m| (m.kd, m.model, m.ke) = (kd, Model::phong(ks, 20.0), Vec3::ONE));
    room(&mut scene, [walls; 6], true);
    let along_the_normal = camera(Vec3::new(0.5, 0.9, 0.5), Vec3::new(0.5, 0.0, 0.5), 0.1);
    let method = Settings { transport: Transport::Method, ..FULL };
    let expected = 1.0 + (kd + ks) / (1.0 - kd - ks * (2.0 / 3.0));
    estimate(&scene, &along_the_normal, method, 512, 3).assert_is(expected, 1e-3);
    // The whole truth is near, and below a furnace that loses none of k_s; highlights that counted for nothing are not.
    let full = estimate(&scene, &along_the_normal, FULL, 512, 3);
    let near = (full.mean / expected - 1.0).abs().max_element() < 0.1;
    assert!(near && full.mean.cmple(1.0 / (1.0 - kd - ks)).all(), "{full:?} {expected}");
    assert!(full.mean.x > 1.2 * (1.0 + (kd + ks) / (1.0 - kd)).x, "{full:?}");
}

/// A spherical lamp of many triangles and a small one over a glossy floor, and boxes of light and shade between.
fn gallery() -> (Scene, Camera) {
    let mut scene = Scene::default();
    let grey = material(&mut scene, |m| m.kd = Vec3::new(0.7, 0.5, 0.3));
    let glossy = material(&mut scene, |m| {
        (m.kd, m.model) = (Vec3::splat(0.2), Model::phong(Vec3::new(0.5, 0.6, 0.7), 60.0));
    });
    room(&mut scene, [grey, grey, glossy, grey, grey, grey], false);
    let large = material(&mut scene, |m| (m.kd, m.ke) = (Vec3::splat(0.5), Vec3::splat(4.0)));
    let triangles = icosphere(&mut scene, Vec3::new(0.4, 0.4, 0.7), 0.15, 2, false, large);
    assert!(triangles.len() > 128, "enough to be sampled by groups");
    light(&mut scene, LightKind::Area { triangles });
    let small = material(&mut scene, |m| m.ke = Vec3::new(90.0, 60.0, 30.0));
    let triangles = patch(&mut scene, Vec3::new(0.7, 0.95, 0.3), Vec3::X * 0.05, Vec3::Z * 0.05, 1, small);
    light(&mut scene, LightKind::Area { triangles });
    patch(&mut scene, Vec3::new(0.6, 0.0, 0.5), Vec3::X * 0.3, Vec3::Y * 0.3, 1, grey);
    (scene, camera(Vec3::new(0.5, 0.6, 0.02), Vec3::new(0.5, 0.2, 0.8), 80.0))
}

#[test]
fn strategies_agree_and_the_weighed_one_is_the_surest() {
    let (scene, camera) = gallery();
    let [both, lights, reflection] =
        STRATEGIES.map(|strategy| estimate(&scene, &camera, Settings { strategy, ..FULL }, 1024, 4));
    both.assert_agrees(lights);
    both.assert_agrees(reflection);
    assert!(both.error.cmplt(lights.error).all() && both.error.cmplt(reflection.error).all(), "{both:?} {lights:?}");
}

/// Irradiance that has bounced is the same everywhere in a sphere, F ρ / (A (1 − ρ)), wherever the light is.
#[test]
fn integrating_sphere() {
    let albedo = Vec3::new(0.8, 0.5, 0.1);
    let mut scene = Scene::default();
    let wall = material(&mut scene, |m| m.kd = albedo);
    let triangles = icosphere(&mut scene, Vec3::ZERO, 2.0, 4, true, wall);
    let area: f32 = triangles.iter().map(|&t| scene.area_vector(t).length() * 0.5).sum();
    light(&mut scene, LightKind::Point { position: Vec3::new(0.9, 0.3, -0.5), intensity: Vec3::new(1.0, 2.0, 3.0) });
    let flux = 4.0 * PI * Vec3::new(1.0, 2.0, 3.0);
    let expected = albedo / PI * flux * albedo / (area * (1.0 - albedo));
    for look_at in [Vec3::X, Vec3::NEG_X, Vec3::new(0.1, -1.0, 0.4)] {
        let camera = camera(Vec3::new(0.1, 0.2, 0.3), look_at * 2.0, 40.0);
        let full = estimate(&scene, &camera, FULL, 1024, 5);
        // The same random numbers give the same direct light.
        let direct = estimate(&scene, &camera, Settings { transport: Transport::Direct, ..FULL }, 1024, 5);
        Estimate { mean: full.mean - direct.mean, error: full.error }.assert_is(expected, 3e-3);
    }
}

/// One bounce: a lit rectangle seen by a small patch at right angles to it.
#[test]
fn light_of_one_bounce_follows_the_form_factor() {
    // Foot at distance c along x, width b along z, height a.
    for (a, b, c, factor) in [(1.0, 1.0, 1.0, 0.055_734_2), (2.0, 1.5, 0.7, 0.148_121)] {
        let mut scene = Scene::default();
        let white = material(&mut scene, |m| m.kd = Vec3::ONE);
        let wall = material(&mut scene, |m| m.kd = Vec3::new(0.9, 0.5, 0.2));
        patch(&mut scene, Vec3::new(-1e-3, 0.0, -1e-3), Vec3::Z * 1e-3, Vec3::X * 1e-3, 1, white);
        patch(&mut scene, Vec3::X * c, Vec3::Z * b, Vec3::Y * a, 1, wall);
        // From below, so that the patch gets none of it but off the wall.
        let direction = Vec3::new(1.0, 0.5, 0.0).normalize();
        light(&mut scene, LightKind::Directional { direction, irradiance: Vec3::splat(2.0) });
        let camera = camera(Vec3::new(-5e-4, 0.1, -5e-4), Vec3::new(-5e-4, 0.0, -5e-4), 0.1);
        let expected = Vec3::new(0.9, 0.5, 0.2) * (2.0 * direction.x / PI * factor);
        estimate(&scene, &camera, FULL, 1024, 6).assert_is(expected, 2e-3);
    }
}

#[test]
fn nothing_shines_through_smooth_walls() {
    let mut scene = Scene::default();
    let wall = material(&mut scene, |m| (m.kd, m.model) = (Vec3::splat(0.5), Model::phong(Vec3::splat(0.5), 5.0)));
    icosphere(&mut scene, Vec3::ZERO, 1.0, 0, true, wall);
    // Normals of the sphere on an icosahedron: they differ by up to 37° from its facets'.
    let inwards = |scene: &Scene, i: u32| -scene.positions[i as usize].normalize();
    scene.normals = scene.triangles.iter().map(|t| t.map(|i| inwards(&scene, i))).collect();
    light(&mut scene, LightKind::Point { position: Vec3::new(3.0, 1.0, 0.0), intensity: Vec3::splat(1e4) });
    let image = render(&scene, &camera(Vec3::ZERO, Vec3::X, 120.0), FULL, 256, 7);
    assert!(image.mean.iter().all(|m| m.truncate() == Vec3::ZERO && m.w == 1.0));
}

/// Directions above a slanted normal's horizon but below the triangle would meet it once more.
#[test]
fn a_triangle_does_not_light_itself() {
    let mut scene = Scene::default();
    let white = material(&mut scene, |m| m.kd = Vec3::ONE);
    patch(&mut scene, Vec3::ZERO, Vec3::Z, Vec3::X, 1, white);
    scene.normals.fill([Vec3::new(0.8, 0.6, 0.0); 3]);
    light(&mut scene, LightKind::Point { position: Vec3::new(1.0, 1.0, 0.5), intensity: Vec3::ONE });
    let camera = camera(Vec3::new(0.5, 2.0, 0.5), Vec3::new(0.5, 0.0, 0.5), 40.0);
    let full = render(&scene, &camera, FULL, 16, 13);
    let direct = render(&scene, &camera, Settings { transport: Transport::Direct, ..FULL }, 16, 13);
    assert!(direct.mean.iter().any(|m| m.x > 0.0));
    assert_eq!(full.mean, direct.mean);
}

#[test]
fn the_back_of_a_lamp_is_dark() {
    let mut scene = Scene::default();
    let lamp = material(&mut scene, |m| (m.kd, m.ke) = (Vec3::ONE, Vec3::ONE));
    // At a slant, so that rounding puts its points on either side of its plane.
    let triangles =
        patch(&mut scene, Vec3::new(-1.1, 0.3, 0.2), Vec3::new(2.0, 0.7, 0.3), Vec3::new(-0.3, 0.4, 2.1), 1, lamp);
    let normal = scene.geometric_normal(triangles[0]);
    light(&mut scene, LightKind::Area { triangles });
    let camera = camera(-normal * 5.0, Vec3::ZERO, 60.0);
    let image = render(&scene, &camera, FULL, 64, 12);
    assert!(image.mean.iter().any(|m| m.w == 1.0));
    assert!(image.mean.iter().all(|m| m.truncate() == Vec3::ZERO));
}

/// Two opposite sheets in one place, as exporters write double-sided lamps: both sides emit, however their light is found.
#[test]
fn both_sides_of_a_lamp_of_two_sheets_emit() {
    let mut scene = Scene::default();
    let grey = material(&mut scene, |m| m.kd = Vec3::splat(0.5));
    let lamp = material(&mut scene, |m| (m.kd, m.ke) = (Vec3::ZERO, Vec3::new(1.0, 2.0, 3.0)));
    patch(&mut scene, Vec3::ZERO, Vec3::Z, Vec3::X, 1, grey);
    patch(&mut scene, Vec3::Y, Vec3::X, Vec3::Z, 1, grey);
    let corner = Vec3::new(0.3, 0.5, 0.3);
    let mut triangles = patch(&mut scene, corner, Vec3::X * 0.4, Vec3::Z * 0.4, 1, lamp);
    triangles.extend(patch(&mut scene, corner, Vec3::Z * 0.4, Vec3::X * 0.4, 1, lamp));
    light(&mut scene, LightKind::Area { triangles });
    scene.coplanar = Coplanar::find(&scene);
    let middle = Vec3::splat(0.5);
    let mut walls = Vec::new();
    for up in [1.0, -1.0] {
        let onto_the_lamp = camera(middle + Vec3::Y * (0.4 * up), middle, 10.0);
        let seen = render(&scene, &onto_the_lamp, FULL, 4, 14);
        assert!(seen.mean.iter().all(|m| m.truncate() == Vec3::new(1.0, 2.0, 3.0)), "{}", seen.mean[0]);
        let onto_the_wall = camera(middle + Vec3::Y * (0.1 * up), middle + Vec3::new(0.0, 0.5 * up, 0.01), 40.0);
        walls.extend(
            STRATEGIES.map(|strategy| estimate(&scene, &onto_the_wall, Settings { strategy, ..FULL }, 2048, 14)),
        );
    }
    for wall in &walls[1..] {
        walls[0].assert_agrees(*wall);
    }
    // k_d Ke F is 0.084 opposite the middle, with the form factor F of a point to a parallel square, and less around it.
    assert!((0.076..0.084).contains(&walls[0].mean.x), "{:?}", walls[0]);
}

/// Direct and indirect irradiance of the Cornell box, from 3·10⁶ paths a point of another program.
#[test]
fn cornell_box_irradiances() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell_box/cornell_box.toml");
    let mut scene = load::load(&file).unwrap().scene;
    // That program's lamp reflects nothing.
    scene.materials.iter_mut().filter(|m| m.is_emissive()).for_each(|m| m.kd = Vec3::ZERO);
    let white = Vec3::new(0.725, 0.71, 0.68);
    let v = Vec3::new;
    let points = [
        (v(278.0, 0.0, 30.0), Vec3::Y, white, v(0.3813, 0.2691, 0.0897), v(0.1169, 0.0428, 0.0092)),
        (v(450.0, 0.0, 100.0), Vec3::Y, white, v(0.5272, 0.3721, 0.1240), v(0.2104, 0.0622, 0.0141)),
        (v(100.0, 400.0, 559.2), Vec3::NEG_Z, white, v(0.5635, 0.3978, 0.1326), v(0.2487, 0.2220, 0.0368)),
        (v(100.0, 548.8, 100.0), Vec3::NEG_Y, white, Vec3::ZERO, v(0.2528, 0.2016, 0.0408)),
        (v(0.0, 274.4, 279.6), Vec3::X, v(0.14, 0.45, 0.091), v(0.7514, 0.5304, 0.1768), v(0.3780, 0.2284, 0.0578)),
    ];
    for (point, normal, kd, direct, indirect) in points {
        let camera = camera(point + normal * 10.0, point, 0.01);
        let settings = Settings { transport: Transport::Direct, ..FULL };
        // The lamp hangs 0.1 below the ceiling here too, and lights none of it.
        let found = estimate(&scene, &camera, settings, 64, 8);
        assert!(
            (found.mean * PI / kd - direct).abs().cmple(direct * 2e-3 + found.error * 14.0).all(),
            "{point}: {found:?}"
        );
        let found = estimate(&scene, &camera, FULL, 2048, 8);
        let irradiance = Estimate { mean: found.mean * PI / kd, error: found.error * PI / kd };
        irradiance.assert_is(direct + indirect, 4e-3);
    }
}

#[test]
fn light_is_linear_in_power() {
    let image = |power: f32| {
        let (mut scene, camera) = gallery();
        scene.materials.iter_mut().for_each(|m| m.ke *= power);
        light(&mut scene, LightKind::Point { position: Vec3::splat(0.5), intensity: Vec3::splat(0.1 * power) });
        render(&scene, &camera, FULL, 16, 9).mean
    };
    for (one, four) in image(1.0).iter().zip(image(4.0)) {
        let off = (four.truncate() - 4.0 * one.truncate()).abs();
        assert!(off.cmple(1e-5 * four.truncate()).all(), "{one} {four}");
    }
}

#[test]
fn threads_do_not_change_a_bit_and_seeds_do() {
    let (scene, camera) = gallery();
    let run = |threads, seed| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let image = pool.install(|| render(&scene, &camera, FULL, 4, seed));
        image.mean.iter().flat_map(|m| m.to_array().map(f32::to_bits)).collect::<Vec<u32>>()
    };
    let one = run(1, 10);
    assert_eq!(one, run(2, 10));
    assert_eq!(one, run(3, 10));
    assert_ne!(one, run(1, 11));
}

/// Some of the pixels get the very samples that they would get among all, on any number of threads; nothing is claimed of the
/// others.
#[test]
fn a_part_of_the_pixels_is_the_same_part_of_the_image() {
    let (scene, camera) = gallery();
    let all = render(&scene, &camera, FULL, 4, 10);
    assert!(all.sampled.is_none());
    let (bvh, lights) = (Bvh::build(&scene), Lights::new(&scene));
    let context = SceneContext::new(&scene, &bvh, &lights, 10, scene.scale());
    let view = scene.view(&camera, ImageSize { width: 16, height: 16 });
    let chosen = random_pixels(view.size, 50);
    let mean = |pixels: &mut dyn Iterator<Item = usize>, n: f32| pixels.map(|i| all.mean[i].x).sum::<f32>() / n;
    let (of_all, of_part) = (mean(&mut (0..256), 256.0), mean(&mut chosen.iter().map(|&i| i as usize), 50.0));
    let spread = (all.mean.iter().map(|m| (m.x - of_all).powi(2)).sum::<f32>() / 256.0).sqrt();
    assert!((of_part - of_all).abs() < 3.0 * spread / 50_f32.sqrt(), "{of_part} of {of_all}, spread {spread}");
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut accumulator = Accumulator::over(&view, chosen.clone());
        for _ in 0..4 {
            assert!(pool.install(|| accumulator.pass(&context, &view, FULL, || false)).finished);
        }
        let part = accumulator.image();
        let sampled = part.sampled.unwrap();
        assert_eq!(sampled.iter().filter(|&&is| is).count(), 50);
        for (i, &is_sampled) in sampled.iter().enumerate() {
            let expected = (all.mean[i], all.variance[i], all.mask[i]);
            let nothing = (glam::Vec4::ZERO, Vec3::ZERO, false);
            let is_chosen = chosen.contains(&(i as u32));
            assert_eq!(is_sampled, is_chosen);
            let expected = if is_chosen { expected } else { nothing };
            assert_eq!((part.mean[i], part.variance[i], part.mask[i]), expected, "pixel {i}");
        }
    }
}

/// Nothing but the number and the image's size says which: fewer are among more, each is there once, and all parts of the image
/// get their share.
#[test]
fn pixels_are_chosen_evenly() {
    let size = ImageSize { width: 64, height: 48 };
    let [few, many] = [300, 1000].map(|n| random_pixels(size, n));
    assert_eq!((few.len(), many.len()), (300, 1000));
    assert!(many.windows(2).all(|pair| pair[0] < pair[1]) && many.iter().all(|&i| i < 64 * 48));
    assert!(few.iter().all(|i| many.binary_search(i).is_ok()));
    assert_eq!(random_pixels(size, 5000), (0..64 * 48).collect::<Vec<u32>>());
    let mut counts = [0_i32; 12];
    many.iter().for_each(|i| counts[(i / 64 / 16 * 4 + i % 64 / 16) as usize] += 1);
    // 83 of 256 expected in each square, with a standard deviation of 7.2.
    assert!(counts.iter().all(|c| (c - 83).abs() < 4 * 7), "{counts:?}");
}

/// The variance says how far means of different seeds scatter: at most, since samples are stratified.
#[test]
fn the_variance_bounds_the_scatter_of_means() {
    let (scene, camera) = gallery();
    let runs: Vec<ReferenceImage> = (0..24).map(|seed| render(&scene, &camera, FULL, 32, 100 + seed)).collect();
    let n = runs.len() as f32;
    let (mut scatter, mut claimed) = (0.0, 0.0);
    for i in 0..runs[0].mean.len() {
        let mean = runs.iter().map(|r| r.mean[i].x).sum::<f32>() / n;
        scatter += runs.iter().map(|r| (r.mean[i].x - mean).powi(2)).sum::<f32>() / (n - 1.0);
        claimed += runs.iter().map(|r| r.variance[i].x).sum::<f32>() / n;
    }
    let ratio = scatter / claimed;
    assert!((0.3..1.1).contains(&ratio), "{ratio}");
}
