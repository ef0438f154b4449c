//! The colour pass against the scene's own look-ups.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use crate::support::device::*;
use glam::{Vec2, Vec3};
use penombre::pass::{FrameOptions, Layers, Renderer};
use penombre::scene::camera::View;
use penombre::scene::footprint::Footprint;
use penombre::scene::material::Model;
use penombre::scene::{EmissionSide, FaceId, Scene, TriangleId};

const COLOUR: FrameOptions = FrameOptions {
    full_luminance: true,
    colour: true,
    combine: None,
    update_mode: penombre::pass::UpdateMode::Stencil,
    queries: 0,
};

fn colours(renderer: &mut Renderer, scene: &Scene, width: u32, height: u32) -> Layers {
    show(renderer, scene, width, height);
    renderer.frame(&COLOUR).unwrap();
    renderer.read_layers().unwrap()
}

/// Barycentrics of the point of a triangle's plane seen at an image point.
fn barycentrics(scene: &Scene, view: &View, triangle: TriangleId, point: Vec2) -> (f32, f32) {
    let [a, b, c] = scene.corners(triangle).map(Vec3::as_dvec3);
    let direction = view.direction(point).as_dvec3();
    let (e1, e2, s) = (b - a, c - a, view.eye.as_dvec3() - a);
    let p = direction.cross(e2);
    let det = e1.dot(p);
    ((s.dot(p) / det) as f32, (direction.dot(s.cross(e1)) / det) as f32)
}

fn centre(pixel: usize, width: u32) -> Vec2 {
    Vec2::new((pixel as u32 % width) as f32 + 0.5, (pixel as u32 / width) as f32 + 0.5)
}

#[test]
fn magnified_textures_are_the_scenes_own_look_up() {
    with_renderer(|renderer| {
        let mut scene = empty_scene();
        let texel = |x: u32, y: u32| [(x * 41 % 256) as u8, (y * 57 % 256) as u8, ((x + y) * 23 % 256) as u8, 255];
        let texture = add_texture(&mut scene, 6, 5, texel);
        let textured = add_material(&mut scene, |m| {
            m.kd = Vec3::new(0.9, 0.8, 0.7);
            m.model = Model::phong(Vec3::new(0.1, 0.05, 0.2), 0.0);
            m.map_kd = Some(texture.into());
        });
        // Coordinates from −1.3 on: repetition on both sides of zero.
        add_quad(&mut scene, Vec3::new(-1.0, -0.8, 0.2), Vec3::new(2.0, 0.3, -0.5), Vec3::Y * 1.6, textured, 2.0);
        scene.uvs.iter_mut().flatten().for_each(|uv| *uv -= 1.3);
        let view = view_of(&scene, 96, 80);
        let layers = colours(renderer, &scene, 96, 80);
        let mut seen = 0;
        for (i, &id) in layers.face_id.iter().enumerate().filter(|&(_, &id)| id != 0) {
            let triangle = FaceId(id - 1).triangle();
            let (u, v) = barycentrics(&scene, &view, triangle, centre(i, 96));
            let expected = scene.kd_at(triangle, u, v);
            let error = (Vec3::from(layers.kd[i]) - expected).abs().max_element();
            assert!(error < 1.5e-3, "pixel {i}: {:?}, not {expected}", layers.kd[i]);
            let ks = Vec3::from(layers.ks[i]);
            assert!((ks - Vec3::new(0.1, 0.05, 0.2)).abs().max_element() < 1e-4);
            seen += 1;
        }
        assert!(seen > 1000);
    });
}

