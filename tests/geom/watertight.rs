//! No ray slips out of a closed mesh between two triangles, however exactly it is aimed at what they share.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use crate::support::by_hand::{material, patch};
use crate::support::shapes::icosphere;
use glam::{Quat, Vec3};
use penombre::geom::Ray;
use penombre::geom::bvh::Bvh;
use penombre::math::sequence::Sequence;
use penombre::scene::Scene;
use penombre::scene::material::MaterialId;

/// The cube from −1 to 1 facing outwards, each side in n × n squares of two triangles.
fn cube(scene: &mut Scene, n: u32, grey: MaterialId) {
    let (x, y, z) = (Vec3::X, Vec3::Y, Vec3::Z);
    for (axis, u, v) in [(x, y, z), (y, z, x), (z, x, y)] {
        patch(scene, axis - u - v, u * 2.0, v * 2.0, n, grey);
        patch(scene, -axis - u - v, v * 2.0, u * 2.0, n, grey);
    }
}

/// Closed meshes around the origin, all corners shared.
fn meshes() -> Vec<(String, Scene)> {
    let turns = [Quat::IDENTITY, Quat::from_euler(glam::EulerRot::XYZ, 0.3, 1.1, -0.7)];
    let places =
        [(1.0, Vec3::ZERO), (1.0, Vec3::new(130.0, -70.0, 900.0)), (1e-3, Vec3::ZERO), (400.0, Vec3::splat(90.0))];
    let mut all = Vec::new();
    for (kind, n) in [("cube", 1), ("cube", 7), ("sphere", 2), ("sphere", 3)] {
        for turn in turns {
            for (scale, place) in places {
                let mut scene = Scene::default();
                let grey = material(&mut scene, |_| {});
                if kind == "cube" {
                    cube(&mut scene, n, grey)
                } else {
                    drop(icosphere(&mut scene, Vec3::ZERO, 1.0, n, false, grey))
                }
                scene.positions.iter_mut().for_each(|p| *p = turn * *p * scale + place);
                all.push((format!("{kind} {n}, turn {turn}, scale {scale} at {place}"), scene));
            }
        }
    }
    all
}

/// A ray from near the centre to a point of an edge of a random triangle; every third is aimed at a corner.
fn aimed(scene: &Scene, sequence: &Sequence, index: u32) -> Ray {
    let [u, v, w, pick] = sequence.point(index);
    let [along, ..] = sequence.point_of_set(index, 1);
    let corners = scene.corners(penombre::scene::TriangleId((pick * scene.triangles.len() as f32) as u32));
    let [a, b] = [corners[index as usize % 3], corners[(index as usize + 1) % 3]];
    let centre = scene.positions.iter().copied().sum::<Vec3>() / scene.positions.len() as f32;
    let origin = centre + (Vec3::new(u, v, w) - 0.5) * (scene.diagonal() * 0.2);
    let target = if index.is_multiple_of(3) { a } else { a + (b - a) * along };
    Ray { origin, direction: (target - origin).normalize(), t_max: f32::INFINITY }
}

#[test]
fn rays_at_edges_and_corners_hit_from_behind() {
    for (name, scene) in meshes() {
        let bvh = Bvh::build(&scene);
        let sequence = Sequence::new(1);
        for index in 0..20_000 {
            let ray = aimed(&scene, &sequence, index);
            let hit = bvh.closest(&scene, &ray).unwrap_or_else(|| panic!("{name}: {ray:?} slips out"));
            assert!(hit.back, "{name}: {ray:?} meets a front at {hit:?}");
            assert!(bvh.occluded(&scene, &ray), "{name}: {ray:?} is not occluded");
        }
    }
}
