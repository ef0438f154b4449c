//! The Phong lobe integrated over a uniformly bright polygon.
//!
//! With w the lobe's axis, n the surface normal and c = w·ω, Stokes' theorem on the sphere turns
//! ∫ (s+2)/(2π) c^s (n·ω) dω over a polygon above the horizon and before w (c ≥ 0) into integrals along its edges,
//!
//! 1/(2π) Σ ∫ \[ (w·n)(w·Γ)(1 − c^s)/(1 − c²) + (n·Γ) c^s \] dψ,
//!
//! Γ the edge's unit normal. It is \[Arvo]'s double-axis moment for any real exponent: his finite series for whole ones is
//! (1 − c^s)/(1 − c²) written out. The integrand is smooth along an edge, with a scale of 1/√s at the point nearest to w:
//! Gauss–Legendre panels in t, ψ = sinh(t)/√(s+1), better than 1e-3 with five nodes a panel (tests/light/area.rs).

use super::polygon::{clip, edges};
use glam::DVec3;

/// Nodes and weights of Gauss–Legendre quadrature on [−1, 1].
const GAUSS: [(f64, f64); 5] = [
    (-0.906_179_845_938_664, 0.236_926_885_056_189),
    (-0.538_469_310_105_683, 0.478_628_670_499_366),
    (0.0, 0.568_888_888_888_889),
    (0.538_469_310_105_683, 0.478_628_670_499_366),
    (0.906_179_845_938_664, 0.236_926_885_056_189),
];
/// Longest panel in t.
const PANEL: f64 = 2.5;

/// A surface's lobe.
#[derive(Clone, Copy, Debug)]
pub struct Lobe {
    /// Unit normal of the surface.
    pub normal: DVec3,
    /// Unit axis: the direction to the eye mirrored at the normal.
    pub axis: DVec3,
    /// Exponent s > 0.
    pub shininess: f64,
}

impl Lobe {
    /// ∫ (s+2)/(2π) max(0, w·ω)^s max(0, n·ω) dω, a number without unit, over the convex polygon `base + relative[i]`
    /// seen from the origin, counter-clockwise (for the other sense: its negative).
    #[must_use]
    pub fn over_polygon(&self, base: DVec3, relative: &[DVec3]) -> f64 {
        let above = clip(base, relative, self.normal);
        let facing = clip(base, &above, self.axis);
        edges(&facing).map(|(a, b)| self.along_edge(base + a, b - a)).sum::<f64>() / std::f64::consts::TAU
    }

    /// The lobe without the cosine, (s+2)/(2π) max(0, c)^s with c = w·ω, sr⁻¹.
    #[must_use]
    pub fn value(&self, cosine: f64) -> f64 {
        (self.shininess + 2.0) / std::f64::consts::TAU * cosine.max(0.0).powf(self.shininess)
    }

    /// A unit direction in proportion to c^s, of density [`Self::density`]; `u` ∈ [0, 1)².
    #[must_use]
    pub fn direction(&self, u: [f64; 2]) -> DVec3 {
        let cosine = (1.0 - u[0]).powf((self.shininess + 1.0).recip());
        let (sin_turn, cos_turn) = (u[1] * std::f64::consts::TAU).sin_cos();
        let (right, up) = self.axis.any_orthonormal_pair();
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        self.axis * cosine + (right * cos_turn + up * sin_turn) * sine
    }

    /// Density of [`Self::direction`], (s+1)/(2π) c^s, sr⁻¹.
    #[must_use]
    pub fn density(&self, cosine: f64) -> f64 {
        self.value(cosine) * (self.shininess + 1.0) / (self.shininess + 2.0)
    }

    /// The integral along the edge from `a` to `a + edge`.
    fn along_edge(&self, a: DVec3, edge: DVec3) -> f64 {
        let Some(gamma) = edge.cross(a).try_normalize() else { return 0.0 };
        let b = a + edge;
        let height = self.axis.dot(gamma);
        // On the edge's great circle: the foot of the axis, and the direction of travel (Γ points left of it).
        let foot = (self.axis - gamma * height).try_normalize().unwrap_or_else(|| gamma.any_orthonormal_vector());
        let forward = foot.cross(gamma);
        let start = a.dot(forward).atan2(a.dot(foot));
        let length = edge.cross(a).length().atan2(a.dot(b));
        let root = (self.shininess + 1.0).sqrt();
        let (from, to) = ((start * root).asinh(), ((start + length) * root).asinh());
        let panels = ((to - from) / PANEL).ceil().max(1.0);
        let half = (to - from) / panels * 0.5;
        let factors = (self.axis.dot(self.normal) * height, gamma.dot(self.normal));
        let mut sum = 0.0;
        for panel in 0..panels as usize {
            let middle = from + half * (2 * panel + 1) as f64;
            for (node, weight) in GAUSS {
                let t = middle + half * node;
                // sinh and its derivative from one exponential.
                let up = t.exp();
                let down = up.recip();
                let psi = 0.5 * (up - down) / root;
                sum += weight * 0.5 * (up + down) / root * self.integrand(psi, height, factors);
            }
        }
        sum * half
    }

    fn integrand(&self, psi: f64, height: f64, (axial, along): (f64, f64)) -> f64 {
        // q = 1 − c² without cancellation near the axis.
        let q = (height * height + (1.0 - height * height) * psi.sin().powi(2)).min(1.0 - f64::EPSILON);
        // 1 − c^s
        let fallen = -(0.5 * self.shininess * (-q).ln_1p()).exp_m1();
        let ratio = if q > 0.0 { fallen / q } else { 0.5 * self.shininess };
        axial * ratio + along * (1.0 - fallen)
    }
}
