//! A reference that is looked at while it is sampled, and lights that count times something.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use crate::support::by_hand::{light, material, patch};
use glam::{Vec3, Vec4};
use penombre::geom::bvh::Bvh;
use penombre::light::context::SceneContext;
use penombre::light::lights::Lights;
use penombre::reference::{Accumulator, Filter, Progressive, Settings, Strategy, Transport};
use penombre::scene::Scene;
use penombre::scene::camera::{Camera, ImageSize, View};
use penombre::scene::light::{LightKind, LightState};
use penombre::scene::material::Model;
use std::sync::atomic::{AtomicU32, Ordering};

const FULL: Settings = Settings { filter: Filter::Point, transport: Transport::Full, strategy: Strategy::Both };
const DIRECT: Settings = Settings { transport: Transport::Direct, ..FULL };

const LAMP: Vec3 = Vec3::new(6.0, 5.0, 4.0);
const POINT: Vec3 = Vec3::new(0.4, 0.5, 0.8);

/// A floor between two walls, with a glossy board on it, an area lamp in view and a point light; what these emit is multiplied by
/// `factors`.
fn scene(factors: [Vec3; 2]) -> Scene {
    let mut scene = Scene::default();
    let white = material(&mut scene, |m| m.kd = Vec3::splat(0.6));
    let glossy = material(&mut scene, |m| {
        m.model = Model::phong(Vec3::splat(0.3), 20.0);
    });
    let bright = material(&mut scene, |m| m.ke = LAMP * factors[0]);
    let (x, y, z) = (Vec3::X * 2.0, Vec3::Y * 2.0, Vec3::Z * 2.0);
    let corner = Vec3::new(-1.0, 0.0, -1.0);
    for (origin, u, v) in [(corner, z, x), (corner, x, y), (corner, y, z)] {
        patch(&mut scene, origin, u, v, 1, white);
    }
    patch(&mut scene, Vec3::new(-0.3, 0.2, -0.3), Vec3::Z * 0.6, Vec3::X * 0.6, 1, glossy);
    let triangles = patch(&mut scene, Vec3::new(-0.3, 1.2, -0.3), Vec3::X * 0.6, Vec3::Z * 0.6, 1, bright);
    light(&mut scene, LightKind::Point { position: Vec3::new(0.6, 1.2, 0.5), intensity: POINT * factors[1] });
    light(&mut scene, LightKind::Area { triangles });
    scene
}

fn view(scene: &Scene, width: u32, height: u32) -> View {
    let camera = Camera {
        position: Vec3::new(2.0, 0.9, 2.0),
        look_at: Vec3::new(-0.3, 0.6, -0.3),
        up: Vec3::Y,
        vertical_fov: 50.0,
    };
    scene.view(&camera, ImageSize { width, height })
}

fn all_at_once(context: &SceneContext<'_>, view: &View, settings: Settings, samples: u32) -> Vec<Vec4> {
    let mut accumulator = Accumulator::new(view);
    for _ in 0..samples {
        assert!(accumulator.pass(context, view, settings, || false).finished);
    }
    accumulator.image().mean
}

#[test]
fn after_whole_passes_it_is_the_image_that_is_sampled_at_once() {
    let scene = scene([Vec3::ONE; 2]);
    let (bvh, lights) = (Bvh::build(&scene), Lights::new(&scene));
    let context = SceneContext::new(&scene, &bvh, &lights, 3, scene.scale());
    // Parts of one pixel, of four, and of sixty-four.
    for (width, height) in [(37, 23), (259, 131), (520, 514)] {
        let view = view(&scene, width, height);
        let mut image = Progressive::new(&view);
        assert!(!image.has_begun());
        for samples in 1..3 {
            image.finish_pass(&context, DIRECT);
            assert_eq!(image.samples(), samples);
            assert!(image.picture() == all_at_once(&context, &view, DIRECT, samples), "{width}x{height}, {samples}");
        }
    }
}

#[test]
fn it_is_coarse_at_first_and_what_is_broken_off_is_left_out() {
    let scene = scene([Vec3::ONE; 2]);
    let (bvh, lights) = (Bvh::build(&scene), Lights::new(&scene));
    let context = SceneContext::new(&scene, &bvh, &lights, 3, scene.scale());
    let view = view(&scene, 520, 514);
    let mut image = Progressive::new(&view);
    let all = all_at_once(&context, &view, DIRECT, 1);
    let asked = AtomicU32::new(0);
    assert!(!image.advance(&context, DIRECT, || asked.fetch_add(1, Ordering::Relaxed) == 3));
    assert!(!image.has_begun() && image.picture().iter().all(|pixel| *pixel == Vec4::ZERO));
    assert!(image.advance(&context, DIRECT, || false));
    assert!(image.has_begun() && image.samples() == 0);
    // Each block shows its first pixel.
    let block =
        |step: u32| (0..514_u32).flat_map(move |y| (0..520_u32).map(move |x| (y / step * step, x / step * step)));
    let coarse = |step: u32| block(step).map(|(y, x)| all[(y * 520 + x) as usize]).collect::<Vec<_>>();
    assert!(image.picture() == coarse(8));
    (0..3).for_each(|_| assert!(image.advance(&context, DIRECT, || false)));
    assert!(image.picture() == coarse(4));
}

/// Four samples a pixel of a scene whose lights are in these states.
fn with_lights(scene: &Scene, view: &View, states: &[LightState]) -> Vec<Vec4> {
    let bvh = Bvh::build(scene);
    let mut lights = Lights::new(scene);
    lights.set(states);
    all_at_once(&SceneContext::new(scene, &bvh, &lights, 5, scene.scale()), view, FULL, 4)
}

#[test]
fn lights_that_count_times_something_are_lights_of_so_much_power() {
    for factors in
        [[Vec3::new(0.25, 1.0, 3.0), Vec3::new(2.0, 0.5, 0.0)], [Vec3::ZERO, Vec3::ONE], [Vec3::ONE, Vec3::ZERO]]
    {
        let (loaded, edited) = (scene([Vec3::ONE; 2]), scene(factors));
        let view = view(&loaded, 64, 48);
        // The point light is the first of the scene.
        let states = [factors[1], factors[0]].map(LightState::times);
        let (relit, expected) = (with_lights(&loaded, &view, &states), with_lights(&edited, &view, &[]));
        let lit = relit.iter().filter(|pixel| pixel.truncate().max_element() > 0.0).count();
        assert!(lit > 1000, "{factors:?}: {lit}");
        for (relit, expected) in relit.iter().zip(&expected) {
            assert!((relit - expected).abs().cmple(expected * 1e-4 + 1e-6).all(), "{factors:?}: {relit} {expected}");
        }
    }
}

#[test]
fn a_light_that_was_moved_is_one_of_that_place() {
    let loaded = scene([Vec3::ONE; 2]);
    let view = view(&loaded, 64, 48);
    let to = Vec3::new(-0.5, 0.9, 0.7);
    let mut edited = loaded.clone();
    edited.lights[0].kind = LightKind::Point { position: to, intensity: POINT };
    let states = [LightState { position: Some(to), ..LightState::default() }];
    let moved = with_lights(&loaded, &view, &states);
    assert!(moved == with_lights(&edited, &view, &[]));
    assert!(moved != with_lights(&loaded, &view, &[]));
}
