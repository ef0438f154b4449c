//! How large a scene is, what of it is nearest to a point, and where it lies.

use super::camera::{Camera, ImageSize, View};
use super::geometry::bounds;
use super::{Scene, TriangleId};
use crate::math::triangle::nearest_to_origin;
use glam::Vec3;
use rayon::prelude::*;

/// The bulk of a scene: this share of its vertices along each axis, the same number left out at either end.
const BULK: f64 = 0.5;
/// Size of a scene against that of its bulk, at most.
const BEYOND_BULK: f32 = 16.0;

/// Least near plane against the coordinates there: what is nearer than that is not told from the eye.
const LEAST_NEAR: f32 = 2e-6;

impl Scene {
    /// Smallest and largest coordinates of the drawable geometry; `None` without any.
    #[must_use]
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        bounds(&self.positions, &self.triangles)
    }

    /// Length of the diagonal of the bounds; 1 for an empty scene.
    #[must_use]
    pub fn diagonal(&self) -> f32 {
        self.bounds().map_or(1.0, |(lo, hi)| (hi - lo).length().max(f32::MIN_POSITIVE))
    }

    /// The size that tolerances derive from: the diagonal, but no more than 16 times that of what holds the middle half of the
    /// vertices along each axis. A house on a ground plane of 2,000 km is of the size of the house.
    #[must_use]
    pub fn scale(&self) -> f32 {
        let diagonal = self.diagonal();
        let Some(bulk) = spread(&self.positions).map(Vec3::length).filter(|&bulk| bulk > 0.0) else { return diagonal };
        diagonal.min(bulk * BEYOND_BULK)
    }

    /// The view of a camera on an image, its near plane before all that can be seen.
    #[must_use]
    pub fn view(&self, camera: &Camera, size: ImageSize) -> View {
        Clearance::new(self).view(self, camera, size)
    }

    /// Distance of a point from the nearest triangle; infinite without any.
    #[must_use]
    pub fn distance_from(&self, point: Vec3) -> f32 {
        let squared = |triangle: u32| {
            let corners @ [a, b, c] = self.corners(TriangleId(triangle)).map(|p| p - point);
            let [u, v, w] = nearest_to_origin(corners);
            (a * u + b * v + c * w).length_squared()
        };
        let all = (0..self.triangles.len() as u32).into_par_iter();
        all.map(squared).reduce(|| f32::INFINITY, f32::min).sqrt()
    }
}

/// Distance of the eye from the nearest triangle, as it moves: going through all triangles is left out while what is known bounds it well
/// enough for a near plane.
#[derive(Clone, Copy, Debug)]
pub struct Clearance {
    scale: f32,
    /// Where the distance was last looked for, and what it was.
    known: Option<(Vec3, f32)>,
}

impl Clearance {
    /// Of a scene, which is the same in all calls.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        Self { scale: scene.scale(), known: None }
    }

    /// Size of the scene, [`Scene::scale`].
    #[must_use]
    pub const fn scale(&self) -> f32 {
        self.scale
    }

    /// [`Scene::view`], by what is known of the views before.
    pub fn view(&mut self, scene: &Scene, camera: &Camera, size: ImageSize) -> View {
        View::new(camera, size, self.near(scene, camera.position))
    }

    /// The largest power of two before all triangles, and not nearer than what can be told from the eye: whatever the way there, and the same for
    /// places that hardly differ.
    fn near(&mut self, scene: &Scene, eye: Vec3) -> f32 {
        let least = LEAST_NEAR * self.scale.max(eye.abs().max_element());
        let before = |distance: f32| power_of_two(distance.max(least));
        // It changes by no more than the eye has moved.
        let bounds = self.known.map(|(at, distance)| {
            let moved = eye.distance(at);
            let moved = moved + ROUNDING * (distance + moved);
            [distance - moved, distance + moved].map(before)
        });
        match bounds {
            Some([nearest, farthest]) if nearest == farthest => nearest,
            _ => {
                let distance = scene.distance_from(eye);
                self.known = Some((eye, distance));
                before(distance)
            }
        }
    }
}

/// What a distance may be off by as a share of itself.
const ROUNDING: f32 = 1e-5;

