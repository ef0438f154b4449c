//! Whose triangles a mesh has, and how they meet.

use crate::support::by_hand::{light, material, triangle};
use crate::support::shapes::{icosphere, room};
use crate::{bake, direct, vertices};
use glam::Vec3;
use penombre::bake::baker::{Plan, Sides, Triangles};
use penombre::bake::lit_mesh::LitMesh;
use penombre::scene::Scene;
use penombre::scene::light::LightKind;
use std::collections::HashMap;

type Bits = [u32; 3];

fn bits(position: Vec3) -> Bits {
    (position + 0.0).to_array().map(f32::to_bits)
}

/// How often each edge, by the bits of its ends, is gone along in its direction.
fn edges(mesh: &LitMesh) -> HashMap<[Bits; 2], usize> {
    let mut edges = HashMap::new();
    for part in &mesh.parts {
        for triangle in &part.triangles {
            let corners = triangle.map(|corner| bits(part.vertices[corner as usize].position));
            (0..3).for_each(|i| *edges.entry([corners[i], corners[(i + 1) % 3]]).or_default() += 1);
        }
    }
    edges
}

/// A closed room with a ball, and a point light whose shadow crosses edges.
fn closed() -> Scene {
    let mut scene = Scene::default();
    let grey = material(&mut scene, |m| m.kd = Vec3::splat(0.7));
    room(&mut scene, [grey; 6], false);
    icosphere(&mut scene, Vec3::new(0.45, 0.3, 0.5), 0.2, 1, false, grey);
    light(&mut scene, LightKind::Point { position: Vec3::new(0.8, 0.9, 0.6), intensity: Vec3::ONE });
    scene
}

#[test]
fn adapted_triangles_leave_no_gap_and_no_t_junction() {
    let scene = closed();
    let mesh = bake(&scene, direct(), Plan::default(), 3_000_000);
    assert!(mesh.triangle_count() > 8 * scene.triangles.len(), "{}", mesh.triangle_count());
    let edges = edges(&mesh);
    for ([a, b], count) in &edges {
        assert_eq!((*count, edges.get(&[*b, *a])), (1, Some(&1)), "from {a:?} to {b:?}");
    }
    let area: f32 = mesh
        .parts
        .iter()
        .flat_map(|part| {
            part.triangles.iter().map(|t| {
                let [a, b, c] = t.map(|corner| part.vertices[corner as usize].position);
                (b - a).cross(c - a).length()
            })
        })
        .sum();
    let all: f32 =
        (0..scene.triangles.len() as u32).map(|t| scene.area_vector(penombre::scene::TriangleId(t)).length()).sum();
    assert!((area / all - 1.0).abs() < 1e-4, "{area} of {all}");
    assert!(vertices(&mesh).all(|v| v.light.is_finite() && v.radiance.is_finite() && v.normal.is_normalized()));
}

#[test]
fn base_triangles_are_the_scenes() {
    let scene = closed();
    let mesh =
        bake(&scene, direct(), Plan { triangles: Triangles::Base, sides: Sides::Front, ..Plan::default() }, 1 << 20);
    let mut found: Vec<[Bits; 3]> = mesh
        .parts
        .iter()
        .flat_map(|part| part.triangles.iter().map(|t| t.map(|corner| bits(part.vertices[corner as usize].position))))
        .collect();
    let ids = (0..scene.triangles.len() as u32).map(penombre::scene::TriangleId);
    let mut wanted: Vec<[Bits; 3]> = ids.map(|id| scene.corners(id).map(bits)).collect();
    found.sort_unstable();
    wanted.sort_unstable();
    assert_eq!(found, wanted);
    // Flat walls share a vertex on each corner, of three normals.
    assert_eq!(mesh.parts[0].vertices.iter().filter(|v| v.position == Vec3::ZERO).count(), 3);
}

#[test]
fn sides_that_no_light_reaches_are_left_out() {
    let mut scene = closed();
    // A sheet in the middle, lit from both sides by what bounces, and one outside, lit by nothing.
    let grey = scene.triangle_materials[0];
    let sheet = [Vec3::new(0.1, 0.7, 0.1), Vec3::new(0.3, 0.7, 0.1), Vec3::new(0.1, 0.7, 0.3)];
    triangle(&mut scene, sheet, grey);
    triangle(&mut scene, sheet.map(|p| p + Vec3::Y * 5.0), grey);
    let count = |sides| {
        bake(&scene, direct(), Plan { triangles: Triangles::Base, sides, ..Plan::default() }, 1).triangle_count()
    };
    let all = scene.triangles.len();
    assert_eq!([Sides::Front, Sides::Both, Sides::Lit].map(count), [all, 2 * all, all + 1]);
}

/// The back of a triangle is wound the other way.
#[test]
fn windings_go_with_normals() {
    let mesh = bake(&closed(), direct(), Plan { sides: Sides::Both, ..Plan::default() }, 1 << 18);
    for part in &mesh.parts {
        for triangle in &part.triangles {
            let corners = triangle.map(|corner| part.vertices[corner as usize]);
            let [a, b, c] = corners.map(|vertex| vertex.position);
            assert!((b - a).cross(c - a).dot(corners[0].normal) > 0.0, "{corners:?}");
        }
    }
}

/// Thousands of triangles in one place are one: all of them would share three vertices, and take quadratic time.
#[test]
fn repeats_are_written_once() {
    let mut scene = closed();
    let all = bake(&scene, direct(), Plan { triangles: Triangles::Base, ..Plan::default() }, 1).triangle_count();
    let (last, ids) = (scene.triangles[0], 0..2_000);
    for _ in ids {
        // As often wound from another corner.
        scene.triangles.push([last[1], last[2], last[0]]);
        scene.normals.push(scene.normals[0]);
        scene.uvs.push(scene.uvs[0]);
        scene.triangle_materials.push(scene.triangle_materials[0]);
    }
    let mesh = bake(&scene, direct(), Plan { triangles: Triangles::Base, ..Plan::default() }, 1);
    assert_eq!(mesh.triangle_count(), all);
}
