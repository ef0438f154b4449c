//! The view frustum: which parts of the scene are outside, and which need no clipping.
//!
//! A software rasteriser takes a slow path for every batch of vertices of which one has to be clipped (docs/lavapipe.md), so that what lies
//! wholly inside is drawn apart.

use crate::scene::camera::View;
use glam::{Vec2, Vec3, Vec4};

/// Where something lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Place {
    /// Beyond one plane, with certainty.
    Outside,
    /// Neither.
    Crossing,
    /// On the inner side of all planes.
    Inside,
}

/// A box along the axes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    low: Vec3,
    high: Vec3,
}

impl Bounds {
    /// Those of points; inside out for none.
    pub(super) fn of(points: impl IntoIterator<Item = Vec3>) -> Self {
        let empty = Self { low: Vec3::INFINITY, high: Vec3::NEG_INFINITY };
        points.into_iter().fold(empty, |b, p| Self { low: b.low.min(p), high: b.high.max(p) })
    }

    /// Coordinates of a point in the box, 0 to 1 along each axis.
    pub(super) fn share(&self, point: Vec3) -> Vec3 {
        let extent = (self.high - self.low).max(Vec3::splat(f32::MIN_POSITIVE));
        ((point - self.low) / extent).clamp(Vec3::ZERO, Vec3::ONE)
    }
}

/// The planes of a view: left, right, top, bottom, near. There is no far one.
pub(super) struct Frustum {
    /// Points p inside have (p, 1) · plane ≥ 0.
    planes: [Vec4; 5],
}

/// What a distance from a plane may be off by, as a share of its summands: here and on the device.
const ROUNDING: f32 = 4e-6;

impl Frustum {
    pub(super) fn new(view: &View, jitter: Vec2) -> Self {
        let clip = view.clip_from_world(jitter);
        let [x, y, z, w] = [0, 1, 2, 3].map(|row| clip.row(row));
        Self { planes: [w + x, w - x, w + y, w - y, w - z] }
    }

    /// Where a box lies; what is in it may be farther out or in.
    pub(super) fn place(&self, bounds: &Bounds) -> Place {
        let (centre, half) = ((bounds.low + bounds.high) * 0.5, (bounds.high - bounds.low) * 0.5);
        self.classify(
            |plane| {
                let (middle, reach) = (plane.truncate().dot(centre) + plane.w, plane.truncate().abs().dot(half));
                [middle - reach, middle + reach]
            },
            centre.abs() + half,
        )
    }

    /// Where a triangle lies.
    pub(super) fn place_triangle(&self, corners: [Vec3; 3]) -> Place {
        let largest = corners.iter().fold(Vec3::ZERO, |most, p| most.max(p.abs()));
        self.classify(
            |plane| {
                let [a, b, c] = corners.map(|p| plane.truncate().dot(p) + plane.w);
                [a.min(b).min(c), a.max(b).max(c)]
            },
            largest,
        )
    }

    /// By the least and the largest distance from each plane of points whose coordinates are `largest` at most.
    fn classify(&self, distances: impl Fn(Vec4) -> [f32; 2], largest: Vec3) -> Place {
        let mut place = Place::Inside;
        for &plane in &self.planes {
            let [least, most] = distances(plane);
            let slack = ROUNDING * (plane.truncate().abs().dot(largest) + plane.w.abs());
            if most < -slack {
                return Place::Outside;
            }
            let is_inside = least >= slack;
            if !is_inside {
                place = Place::Crossing;
            }
        }
        place
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::camera::{Camera, ImageSize};

    /// Looks along −z from the origin over 90 degrees, near plane at 1.
    fn frustum() -> Frustum {
        let camera = Camera { position: Vec3::ZERO, look_at: Vec3::NEG_Z, up: Vec3::Y, vertical_fov: 90.0 };
        let view = View { near: 1.0, ..View::new(&camera, ImageSize { width: 64, height: 64 }, 1.0) };
        Frustum::new(&view, Vec2::ZERO)
    }

    #[test]
    fn boxes_and_triangles_are_placed_by_all_five_planes() {
        let at = |centre: Vec3| {
            let corners = [centre + Vec3::splat(0.4), centre - Vec3::splat(0.4), centre];
            let (triangle, boxed) = (frustum().place_triangle(corners), frustum().place(&Bounds::of(corners)));
            assert_eq!(triangle, boxed, "{centre}");
            triangle
        };
        assert_eq!(at(Vec3::new(1.0, -2.0, -5.0)), Place::Inside);
        for side in [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y] {
            assert_eq!(at(side * 5.0 + Vec3::NEG_Z * 5.0), Place::Crossing);
            assert_eq!(at(side * 6.0 + Vec3::NEG_Z * 5.0), Place::Outside);
        }
        assert_eq!(at(Vec3::NEG_Z), Place::Crossing, "the near plane");
        assert_eq!(at(Vec3::NEG_Z * 0.5), Place::Outside);
        assert_eq!(at(Vec3::Z * 5.0), Place::Outside, "behind the eye");
        assert_eq!(at(Vec3::NEG_Z * 1e9), Place::Inside, "there is no far plane");
    }

    #[test]
    fn a_triangle_around_the_frustum_is_not_outside() {
        let around = [Vec3::new(-900.0, -500.0, -2.0), Vec3::new(900.0, -500.0, -2.0), Vec3::new(0.0, 900.0, -2.0)];
        assert_eq!(frustum().place_triangle(around), Place::Crossing);
        let through_the_eye = [Vec3::new(0.0, -1.0, 9.0), Vec3::new(-3.0, -1.0, -9.0), Vec3::new(3.0, -1.0, -9.0)];
        assert_eq!(frustum().place_triangle(through_the_eye), Place::Crossing);
    }
}
