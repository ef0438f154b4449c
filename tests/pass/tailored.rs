//! Pipelines made for a scene draw what those for any scene draw.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use crate::support::device::*;
use glam::Vec3;
use penombre::pass::{FrameOptions, Layers, Renderer, RendererOptions};
use penombre::refine::update::Slot;
use penombre::scene::camera::ImageSize;
use penombre::scene::material::{Material, MetallicRoughness, Model, NormalMap};
use penombre::scene::texture::{Encoding, Texture, TextureId};
use penombre::scene::{Display, Scene};
use penombre::vk::Device;
use std::sync::Arc;

const SIZE: ImageSize = ImageSize { width: 96, height: 80 };

/// Plain triangles, and before them a board of another material.
fn scene(material: impl FnOnce(&mut Scene) -> u32) -> Scene {
    let mut scene = confetti(40);
    let of_board = material(&mut scene);
    let (right, up) = (Vec3::new(2.0, 0.3, -0.9), Vec3::new(-0.2, 2.0, 1.4));
    add_quad(&mut scene, Vec3::new(-1.5, -1.5, -0.5), right, up, of_board, 3.0);
    scene
}

fn matte() -> Scene {
    scene(|scene| add_material(scene, |_| {}))
}

fn glossy() -> Scene {
    scene(|scene| add_material(scene, |m| m.model = Model::phong(Vec3::splat(0.4), 0.0)))
}

fn coloured() -> Scene {
    let mut scene = matte();
    let colour = |t: usize| [0.2, 0.5, 0.9].map(|c| Vec3::splat(c * (t % 7) as f32 / 7.0));
    scene.colours = (0..scene.triangles.len()).map(colour).collect();
    scene
}

fn textured() -> Scene {
    scene(|scene| {
        let pattern = add_texture(scene, 64, 32, |x, y| [(x * 4) as u8, (y * 8) as u8, (x ^ y) as u8, 255]);
        add_material(scene, |m| m.map_kd = Some(pattern.into()))
    })
}

fn lamp() -> Scene {
    scene(|scene| {
        let pattern = add_texture(scene, 16, 16, |x, y| [255, (y * 16) as u8, (x * 16) as u8, 255]);
        add_material(scene, |m| (m.ke, m.map_ke) = (Vec3::new(3.0, 2.0, 0.5), Some(pattern.into())))
    })
}

/// Metal whose roughness is textured.
fn metal() -> Scene {
    scene(|scene| {
        let pattern = add_data(scene, |x, y| [128, (y * 16) as u8, (x * 16) as u8, 255]);
        let map = Some(pattern.into());
        let model = MetallicRoughness { metallic: 0.8, roughness: 0.9, map_metallic: map, map_roughness: map };
        add_material(scene, |m| m.model = Model::MetallicRoughness(model))
    })
}

fn bumpy() -> Scene {
    scene(|scene| {
        let pattern = add_data(scene, |x, y| [118 + x as u8, 120 + y as u8, 250, 255]);
        add_material(scene, |m| m.map_normal = Some(NormalMap { map: pattern.into(), scale: 1.0 }))
    })
}

fn add_data(scene: &mut Scene, texel: impl Fn(u32, u32) -> [u8; 4]) -> TextureId {
    let texels = (0..256).map(|i| texel(i % 16, i / 16)).collect();
    scene.textures.push(Texture::encoded("data".into(), [16, 16], texels, Encoding::Linear));
    TextureId(scene.textures.len() as u32 - 1)
}

fn renderer(device: &Arc<Device>, tailored: bool) -> Renderer {
    let options = RendererOptions { tailored, ..RendererOptions::new(device).unwrap() };
    Renderer::with_options(Arc::clone(device), SIZE, options).unwrap()
}

fn draw(renderer: &mut Renderer, scene: &Scene, size: ImageSize) -> (Layers, Vec<[u8; 4]>) {
    let visible = faces(&show(renderer, scene, size.width, size.height));
    let is_glossy = scene.materials.iter().any(Material::is_glossy);
    let specular = |position: Vec3| if is_glossy { 3.0 - position } else { Vec3::ZERO };
    let light = |_, position: Vec3| Slot {
        position,
        weight: 1.0,
        diffuse: position + 2.0,
        specular: specular(position),
        light_vector: glam::Vec4::ZERO,
    };
    renderer.apply(&base_update(scene, visible, false, light)).unwrap();
    let combine = Some(Display::default());
    renderer.frame(&FrameOptions { full_luminance: true, colour: true, combine, ..FrameOptions::default() }).unwrap();
    (renderer.read_layers().unwrap(), renderer.read_display().unwrap())
}

/// One renderer after the other scene, so that each leaves out what the one before needed, and the other way round.
#[test]
fn pipelines_made_for_a_scene_draw_the_same() {
    let Some(device) = device() else { return };
    let [mut plain, mut tailored] = [false, true].map(|tailored| renderer(&device, tailored));
    let scenes = [glossy(), matte(), textured(), coloured(), lamp(), metal(), bumpy(), glossy()];
    let larger = ImageSize { width: 128, height: 64 };
    for (number, scene) in scenes.iter().enumerate() {
        for size in [SIZE, larger] {
            let [(layers, picture), (other_layers, other_picture)] =
                [&mut plain, &mut tailored].map(|renderer| draw(renderer, scene, size));
            assert!(picture == other_picture, "picture of scene {number}");
            assert!(layers == other_layers, "layers of scene {number}");
            let is_glossy = scene.materials.iter().any(Material::is_glossy);
            assert_eq!(layers.s.iter().any(|s| s[0] > 0.0), is_glossy, "highlights of scene {number}");
        }
    }
    drop([plain, tailored]);
    finish(device);
}
