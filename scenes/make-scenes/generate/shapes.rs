//! Solids and surfaces that the scenes are built of.

use super::obj::{Corner, Obj};
use super::paint::Paint;
use glam::{DVec2, DVec3};
use std::f64::consts::TAU;

/// Faces of a box, for the mask of [`block`].
pub mod side {
    /// All but the bottom, for what stands on something.
    pub const NO_BOTTOM: u8 = 0b11_1011;
    /// All six.
    pub const ALL: u8 = 0b11_1111;
    /// −x, +x, −y, +y, −z, +z.
    pub const BIT: [u8; 6] = [1, 2, 4, 8, 16, 32];
}

/// `a` to `b` in equal steps of about `cell`.
#[must_use]
pub fn steps(a: f64, b: f64, cell: f64) -> Vec<f64> {
    let count = ((b - a).abs() / cell - 1e-6).ceil().max(1.0) as usize;
    linspace(a, b, count)
}

/// `a` to `b` in `count` equal steps.
#[must_use]
pub fn linspace(a: f64, b: f64, count: usize) -> Vec<f64> {
    (0..=count).map(|i| a + (b - a) * i as f64 / count as f64).collect()
}

/// Steps through several stations in turn, each reached exactly.
#[must_use]
pub fn stations(points: &[f64], cell: f64) -> Vec<f64> {
    let mut all = vec![points[0]];
    for pair in points.windows(2) {
        all.extend_from_slice(&steps(pair[0], pair[1], cell)[1..]);
    }
    all
}

/// A flat lattice through `origin` + u·`axis_u` + v·`axis_v`, facing `axis_u` × `axis_v`; cells whose centre `keep` refuses are left out.
pub fn lattice(
    obj: &mut Obj,
    paint: &'static Paint,
    [origin, axis_u, axis_v]: [DVec3; 3],
    [us, vs]: [&[f64]; 2],
    keep: impl Fn(f64, f64) -> bool,
) {
    for u in us.windows(2) {
        for v in vs.windows(2) {
            if keep((u[0] + u[1]) * 0.5, (v[0] + v[1]) * 0.5) {
                let at = |u: f64, v: f64| origin + axis_u * u + axis_v * v;
                obj.flat(paint, &[at(u[0], v[0]), at(u[1], v[0]), at(u[1], v[1]), at(u[0], v[1])]);
            }
        }
    }
}

/// An axis-aligned box from `lo` to `hi`, faces by `mask`, in cells of about `cell`.
pub fn block(obj: &mut Obj, paint: &'static Paint, [lo, hi]: [DVec3; 2], cell: f64, mask: u8) {
    for axis in 0..3 {
        let (iu, iv) = ((axis + 1) % 3, (axis + 2) % 3);
        for (high, bit) in [(false, side::BIT[axis * 2]), (true, side::BIT[axis * 2 + 1])] {
            if mask & bit == 0 {
                continue;
            }
            let mut origin = DVec3::ZERO;
            origin[axis] = if high { hi[axis] } else { lo[axis] };
            let (mut u, mut v) = (DVec3::ZERO, DVec3::ZERO);
            (u[iu], v[iv]) = (1.0, 1.0);
            let (us, vs) = (steps(lo[iu], hi[iu], cell), steps(lo[iv], hi[iv], cell));
            if high {
                lattice(obj, paint, [origin, u, v], [&us, &vs], |_, _| true);
            } else {
                lattice(obj, paint, [origin, v, u], [&vs, &us], |_, _| true);
            }
        }
    }
}

/// A box by its centre at the bottom and its size, standing on something.
pub fn standing(obj: &mut Obj, paint: &'static Paint, foot: DVec3, size: DVec3, cell: f64) {
    let half = DVec3::new(size.x * 0.5, 0.0, size.z * 0.5);
    block(obj, paint, [foot - half, foot + half + DVec3::Y * size.y], cell, side::NO_BOTTOM);
}

/// A smooth surface p(u, v) facing ∂u × ∂v, with normals by differences; `repeats` of the texture a unit of (u, v).
pub fn surface(
    obj: &mut Obj,
    paint: &'static Paint,
    [us, vs]: [&[f64]; 2],
    repeats: DVec2,
    p: impl Fn(f64, f64) -> DVec3,
) {
    let normal = |u: f64, v: f64| {
        const H: f64 = 1e-4;
        (p(u + H, v) - p(u - H, v)).cross(p(u, v + H) - p(u, v - H))
    };
    let middle = (vs[0] + vs[vs.len() - 1]) * 0.5;
    let corner = |u: f64, v: f64| {
        // A pole has no normal of its own: take it a little way in.
        let own = normal(u, v);
        let inner = normal(u, v + (middle - v) * 1e-2);
        let n = if own.length_squared() < inner.length_squared() * 1e-4 { inner } else { own };
        Corner { p: p(u, v), n, uv: DVec2::new(u, v) * repeats }
    };
    for u in us.windows(2) {
        for v in vs.windows(2) {
            obj.face(paint, &[corner(u[0], v[0]), corner(u[1], v[0]), corner(u[1], v[1]), corner(u[0], v[1])]);
        }
    }
}

