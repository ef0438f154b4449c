//! The id image against rays cast by brute force, pixel counts, sides, cut-outs.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use crate::support::device::*;
use glam::{Vec2, Vec3};
use penombre::scene::camera::{Camera, View};
use penombre::scene::{FaceId, Scene, TriangleId};

/// The nearest face on the ray through an image point, by trying every triangle in f64.
fn cast(scene: &Scene, view: &View, point: Vec2) -> Option<FaceId> {
    let (origin, direction) = (view.eye.as_dvec3(), view.direction(point).as_dvec3());
    let mut nearest: Option<(f64, FaceId)> = None;
    for t in 0..scene.triangles.len() as u32 {
        let [a, b, c] = scene.corners(TriangleId(t)).map(Vec3::as_dvec3);
        let (e1, e2) = (b - a, c - a);
        let p = direction.cross(e2);
        let det = e1.dot(p);
        let s = origin - a;
        let u = s.dot(p) / det;
        let q = s.cross(e1);
        let v = direction.dot(q) / det;
        let distance = e2.dot(q) / det;
        let inside = u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance > f64::from(view.near);
        if inside && nearest.is_none_or(|(d, _)| distance < d) && scene.is_opaque_at(TriangleId(t), u as f32, v as f32)
        {
            nearest = Some((distance, FaceId::new(TriangleId(t), det < 0.0)));
        }
    }
    nearest.map(|(_, face)| face)
}

/// Share of pixels whose id differs from the ray's face.
fn disagreement(scene: &Scene, view: &View, jitter: Vec2, ids: &[u32]) -> f32 {
    let differs = |&(i, &id): &(usize, &u32)| {
        let (x, y) = (i as u32 % view.size.width, i as u32 / view.size.width);
        let face = cast(scene, view, Vec2::new(x as f32 + 0.5, y as f32 + 0.5) + jitter);
        face.map_or(0, |f| f.0 + 1) != id
    };
    ids.iter().enumerate().filter(differs).count() as f32 / ids.len() as f32
}

#[test]
fn ids_are_those_of_rays_through_pixel_centres() {
    with_renderer(|renderer| {
        let scene = confetti(200);
        let view = view_of(&scene, 96, 64);
        show(renderer, &scene, 96, 64);
        for jitter in [Vec2::ZERO, Vec2::new(0.4, -0.3)] {
            renderer.set_view(&view, jitter);
            let counts = renderer.visibility().unwrap();
            let ids = renderer.read_layers().unwrap().face_id;
            assert!(ids.contains(&0), "no background to compare");
            // The rasteriser snaps vertices to 1/256 pixel; rays do not: a few pixels on edges may differ.
            let share = disagreement(&scene, &view, jitter, &ids);
            assert!(share < 0.004, "{share}");
            for &(face, count) in &counts {
                assert_eq!(ids.iter().filter(|&&id| id == face.0 + 1).count() as u32, count);
            }
            assert_eq!(counts.iter().map(|c| c.1 as usize).sum::<usize>(), ids.iter().filter(|&&i| i != 0).count());
            assert!(counts.is_sorted_by_key(|c| c.0));
            let back = counts.iter().filter(|c| c.0.is_back()).count();
            assert!(back > 10 && counts.len() - back > 10, "one side is hardly seen");
        }
    });
}

#[test]
fn triangles_through_the_eye_plane_are_clipped() {
    with_renderer(|renderer| {
        let mut scene = empty_scene();
        // A floor that starts behind the eye (z = 3) and ends beyond the wall.
        add_quad(&mut scene, Vec3::new(-5.0, -1.0, 8.0), Vec3::X * 10.0, Vec3::Z * -14.0, 0, 1.0);
        add_quad(&mut scene, Vec3::new(-1.0, -1.0, -2.0), Vec3::X * 2.0, Vec3::Y * 2.0, 0, 1.0);
        let view = view_of(&scene, 64, 64);
        show(renderer, &scene, 64, 64);
        let ids = renderer.read_layers().unwrap().face_id;
        assert!(disagreement(&scene, &view, Vec2::ZERO, &ids) < 0.004);
    });
}

#[test]
fn culling_leaves_out_nothing_that_rays_find() {
    with_renderer(|renderer| {
        // Many clusters around the eye; a floor through the eye plane that is larger than the view.
        let mut scene = confetti(3000);
        let extent = scene.positions.iter().fold(Vec3::ZERO, |most, p| most.max(p.abs()));
        add_quad(&mut scene, Vec3::new(-50.0, -1.1 * extent.y, 50.0), Vec3::X * 100.0, Vec3::Z * -100.0, 0, 1.0);
        let base = view_of(&scene, 96, 64);
        show(renderer, &scene, 96, 64);
        for (position, look_at, near) in [
            (Vec3::ZERO, Vec3::new(0.3, 0.1, -1.0), 0.01),
            (Vec3::ZERO, Vec3::new(-0.2, -1.0, 0.4), 0.5),
            (extent * 0.7, Vec3::new(-4.0, 1.0, 2.0), 0.02),
            (extent * 2.0, Vec3::new(4.0, 2.0, -9.0), 0.1),
        ] {
            let camera = Camera { position, look_at, ..scene.cameras[0].camera };
            let view = View { near, ..View::new(&camera, base.size, 1.0) };
            renderer.set_view(&view, Vec2::new(0.4, -0.3));
            renderer.visibility().unwrap();
            let share = disagreement(&scene, &view, Vec2::new(0.4, -0.3), renderer.face_ids());
            assert!(share < 0.01, "{share} from {position}");
        }
    });
}

#[test]
fn masks_cut_out_what_the_rule_of_rays_cuts_out() {
    with_renderer(|renderer| {
        let mut scene = empty_scene();
        let holes = add_texture(&mut scene, 5, 7, |x, y| [255, 255, 255, ((x * 53 + y * 91) % 256) as u8]);
        let masked = add_material(&mut scene, |m| m.map_d = Some(holes.into()));
        add_quad(&mut scene, Vec3::new(-1.0, -0.8, 0.5), Vec3::new(1.9, 0.2, -0.6), Vec3::Y * 1.6, masked, 3.3);
        add_quad(&mut scene, Vec3::new(1.0, -1.0, -0.5), Vec3::X * -2.0, Vec3::Y * 2.0, masked, 1.7);
        add_quad(&mut scene, Vec3::new(-0.6, -0.9, -1.0), Vec3::X * 1.2, Vec3::Y * 1.8, 0, 1.0);
        let view = view_of(&scene, 128, 96);
        let counts = show(renderer, &scene, 128, 96);
        assert_eq!(counts.len(), 6, "all six triangles can be seen");
        let ids = renderer.read_layers().unwrap().face_id;
        let share = disagreement(&scene, &view, Vec2::ZERO, &ids);
        assert!(share < 0.01, "{share}");
    });
}

#[test]
fn an_empty_scene_is_background() {
    with_renderer(|renderer| {
        assert!(show(renderer, &empty_scene(), 33, 17).is_empty());
        renderer
            .frame(&penombre::pass::FrameOptions { full_luminance: true, colour: true, ..Default::default() })
            .unwrap();
        let layers = renderer.read_layers().unwrap();
        assert!(layers.combined.iter().all(|&c| c == [0.0; 4]));
    });
}
