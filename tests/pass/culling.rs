//! What the host leaves out of the visibility pass cannot be seen: images with and without culling are the same.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use crate::support::device::*;
use glam::{Vec2, Vec3};
use penombre::pass::{Renderer, RendererOptions};
use penombre::scene::Scene;
use penombre::scene::camera::{Camera, ImageSize, View};
use penombre::vk::Device;
use std::sync::Arc;

const SIZE: ImageSize = ImageSize { width: 160, height: 112 };

fn renderer(device: &Arc<Device>, scene: &Scene, culls_on_host: bool) -> Renderer {
    let options = RendererOptions { culls_on_host, ..RendererOptions::new(device).unwrap() };
    let mut renderer = Renderer::with_options(Arc::clone(device), SIZE, options).unwrap();
    renderer.load(scene).unwrap();
    renderer.resize(SIZE).unwrap();
    renderer
}

fn look(scene: &Scene, position: Vec3, look_at: Vec3) -> View {
    scene.view(&Camera { position, look_at, up: Vec3::Y, vertical_fov: 60.0 }, SIZE)
}

/// Adds a wall of 2 n² triangles, of which pixels see one or many.
fn add_grid(scene: &mut Scene, origin: Vec3, a: Vec3, b: Vec3, n: u32, material: u32) {
    let (a, b) = (a / n as f32, b / n as f32);
    for (i, j) in (0..n).flat_map(|j| (0..n).map(move |i| (i, j))) {
        add_quad(scene, origin + a * i as f32 + b * j as f32, a, b, material, 1.0);
    }
}

/// A hall from z = 0 to −12: columns of fine triangles, a wall across it at −8, leaves before and behind it, and nets with holes.
fn hall() -> Scene {
    let mut scene = empty_scene();
    let (x, y, z) = (Vec3::X, Vec3::Y, Vec3::NEG_Z);
    add_quad(&mut scene, Vec3::new(-3.0, -1.0, 0.5), z * 13.0, x * 6.0, 0, 1.0);
    add_grid(&mut scene, Vec3::new(-3.0, 2.0, 0.5), x * 6.0, z * 13.0, 24, 0);
    add_grid(&mut scene, Vec3::new(-3.0, -1.0, 0.5), y * 3.0, z * 13.0, 30, 0);
    add_quad(&mut scene, Vec3::new(3.0, -1.0, 0.5), z * 13.0, y * 3.0, 0, 1.0);
    add_grid(&mut scene, Vec3::new(-3.0, -1.0, -8.0), x * 5.0, y * 3.0, 3, 0);
    for k in 0..6 {
        let foot = Vec3::new(if k % 2 == 0 { -1.4 } else { 1.1 }, -1.0, -1.5 - 1.7 * k as f32);
        add_grid(&mut scene, foot, x * 0.4, y * 3.0, 20, 0);
        add_grid(&mut scene, foot, z * 0.4, y * 3.0, 20, 0);
    }
    let holes = add_texture(&mut scene, 8, 8, |x, y| [255, 255, 255, if (x + y) % 3 == 0 { 0 } else { 255 }]);
    let net = add_material(&mut scene, |m| m.map_d = Some(holes.into()));
    add_grid(&mut scene, Vec3::new(-0.5, -1.0, -3.0), x, y * 1.5, 8, net);
    let at = |i: u32| Vec3::new(noise(3 * i), noise(3 * i + 1), noise(3 * i + 2));
    for i in 0..4000 {
        let centre = (at(4 * i) - Vec3::new(0.5, 0.5, 1.0)) * Vec3::new(5.6, 2.6, 12.0) + Vec3::Y * 0.5;
        let corners = [1, 2, 3].map(|k| centre + (at(4 * i + k) - 0.5) * 0.12);
        add_triangle(&mut scene, corners, [Vec2::ZERO; 3], 0);
    }
    scene
}

