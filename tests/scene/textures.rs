//! Textures as materials place them, the same on the CPU and on the GPU; masks; what is asked of image files.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use crate::support::device::*;
use glam::{Mat2, Vec2, Vec3};
use penombre::geom::Ray;
use penombre::geom::bvh::Bvh;
use penombre::pass::{FrameOptions, Layers, Renderer, UpdateMode};
use penombre::scene::footprint::Footprint;
use penombre::scene::load::{Loaded, load};
use penombre::scene::material::TextureMap;
use penombre::scene::texture::{Encoding, Texture, TextureId, Wrap};
use penombre::scene::{FaceId, Scene, TriangleId};

const COLOUR: FrameOptions =
    FrameOptions { full_luminance: true, colour: true, combine: None, update_mode: UpdateMode::Id, queries: 0 };

fn colours(renderer: &mut Renderer, scene: &Scene) -> Layers {
    show(renderer, scene, 96, 80);
    renderer.frame(&COLOUR).unwrap();
    renderer.read_layers().unwrap()
}

/// The pixels that show something: index, triangle, its barycentrics there, and the footprint.
fn seen(scene: &Scene, layers: &Layers, width: f32) -> Vec<(usize, TriangleId, [f32; 2], Footprint)> {
    let view = view_of(scene, 96, 80);
    let at = |(i, &id): (usize, &u32)| {
        let triangle = FaceId(id - 1).triangle();
        let pixel = Vec2::new((i % 96) as f32 + 0.5, (i / 96) as f32 + 0.5);
        let [a, b, c] = scene.corners(triangle).map(Vec3::as_dvec3);
        let (eye, direction, n) = (view.eye.as_dvec3(), view.direction(pixel).as_dvec3(), (b - a).cross(c - a));
        let p = eye + direction * ((a - eye).dot(n) / direction.dot(n));
        let weights = [(p - a).cross(c - a), (b - a).cross(p - a)].map(|w| (w.dot(n) / n.length_squared()) as f32);
        (i, triangle, weights, Footprint::of_pixel(scene.corners(triangle), &view, pixel, width))
    };
    layers.face_id.iter().enumerate().filter(|&(_, &id)| id != 0).map(at).collect()
}

/// Texels that all differ.
fn texel(x: u32, y: u32) -> [u8; 4] {
    let [r, g, b, a] = [0, 1, 2, 3].map(|c| (noise(4 * (y * 64 + x) + c) * 255.0) as u8);
    [r, g, b, a]
}

/// Ways to place a texture, all visible at once with coordinates from 0 to 2.
fn placings(texture: TextureId) -> [TextureMap; 4] {
    let plain = TextureMap::from(texture);
    [
        plain,
        TextureMap {
            matrix: Mat2::from_angle(0.7) * Mat2::from_diagonal(Vec2::new(0.5, 1.5)),
            offset: Vec2::new(-0.3, 0.2),
            ..plain
        },
        TextureMap {
            matrix: Mat2::from_diagonal(Vec2::splat(0.7)),
            offset: Vec2::splat(-0.2),
            wrap: [Wrap::Clamp, Wrap::Mirror],
            ..plain
        },
        TextureMap { matrix: Mat2::from_diagonal(Vec2::new(-1.0, 3.0)), wrap: [Wrap::Mirror, Wrap::Repeat], ..plain },
    ]
}

/// Four quads in the plane z = 0, in the corners of the image, each of its own material.
fn four(scene: &mut Scene, materials: [u32; 4]) {
    for (k, material) in (0..).zip(materials) {
        let origin = Vec3::new((k % 2) as f32 * 1.2 - 1.15, (k / 2) as f32 * 1.1 - 1.05, 0.0);
        add_quad(scene, origin, Vec3::X * 1.1, Vec3::Y, material, 2.0);
    }
}

#[test]
fn placed_textures_are_the_same_on_the_gpu() {
    with_renderer(|renderer| {
        let mut scene = empty_scene();
        let texture = add_texture(&mut scene, 6, 5, texel);
        let bright = |i: u32| [(i * 37 % 128) as u8 + 128, (i * 91 % 256) as u8, 40, 125 + (i % 8) as u8];
        scene.textures.push(Texture::encoded(
            "bright".into(),
            [6, 5],
            (0..30).map(bright).collect(),
            Encoding::SharedExponent,
        ));
        let lamps = placings(TextureId(1));
        let maps = placings(texture);
        let materials = [0, 1, 2, 3].map(|k| {
            add_material(&mut scene, |m| {
                (m.kd, m.ke) = (Vec3::new(0.9, 0.8, 0.7), Vec3::new(1.0, 0.5, 2.0));
                (m.map_kd, m.map_ke) = (Some(maps[k]), Some(lamps[k]));
            })
        });
        four(&mut scene, materials);
        let layers = colours(renderer, &scene);
        let pixels = seen(&scene, &layers, 1.0);
        assert!(pixels.len() > 3000, "{}", pixels.len());
        for (i, triangle, [u, v], footprint) in pixels {
            let expected = scene.kd_over(triangle, u, v, &footprint);
            let error = (Vec3::from(layers.kd[i]) - expected).abs().max_element();
            assert!(error < 3e-3, "pixel {i}: {:?}, not {expected}", layers.kd[i]);
            let expected = scene.emitted_over(FaceId::new(triangle, false), u, v, &footprint);
            let error = (Vec3::from(layers.le[i]) - expected).abs().max_element();
            assert!(error < 4e-3 * 32.0, "pixel {i}: {:?}, not {expected}", layers.le[i]);
        }
    });
}

