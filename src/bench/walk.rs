//! A walk where no camera path is given: a small round about where the camera stands, with a look to either side.

use crate::geom::Ray;
use crate::geom::bvh::Bvh;
use crate::scene::Scene;
use crate::scene::camera::Camera;
use glam::{Quat, Vec3};
use std::f32::consts::TAU;

/// How far the camera turns to either side, degrees.
const TURN: f32 = 30.0;
/// Radius of the round against the way to what is nearest in its plane: its far side comes half as near.
const RADIUS: f32 = 0.25;
/// Radius against the scene's size where nothing is in that plane.
const RADIUS_IN_THE_OPEN: f32 = 0.02;
/// Directions in which the nearest is looked for.
const DIRECTIONS: u32 = 64;

/// Cameras of a walk, the first as given. It goes through nothing: the round stays where rays from the camera find nothing.
#[must_use]
pub fn walk(scene: &Scene, bvh: &Bvh, camera: &Camera, pictures: u32) -> Vec<Camera> {
    let forward = (camera.look_at - camera.position).normalize_or(Vec3::NEG_Z);
    let up = camera.up.normalize_or(Vec3::Y);
    let side = forward.cross(up).normalize_or(forward.any_orthonormal_vector());
    let radius = radius(scene, bvh, camera.position, [forward, side]);
    let at = |index: u32| {
        let (sine, cosine) = (index as f32 / pictures as f32 * TAU).sin_cos();
        let position = camera.position + radius * (side * sine + forward * (1.0 - cosine));
        let turn = Quat::from_axis_angle(up, -(TURN * sine).to_radians());
        Camera { position, look_at: position + turn * (camera.look_at - camera.position), ..*camera }
    };
    (0..pictures).map(at).collect()
}

/// Radius of a round in the plane of two axes that goes through nothing, scene units.
fn radius(scene: &Scene, bvh: &Bvh, from: Vec3, [x, y]: [Vec3; 2]) -> f32 {
    let distance = |index: u32| {
        let (sine, cosine) = (index as f32 / DIRECTIONS as f32 * TAU).sin_cos();
        let ray = Ray { origin: from, direction: x * cosine + y * sine, t_max: f32::INFINITY };
        bvh.closest(scene, &ray).map(|hit| hit.t)
    };
    let nearest = (0..DIRECTIONS).filter_map(distance).min_by(f32::total_cmp);
    nearest.map_or(RADIUS_IN_THE_OPEN * scene.scale(), |distance| RADIUS * distance)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::load::load;
    use std::path::Path;

    #[test]
    fn a_walk_starts_at_the_camera_and_goes_through_nothing() {
        let box_ = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell_box/cornell_box.toml");
        let scene = load(&box_).expect("the box").scene;
        let bvh = Bvh::build(&scene);
        // In the box, near its left wall.
        let (position, look_at) = (Vec3::new(500.0, 300.0, 100.0), Vec3::new(300.0, 250.0, 500.0));
        let camera = Camera { position, look_at, ..scene.cameras[0].camera };
        let cameras = walk(&scene, &bvh, &camera, 60);
        assert_eq!((cameras.len(), cameras[0]), (60, camera));
        let (mut farthest, mut turned) = (0.0_f32, 1.0_f32);
        let first = (look_at - position).normalize();
        for pair in cameras.windows(2) {
            let step = pair[1].position - pair[0].position;
            assert!(step.length() > 1.0 && pair[0] != pair[1]);
            let ray = Ray { origin: pair[0].position, direction: step, t_max: 1.0 };
            assert!(!bvh.occluded(&scene, &ray), "{pair:?}");
            farthest = farthest.max(pair[1].position.distance(position));
            turned = turned.min((pair[1].look_at - pair[1].position).normalize().dot(first));
        }
        // 56 units to the wall at x = 556.
        assert!((10.0..50.0).contains(&farthest), "{farthest}");
        assert!((turned.acos().to_degrees() - TURN).abs() < 2.0, "{}", turned.acos().to_degrees());
    }

    #[test]
    fn nothing_in_sight_gives_a_small_round() {
        let scene = Scene::default();
        let camera = Camera { position: Vec3::ZERO, look_at: Vec3::X, up: Vec3::Y, vertical_fov: 40.0 };
        let cameras = walk(&scene, &Bvh::build(&scene), &camera, 4);
        let farthest = cameras.iter().map(|c| c.position.length()).fold(0.0, f32::max);
        assert!((farthest / (2.0 * RADIUS_IN_THE_OPEN * scene.scale()) - 1.0).abs() < 1e-5, "{farthest}");
    }
}
