//! Shaders that read the scene and the light as texels draw what those that read by device address draw.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use crate::support::device::*;
use glam::Vec3;
use penombre::pass::{FrameOptions, Layers, Renderer, RendererOptions, UpdateMode};
use penombre::refine::update::Slot;
use penombre::scene::Scene;
use penombre::scene::camera::ImageSize;
use penombre::scene::material::Model;
use penombre::vk::Device;
use std::sync::Arc;

const SIZE: ImageSize = ImageSize { width: 96, height: 80 };

/// A textured lamp with several mip levels, highlights, a cut-out before it, and plain triangles.
fn scene() -> Scene {
    let mut scene = confetti(40);
    let pattern = add_texture(&mut scene, 64, 32, |x, y| [(x * 4) as u8, (y * 8) as u8, (x ^ y) as u8, 255]);
    let holes = add_texture(&mut scene, 4, 4, |x, y| [255, 255, 255, if (x + y) % 2 == 0 { 255 } else { 0 }]);
    let lamp = add_material(&mut scene, |m| {
        (m.ke, m.model) = (Vec3::new(3.0, 2.0, 0.5), Model::phong(Vec3::splat(0.1), 0.0));
        (m.map_kd, m.map_ke) = (Some(pattern.into()), Some(pattern.into()));
    });
    let masked = add_material(&mut scene, |m| m.map_d = Some(holes.into()));
    add_quad(&mut scene, Vec3::new(-1.5, -1.5, -1.5), Vec3::new(3.0, 0.3, -0.9), Vec3::new(-0.2, 3.0, 1.4), lamp, 3.0);
    add_quad(&mut scene, Vec3::new(-1.0, -1.0, 1.2), Vec3::new(2.0, 0.0, -0.7), Vec3::Y * 2.0, masked, 2.0);
    scene
}

fn draw(device: &Arc<Device>, mode: UpdateMode, texel_buffers: bool) -> Layers {
    let options = RendererOptions { modes: vec![mode], texel_buffers, ..RendererOptions::new(device).unwrap() };
    let mut renderer = Renderer::with_options(Arc::clone(device), SIZE, options).unwrap();
    let scene = scene();
    let visible = faces(&show(&mut renderer, &scene, SIZE.width, SIZE.height));
    let light = |_, position: Vec3| Slot {
        position,
        weight: 1.0,
        diffuse: position + 2.0,
        specular: 3.0 - position,
        light_vector: glam::Vec4::ZERO,
    };
    renderer.apply(&base_update(&scene, visible, false, light)).unwrap();
    let full = FrameOptions { full_luminance: true, colour: true, update_mode: mode, ..FrameOptions::default() };
    renderer.frame(&full).unwrap();
    renderer.read_layers().unwrap()
}

/// Whether values that 16-bit floats hold are next to each other at most: the curve of sRGB and the table of it round apart.
fn is_next_half(a: f32, b: f32) -> bool {
    (a - b).abs() <= a.abs().max(b.abs()) / 1024.0
}

#[test]
fn texels_and_addresses_draw_the_same() {
    let Some(device) = device() else { return };
    for mode in [UpdateMode::Id, UpdateMode::Lookup] {
        let [by_address, by_texel] = [false, true].map(|texel_buffers| draw(&device, mode, texel_buffers));
        assert!(by_address.le.iter().any(|le| le[0] > 0.0) && by_address.s.iter().any(|s| s[0] > 0.0));
        assert!(by_address.d == by_texel.d && by_address.s == by_texel.s, "{}", mode.name());
        assert_eq!(by_address.drawn_id, by_texel.drawn_id);
        assert_eq!(by_address.ks, by_texel.ks);
        for (computed, looked_up) in [(&by_address.kd, &by_texel.kd), (&by_address.le, &by_texel.le)] {
            assert!(computed.iter().zip(looked_up).all(|(a, b)| (0..3).all(|c| is_next_half(a[c], b[c]))));
        }
    }
    finish(device);
}
