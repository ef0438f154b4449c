//! The frame as a whole: a lit room, looked at and compared with the light that it was given.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use crate::support::device::*;
use glam::Vec3;
use penombre::pass::FrameOptions;
use penombre::refine::update::Slot;
use penombre::scene::{Display, Scene};

/// A room open to the camera: textured floor, coloured walls, a lamp, and a cut-out screen seen from its back.
fn room() -> Scene {
    let mut scene = empty_scene();
    let checks = add_texture(&mut scene, 64, 64, |x, y| {
        if (x / 8 + y / 8) % 2 == 0 { [230, 220, 200, 255] } else { [60, 50, 90, 255] }
    });
    let holes = add_texture(&mut scene, 32, 32, |x, y| [255, 255, 255, if (x / 4 + y / 4) % 2 == 0 { 255 } else { 0 }]);
    let floor = add_material(&mut scene, |m| m.map_kd = Some(checks.into()));
    let red = add_material(&mut scene, |m| m.kd = Vec3::new(0.7, 0.1, 0.1));
    let green = add_material(&mut scene, |m| m.kd = Vec3::new(0.1, 0.6, 0.2));
    let lamp = add_material(&mut scene, |m| m.ke = Vec3::splat(12.0));
    let screen = add_material(&mut scene, |m| m.map_d = Some(holes.into()));
    add_quad(&mut scene, Vec3::new(-1.0, -1.0, 1.0), Vec3::X * 2.0, Vec3::Z * -2.0, floor, 3.0);
    add_quad(&mut scene, Vec3::new(-1.0, 1.0, -1.0), Vec3::X * 2.0, Vec3::Z * 2.0, 0, 1.0);
    add_quad(&mut scene, Vec3::new(-1.0, -1.0, -1.0), Vec3::X * 2.0, Vec3::Y * 2.0, 0, 1.0);
    add_quad(&mut scene, Vec3::new(-1.0, -1.0, 1.0), Vec3::Z * -2.0, Vec3::Y * 2.0, red, 1.0);
    add_quad(&mut scene, Vec3::new(1.0, -1.0, -1.0), Vec3::Z * 2.0, Vec3::Y * 2.0, green, 1.0);
    add_quad(&mut scene, Vec3::new(-0.3, 0.99, -0.3), Vec3::X * 0.6, Vec3::Z * 0.6, lamp, 1.0);
    add_quad(&mut scene, Vec3::new(0.5, -1.0, 0.0), Vec3::X * -0.8, Vec3::Y * 0.8, screen, 1.0);
    scene
}

/// D of a lamp at the ceiling, without shadows.
fn lamp_light(position: Vec3) -> Slot {
    let to_lamp = Vec3::Y * 0.9 - position;
    let diffuse = Vec3::new(1.0, 0.9, 0.75) * (1.5 / (0.5 + to_lamp.length_squared()));
    Slot { position, weight: 1.0, diffuse, specular: Vec3::ZERO, light_vector: glam::Vec4::ZERO }
}

#[test]
fn a_room_is_drawn() {
    with_renderer(|renderer| {
        let scene = room();
        let visible = show(renderer, &scene, 256, 256);
        renderer.apply(&base_update(&scene, faces(&visible), false, |_, p| lamp_light(p))).unwrap();
        let combine = Some(Display::default());
        let options = FrameOptions { full_luminance: true, colour: true, combine, ..FrameOptions::default() };
        let stats = renderer.frame(&options).unwrap();
        assert_eq!(stats.triangles_drawn as usize, visible.len());
        let display = renderer.read_display().unwrap();
        if let Ok(folder) = std::env::var("PENOMBRE_TEST_PICTURES") {
            let path = std::path::Path::new(&folder).join("room.png");
            image::save_buffer(path, display.as_flattened(), 256, 256, image::ColorType::Rgba8).unwrap();
        }
        println!("{stats:?}");
        // The picture is L_e + k_d D + k_s S, pixel by pixel.
        let layers = renderer.read_layers().unwrap();
        for i in 0..layers.combined.len() {
            for c in 0..3 {
                let expected = layers.le[i][c] + layers.kd[i][c] * layers.d[i][c] + layers.ks[i][c] * layers.s[i][c];
                assert!((layers.combined[i][c] - expected).abs() <= 1e-5 * expected.max(1.0));
            }
            assert_eq!(layers.combined[i][3], if layers.face_id[i] == 0 { 0.0 } else { 1.0 });
        }
        assert!(layers.le.iter().any(|l| l[0] == 12.0), "the lamp is not seen");
    });
}
