//! Emission textures brighter than 1: as bright as the same light without a texture, for the engine, the path tracer and bounds.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use crate::support::by_hand::{both_sides, engine, light, material, patch, solve};
use glam::{Vec2, Vec3};
use penombre::geom::bvh::Bvh;
use penombre::light::context::SceneContext;
use penombre::light::lights::Lights;
use penombre::reference::{Accumulator, Filter, Settings, Strategy, Transport};
use penombre::scene::camera::{Camera, ImageSize};
use penombre::scene::light::LightKind;
use penombre::scene::material::{MaterialId, TextureMap};
use penombre::scene::texture::{Encoding, Texture, TextureId, Wrap};
use penombre::scene::{FaceId, Scene, TriangleId, load};
use std::f32::consts::PI;

/// Radiance of the halves of the panel.
const HALVES: [f32; 2] = [40.0, 0.5];

/// A floor, a block between it and the panel, and the panel's halves as emitters of their own.
fn plain() -> (Scene, Vec<TriangleId>) {
    let (mut scene, floor) = floor();
    for (half, radiance) in (0..).zip(HALVES) {
        let bright = material(&mut scene, |m| m.ke = Vec3::splat(radiance));
        let corner = Vec3::new(-0.5 + 0.5 * half as f32, 1.0, -0.5);
        let triangles = patch(&mut scene, corner, Vec3::X * 0.5, Vec3::Z, 1, bright);
        light(&mut scene, LightKind::Area { triangles });
    }
    (scene, floor)
}

/// The same with a panel of one texture.
fn textured() -> (Scene, Vec<TriangleId>) {
    let (mut scene, floor) = floor();
    // 40 is 160/256 · 2^6, 0.5 is 128/256 · 2^0.
    let texel = |x: usize| if x < 64 { [160, 160, 160, 134] } else { [128, 128, 128, 128] };
    let texels = (0..128).map(texel).collect();
    scene.textures.push(Texture::encoded("halves".into(), [128, 1], texels, Encoding::SharedExponent));
    let map = TextureMap { wrap: [Wrap::Clamp; 2], offset: Vec2::new(0.5, 0.0), ..TextureId(0).into() };
    let bright = material(&mut scene, |m| (m.ke, m.map_ke) = (Vec3::ONE, Some(map)));
    let triangles = patch(&mut scene, Vec3::new(-0.5, 1.0, -0.5), Vec3::X, Vec3::Z, 1, bright);
    for t in &triangles {
        scene.uvs[t.0 as usize] = scene.corners(*t).map(|p| Vec2::new(p.x, p.z));
    }
    light(&mut scene, LightKind::Area { triangles });
    (scene, floor)
}

fn floor() -> (Scene, Vec<TriangleId>) {
    let mut scene = Scene::default();
    let grey = material(&mut scene, |_| {});
    let floor = patch(&mut scene, Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0, 6, grey);
    patch(&mut scene, Vec3::new(-0.1, 0.6, -0.7), Vec3::Z * 0.4, Vec3::X * 0.5, 1, MaterialId(0));
    (scene, floor)
}

/// Mean radiance of the floor seen from above beside the panel, by path tracing, with its standard error.
fn traced(scene: &Scene) -> (f32, f32) {
    let (bvh, lights) = (Bvh::build(scene), Lights::new(scene));
    let context = SceneContext::new(scene, &bvh, &lights, 5, scene.scale());
    let camera = Camera { position: Vec3::new(1.4, 0.8, 0.0), look_at: Vec3::ZERO, up: Vec3::Y, vertical_fov: 30.0 };
    let view = scene.view(&camera, ImageSize { width: 16, height: 16 });
    let settings = Settings { filter: Filter::Box, transport: Transport::Full, strategy: Strategy::Both };
    let mut accumulator = Accumulator::new(&view);
    for _ in 0..256 {
        assert!(accumulator.pass(&context, &view, settings, || false).finished);
    }
    let image = accumulator.image();
    let n = image.mean.len() as f32;
    (
        image.mean.iter().map(|m| m.x).sum::<f32>() / n,
        (image.variance.iter().map(|v| v.x).sum::<f32>() / (n * n)).sqrt(),
    )
}