#[test]
fn placed_masks_cut_out_the_same_for_pixels_and_rays() {
    with_renderer(|renderer| {
        let mut scene = empty_scene();
        let texture = add_texture(&mut scene, 6, 5, texel);
        let maps = placings(texture);
        let materials = [0, 1, 2, 3].map(|k| add_material(&mut scene, |m| m.map_d = Some(maps[k])));
        four(&mut scene, materials);
        let layers = colours(renderer, &scene);
        let (bvh, view) = (Bvh::build(&scene), view_of(&scene, 96, 80));
        let (mut holes, mut differ) = (0, 0);
        for (i, &id) in layers.face_id.iter().enumerate() {
            let pixel = Vec2::new((i % 96) as f32 + 0.5, (i / 96) as f32 + 0.5);
            let ray = Ray { origin: view.eye, direction: view.direction(pixel), t_max: f32::INFINITY };
            let hit = bvh.closest(&scene, &ray).is_some();
            differ += u32::from(hit != (id != 0));
            holes += u32::from(!hit);
        }
        assert!((1000..6000).contains(&holes), "{holes}");
        // Rounding, along the edges.
        assert!(differ < 15, "{differ}");
    });
}

/// A scene of one triangle, its material, and an image.
fn with_image(mtl: &str, name: &str, image: impl Into<image::DynamicImage>) -> Loaded {
    let directory = tempfile::tempdir().unwrap();
    let path = |name: &str| directory.path().join(name);
    image.into().save(path(name)).unwrap();
    let obj = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl a\nf 1/1 2/2 3/3\n";
    std::fs::write(path("a.obj"), obj).unwrap();
    std::fs::write(path("a.mtl"), format!("newmtl a\n{mtl}")).unwrap();
    load(&path("a.obj")).unwrap()
}

/// Left half of the image with one alpha, right half with another.
fn halves(left: u8, right: u8) -> image::RgbaImage {
    image::RgbaImage::from_fn(8, 8, |x, _| image::Rgba([200, 100, 50, if x < 4 { left } else { right }]))
}

#[test]
fn the_alpha_of_a_colour_map_is_its_mask_where_it_cuts() {
    let opaque = |loaded: &Loaded| [0.25, 0.75].map(|u| loaded.scene.is_opaque_at(TriangleId(0), u, 0.1));
    let cut = with_image("map_Kd a.png\n", "a.png", halves(0, 255));
    assert_eq!(opaque(&cut), [false, true]);
    // Its colour is that of the image, all over.
    let kd = cut.scene.kd_at(TriangleId(0), 0.4, 0.1);
    assert!((kd.x - 0.578).abs() < 1e-3, "{kd}");
    for (left, right) in [(255, 255), (0, 0), (130, 255), (0, 120)] {
        let loaded = with_image("map_Kd a.png\n", "a.png", halves(left, right));
        assert_eq!(loaded.scene.materials[0].map_d, None, "{left} {right}");
        assert_eq!(loaded.scene.textures.len(), 1);
    }
    // A mask of its own wins: here one that is opaque everywhere, by its luminance.
    let own = with_image("map_Kd a.png\nmap_d a.png\n", "a.png", halves(255, 255));
    assert!(own.scene.materials[0].map_d.is_some());
    assert!(own.report.faults.iter().all(|f| !f.message.contains("texture")), "{:?}", own.report);
}

#[test]
fn an_image_with_too_many_texels_is_refused_with_figures() {
    // The header of a PNG of 40,000 × 8 texels.
    let directory = tempfile::tempdir().unwrap();
    let path = |name: &str| directory.path().join(name);
    let mut png = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR".to_vec();
    png.extend_from_slice(&[0, 0, 0x9c, 0x40, 0, 0, 0, 8, 8, 6, 0, 0, 0, 0x9a, 0x6f, 0x9a, 0x4c]);
    png.extend_from_slice(b"\0\0\0\0IDAT\x35\xaf\x06\x1e");
    std::fs::write(path("wide.png"), png).unwrap();
    std::fs::write(path("a.mtl"), "newmtl a\nmap_Kd wide.png\n").unwrap();
    std::fs::write(path("a.obj"), "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n").unwrap();
    let loaded = load(&path("a.obj")).unwrap();
    let said: Vec<String> = loaded.report.faults.iter().map(ToString::to_string).collect();
    assert!(said.iter().any(|m| m.contains("40000 × 8") && m.contains("16384")), "{said:?}");
}
