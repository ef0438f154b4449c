//! How far off a surface rays start, and how far short of a light they end: the only place that says so.
//!
//! A point that was computed on a surface lies some rounding errors before or behind it. A ray that starts there may meet
//! the surface itself, and the back of a lamp would lie in front of its own plane half of the time. So rays start a step
//! along the normal away from the surface. Rounding grows with the numbers that a point is computed from, so a step is a
//! share of a scale, in scene units: of the largest coordinate of the point, of the length of the ray that found it, or of
//! the scene. The shares differ by what is known of the surface around the point:
//!
//! | Share | Of | Who |
//! |---|---|---|
//! | [`HIT`] | largest coordinate, ray length ([`scale_of_hit`]) | points that rays hit |
//! | [`INSIDE`] | largest coordinate, a tenth of the scene | vertices inside a triangle |
//! | [`VERTEX`] | largest coordinate, the scene | vertices at corners and on edges |
//! | [`INWARD`] | largest coordinate, the scene | the same, along the surface towards the inside of their facets |
//! | [`CONTACT`] | the scene | the test for geometry that lies on a vertex |
//! | [`SHORT_OF_LIGHT`] | distance of the light | the end of shadow rays |

use glam::Vec3;

/// Of a point that a ray has hit: some 30 units in the last place of f32, well above the rounding of its position, and
/// short of what a pixel shows to lie on the surface.
pub const HIT: f32 = 4e-6;
/// Of a vertex inside a triangle, where there is no corner to step clear of: as of a hit.
pub const INSIDE: f32 = 4e-6;
/// Least and largest of a vertex at a corner or on an edge: large enough for f32, small enough for thin parts. Between
/// them it is a hundredth of the size of the facets around.
pub const VERTEX: [f32; 2] = [4e-6, 4e-5];
/// Least and largest along the surface, towards the inside of the facets around, so that a vertex on the edge of a wall
/// sees what its surface sees and not the wall that it touches. Between them it is a fiftieth of their size.
pub const INWARD: [f32; 2] = [1e-5, 1e-3];
/// Length of the contact test's ray: what lies nearer than this on a vertex covers it; five of the largest steps off.
pub const CONTACT: f32 = 2e-4;
/// Length of a shadow ray against the distance of its light, whose own surface must not hide it.
pub const SHORT_OF_LIGHT: f32 = 1.0 - 1e-4;

/// Where rays from a point of a surface start: `share` of a `scale` off it along its unit `normal`, on whose side they
/// stay.
#[must_use]
#[inline]
pub fn origin(position: Vec3, normal: Vec3, scale: f32, share: f32) -> Vec3 {
    position + normal * (scale * share)
}

/// The scale of a point that a ray hit after `length`, both in scene units: the largest number that it was computed
/// from.
#[must_use]
#[inline]
pub fn scale_of_hit(position: Vec3, length: f32) -> f32 {
    position.abs().max_element().max(length)
}
