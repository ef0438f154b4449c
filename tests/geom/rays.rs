//! The hierarchy against testing every triangle.

use crate::support::by_hand::{material, patch, triangle};
use glam::{Vec2, Vec3};
use penombre::geom::Ray;
use penombre::geom::bvh::{Bvh, closest_by_brute_force};
use penombre::math::sequence::Sequence;
use penombre::scene::Scene;
use penombre::scene::coplanar::Coplanar;
use penombre::scene::material::MaterialId;
use penombre::scene::texture::{Texture, TextureId};

/// A soup of triangles of many sizes, half of them with a cut-out mask.
fn soup(count: u32) -> Scene {
    let mut scene = Scene::default();
    material(&mut scene, |_| {});
    material(&mut scene, |m| m.map_d = Some(TextureId(0).into()));
    let texels = (0..64).map(|i| [255, 255, 255, if (i / 8 + i % 8) % 2 == 0 { 255 } else { 0 }]).collect();
    scene.textures.push(Texture::new("checker".into(), [8, 8], texels));
    let sequence = Sequence::new(1);
    for i in 0..count {
        let at = |set| Vec3::from_slice(&sequence.point_of_set(i, set)[..3]);
        let size = 0.02 + 0.5 * sequence.point_of_set(i, 3)[0].powi(4);
        let corner = at(0);
        triangle(&mut scene, [corner, corner + (at(1) - 0.5) * size, corner + (at(2) - 0.5) * size], MaterialId(i % 2));
    }
    scene
}

fn rays(n: u32) -> impl Iterator<Item = Ray> {
    let sequence = Sequence::new(2);
    (0..n).map(move |i| {
        let at = |set| Vec3::from_slice(&sequence.point_of_set(i, set)[..3]);
        let origin = at(0) * 3.0 - 1.0;
        Ray { origin, direction: (at(1) - origin).normalize(), t_max: f32::INFINITY }
    })
}

#[test]
fn closest_hits_equal_brute_force() {
    compare_closest(&soup(600), 4000);
}

/// So many that the tree is made in parts.
#[test]
fn closest_hits_in_a_large_tree_equal_brute_force() {
    compare_closest(&soup(6000), 2000);
}

fn compare_closest(scene: &Scene, count: u32) {
    let bvh = Bvh::build(scene);
    let (mut hits, mut differ) = (0, 0);
    for ray in rays(count) {
        let (found, expected) = (bvh.closest(scene, &ray), closest_by_brute_force(scene, &ray));
        hits += u32::from(expected.is_some());
        let same = match (found, expected) {
            (Some(a), Some(b)) => {
                a.triangle == b.triangle && a.back == b.back && (a.t - b.t).abs() < 1e-4 && (a.u - b.u).abs() < 1e-2
            }
            (None, None) => true,
            _ => false,
        };
        differ += u32::from(!same);
    }
    // Rays through an edge (of a triangle or of a texel of the mask) may fall either way in f32.
    assert!(hits > 1000 && differ <= 4, "{differ} of {hits} differ");
}

#[test]
fn occlusion_equals_brute_force_on_segments() {
    let scene = soup(600);
    let bvh = Bvh::build(&scene);
    let (mut blocked, mut differ) = (0, 0);
    for (i, ray) in rays(4000).enumerate() {
        let ray = Ray { t_max: 0.2 + (i % 10) as f32 * 0.2, ..ray };
        let expected = closest_by_brute_force(&scene, &ray).is_some();
        blocked += u32::from(expected);
        differ += u32::from(bvh.occluded(&scene, &ray) != expected);
    }
    assert!(blocked > 500 && differ <= 4, "{differ} of {blocked} differ");
}

#[test]
fn an_empty_scene_and_coincident_triangles_are_no_trouble() {
    let empty = Scene::default();
    let ray = Ray { origin: Vec3::new(0.0, 0.1, 0.3), direction: Vec3::X, t_max: f32::INFINITY };
    assert!(Bvh::build(&empty).closest(&empty, &ray).is_none());
    let mut scene = Scene::default();
    let grey = material(&mut scene, |_| {});
    let ids = patch(&mut scene, Vec3::new(1.0, -1.0, -1.0), Vec3::Y * 2.0, Vec3::Z * 2.0, 1, grey);
    for _ in 0..20_000 {
        scene.triangles.push(scene.triangles[ids[0].0 as usize]);
        scene.normals.push(scene.normals[0]);
        scene.uvs.push([Vec2::ZERO; 3]);
        scene.triangle_materials.push(grey);
    }
    let bvh = Bvh::build(&scene);
    let hit = bvh.closest(&scene, &ray).expect("the patch is in the way");
    assert!((hit.t - 1.0).abs() < 1e-6 && hit.back);
}

