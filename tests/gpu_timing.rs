//! Times of start-up and passes, printed; run with `--ignored --nocapture` on a quiet machine.

mod support;

use glam::{Vec2, Vec3};
use penombre::pass::{FrameOptions, Renderer, UpdateMode};
use penombre::refine::update::Slot;
use penombre::scene::camera::ImageSize;
use penombre::scene::{Display, Scene};
use penombre::vk::{Device, DeviceOptions};
use std::sync::Arc;
use std::time::Instant;
use support::*;

/// A bumpy floor of `2 n²` triangles, textured.
fn terrain(n: u32) -> Scene {
    let mut scene = empty_scene();
    let texture = add_texture(&mut scene, 256, 256, |x, y| [(x ^ y) as u8, x as u8, y as u8, 255]);
    let material = add_material(&mut scene, |m| m.map_kd = Some(texture));
    let at = |x: u32, y: u32| {
        let height = noise(x * 7919 + y) * 1.5 / n as f32;
        Vec3::new(x as f32 / n as f32 * 2.0 - 1.0, y as f32 / n as f32 * 2.0 - 1.0, height)
    };
    let uv = |x: u32, y: u32| Vec2::new(x as f32, y as f32) / n as f32 * 4.0;
    for (x, y) in (0..n).flat_map(|y| (0..n).map(move |x| (x, y))) {
        let [a, b, c, d] = [(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)];
        for [p, q, r] in [[a, b, c], [a, c, d]] {
            add_triangle(&mut scene, [p, q, r].map(|(x, y)| at(x, y)), [p, q, r].map(|(x, y)| uv(x, y)), material);
        }
    }
    scene
}

#[test]
#[ignore = "a measurement"]
fn start_up_and_passes() {
    let start = Instant::now();
    let options = DeviceOptions { device: None, validation: Some(false) };
    let Ok(device) = Device::new(&options) else { return };
    let ms = |since: Instant| since.elapsed().as_secs_f64() * 1e3;
    println!("device {:.1} ms", ms(start));
    let start = Instant::now();
    let mut renderer = Renderer::new(Arc::clone(&device)).unwrap();
    println!("pipelines {:.1} ms", ms(start));
    for (n, size) in [(10, 64), (10, 500), (100, 512), (370, 512), (370, 512)] {
        let scene = terrain(n);
        let start = Instant::now();
        renderer.load(&scene).unwrap();
        println!("{} triangles, {size} x {size}: load {:.1} ms", scene.triangles.len(), ms(start));
        renderer.resize(ImageSize { width: size, height: size }).unwrap();
        renderer.set_view(&view_of(&scene, size, size), Vec2::ZERO);
        for round in 0..3 {
            let start = Instant::now();
            let visible = renderer.visibility().unwrap();
            let seen = ms(start);
            let light = |_, position| Slot { position, weight: 1.0, diffuse: Vec3::ONE, specular: Vec3::ZERO };
            renderer.apply(&base_update(&scene, faces(&visible), round > 0, light)).unwrap();
            let combine = Some(Display::default());
            let full = FrameOptions { full_luminance: true, colour: true, combine, update_mode: UpdateMode::Stencil };
            let start = Instant::now();
            let stats = renderer.frame(&full).unwrap();
            println!("  visibility call {seen:.1} ms, frame call {:.1} ms, {stats:.1?}", ms(start));
        }
    }
}
