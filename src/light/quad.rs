//! Lamps that are one parallelogram, sampled for one surface: about in proportion to the light that it gets from each point.
//!
//! What a point at `offset` sends is (n·offset) h / |offset|⁴, h the height over the lamp's plane. Computed at the four corners
//! and bilinear between, that is a density whose points cost two square roots and whose inverse is direct. It takes the
//! surface's own cosine into account, as solid angles do not.

use super::area::AreaSource;
use super::facets::Outlines;
use super::lights::Arrival;
use crate::scene::Scene;
use glam::{DVec3, Vec3, Vec4};

/// A parallelogram, prepared.
#[derive(Clone, Debug)]
pub struct QuadLight {
    /// First corner, scene units.
    corner: Vec3,
    /// From there to the corners beside it.
    edges: [Vec3; 2],
    /// What offsets from the first corner are multiplied by for their shares of the edges.
    duals: [Vec3; 2],
    /// x, y and z of the corners (0, 0), (1, 0), (0, 1), (1, 1).
    corners: [Vec4; 3],
    /// Unit normal of the front.
    normal: Vec3,
    area: f32,
    middle: Vec3,
    /// Square of the distance from the middle below which corners say too little about what is between.
    near_squared: f32,
}

/// Distance in radii below which that is so. Measured on the modern hall: at 0.8 places over the middle of a lamp, brighter than
/// its corners tell, make twenty times the variance; from 1.3 on it is no more than that of points uniform in solid angle.
const NEAR: f32 = 1.3;
/// Rounding of single-precision coordinates, relative to the largest.
const ROUNDING: f64 = 2.5e-7;

/// What a surface gets from the corners of a panel, in any unit.
struct FacingQuad<'a> {
    panel: &'a QuadLight,
    /// From the surface to the first corner.
    base: Vec3,
    /// Distance from the panel's plane.
    height: f32,
    weights: [f32; 4],
    /// Mean of the weights.
    mean: f32,
}

impl QuadLight {
    /// The parallelogram that a source consists of; `None` for any other shape.
    #[must_use]
    pub fn new(outlines: &Outlines) -> Option<Self> {
        let ([polygon], [_, a, c, b]) = (&outlines.polygons[..], &outlines.corners[..]) else { return None };
        let bounds = (polygon.base.abs() + c.abs()).max_element();
        if (*a + *b - *c).abs().max_element() > ROUNDING * bounds {
            return None;
        }
        let cross = a.cross(*b);
        let squared = cross.length_squared();
        let duals = [b.cross(cross) / squared, cross.cross(*a) / squared].map(|d| d.as_vec3());
        let corners = [DVec3::ZERO, *a, *b, *c].map(|p| (polygon.base + p).as_vec3());
        let radius = ((*a - *b).length().max(c.length()) * 0.5) as f32;
        Some(Self {
            corner: corners[0],
            edges: [a.as_vec3(), b.as_vec3()],
            duals,
            corners: [0, 1, 2].map(|axis| Vec4::from_array(corners.map(|p| p[axis]))),
            normal: polygon.normal.as_vec3(),
            area: cross.length() as f32,
            middle: (polygon.base + *c * 0.5).as_vec3(),
            near_squared: (NEAR * radius).powi(2),
        })
    }

    /// `None` where the surface gets nothing.
    fn seen(&self, x: Vec3, normal: Vec3, both_sides: bool) -> Option<FacingQuad<'_>> {
        let base = self.corner - x;
        let height = -self.normal.dot(base);
        let height = if both_sides { height.abs() } else { height };
        let [dx, dy, dz] = [0, 1, 2].map(|axis| self.corners[axis] - x[axis]);
        let cosines = (dx * normal.x + dy * normal.y + dz * normal.z).max(Vec4::ZERO);
        // In units of the distance, so that no power of it leaves the range of numbers.
        let ratio = self.near_squared / (dx * dx + dy * dy + dz * dz);
        let weights = cosines * ratio * ratio;
        let mean = weights.element_sum() * 0.25;
        (height > 0.0 && mean > 0.0).then(|| FacingQuad {
            panel: self,
            base,
            height,
            weights: weights.to_array(),
            mean,
        })
    }
}

/// Where in [0, 1] a density that goes from `a` to `b` has the share `u` of its points before it.
fn linear(u: f32, a: f32, b: f32) -> f32 {
    let root = (a * a + (b * b - a * a) * u).max(0.0).sqrt();
    (u * (a + b) / (a + root).max(f32::MIN_POSITIVE)).min(1.0)
}

impl FacingQuad<'_> {
    /// Shares of the edges of the point chosen by `u`; strata stay strata.
    fn point(&self, [u, v]: [f32; 2]) -> [f32; 2] {
        let [a, b, c, d] = self.weights;
        let t = linear(v, a + b, c + d);
        [linear(u, a + (c - a) * t, b + (d - b) * t), t]
    }

    /// Solid angle that a point of these shares stands for, and its offset and distance; `None` where none is chosen.
    fn measure(&self, [s, t]: [f32; 2]) -> Option<(f32, Vec3, f32)> {
        let [a, b, c, d] = self.weights;
        let (left, right) = (a + (c - a) * t, b + (d - b) * t);
        let weight = left + (right - left) * s;
        let [e, f] = self.panel.edges;
        let offset = self.base + e * s + f * t;
        let squared = offset.length_squared();
        let distance = squared.sqrt();
        let measure = self.panel.area * self.height * self.mean / (squared * distance * weight);
        (weight > 0.0).then_some((measure, offset, distance))
    }
}

impl AreaSource {
    /// The light that arrives at a surface at `x` of unit `normal` from the point of the source chosen by `u` ∈ [0, 1)²;
    /// `None` where no light does. The mean of `facing · max(0, n·direction)` over u is the unoccluded irradiance, as with
    /// [`super::lights::Sampler::sample`]; points that send much are chosen more often where that is cheap. Strata of u are kept.
    #[must_use]
    pub fn sample_for(&self, scene: &Scene, (x, normal): (Vec3, Vec3), u: [f32; 2]) -> Option<Arrival> {
        let Some(panel) = self.panel_from(x) else { return self.at(x).sample(scene, u) };
        let seen = panel.seen(x, normal, self.both_sides)?;
        let (measure, offset, distance) = seen.measure(seen.point(u))?;
        let facing = self.mean_radiance() * measure;
        Some(Arrival { direction: offset / distance, distance, facing, measure })
    }

    /// Density with which [`Self::sample_for`] takes the direction of the point of the source that lies `offset` from x, sr⁻¹;
    /// 0 where it never does.
    #[must_use]
    pub fn density_for(&self, (x, normal): (Vec3, Vec3), offset: Vec3) -> f32 {
        let Some(panel) = self.panel_from(x) else { return self.at(x).density(offset) };
        let measure = panel.seen(x, normal, self.both_sides).and_then(|seen| {
            let shares = panel.duals.map(|dual| dual.dot(offset - seen.base).clamp(0.0, 1.0));
            seen.measure(shares)
        });
        measure.map_or(0.0, |(measure, ..)| measure.recip())
    }

    fn panel_from(&self, x: Vec3) -> Option<&QuadLight> {
        self.panel.as_deref().filter(|panel| panel.middle.distance_squared(x) > panel.near_squared)
    }
}
