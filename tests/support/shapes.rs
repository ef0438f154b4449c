//! Closed shapes.

use super::by_hand::{light, patch, triangle};
use glam::Vec3;
use penombre::scene::light::LightKind;
use penombre::scene::material::MaterialId;
use penombre::scene::{Scene, TriangleId};

/// The unit cube seen from inside, walls −x +x −y +y −z +z. Those that emit become one light, or one each.
pub fn room(scene: &mut Scene, materials: [MaterialId; 6], one_light: bool) {
    let (x, y, z) = (Vec3::X, Vec3::Y, Vec3::Z);
    let walls = [(Vec3::ZERO, y, z), (x, z, y), (Vec3::ZERO, z, x), (y, x, z), (Vec3::ZERO, x, y), (z, y, x)];
    let mut lamps: Vec<Vec<TriangleId>> = Vec::new();
    for ((origin, u, v), material) in walls.into_iter().zip(materials) {
        let triangles = patch(scene, origin, u, v, 1, material);
        if scene.materials[material.0 as usize].is_emissive() {
            lamps.push(triangles);
        }
    }
    if one_light && !lamps.is_empty() {
        lamps = vec![lamps.concat()];
    }
    lamps.into_iter().for_each(|triangles| light(scene, LightKind::Area { triangles }));
}

/// A sphere of 20·4ⁿ triangles with its corners on it, facing outwards or inwards.
pub fn icosphere(
    scene: &mut Scene,
    centre: Vec3,
    radius: f32,
    n: u32,
    inwards: bool,
    material: MaterialId,
) -> Vec<TriangleId> {
    let g = 0.5 * (1.0 + 5f32.sqrt());
    let corners = [[0.0, 1.0, g], [0.0, -1.0, g], [0.0, 1.0, -g], [0.0, -1.0, -g]].map(Vec3::from_array);
    let all: Vec<Vec3> =
        corners.iter().flat_map(|&c| [c, Vec3::new(c.y, c.z, c.x), Vec3::new(c.z, c.x, c.y)]).collect();
    let mut faces: Vec<[Vec3; 3]> = Vec::new();
    for (i, &a) in all.iter().enumerate() {
        for (j, &b) in all.iter().enumerate().skip(i + 1) {
            for &c in &all[j + 1..] {
                let edges = [a.distance(b), b.distance(c), c.distance(a)];
                if edges.iter().all(|e| (e - 2.0).abs() < 1e-3) {
                    let outwards = (b - a).cross(c - a).dot(a) > 0.0;
                    faces.push(if outwards == inwards { [a, c, b] } else { [a, b, c] });
                }
            }
        }
    }
    for _ in 0..n {
        faces = faces.into_iter().flat_map(quarters).collect();
    }
    faces.into_iter().map(|f| triangle(scene, f.map(|p| centre + p.normalize() * radius), material)).collect()
}

fn quarters([a, b, c]: [Vec3; 3]) -> [[Vec3; 3]; 4] {
    let middle = |p: Vec3, q: Vec3| (p.normalize() + q.normalize()) * 0.5;
    let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
}
