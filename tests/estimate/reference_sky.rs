//! The path tracer under environments and suns.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use crate::support::by_hand::{light, material, patch};
use crate::support::shapes::icosphere;
use glam::Vec3;
use penombre::geom::bvh::Bvh;
use penombre::light::context::SceneContext;
use penombre::light::lights::Lights;
use penombre::reference::{Accumulator, Filter, ReferenceImage, Settings, Strategy, Transport};
use penombre::scene::Scene;
use penombre::scene::camera::{Camera, ImageSize};
use penombre::scene::environment::{Environment, Picture};
use penombre::scene::light::LightKind;
use penombre::scene::material::Model;
use std::f32::consts::PI;
use std::sync::Arc;

const FULL: Settings = Settings { filter: Filter::Box, transport: Transport::Full, strategy: Strategy::Both };
const STRATEGIES: [Strategy; 3] = [Strategy::Both, Strategy::Lights, Strategy::Reflection];

fn image(scene: &Scene, camera: &Camera, settings: Settings, passes: u32) -> ReferenceImage {
    let (bvh, lights) = (Bvh::build(scene), Lights::new(scene));
    let context = SceneContext::new(scene, &bvh, &lights, 1, scene.scale());
    let view = scene.view(camera, ImageSize { width: 16, height: 16 });
    let mut accumulator = Accumulator::new(&view);
    (0..passes).for_each(|_| assert!(accumulator.pass(&context, &view, settings, || false).finished));
    accumulator.image()
}

/// Mean over the pixels, and its standard error.
fn mean(scene: &Scene, camera: &Camera, settings: Settings, passes: u32) -> [Vec3; 2] {
    let image = image(scene, camera, settings, passes);
    let n = image.mean.len() as f32;
    let error = (image.variance.iter().sum::<Vec3>() / (n * n)).map(f32::sqrt);
    [image.mean.iter().map(|m| m.truncate()).sum::<Vec3>() / n, error]
}

#[track_caller]
fn assert_is([mean, error]: [Vec3; 2], expected: Vec3) {
    assert!(error.cmple(expected * 0.01 + 1e-9).all(), "too noisy: {mean} ± {error}, expected {expected}");
    assert!((mean - expected).abs().cmple(error * 4.0 + expected * 2e-3).all(), "{mean} ± {error}, not {expected}");
}

fn around(scene: &mut Scene, picture: Picture, up: Vec3, rotation: f32) {
    light(scene, LightKind::Environment(Arc::new(Environment::new(Arc::new(picture), up, rotation))));
}

fn look(position: Vec3, look_at: Vec3, vertical_fov: f32) -> Camera {
    Camera { position, look_at, up: Vec3::new(0.1, 1.0, 0.2), vertical_fov }
}

/// A white body under an even sky shows nothing but that, whatever its shape, and nor does what is beside it.
#[test]
fn a_white_body_cannot_be_told_from_an_even_sky() {
    let radiance = Vec3::new(0.5, 1.0, 2.0);
    let mut scene = Scene::default();
    let white = material(&mut scene, |m| m.kd = Vec3::ONE);
    icosphere(&mut scene, Vec3::ZERO, 1.0, 2, false, white);
    around(&mut scene, Picture::constant(radiance), Vec3::Y, 0.0);
    let camera = look(Vec3::new(0.0, 0.5, 3.0), Vec3::ZERO, 60.0);
    for strategy in STRATEGIES {
        let found = image(&scene, &camera, Settings { strategy, ..FULL }, 64);
        let beside = found.mean.iter().filter(|pixel| pixel.w == 0.0);
        assert!(beside.clone().count() > 20);
        beside.for_each(|pixel| assert!((pixel.truncate() / radiance - 1.0).abs().max_element() < 5e-3, "{pixel}"));
        assert_is(mean(&scene, &camera, Settings { strategy, ..FULL }, 64), radiance);
    }
}

/// A floor between walls under a sky with a sun of one texel: three ways to the same light.
#[test]
fn all_strategies_agree_under_an_uneven_sky() {
    let texel = |i: u32| Vec3::new(0.2 + (i % 32) as f32 * 0.05, 0.5, 1.0) * if i == 32 * 6 + 12 { 60.0 } else { 1.0 };
    for (shininess, sun) in [(0.0, false), (40.0, false), (40.0, true)] {
        let mut scene = Scene::default();
        let floor = material(&mut scene, |m| {
            (m.kd, m.model) = (Vec3::splat(0.4), Model::phong(Vec3::splat(0.3), shininess));
        });
        let wall = material(&mut scene, |m| m.kd = Vec3::new(0.6, 0.3, 0.3));
        patch(&mut scene, Vec3::new(-1.0, 0.0, -1.0), Vec3::Z * 2.0, Vec3::X * 2.0, 1, floor);
        patch(&mut scene, Vec3::new(-1.0, 0.0, -1.0), Vec3::X * 2.0, Vec3::Y, 1, wall);
        around(&mut scene, Picture::new([32, 16], (0..512).map(texel).collect()), Vec3::Y, 0.8);
        if sun {
            // Wide enough to be found by reflection.
            let direction = Vec3::new(0.3, 0.8, 0.52).normalize();
            light(&mut scene, LightKind::Sun { direction, half_angle: 0.15, radiance: Vec3::splat(9.0) });
        }
        let camera = look(Vec3::new(0.3, 1.2, 1.6), Vec3::new(0.0, 0.1, -0.2), 20.0);
        let [both, lights, reflection] = STRATEGIES.map(|strategy| {
            let passes = if strategy == Strategy::Reflection { 2048 } else { 512 };
            mean(&scene, &camera, Settings { strategy, ..FULL }, passes)
        });
        for other in [lights, reflection] {
            let error = (both[1] * both[1] + other[1] * other[1]).map(f32::sqrt);
            assert!(error.cmple(both[0] * 0.01).all(), "too noisy to test: {both:?} {other:?}");
            assert!((both[0] - other[0]).abs().cmple(error * 4.0).all(), "{shininess} {sun}: {both:?} {other:?}");
        }
    }
}

/// One texel of 1e5 times the radiance of the others on a plane: its direct light is found as surely as that of a lamp.
#[test]
fn a_sun_of_one_texel_does_not_add_noise() {
    let mut texels = vec![Vec3::ONE; 256 * 128];
    texels[36 * 256 + 90] = Vec3::splat(1e5);
    let mut scene = Scene::default();
    let grey = material(&mut scene, |m| m.kd = Vec3::splat(0.5));
    patch(&mut scene, Vec3::new(-1.0, 0.0, -1.0), Vec3::Z * 2.0, Vec3::X * 2.0, 1, grey);
    around(&mut scene, Picture::new([256, 128], texels), Vec3::Y, 0.0);
    let step = PI / 128.0;
    let height = (36.5 * step).cos();
    let of_sun = 1e5 * height * 2.0 * (36.5 * step).sin() * (step / 2.0).sin() * 2.0 * PI / 256.0;
    let camera = look(Vec3::new(0.0, 1.0, 0.1), Vec3::ZERO, 30.0);
    let [found, error] = mean(&scene, &camera, Settings { transport: Transport::Direct, ..FULL }, 16);
    let expected = 0.5 * (1.0 + of_sun / PI);
    assert!((found.x / expected - 1.0).abs() < 2e-3, "{found}, not {expected}");
    assert!(error.x < 3e-3 * expected, "{error} of {expected}");
}