#[test]
fn an_uneven_panel_lights_as_its_parts_do() {
    let [parts, whole] = [plain(), textured()].map(|(scene, floor)| {
        let mirror = solve(&mut engine(scene, 1, 3), &both_sides(&floor), Vec3::Y);
        let lit = floor.iter().flat_map(|&t| mirror.face(FaceId::new(t, false)));
        lit.map(|slot| slot.diffuse.x).collect::<Vec<f32>>()
    });
    let brightest = parts.iter().copied().fold(0.0, f32::max);
    assert!(brightest > 3.0, "{brightest}");
    for (i, (&a, &b)) in parts.iter().zip(&whole).enumerate() {
        assert!((a - b).abs() < 0.01 * a + 0.004 * brightest, "{i}: {b}, its parts {a}");
    }
}

#[test]
fn an_uneven_panel_is_traced_as_its_parts_are() {
    let [(a, ea), (b, eb)] = [plain(), textured()].map(|(scene, _)| traced(&scene));
    assert!(ea < 0.01 * a && eb < 0.01 * b, "too noisy to test: {a} ± {ea}, {b} ± {eb}");
    assert!((a - b).abs() < 4.0 * ea.hypot(eb) + 2e-3 * a, "{b} ± {eb}, its parts {a} ± {ea}");
}

#[test]
fn bounds_and_power_count_the_brightest_texels() {
    let [parts, whole] = [plain(), textured()].map(|(scene, _)| Lights::new(&scene));
    let power = parts.lighting().power.x;
    assert!((power / (PI * 0.5 * (HALVES[0] + HALVES[1])) - 1.0).abs() < 1e-4);
    assert!((whole.lighting().power.x / power - 1.0).abs() < 5e-3, "{}, its parts {power}", whole.lighting().power);
    for x in [Vec3::ZERO, Vec3::new(-0.3, 0.9, 0.1), Vec3::new(0.4, 0.99, 0.2), Vec3::new(-3.0, 0.2, 0.0)] {
        // Under the bright half all that arrives is its light.
        let arriving: f32 = parts.sources.iter().map(|s| exact(s, x)).sum();
        let bound = whole.sources[0].bound(x, Vec3::Y);
        assert!(bound >= arriving, "{x}: {bound}, {arriving} arrives");
    }
}

fn exact(source: &penombre::light::source::Source, x: Vec3) -> f32 {
    match source {
        penombre::light::source::Source::Area(area) => area.closed_form(x).unwrap().irradiance(Vec3::Y).x,
        other => panic!("{other:?}"),
    }
}

/// Writes a scene of one lamp whose image has every texel `value`, and loads it.
fn lamp_of(file: &str, statements: &str, value: f32) -> Scene {
    let directory = tempfile::tempdir().unwrap();
    let path = |name: &str| directory.path().join(name);
    let image = image::Rgb32FImage::from_pixel(8, 4, image::Rgb([value, value * 0.5, 0.0]));
    image::DynamicImage::from(image).save(path(file)).unwrap();
    let obj = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl lamp\nf 1/1 2/2 3/3\n";
    std::fs::write(path("a.obj"), obj).unwrap();
    std::fs::write(path("a.mtl"), format!("newmtl lamp\n{statements} {file}\n")).unwrap();
    let loaded = load::load(&path("a.obj")).unwrap();
    let faults: Vec<_> = loaded.report.faults.iter().filter(|f| f.message.starts_with("texture")).collect();
    assert!(faults.is_empty(), "{faults:?}");
    loaded.scene
}

#[test]
fn images_of_floats_keep_their_range_as_emission() {
    for file in ["panel.hdr", "panel.exr"] {
        for value in [20.0, 3e-3, 7e4] {
            let scene = lamp_of(file, "Ke 2\nmap_Ke", value);
            let (expected, found) = (Vec3::new(2.0, 1.0, 0.0) * value, scene.emitted_at(FaceId(0), 0.3, 0.3));
            assert!((found - expected).abs().max_element() < 0.01 * expected.x, "{file}: {found}, not {expected}");
            let mean = Lights::new(&scene).lighting().power / (PI * 0.5);
            assert!((mean - expected).abs().max_element() < 0.01 * expected.x, "{file}: {mean}, not {expected}");
        }
    }
}

#[test]
fn a_reflectance_stays_below_one() {
    let scene = lamp_of("paint.hdr", "Kd 0.5\nmap_Kd", 20.0);
    assert_eq!(scene.kd_at(TriangleId(0), 0.3, 0.3), Vec3::new(0.5, 0.5, 0.0));
}