/// The largest power of two up to a positive number; infinity and not a number stay.
fn power_of_two(value: f32) -> f32 {
    const MANTISSA: u32 = (1 << (f32::MANTISSA_DIGITS - 1)) - 1;
    if value.is_normal() { f32::from_bits(value.to_bits() & !MANTISSA) } else { value }
}

/// Extents of what holds the bulk of the points along each axis; `None` for no points.
fn spread(points: &[Vec3]) -> Option<Vec3> {
    let left_out = (points.len() as f64 * (1.0 - BULK) * 0.5) as usize;
    let last = points.len().checked_sub(1)?;
    let along = |axis: usize| {
        let mut values: Vec<f32> = points.iter().map(|p| p[axis]).collect();
        let low = *values.select_nth_unstable_by(left_out, f32::total_cmp).1;
        *values.select_nth_unstable_by(last - left_out, f32::total_cmp).1 - low
    };
    let (x, (y, z)) = rayon::join(|| along(0), || rayon::join(|| along(1), || along(2)));
    Some(Vec3::new(x, y, z))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene(positions: Vec<Vec3>) -> Scene {
        let triangles = (0..positions.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        Scene { positions, triangles, ..Scene::default() }
    }

    /// A grid of triangles of one unit in 10 × 10.
    fn grid() -> Vec<Vec3> {
        let corner = |i: u32| Vec3::new((i % 10) as f32, 0.0, (i / 10) as f32);
        (0..100).flat_map(|i| [corner(i), corner(i) + Vec3::Z, corner(i) + Vec3::X]).collect()
    }

    #[test]
    fn a_ground_plane_does_not_decide_the_scale() {
        let alone = scene(grid());
        assert_eq!(alone.scale(), alone.diagonal());
        let ground = [Vec3::new(-1e6, 0.0, -1e6), Vec3::new(0.0, 0.0, 1e6), Vec3::new(1e6, 0.0, -1e6)];
        let with_ground = scene(grid().into_iter().chain(ground).collect());
        assert!(with_ground.diagonal() > 2e6);
        assert!(with_ground.scale() < 20.0 * alone.diagonal(), "{}", with_ground.scale());
        assert_eq!(scene(vec![Vec3::X; 3]).scale(), scene(vec![Vec3::X; 3]).diagonal(), "all in one point");
        assert_eq!(Scene::default().scale(), 1.0);
    }

    #[test]
    fn a_walk_has_the_near_planes_of_its_places() {
        let scene = scene(grid());
        let size = ImageSize { width: 200, height: 100 };
        let (mut clearance, mut searches) = (Clearance::new(&scene), 0);
        for step in 0..400 {
            let along = step as f32 / 400.0;
            let position = Vec3::new(12.0 * along, 0.4 + 3.0 * (1.0 - along).powi(3), 4.0);
            let camera = Camera { position, look_at: Vec3::NEG_Y, up: Vec3::X, vertical_fov: 60.0 };
            let before = clearance.known;
            assert_eq!(clearance.view(&scene, &camera, size), scene.view(&camera, size), "{step}");
            searches += i32::from(clearance.known != before);
        }
        assert!(searches < 133, "{searches} of 400");
        assert_eq!([1.0, 3.9, 4.0, 1e-3].map(power_of_two), [1.0, 2.0, 4.0, 2f32.powi(-10)]);
    }

    #[test]
    fn the_near_plane_lies_before_everything() {
        let scene = scene(grid());
        let camera =
            Camera { position: Vec3::new(4.0, 0.3, 4.0), look_at: Vec3::ZERO, up: Vec3::Y, vertical_fov: 120.0 };
        assert!((scene.distance_from(camera.position) - 0.3).abs() < 1e-6);
        let view = scene.view(&camera, ImageSize { width: 200, height: 100 });
        // The corner of the image looks farthest aside.
        let corner = view.direction(glam::Vec2::ZERO);
        assert!(view.near > 0.01 && corner.length() * view.near <= 0.3, "{}", view.near);
        let touching = Camera { position: Vec3::new(4.2, 0.0, 4.2), look_at: Vec3::ZERO, ..camera };
        let near = scene.view(&touching, ImageSize { width: 200, height: 100 }).near;
        assert!(near > 0.0 && near < 1e-4, "{near}");
    }
}