/// Steps down the hall, two jumps, a look along the wall and one from within leaves.
fn walk(scene: &Scene) -> Vec<(View, Vec2)> {
    let steps = (0..5).map(|k| (Vec3::new(0.2 * k as f32 - 0.5, 0.2, -0.9 * k as f32), Vec3::new(0.1, 0.0, -12.0)));
    let jumps = [
        (Vec3::new(1.0, 0.0, -11.5), Vec3::new(-1.0, 0.0, 0.0)),
        (Vec3::new(0.0, 0.3, -0.2), Vec3::new(0.4, 0.1, -9.0)),
        (Vec3::new(-2.9, 0.0, -0.5), Vec3::new(-2.9, 0.1, -9.0)),
        (Vec3::new(0.3, 0.0, -5.0), Vec3::new(2.0, 0.5, -6.0)),
    ];
    let views = steps.chain(jumps).map(|(eye, at)| look(scene, eye, at));
    let jitter = (0u32..).map(|k| Vec2::new(noise(2 * k) - 0.5, noise(2 * k + 1) - 0.5));
    views.zip(jitter).collect()
}

/// Draws a scene's views in turn with and without culling, and returns the triangles that each drew, summed over the views.
fn compare(device: &Arc<Device>, scene: &Scene, views: &[(View, Vec2)]) -> [u32; 2] {
    let [mut culled, mut whole] = [true, false].map(|culls| renderer(device, scene, culls));
    let mut drawn = [0, 0];
    for (number, (view, jitter)) in views.iter().enumerate() {
        for (renderer, drawn) in [&mut culled, &mut whole].into_iter().zip(&mut drawn) {
            renderer.set_view(view, *jitter);
            renderer.visibility().unwrap();
            *drawn += renderer.visibility_triangles();
        }
        assert!(whole.face_ids().iter().any(|&id| id != 0), "view {number} shows nothing");
        let differ = culled.face_ids().iter().zip(whole.face_ids()).filter(|(a, b)| a != b).count();
        assert_eq!(differ, 0, "pixels of view {number}");
    }
    drawn
}

#[test]
fn culled_and_whole_draws_show_the_same_faces_along_a_walk() {
    let Some(device) = device() else { return };
    let scene = hall();
    let [culled, whole] = compare(&device, &scene, &walk(&scene));
    if device.report().is_cpu() {
        assert!(culled < whole * 2 / 5, "{culled} of {whole} triangles drawn");
    }
    finish(device);
}

#[test]
fn of_faces_at_one_depth_the_same_are_seen_whichever_are_drawn_first() {
    let Some(device) = device() else { return };
    let mut scene = empty_scene();
    // Twice the same triangles to the bit, and then some of them again: as occluders they are drawn before the others.
    for n in [5, 5, 2] {
        add_grid(&mut scene, Vec3::new(-2.0, -2.0, -4.0), Vec3::X * 4.0, Vec3::new(0.3, 4.0, -1.0), n, 0);
    }
    let views: Vec<_> = [0.0, 0.1, 0.9, -1.3]
        .map(|x| (look(&scene, Vec3::new(x, 0.0, 0.0), Vec3::new(0.2 - x, 0.1, -4.0)), Vec2::ZERO))
        .to_vec();
    compare(&device, &scene, &views);
    finish(device);
}

#[test]
fn a_wall_hides_nearly_all() {
    let Some(device) = device() else { return };
    let mut scene = terrain(64);
    add_quad(&mut scene, Vec3::new(-9.0, -9.0, 1.8), Vec3::X * 18.0, Vec3::Y * 18.0, 0, 1.0);
    let views: Vec<_> = [2.6, 2.5, 2.4].map(|z| (look(&scene, Vec3::Z * z, Vec3::ZERO), Vec2::ZERO)).to_vec();
    compare(&device, &scene, &views);
    let mut culled = renderer(&device, &scene, true);
    for (view, jitter) in views {
        culled.set_view(&view, jitter);
        culled.visibility().unwrap();
    }
    if device.report().is_cpu() {
        assert!(culled.visibility_triangles() < 64, "{}", culled.visibility_triangles());
    }
    drop(culled);
    finish(device);
}
