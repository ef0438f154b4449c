//! Rays against the scene's triangles.

pub mod bvh;
mod collapse;
mod halves;
pub mod offset;
mod places;
mod sheets;
mod traversal;
pub mod tree;
mod watertight;

use crate::math::triangle::unit_normal;
use crate::scene::{FaceId, TriangleId};
use glam::Vec3;

/// A ray segment: points origin + t·direction with t in (0, t_max).
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Origin, scene units.
    pub origin: Vec3,
    /// Direction; t counts in its length.
    pub direction: Vec3,
    /// End of the segment.
    pub t_max: f32,
}

/// The closest hit of a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance in lengths of the ray's direction.
    pub t: f32,
    /// The triangle.
    pub triangle: TriangleId,
    /// Barycentric weight of corner 1.
    pub u: f32,
    /// Barycentric weight of corner 2.
    pub v: f32,
    /// Whether the ray came from the back (clockwise) side.
    pub back: bool,
    /// The corners of the triangle, scene units: from the hierarchy, where they are at hand.
    pub corners: [Vec3; 3],
}

impl Hit {
    /// Where `ray` was hit: by the barycentrics, whose error follows the triangle's size and not the distance, or by the distance
    /// where the triangle's corners lie much farther away than that.
    #[must_use]
    #[inline]
    pub fn position(&self, ray: &Ray) -> Vec3 {
        const MUCH_FARTHER: f32 = 16.0;
        let [a, b, c] = self.corners;
        let reach = ray.origin.abs().max((ray.direction * self.t).abs()).max_element();
        if a.abs().max(b.abs()).max(c.abs()).max_element() > MUCH_FARTHER * reach {
            return ray.origin + ray.direction * self.t;
        }
        a * (1.0 - self.u - self.v) + b * self.u + c * self.v
    }

    /// Unit normal of the triangle on the side that was hit (zero for a degenerate one).
    #[must_use]
    #[inline]
    pub fn facet(&self) -> Vec3 {
        unit_normal(self.corners) * self.side()
    }

    /// Twice the area times that.
    #[must_use]
    #[inline]
    pub fn area_vector(&self) -> Vec3 {
        let [a, b, c] = self.corners;
        (b - a).cross(c - a) * self.side()
    }

    /// 1 on the front, −1 on the back.
    const fn side(&self) -> f32 {
        if self.back { -1.0 } else { 1.0 }
    }

    /// The face that was hit.
    #[must_use]
    pub const fn face(&self) -> FaceId {
        FaceId::new(self.triangle, self.back)
    }
}
