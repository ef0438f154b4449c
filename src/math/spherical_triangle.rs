//! Solid angle of a triangle seen from the origin, and uniform directions in it.

use glam::DVec3;

/// Solid angle of the triangle `corner + s·edges[0] + t·edges[1]` seen from the origin, sr, after \[vOS83\]; unsigned.
#[must_use]
pub fn solid_angle(corner: DVec3, edges: [DVec3; 2]) -> f64 {
    let (a, b, c) = (corner, corner + edges[0], corner + edges[1]);
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    // The volume from the edges, not from the corners: small far triangles keep their digits.
    let volume = a.dot(edges[0].cross(edges[1])).abs();
    2.0 * volume.atan2(la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb)
}

/// Smallest solid angle, and smallest distance from a full hemisphere, for which [`direction`] is trusted, sr.
const TRUSTED: f64 = 1e-6;

/// A direction (not normalised) uniform in the solid angle `omega` of the triangle \[Arvo95\]; strata of `u` ∈ [0, 1)² stay
/// strata. `None` where the triangle is too small or too thin: then its points are as good as equally bright.
#[must_use]
pub fn direction(corner: DVec3, edges: [DVec3; 2], omega: f64, u: [f64; 2]) -> Option<DVec3> {
    if !(TRUSTED..=std::f64::consts::TAU - TRUSTED).contains(&omega) {
        return None;
    }
    let [a, b, c] = [corner, corner + edges[0], corner + edges[1]].map(DVec3::normalize);
    let (n_ab, n_ac) = (a.cross(b), a.cross(c));
    // Angle at a, between the planes ab and ac, and cosine of the side ab.
    let (sin_a, cos_a) = (n_ab.cross(n_ac).length(), n_ab.dot(n_ac));
    let norm = (sin_a * sin_a + cos_a * cos_a).sqrt();
    let (sin_a, cos_a) = (sin_a / norm, cos_a / norm);
    let cos_ab = a.dot(b);
    // The sub-triangle a, b, c' of the wanted area, its corner c' on the side ac. With φ = area − angle a:
    let area = u[0] * omega;
    let (sin_area, cos_area) = area.sin_cos();
    let (s, t) = (sin_area * cos_a - cos_area * sin_a, cos_area * cos_a + sin_area * sin_a);
    let (p, q) = (t - cos_a, s + sin_a * cos_ab);
    let above = (q * t - p * s) * cos_a - q;
    let below = (q * s + p * t) * sin_a;
    let cosine = (above / below).clamp(-1.0, 1.0);
    let towards_c = (c - a * a.dot(c)).try_normalize()?;
    let end = if below == 0.0 { a } else { a * cosine + towards_c * (1.0 - cosine * cosine).sqrt() };
    // Between b and c' by height over b.
    let cos_along = 1.0 - u[1] * (1.0 - end.dot(b));
    let towards_end = (end - b * end.dot(b)).try_normalize()?;
    let found = b * cos_along + towards_end * (1.0 - cos_along * cos_along).max(0.0).sqrt();
    found.is_finite().then_some(found)
}

/// Where the line from the origin along `direction` meets the triangle's plane: barycentrics of the ends of its edges, and
/// the way there in lengths of `direction`. `None` for a line within the plane.
#[must_use]
pub fn meet(corner: DVec3, edges: [DVec3; 2], direction: DVec3) -> Option<([f64; 2], f64)> {
    let p = direction.cross(edges[1]);
    let determinant = edges[0].dot(p);
    let q = -corner.cross(edges[0]);
    let (s, t) = (-corner.dot(p) / determinant, direction.dot(q) / determinant);
    (s.is_finite() && t.is_finite()).then(|| ([s, t], edges[1].dot(q) / determinant))
}
