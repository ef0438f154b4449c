//! Intersection of a ray with a triangle that leaves no gap to the triangle beside it \[Woop13\].
//!
//! Corners are moved into a space in which the ray is the z axis: each by itself, so that triangles that share a corner agree on where
//! it is. There the sign of an edge function is exact, and an edge has opposite signs in the two triangles beside it; so a ray through
//! the edge hits one of them at least.

use glam::{Vec3, Vec3Swizzles as _, Vec4, Vec4Swizzles as _};

/// A triangle's corners, one vector for each coordinate.
#[derive(Clone, Copy, Debug)]
pub struct Corners {
    /// x, y and z of the corners 0, 1, 2; the fourth is 0.
    axes: [Vec4; 3],
}

/// A ray that becomes the z axis.
#[derive(Clone, Copy, Debug)]
pub struct Shear {
    /// The axes that become x, y and z, in turn: z is the one along which the direction is longest.
    order: [usize; 3],
    /// Origin along x, y and z.
    origin: [Vec4; 3],
    /// What x and y are sheared by, and z scaled.
    factors: [Vec4; 3],
}

/// Where a ray meets the plane of a triangle, within the triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Meeting {
    /// Distance in lengths of the ray's direction.
    pub t: f32,
    /// Barycentric weight of corner 1.
    pub u: f32,
    /// Barycentric weight of corner 2.
    pub v: f32,
}

/// The lanes of the three edges in a mask.
const EDGES: u32 = 0b111;
/// Bit n is set where the mask n has some edges but not all.
const MIXED: u32 = 0b0111_1110;

impl Corners {
    /// From the corners.
    #[must_use]
    pub fn new([a, b, c]: [Vec3; 3]) -> Self {
        Self { axes: [0, 1, 2].map(|k| Vec4::new(a[k], b[k], c[k], 0.0)) }
    }

    /// Where the ray meets the triangle, its edges included, from its origin to before `t_max`; `None` if it does not, or runs along
    /// the triangle's plane.
    #[must_use]
    #[inline]
    pub fn meet(&self, ray: &Shear, t_max: f32) -> Option<Meeting> {
        self.meet_line(ray).filter(|meeting| meeting.t >= 0.0 && meeting.t < t_max)
    }

    /// Where the ray, extended both ways, meets the triangle; `t` is no number or infinite for a line along its plane.
    #[must_use]
    #[inline]
    pub fn meet_line(&self, ray: &Shear) -> Option<Meeting> {
        let along = |k: usize| self.axes[ray.order[k]] - ray.origin[k];
        let z = along(2);
        let (x, y) = (along(0) - ray.factors[0] * z, along(1) - ray.factors[1] * z);
        // Edge functions of the edges opposite corners 2, 0 and 1. Rounding keeps the order of the two products, so that only equal
        // ones can hide a sign.
        let mut edges = y * x.yzxw() - y.yzxw() * x;
        if MIXED >> (edges.is_negative_bitmask() & EDGES) & 1 != 0 {
            if edges.cmpeq(Vec4::ZERO).bitmask() & EDGES == 0 {
                return None;
            }
            edges = exact_edges(x, y);
            if edges.cmplt(Vec4::ZERO).bitmask() & EDGES != 0 && edges.cmpgt(Vec4::ZERO).bitmask() & EDGES != 0 {
                return None;
            }
        }
        let inverse = (edges.x + edges.y + edges.z).recip();
        // Infinite or no number where the sum is 0.
        let t = (edges.y * z.x + edges.z * z.y + edges.x * z.z) * (ray.factors[2].x * inverse);
        Some(Meeting { t, u: edges.z * inverse, v: edges.x * inverse })
    }
}

/// The edge functions in double precision, in which products of f32 are exact.
#[cold]
fn exact_edges(x: Vec4, y: Vec4) -> Vec4 {
    let (x, y) = (x.as_dvec4(), y.as_dvec4());
    (y * x.yzxw() - y.yzxw() * x).as_vec4()
}

impl Shear {
    /// The space of a ray.
    #[must_use]
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        let size = direction.abs();
        let (order, origin, direction) = if size.x > size.y && size.x > size.z {
            ([1, 2, 0], origin.yzx(), direction.yzx())
        } else if size.y > size.z {
            ([2, 0, 1], origin.zxy(), direction.zxy())
        } else {
            ([0, 1, 2], origin, direction)
        };
        let scale = direction.z.recip();
        let factors = [direction.x * scale, direction.y * scale, scale].map(Vec4::splat);
        Self { order, origin: origin.to_array().map(Vec4::splat), factors }
    }
}
