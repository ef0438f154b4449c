//! How much of a surface a pixel covers: what textures are filtered over.

use super::camera::View;
use glam::{Vec2, Vec3};

/// By how much the barycentrics (of corners 1 and 2) change across a pixel on the plane of a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Footprint {
    /// Towards the right neighbour.
    pub d_dx: Vec2,
    /// Towards the lower neighbour.
    pub d_dy: Vec2,
}

impl Footprint {
    /// That of a point: nothing is filtered.
    pub const POINT: Self = Self { d_dx: Vec2::ZERO, d_dy: Vec2::ZERO };

    /// The footprint on a triangle of a square of `width` pixels about the image point `pixel`, by the rays through the
    /// point and through the points `width` to its right and below it, as the colour pass has it. Not finite where one
    /// of the rays runs along the plane.
    #[must_use]
    pub fn of_pixel(corners: [Vec3; 3], view: &View, pixel: Vec2, width: f32) -> Self {
        if width == 0.0 {
            return Self::POINT;
        }
        let at = |offset: Vec2| barycentrics(corners, view.eye, view.direction(pixel + offset));
        let centre = at(Vec2::ZERO);
        Self { d_dx: at(Vec2::X * width) - centre, d_dy: at(Vec2::Y * width) - centre }
    }
}

/// Barycentrics of corners 1 and 2 where a ray meets the plane of a triangle.
fn barycentrics([a, b, c]: [Vec3; 3], origin: Vec3, direction: Vec3) -> Vec2 {
    let (edge1, edge2, s) = (b - a, c - a, origin - a);
    let p = direction.cross(edge2);
    Vec2::new(s.dot(p), direction.dot(s.cross(edge1))) / edge1.dot(p)
}
