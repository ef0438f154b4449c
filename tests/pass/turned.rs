//! Normal maps turn light: the luminance pass against the formulas of docs/method/reflection.md.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use crate::support::device::*;
use glam::{Vec2, Vec3};
use penombre::pass::{FrameOptions, UpdateMode};
use penombre::refine::update::Slot;
use penombre::scene::footprint::Footprint;
use penombre::scene::material::NormalMap;
use penombre::scene::texture::{Encoding, Texture, TextureId};
use penombre::scene::{FaceId, Scene};

const FRAME: FrameOptions =
    FrameOptions { full_luminance: true, colour: true, combine: None, update_mode: UpdateMode::Id, queries: 0 };
const WIDTH: u32 = 96;

/// Boards at all angles with a normal map of one texel, and one board without.
fn scene() -> Scene {
    let mut scene = empty_scene();
    let texel = [190, 90, 220, 255];
    scene.textures.push(Texture::encoded("lean".into(), [1, 1], vec![texel], Encoding::Linear));
    let map = Some(NormalMap { map: TextureId(scene.textures.len() as u32 - 1).into(), scale: 0.8 });
    let bumpy = add_material(&mut scene, |m| m.map_normal = map);
    let plain = add_material(&mut scene, |_| {});
    for (i, material) in [bumpy, bumpy, bumpy, plain].into_iter().enumerate() {
        let at = Vec3::new(-1.2 + 0.6 * i as f32, -0.5, 0.0);
        let (right, up) = (Vec3::new(0.5, 0.1, 0.2 * i as f32), Vec3::new(0.1, 0.9, -0.3));
        add_quad(&mut scene, at, right, up, material, 2.0);
    }
    scene
}

#[test]
fn diffuse_luminance_follows_the_mapped_normal() {
    with_renderer(|renderer| {
        let scene = scene();
        let visible = show(renderer, &scene, WIDTH, 64);
        let towards = Vec3::new(0.3, 0.7, 0.9).normalize();
        let light = |face: FaceId, position: Vec3| {
            let normal = scene.shading_normal_at(face.triangle(), 0.3, 0.3, face.is_back());
            let vector = towards / normal.dot(towards).max(0.3);
            let diffuse = Vec3::new(2.0, 1.0, 0.5);
            Slot { position, weight: 1.0, diffuse, specular: Vec3::ONE, light_vector: vector.extend(1.0) }
        };
        renderer.apply(&base_update(&scene, faces(&visible), false, light)).unwrap();
        renderer.frame(&FRAME).unwrap();
        let layers = renderer.read_layers().unwrap();
        let (mut turned, mut unturned) = (0, 0);
        for (pixel, &id) in layers.face_id.iter().enumerate().filter(|(_, id)| **id != 0) {
            let face = FaceId(id - 1);
            let normal = scene.shading_normal_at(face.triangle(), 0.3, 0.3, face.is_back());
            let mapped = scene.mapped_normal(
                face.triangle(),
                [0.3, 0.3],
                &Footprint { d_dx: Vec2::ZERO, d_dy: Vec2::ZERO },
                (normal, face.is_back()),
            );
            let vector = towards / normal.dot(towards).max(0.3);
            let gain = (1.0 + vector.dot(mapped - normal)).max(0.0);
            let expected = Vec3::new(2.0, 1.0, 0.5) * gain;
            let found = Vec3::from(layers.d[pixel]);
            assert!(
                (found - expected).abs().max_element() < 4e-3 * expected.max_element() + 1e-3,
                "{face:?}: {found} {expected}"
            );
            assert_eq!(layers.s[pixel], [1.0; 3], "no highlight of microfacets to turn");
            if mapped == normal { unturned += 1 } else { turned += 1 }
        }
        assert!(turned > 300 && unturned > 100, "{turned} {unturned}");
    });
}
