//! Intersection of a ray with triangles that leaves no gap to the triangle beside them \[Woop13\], four at a time.
//!
//! Corners are moved into a space in which the ray is the z axis: each by itself, so that triangles that share a corner agree on where
//! it is. There the sign of an edge function is exact, and an edge has opposite signs in the two triangles beside it; so a ray through
//! the edge hits one of them at least.

use glam::{DVec2, Vec3};
use wide::f32x4;

/// Triangles side by side.
pub const LANES: usize = 4;
/// The bits of all lanes in a mask.
const ALL: u32 = (1 << LANES) - 1;

/// The corners of [`LANES`] triangles, coordinate by coordinate.
#[derive(Clone, Copy, Debug)]
pub struct Corners {
    /// Along x, y and z, of the corners 0, 1 and 2.
    axes: [[f32x4; 3]; 3],
}

/// A ray that becomes the z axis.
#[derive(Clone, Copy, Debug)]
pub struct Shear {
    /// The axes that become x, y and z, in turn: z is the one along which the direction is longest.
    order: [usize; 3],
    /// Origin along x, y and z.
    origin: [f32x4; 3],
    /// What x and y are sheared by, and z scaled.
    factors: [f32x4; 3],
    /// All lanes where the ray goes down the z axis.
    downwards: u32,
}

/// Where a ray, extended both ways, meets the planes of triangles.
#[derive(Clone, Copy, Debug)]
pub struct Meetings {
    t: f32x4,
    u: f32x4,
    v: f32x4,
    /// The lanes within whose triangle that is, edges included.
    inside: u32,
    /// The lanes whose triangle is seen from the back.
    back: u32,
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
    /// Whether the ray comes from the back (clockwise) side.
    pub back: bool,
}

impl Corners {
    /// Of up to [`LANES`] triangles; what is left of the lanes is never hit.
    #[must_use]
    pub fn new(triangles: &[[Vec3; 3]]) -> Self {
        let coordinate =
            |lane: usize, corner: usize, axis: usize| triangles.get(lane).map_or(f32::NAN, |t| t[corner][axis]);
        let lanes = |corner, axis| f32x4::new([0, 1, 2, 3].map(|lane| coordinate(lane, corner, axis)));
        Self { axes: [0, 1, 2].map(|axis| [0, 1, 2].map(|corner| lanes(corner, axis))) }
    }

    /// The corners of the triangle in a lane.
    #[must_use]
    #[inline]
    pub fn of_lane(&self, lane: usize) -> [Vec3; 3] {
        let along = |axis: usize, corner: usize| self.axes[axis][corner].to_array()[lane % LANES];
        let at = |corner| Vec3::new(along(0, corner), along(1, corner), along(2, corner));
        [at(0), at(1), at(2)]
    }

    /// Where the ray, extended both ways, meets the triangles.
    #[must_use]
    #[inline(always)]
    pub fn meet(&self, ray: &Shear) -> Meetings {
        // Arrays are written out: their `map` stays a call of its own, here and below.
        let along = |k: usize| {
            let ([a, b, c], origin) = (self.axes[ray.order[k]], ray.origin[k]);
            [a - origin, b - origin, c - origin]
        };
        let (mut x, mut y, z) = (along(0), along(1), along(2));
        for corner in 0..3 {
            x[corner] -= ray.factors[0] * z[corner];
            y[corner] -= ray.factors[1] * z[corner];
        }
        // Edge functions of the edges opposite corners 2, 0 and 1. Rounding keeps the order of the two products, so that only equal
        // ones can hide a sign.
        let edge = |a: usize, b: usize| y[a] * x[b] - y[b] * x[a];
        let mut edges = [edge(0, 1), edge(1, 2), edge(2, 0)];
        let mut mixed = mixed_signs(&edges);
        let is_zero = |edge: f32x4| edge.simd_eq(f32x4::ZERO);
        let hidden = (is_zero(edges[0]) | is_zero(edges[1]) | is_zero(edges[2])).to_bitmask() & mixed;
        if hidden != 0 {
            (edges, mixed) = resolve(edges, (x, y), (hidden, mixed));
        }
        let sum = edges[0] + edges[1] + edges[2];
        let inverse = f32x4::ONE / sum;
        Meetings {
            // Infinite or no number where the sum is 0.
            t: (edges[1] * z[0] + edges[2] * z[1] + edges[0] * z[2]) * (ray.factors[2] * inverse),
            u: edges[2] * inverse,
            v: edges[0] * inverse,
            inside: !mixed & ALL,
            back: sum.to_bitmask() ^ ray.downwards,
        }
    }
}

/// The lanes with edge functions of both signs, −0 being negative.
#[inline(always)]
fn mixed_signs(edges: &[f32x4; 3]) -> u32 {
    let [a, b, c] = [edges[0].to_bitmask(), edges[1].to_bitmask(), edges[2].to_bitmask()];
    (a | b | c) & !(a & b & c)
}

/// Finds edge functions in double precision, in which products of f32 are exact, in the lanes of `hidden`; returns them with those lanes
/// of `mixed` in which signs still differ. All by value, so that nothing has an address where this is not called.
#[cold]
#[inline(never)]
fn resolve(edges: [f32x4; 3], (x, y): ([f32x4; 3], [f32x4; 3]), (hidden, mut mixed): (u32, u32)) -> ([f32x4; 3], u32) {
    let (mut edges, x, y) = (edges.map(f32x4::to_array), x.map(f32x4::to_array), y.map(f32x4::to_array));
    for lane in (0..LANES).filter(|lane| hidden >> lane & 1 != 0) {
        let corner = |k: usize| DVec2::new(x[k][lane].into(), y[k][lane].into());
        let exact = [(0, 1), (1, 2), (2, 0)].map(|(a, b)| corner(b).perp_dot(corner(a)) as f32);
        for (edge, exact) in edges.iter_mut().zip(exact) {
            edge[lane] = exact;
        }
        if exact.iter().all(|&edge| edge >= 0.0) || exact.iter().all(|&edge| edge <= 0.0) {
            mixed &= !(1 << lane);
        }
    }
    (edges.map(f32x4::new), mixed)
}

impl Meetings {
    /// The lanes whose triangle is met, its edges included.
    #[must_use]
    #[inline(always)]
    pub const fn inside(&self) -> u32 {
        self.inside
    }

    /// Those of them that are met from the ray's origin to before `t_max`.
    #[must_use]
    #[inline(always)]
    pub fn within(&self, t_max: f32) -> u32 {
        let within = self.t.simd_ge(f32x4::ZERO) & self.t.simd_lt(f32x4::splat(t_max));
        within.to_bitmask() & self.inside
    }

    /// That of a lane.
    #[must_use]
    #[inline(always)]
    pub fn of_lane(&self, lane: usize) -> Meeting {
        let of = |lanes: f32x4| lanes.to_array()[lane % LANES];
        Meeting { t: of(self.t), u: of(self.u), v: of(self.v), back: self.back >> lane & 1 != 0 }
    }
}

impl Shear {
    /// The space of a ray.
    #[must_use]
    #[inline(always)]
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        let size = direction.abs();
        let order = if size.x > size.y && size.x > size.z {
            [1, 2, 0]
        } else if size.y > size.z {
            [2, 0, 1]
        } else {
            [0, 1, 2]
        };
        let [x, y, z] = order.map(|axis| direction[axis]);
        let scale = z.recip();
        Self {
            order,
            origin: order.map(|axis| f32x4::splat(origin[axis])),
            factors: [x * scale, y * scale, scale].map(f32x4::splat),
            downwards: if z < 0.0 { ALL } else { 0 },
        }
    }
}
