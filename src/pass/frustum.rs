//! The view frustum: which parts of the scene are outside, and which need no clipping.
//!
//! A software rasteriser takes a slow path for every batch of vertices of which one has to be clipped (docs/lavapipe.md), so that what lies
//! wholly inside is drawn apart.

use crate::scene::camera::View;
use glam::{Mat4, Vec2, Vec3, Vec4};

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

/// Planes side by side: point p is inside of each whose (p, 1) · plane ≥ 0.
#[derive(Clone, Copy)]
struct Planes {
    x: Vec4,
    y: Vec4,
    z: Vec4,
    w: Vec4,
}

impl Planes {
    /// Distance of a point from each, times the length of its normal.
    fn distances(&self, point: Vec3) -> Vec4 {
        self.x * point.x + self.y * point.y + self.z * point.z + self.w
    }

    /// What distances may be off by where coordinates are `largest` at most.
    fn slack(&self, largest: Vec3) -> Vec4 {
        let Self { x, y, z, w } = self;
        (x.abs() * largest.x + y.abs() * largest.y + z.abs() * largest.z + w.abs()) * ROUNDING
    }
}

/// The planes of a view: left, right, top, bottom, and the near one. There is no far one.
pub(super) struct Frustum {
    sides: Planes,
    /// Four times the same.
    near: Planes,
}

/// What a distance from a plane may be off by, as a share of its summands: here and on the device.
const ROUNDING: f32 = 4e-6;

impl Frustum {
    pub(super) fn new(view: &View, jitter: Vec2) -> Self {
        let clip = view.clip_from_world(jitter);
        let [x, y, z, w] = [0, 1, 2, 3].map(|row| clip.row(row));
        let beside = |planes: [Vec4; 4]| {
            let [a, b, c, d] = planes;
            let across = Mat4::from_cols(a, b, c, d).transpose();
            Planes { x: across.x_axis, y: across.y_axis, z: across.z_axis, w: across.w_axis }
        };
        Self { sides: beside([w + x, w - x, w + y, w - y]), near: beside([w - z; 4]) }
    }

    /// Where a box lies; what is in it may be farther out or in.
    pub(super) fn place(&self, bounds: &Bounds) -> Place {
        let (centre, half) = ((bounds.low + bounds.high) * 0.5, (bounds.high - bounds.low) * 0.5);
        let reaches = |planes: &Planes| {
            let middle = planes.distances(centre);
            let reach = planes.x.abs() * half.x + planes.y.abs() * half.y + planes.z.abs() * half.z;
            [middle - reach, middle + reach]
        };
        self.classify(reaches, centre.abs() + half)
    }

    /// Where a triangle lies.
    pub(super) fn place_triangle(&self, [a, b, c]: [Vec3; 3]) -> Place {
        let reaches = |planes: &Planes| {
            let (a, b, c) = (planes.distances(a), planes.distances(b), planes.distances(c));
            [a.min(b).min(c), a.max(b).max(c)]
        };
        self.classify(reaches, a.abs().max(b.abs()).max(c.abs()))
    }

    /// By the least and the largest distance from planes of points whose coordinates are `largest` at most.
    fn classify(&self, reaches: impl Fn(&Planes) -> [Vec4; 2], largest: Vec3) -> Place {
        let ([least, most], slack) = (reaches(&self.sides), self.sides.slack(largest));
        let ([nearest, farthest], near_slack) = (reaches(&self.near), self.near.slack(largest));
        if (most.cmplt(-slack) | farthest.cmplt(-near_slack)).any() {
            return Place::Outside;
        }
        // Not a number crosses.
        let is_inside = (least.cmpge(slack) & nearest.cmpge(near_slack)).all();
        if is_inside { Place::Inside } else { Place::Crossing }
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
