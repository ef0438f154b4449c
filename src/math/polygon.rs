//! Light of a uniformly bright polygon at a point, in closed form \[Lambert\].
//!
//! A polygon of radiance 1 seen from the origin sends the light vector D = ½ Σ Θ Γ, where Θ is the angle that an edge
//! subtends and Γ the unit normal of the plane through edge and origin; n·D is the irradiance on a surface of normal n
//! if the polygon lies above its horizon, else the polygon is clipped there first.
//!
//! The terms of the sum are of the order of an edge's angle ε, the sum of the order ε². Corners are therefore kept relative
//! to one of them and Γ comes from a × (b − a), so that the relative error is about 1e-16 / ε and not 1e-16 / ε²: no other
//! form is needed for small lights (measured: tests/light/area.rs).

use glam::DVec3;
use smallvec::SmallVec;

/// Corners of a polygon or of a clipped one, on the stack up to a 24-gon.
pub type Corners = SmallVec<[DVec3; 24]>;

/// ½ Θ Γ of the edge from `a` to `a + edge`, as seen from the origin: its part of the light vector for radiance 1, sr;
/// zero where the edge's line passes through it.
///
/// Summed over the edges of a polygon that runs counter-clockwise seen from the origin this points towards it.
#[must_use]
#[inline]
pub fn edge_term(a: DVec3, edge: DVec3) -> DVec3 {
    let normal = edge.cross(a);
    let (cosine, squared_sine) = (a.dot(a + edge), normal.length_squared());
    if cosine > 0.0 && squared_sine < SERIES * cosine * cosine {
        return normal * (0.5 / cosine * arctangent_ratio(squared_sine / (cosine * cosine)));
    }
    let sine = squared_sine.sqrt();
    if sine > 0.0 { normal * (0.5 * sine.atan2(cosine) / sine) } else { DVec3::ZERO }
}

/// Square of the tangent of an edge's angle up to which a series is as exact as `atan2`, and several times as fast.
const SERIES: f64 = 0.01;

/// atan(z) / z for z² ≤ [`SERIES`].
fn arctangent_ratio(z2: f64) -> f64 {
    const ODD: [f64; 8] = [1.0, 3.0, 5.0, 7.0, 9.0, 11.0, 13.0, 15.0];
    ODD.iter().rev().fold(0.0, |sum, odd| odd.recip() - z2 * sum)
}

/// The part of a convex polygon `base + relative[i]` where `normal · v ≥ 0`, corners relative to `base` again; empty where
/// it has no inside.
#[must_use]
pub fn clip(base: DVec3, relative: &[DVec3], normal: DVec3) -> Corners {
    let offset = normal.dot(base);
    let height = |r: DVec3| offset + normal.dot(r);
    let mut kept = Corners::new();
    for (a, b) in edges(relative) {
        let (ha, hb) = (height(a), height(b));
        if ha >= 0.0 {
            kept.push(a);
        }
        if (ha > 0.0 && hb < 0.0) || (ha < 0.0 && hb > 0.0) {
            kept.push(a + (b - a) * (ha / (ha - hb)));
        }
    }
    kept
}

/// Consecutive pairs of corners, the last with the first.
pub fn edges(corners: &[DVec3]) -> impl Iterator<Item = (DVec3, DVec3)> {
    corners.iter().copied().zip(corners.iter().copied().cycle().skip(1))
}
