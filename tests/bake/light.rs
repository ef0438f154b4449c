//! What vertices hold, against closed forms.

use crate::support::by_hand::{light, material, patch, triangle};
use crate::support::shapes::room;
use crate::{all_light, bake, direct, vertices};
use glam::Vec3;
use penombre::bake::baker::{Plan, Sides, Triangles};
use penombre::scene::Scene;
use penombre::scene::light::LightKind;
use std::f32::consts::PI;

const INTENSITY: f32 = 30.0;
const LAMP: Vec3 = Vec3::new(0.3, 2.0, -0.4);

/// A floor of 4 × 4 in y = 0, k_d ½, under a point light.
fn floor() -> Scene {
    let mut scene = Scene::default();
    let grey = material(&mut scene, |m| m.kd = Vec3::splat(0.5));
    patch(&mut scene, Vec3::new(-2.0, 0.0, 2.0), Vec3::X * 4.0, Vec3::Z * -4.0, 4, grey);
    light(&mut scene, LightKind::Point { position: LAMP, intensity: Vec3::splat(INTENSITY) });
    scene
}

/// E/π = I cosθ / (π d²).
fn expected(position: Vec3) -> f32 {
    let d = LAMP - position;
    INTENSITY * d.y / d.length().powi(3) / PI
}

#[test]
fn a_point_light_over_a_floor() {
    for triangles in [Triangles::Base, Triangles::Adapted] {
        let mesh = bake(&floor(), direct(), Plan { triangles, ..Plan::default() }, 1 << 22);
        // Light reaches the upper side alone.
        assert_eq!((mesh.triangle_count() == 32, mesh.filled[0]), (triangles == Triangles::Base, 0));
        for vertex in vertices(&mesh) {
            let wanted = expected(vertex.position);
            assert!((vertex.light - wanted).abs().max_element() < 2e-3 * wanted, "{vertex:?}: {wanted}");
            assert!((vertex.radiance - vertex.light * 0.5).length() < 1e-6 && vertex.normal.dot(Vec3::Y) > 0.999);
        }
    }
}

/// Between vertices, too, adapted triangles are as close as they say.
#[test]
fn adapted_triangles_interpolate_well() {
    let mesh = bake(&floor(), direct(), Plan::default(), 1 << 22);
    let (mut square, mut light, mut area) = (0.0, 0.0, 0.0);
    for part in &mesh.parts {
        for corners in part.triangles.iter().map(|t| t.map(|corner| part.vertices[corner as usize])) {
            let [a, b, c] = corners.map(|vertex| vertex.position);
            let weight = f64::from((b - a).cross(c - a).length());
            let wanted = expected((a + b + c) / 3.0);
            let off = corners.iter().map(|vertex| vertex.light.x).sum::<f32>() / 3.0 - wanted;
            square += f64::from(off * off) * weight;
            (light, area) = (light + f64::from(wanted) * weight, area + weight);
        }
    }
    let relative = (square / area).sqrt() / (light / area);
    assert!(relative < 3e-3, "{relative}");
}

/// In a closed room whose walls emit 1 and reflect ½, 1 / (1 − ½) leaves every point.
#[test]
fn a_furnace() {
    let mut scene = Scene::default();
    let wall = material(&mut scene, |m| (m.kd, m.ke) = (Vec3::splat(0.5), Vec3::ONE));
    room(&mut scene, [wall; 6], true);
    let mesh = bake(&scene, all_light(), Plan::default(), 3_000_000);
    // Where walls meet, a vertex lies in the planes of the lamps beside it, which it then sees edge on.
    let inside = |p: Vec3| p.to_array().iter().filter(|c| **c > 0.1 && **c < 0.9).count() == 2;
    let all: Vec<_> = vertices(&mesh).filter(|vertex| inside(vertex.position)).collect();
    assert!(all.len() > 20, "{}", all.len());
    for vertex in &all {
        assert!((vertex.light - 2.0).abs().max_element() < 0.15, "{vertex:?}");
        assert!((vertex.radiance - 1.0 - vertex.light * 0.5).abs().max_element() < 1e-6, "{vertex:?}");
    }
    let mean = all.iter().map(|vertex| vertex.light.x).sum::<f32>() / all.len() as f32;
    assert!((mean - 2.0).abs() < 0.03, "{mean}");
}

#[test]
fn lights_add_up() {
    let mut scene = floor();
    light(&mut scene, LightKind::Point { position: Vec3::new(-1.0, 1.0, 1.0), intensity: Vec3::new(3.0, 0.0, 1.0) });
    let (x, z) = (Vec3::X, Vec3::Z);
    let grey = scene.triangle_materials[0];
    triangle(
        &mut scene,
        [Vec3::new(-0.5, 0.7, 0.5), Vec3::new(-0.5, 0.7, 0.5) + x, Vec3::new(-0.5, 0.7, 0.5) - z],
        grey,
    );
    let mesh = bake(&scene, all_light(), Plan { per_light: true, ..Plan::default() }, 2_000_000);
    let names: Vec<Option<&str>> = mesh.lights.iter().map(Option::as_deref).collect();
    assert_eq!(names, [Some("light 1"), Some("light 2"), None]);
    let mut most = Vec3::ZERO;
    for part in &mesh.parts {
        for (index, vertex) in part.vertices.iter().enumerate() {
            let sum: Vec3 = part.lights.iter().map(|light| light[index]).sum();
            assert!(
                (sum - vertex.light).abs().max_element() < 2e-3 * vertex.light.max_element().max(0.1),
                "{vertex:?} {sum}"
            );
            most = most.max(Vec3::from_array([0, 1, 2].map(|i| part.lights[i][index].y)));
        }
    }
    // The second has no green.
    assert!(most.x > 1.0 && most.y == 0.0 && most.z > 0.01, "{most}");
}

/// Corners of a floor inside of boxes know no light, and take it from around.
#[test]
fn what_is_buried_is_not_black() {
    let mut scene = floor();
    let grey = scene.triangle_materials[0];
    for corner in [Vec3::new(-2.0, 0.0, -2.0), Vec3::new(2.0, 0.0, 2.0)] {
        let (u, v, w) = (Vec3::X * 0.6, Vec3::Y * 0.6, Vec3::Z * 0.6);
        let least = corner - (u + v + w) * 0.5;
        for (origin, u, v) in
            [(least, v, u), (least + w, u, v), (least, w, v), (least + u, v, w), (least, u, w), (least + v, w, u)]
        {
            patch(&mut scene, origin, u, v, 1, grey);
        }
    }
    for triangles in [Triangles::Base, Triangles::Adapted] {
        let mesh = bake(&scene, direct(), Plan { triangles, sides: Sides::Front, ..Plan::default() }, 1 << 22);
        let is_floor = |v: &&penombre::bake::lit_mesh::Vertex| v.position.y == 0.0 && v.normal.y > 0.9;
        assert!(mesh.filled[0] > 0);
        for vertex in vertices(&mesh).filter(is_floor) {
            assert!(vertex.light.x > 0.2, "{triangles:?}: {vertex:?}");
        }
    }
}