/// A solid of revolution about the local y axis: `profile` holds (radius, height) upwards; corners under 50° are smooth.
pub fn lathe(obj: &mut Obj, paint: &'static Paint, profile: &[(f64, f64)], segments: usize) {
    let slopes: Vec<DVec2> =
        profile.windows(2).map(|w| DVec2::new(w[1].1 - w[0].1, w[0].0 - w[1].0).normalize_or(DVec2::Y)).collect();
    let smooth = |own: usize, other: Option<usize>| match other.and_then(|o| slopes.get(o)) {
        Some(next) if next.dot(slopes[own]) > 0.64 => slopes[own] + *next,
        _ => slopes[own],
    };
    let around = TAU * profile.iter().map(|p| p.0).fold(0.0, f64::max);
    let repeats = (around / paint.tile).round().max(1.0);
    for (i, pair) in profile.windows(2).enumerate() {
        let ends = [(pair[0], smooth(i, i.checked_sub(1))), (pair[1], smooth(i, Some(i + 1)))];
        for k in 0..segments {
            let corner = |step: usize, end: usize| {
                let turn = step as f64 / segments as f64;
                let (s, c) = (turn * TAU).sin_cos();
                let ((r, y), n) = ends[end];
                let uv = DVec2::new(turn * repeats, y / paint.tile);
                Corner { p: DVec3::new(r * c, y, -r * s), n: DVec3::new(n.x * c, n.y, -n.x * s), uv }
            };
            obj.face(paint, &[corner(k, 0), corner(k + 1, 0), corner(k + 1, 1), corner(k, 1)]);
        }
    }
}

/// A sphere at the local origin, `around` × `rows` faces.
pub fn sphere(obj: &mut Obj, paint: &'static Paint, radius: f64, around: usize, rows: usize) {
    let profile: Vec<(f64, f64)> = (0..=rows)
        .map(|i| {
            let (s, c) = (std::f64::consts::PI * i as f64 / rows as f64).sin_cos();
            (if i == 0 || i == rows { 0.0 } else { radius * s }, -radius * c)
        })
        .collect();
    lathe(obj, paint, &profile, around);
}

/// A round bar along `path`; open ends are capped.
pub fn tube(obj: &mut Obj, paint: &'static Paint, path: &[DVec3], radius: f64, segments: usize, closed: bool) {
    let count = path.len();
    let at = |i: isize| {
        let i = if closed { i.rem_euclid(count as isize) } else { i.clamp(0, count as isize - 1) };
        path[i as usize]
    };
    let mut a = DVec3::ZERO;
    let mut rings: Vec<Vec<Corner>> = Vec::with_capacity(count + 1);
    let mut along = 0.0;
    for i in 0..count {
        let tangent = (at(i as isize + 1) - at(i as isize - 1)).normalize_or(DVec3::Y);
        let carried = a - tangent * a.dot(tangent);
        a = if carried.length_squared() > 1e-6 { carried.normalize() } else { tangent.any_orthonormal_vector() };
        let b = tangent.cross(a);
        along += if i > 0 { path[i].distance(path[i - 1]) } else { 0.0 };
        rings.push(ring(path[i], [a, b], radius, segments, along / paint.tile));
    }
    if closed {
        rings.push(rings[0].clone());
    }
    for pair in rings.windows(2) {
        for k in 0..segments {
            obj.face(paint, &[pair[0][k], pair[0][k + 1], pair[1][k + 1], pair[1][k]]);
        }
    }
    if !closed {
        let cap = |ring: &[Corner]| ring[..segments].iter().map(|c| c.p).collect::<Vec<_>>();
        let (mut first, last) = (cap(&rings[0]), cap(&rings[count - 1]));
        first.reverse();
        obj.flat(paint, &first);
        obj.flat(paint, &last);
    }
}

fn ring(centre: DVec3, [a, b]: [DVec3; 2], radius: f64, segments: usize, v: f64) -> Vec<Corner> {
    (0..=segments)
        .map(|k| {
            let turn = k as f64 / segments as f64;
            let (s, c) = (turn * TAU).sin_cos();
            let n = a * c + b * s;
            Corner { p: centre + n * radius, n, uv: DVec2::new(turn, v) }
        })
        .collect()
}

/// A straight round bar.
pub fn rod(obj: &mut Obj, paint: &'static Paint, [from, to]: [DVec3; 2], radius: f64, segments: usize) {
    tube(obj, paint, &[from, to], radius, segments, false);
}

/// A closed ring about `axis` through the local origin.
pub fn hoop(
    obj: &mut Obj,
    paint: &'static Paint,
    axis: DVec3,
    radius: f64,
    thickness: f64,
    [around, across]: [usize; 2],
) {
    let a = axis.normalize().any_orthonormal_vector();
    let b = axis.normalize().cross(a);
    let path: Vec<DVec3> = (0..around)
        .map(|i| {
            let (s, c) = (TAU * i as f64 / around as f64).sin_cos();
            (a * c + b * s) * radius
        })
        .collect();
    tube(obj, paint, &path, thickness, across, true);
}
