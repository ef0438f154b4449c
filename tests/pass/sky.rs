//! What shows where no geometry is, against the scene's own look-ups.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use crate::support::device::*;
use glam::{Vec2, Vec3};
use penombre::light::sun::SunSource;
use penombre::pass::{FrameOptions, Layers, Renderer, UpdateMode};
use penombre::scene::Scene;
use penombre::scene::environment::{Environment, Picture};
use penombre::scene::light::{Light, LightKind, LightState};
use std::sync::Arc;

const FRAME: FrameOptions =
    FrameOptions { full_luminance: true, colour: true, combine: None, update_mode: UpdateMode::Id, queries: 0 };
const SIZE: [u32; 2] = [96, 80];
const HALF_ANGLE: f32 = 0.05;

/// A small triangle before a picture of noise, turned so that its seam or a pole may be seen, and a sun beside the middle of the view.
fn scene(look_at: Vec3, rotation: f32) -> (Scene, Environment, SunSource) {
    let mut scene = empty_scene();
    let small = [Vec3::X * -0.3, Vec3::X * -0.1, Vec3::new(-0.3, 0.15, 0.15)].map(|p| p + look_at.normalize());
    add_triangle(&mut scene, small, [Vec2::ZERO; 3], 0);
    scene.cameras[0].camera.position = Vec3::ZERO;
    scene.cameras[0].camera.look_at = look_at;
    scene.cameras[0].camera.up = Vec3::new(0.2, 0.8, 0.5);
    let texel = |i: u32| {
        Vec3::new(noise(3 * i), noise(3 * i + 1), noise(3 * i + 2)) * if i.is_multiple_of(97) { 10.0 } else { 1.0 }
    };
    let picture = Picture::new([100, 50], (0..5000).map(texel).collect());
    let environment = Environment::new(Arc::new(picture), Vec3::new(0.1, 0.9, 0.1).normalize(), rotation);
    scene.lights.push(Light { name: "sky".into(), kind: LightKind::Environment(Arc::new(environment.clone())) });
    let direction = (look_at.normalize() + Vec3::new(0.1, 0.05, 0.1)).normalize();
    let radiance = Vec3::new(100.0, 200.0, 300.0);
    scene
        .lights
        .push(Light { name: "sun".into(), kind: LightKind::Sun { direction, half_angle: HALF_ANGLE, radiance } });
    (scene, environment, SunSource::new(direction, HALF_ANGLE, radiance))
}

fn layers(renderer: &mut Renderer, scene: &Scene) -> Layers {
    show(renderer, scene, SIZE[0], SIZE[1]);
    renderer.frame(&FRAME).unwrap();
    renderer.read_layers().unwrap()
}

#[test]
fn the_background_is_the_environment_and_the_sun() {
    with_renderer(|renderer| {
        for (look_at, rotation) in
            [(Vec3::Z, 0.0), (Vec3::NEG_Z, 1.0), (Vec3::new(0.1, 1.0, 0.2), 2.0), (Vec3::NEG_Y, 0.0)]
        {
            let (scene, environment, sun) = scene(look_at, rotation);
            let view = view_of(&scene, SIZE[0], SIZE[1]);
            let layers = layers(renderer, &scene);
            let (mut beside, mut in_sun, mut off) = (0, 0, 0);
            for (pixel, &id) in layers.face_id.iter().enumerate() {
                if id != 0 {
                    beside += 1;
                    assert!(layers.combined[pixel][3] == 1.0 && Vec3::from(layers.le[pixel]) == Vec3::ZERO);
                    continue;
                }
                let centre = view.size.centre_of(pixel);
                let direction = |offset: Vec2| view.direction(centre + offset).normalize();
                let middle = direction(Vec2::ZERO);
                let angle = [Vec2::X, Vec2::Y].map(|by| direction(by).distance(middle)).into_iter().fold(0.0, f32::max);
                let of_sun = sun.seen(middle, angle);
                let expected = environment.seen(middle, angle) + of_sun;
                let [r, g, b, coverage] = layers.combined[pixel];
                assert_eq!(coverage, 0.0, "nothing covers it");
                let error = (Vec3::new(r, g, b) - expected).abs().max_element();
                // Half floats; and a device's arc tangent may be off by a hundredth of a texel.
                off += usize::from(error > 4e-3 * expected.max_element() + 0.02);
                in_sun += usize::from(of_sun.x > 50.0);
            }
            assert!(beside > 20 && in_sun > 20, "{look_at}: {beside} {in_sun}");
            assert!(off * 500 < layers.face_id.len(), "{look_at}: {off} pixels differ");
        }
    });
}

#[test]
fn sky_and_sun_are_dimmed_apart_and_go_with_another_scene() {
    with_renderer(|renderer| {
        let (scene, ..) = scene(Vec3::Z, 0.0);
        let before = layers(renderer, &scene);
        renderer.relight(&[LightState::times(Vec3::new(0.5, 0.0, 0.25)), LightState::times(Vec3::ZERO)]).unwrap();
        renderer.frame(&FRAME).unwrap();
        let dimmed = renderer.read_layers().unwrap();
        let brightest = |layers: &Layers| layers.le.iter().map(|p| p[1]).fold(0.0, f32::max);
        assert!(brightest(&before) > 199.0 && brightest(&dimmed) == 0.0);
        let pairs = before.le.iter().zip(&dimmed.le).filter(|(a, _)| a[1] > 0.0 && a[1] < 1.0);
        assert!(pairs.clone().count() > 1000);
        pairs.for_each(|(a, b)| {
            assert!((b[0] - 0.5 * a[0]).abs() <= 2e-3 * a[0] && (b[2] - 0.25 * a[2]).abs() <= 2e-3 * a[2])
        });
        let mut bare = scene.clone();
        bare.lights.clear();
        let bare = layers(renderer, &bare);
        assert!(bare.combined.iter().zip(&bare.face_id).all(|(p, &id)| id != 0 || *p == [0.0; 4]), "nothing is left");
    });
}