/// Of two triangles back to back each is met from its front, wherever its corners start.
#[test]
fn triangles_back_to_back_are_met_from_their_fronts() {
    let corners = [Vec3::new(0.1, 0.0, 0.2), Vec3::new(0.9, 0.3, -0.4), Vec3::new(-0.0, 0.7, 0.5)];
    for order in [[0, 2, 1], [2, 1, 0], [1, 0, 2]] {
        // Corners of their own, as an OBJ file may have them.
        for (shared, second) in [(true, 0), (false, 0), (true, 1)] {
            let mut scene = Scene::default();
            for _ in 0..2 {
                material(&mut scene, |_| {});
            }
            triangle(&mut scene, corners, MaterialId(0));
            if shared {
                triangle(&mut scene, order.map(|i| corners[i]), MaterialId(second));
            } else {
                let positions = order.map(|i| corners[i] + Vec3::ZERO);
                scene.positions.extend(positions);
                scene.triangles.push([3, 4, 5]);
                scene.normals.push([scene.geometric_normal(penombre::scene::TriangleId(1)); 3]);
                scene.uvs.push([Vec2::ZERO; 3]);
                scene.triangle_materials.push(MaterialId(second));
            }
            scene.coplanar = Coplanar::find(&scene);
            let bvh = Bvh::build(&scene);
            let point = corners[0] * 0.5 + corners[1] * 0.3 + corners[2] * 0.2;
            let normal = scene.geometric_normal(penombre::scene::TriangleId(0));
            for (side, expected) in [(1.0, 0), (-1.0, 1)] {
                let ray = Ray { origin: point + normal * side, direction: normal * -side, t_max: f32::INFINITY };
                let hit = bvh.closest(&scene, &ray).expect("both are in the way");
                assert_eq!((hit.triangle.0, hit.back), (expected, false), "{order:?}");
                let [a, b, c] = scene.corners(hit.triangle);
                let found = a * (1.0 - hit.u - hit.v) + b * hit.u + c * hit.v;
                assert!(found.distance(point) < 1e-5, "{order:?}: {found} {point}");
            }
        }
    }
}

/// obvhs has an absolute tolerance; scenes have none.
#[test]
fn hits_do_not_depend_on_the_scale_of_the_scene() {
    for exponent in [-8, -6, -5, -4, -3, -2, 0, 3, 6, 8] {
        let scale = 10_f32.powi(exponent);
        let mut scene = Scene::default();
        let grey = material(&mut scene, |_| {});
        patch(&mut scene, Vec3::new(-1.0, 0.0, -1.0) * scale, Vec3::Z * 2.0 * scale, Vec3::X * 2.0 * scale, 8, grey);
        patch(&mut scene, Vec3::new(-0.5, 0.5, -0.5) * scale, Vec3::Z * scale, Vec3::X * scale, 4, grey);
        let bvh = Bvh::build(&scene);
        let (mut hits, mut differ) = (0, 0);
        for ray in rays(2000) {
            let ray = Ray { origin: (ray.origin - 0.5) * scale, t_max: 10.0 * scale, ..ray };
            let (found, expected) = (bvh.closest(&scene, &ray), closest_by_brute_force(&scene, &ray));
            hits += u32::from(expected.is_some());
            let same = match (found, expected) {
                (Some(a), Some(b)) => a.triangle == b.triangle && (a.t - b.t).abs() < 1e-4 * scale,
                (None, None) => true,
                _ => false,
            };
            differ += u32::from(!same || bvh.occluded(&scene, &ray) != expected.is_some());
        }
        assert!(hits > 300 && differ <= 2, "scale 1e{exponent}: {differ} of {hits} differ");
    }
}

/// Triangles in each other make a chain of nodes by clustering, which took minutes to build and overflowed the stack.
#[test]
fn nested_triangles_are_found_in_no_time() {
    let mut scene = Scene::default();
    let grey = material(&mut scene, |_| {});
    for i in 0..20_000 {
        let size = 1.0 - i as f32 / 20_016.0;
        let first = scene.positions.len() as u32;
        scene.positions.extend([Vec3::ZERO, Vec3::X, Vec3::Y].map(|p| p * size + Vec3::Z * (1.0 - size)));
        scene.triangles.push([first, first + 1, first + 2]);
        scene.normals.push([Vec3::Z; 3]);
        scene.uvs.push([Vec2::ZERO; 3]);
        scene.triangle_materials.push(grey);
    }
    let start = std::time::Instant::now();
    let bvh = Bvh::build(&scene);
    let off = |ray: Ray| match (bvh.closest(&scene, &ray), closest_by_brute_force(&scene, &ray)) {
        (Some(a), Some(b)) => (a.t - b.t).abs() > 1e-3,
        (a, b) => a.is_some() != b.is_some(),
    };
    assert_eq!(rays(500).filter(|ray| off(*ray)).count(), 0);
    assert!(start.elapsed().as_secs() < 30, "{:?}", start.elapsed());
}