#[test]
fn tilted_planes_are_filtered_as_on_the_cpu() {
    with_renderer(|renderer| {
        let mut scene = empty_scene();
        // Every level differs, and a step between neighbouring texels is large.
        let texel = |x: u32, y: u32| [0, 1, 2].map(|c| (noise(3 * (y * 256 + x) + c) * 255.0) as u8);
        let texture = add_texture(&mut scene, 256, 128, |x, y| {
            let [r, g, b] = texel(x / 4, y / 8);
            [r, g, b, 255]
        });
        let textured = add_material(&mut scene, |m| {
            m.kd = Vec3::new(0.9, 0.8, 0.7);
            m.ke = Vec3::new(1.0, 2.0, 3.0);
            (m.map_kd, m.map_ke) = (Some(texture.into()), Some(texture.into()));
        });
        // From magnified at the lower edge to far minified near the horizon.
        add_quad(&mut scene, Vec3::new(-3.0, -0.4, 2.9), Vec3::X * 6.0, Vec3::new(0.5, 0.3, -30.0), textured, 9.0);
        for width in [1.0, 0.25] {
            renderer.set_filter_width(width);
            let view = view_of(&scene, 160, 120);
            let layers = colours(renderer, &scene, 160, 120);
            let (mut seen, mut off) = (0, 0);
            for (i, &id) in layers.face_id.iter().enumerate().filter(|&(_, &id)| id != 0) {
                let face = FaceId(id - 1);
                let point = centre(i, 160);
                let (u, v) = barycentrics(&scene, &view, face.triangle(), point);
                let footprint = Footprint::of_pixel(scene.corners(face.triangle()), &view, point, width);
                let kd = scene.kd_over(face.triangle(), u, v, &footprint);
                let emitted = scene.emitted_over(face, u, v, &footprint);
                let is_off = |value: [f32; 3], expected: Vec3| {
                    // A half's step is at most 2⁻¹⁰ of its value (drivers may truncate); the rest is for f32 coordinates.
                    (Vec3::from(value) - expected).abs().cmpgt(expected * 2f32.powi(-10) + 1e-4).any()
                };
                seen += 1;
                off += i32::from(is_off(layers.kd[i], kd) || is_off(layers.le[i], emitted));
            }
            assert!(seen > 5000, "{seen}");
            // Where two mip levels or texels meet, rounding decides: 10 of 8,961 pixels on an NVIDIA H200.
            assert!(off * 500 <= seen, "{off} of {seen} pixels differ at width {width}");
        }
    });
}

#[test]
fn minified_textures_tend_to_their_mean_in_linear_light() {
    with_renderer(|renderer| {
        let mut scene = empty_scene();
        let checks = add_texture(&mut scene, 64, 64, |x, y| [if (x + y) % 2 == 0 { 255 } else { 0 }; 4]);
        let textured = add_material(&mut scene, |m| {
            m.kd = Vec3::ONE;
            m.map_kd = Some(checks.into());
        });
        add_quad(&mut scene, Vec3::new(-1.0, -1.0, 0.0), Vec3::X * 2.0, Vec3::Y * 2.0, textured, 20.0);
        let layers = colours(renderer, &scene, 64, 64);
        for (i, _) in layers.face_id.iter().enumerate().filter(|&(_, &id)| id != 0) {
            // Code 188 stands for 0.503.
            assert!((layers.kd[i][0] - 0.503).abs() < 3e-3, "{:?}", layers.kd[i]);
        }
    });
}

#[test]
fn light_is_emitted_on_the_side_that_the_scene_says() {
    with_renderer(|renderer| {
        for (side, back_emits) in [(EmissionSide::Front, false), (EmissionSide::Both, true)] {
            let mut scene = empty_scene();
            scene.emission_side = side;
            let texture = add_texture(&mut scene, 1, 1, |_, _| [188, 188, 188, 255]);
            // Far beyond half range: stored by scale.
            let lamp = add_material(&mut scene, |m| m.ke = Vec3::new(3e5, 1e5, 10.0));
            let screen = add_material(&mut scene, |m| {
                m.ke = Vec3::splat(2.0);
                m.map_ke = Some(texture.into());
            });
            add_quad(&mut scene, Vec3::new(-1.0, -1.0, 0.0), Vec3::X, Vec3::Y * 2.0, lamp, 1.0);
            add_quad(&mut scene, Vec3::new(1.0, -1.0, 0.0), Vec3::X * -0.9, Vec3::Y * 2.0, screen, 1.0);
            let layers = colours(renderer, &scene, 48, 48);
            let mut sides = [0, 0];
            for (i, &id) in layers.face_id.iter().enumerate().filter(|&(_, &id)| id != 0) {
                let face = FaceId(id - 1);
                let expected = scene.emitted_at(face, 0.3, 0.3);
                assert_eq!(expected == Vec3::ZERO, face.is_back() && !back_emits);
                let error = (Vec3::from(layers.le[i]) - expected).abs();
                assert!(error.cmple(expected * 1e-3 + 1e-3).all(), "{:?}, not {expected}", layers.le[i]);
                sides[usize::from(face.is_back())] += 1;
            }
            assert!(sides[0] > 100 && sides[1] > 100, "{sides:?}");
        }
    });
}
