//! Facets of an area light by place and direction, for lights of too many to look at each: a cluster is weighed as a
//! whole.

use super::facets::Facet;
use glam::DVec3;
use std::ops::Range;

/// Facets up to which the solid angle of each is computed (a closed surface shows half of them).
const MAX_FACETS: usize = 128;
/// Largest number of clusters.
const CLUSTERS: usize = 64;

/// Neighbouring facets, weighed together.
#[derive(Clone, Debug)]
pub struct Cluster {
    /// In the source's facets.
    pub(super) facets: Range<usize>,
    pub(super) area: f64,
    pub(super) centre: DVec3,
    pub(super) radius: f64,
    /// Axis of the cone of the normals, and cosine and sine of its half angle.
    axis: DVec3,
    spread: [f64; 2],
}

impl Cluster {
    /// Groups facets, bringing those of a group together; none where each can be looked at.
    #[must_use]
    pub fn build(facets: &mut [Facet]) -> Vec<Self> {
        let mut clusters = Vec::new();
        if facets.len() > MAX_FACETS {
            split(facets, 0, CLUSTERS, &mut clusters);
        }
        clusters
    }

    fn new(facets: &[Facet], first: usize) -> Self {
        let corners = || facets.iter().flat_map(|f| [f.corner, f.corner + f.edges[0], f.corner + f.edges[1]]);
        let lo = corners().fold(DVec3::INFINITY, DVec3::min);
        let hi = corners().fold(DVec3::NEG_INFINITY, DVec3::max);
        let centre = (lo + hi) * 0.5;
        let axis = facets.iter().map(|f| f.normal * f.area).sum::<DVec3>().normalize_or(facets[0].normal);
        Self {
            facets: first..first + facets.len(),
            area: facets.iter().map(|f| f.area).sum(),
            centre,
            radius: corners().map(|p| p.distance(centre)).fold(0.0, f64::max),
            axis,
            spread: {
                let (sine, cosine) = facets.iter().map(|f| f.normal.angle_between(axis)).fold(0.0, f64::max).sin_cos();
                [cosine, sine]
            },
        }
    }

    /// Rough size of the light that the cluster can send to `x`; 0 only where it surely sends none.
    pub(super) fn weight(&self, x: DVec3, both_sides: bool) -> f64 {
        let offset = x - self.centre;
        let distance = offset.length();
        if distance <= self.radius {
            return self.area / (self.radius * self.radius);
        }
        let cosine = (offset.dot(self.axis) / distance).clamp(-1.0, 1.0);
        let cosine = if both_sides { cosine.abs() } else { cosine };
        // The cone of normals widened by the cluster's own half angle, all by sums of angles: there are many clusters.
        let width = self.radius / distance;
        let (cos_width, [cos_spread, sin_spread]) = ((1.0 - width * width).sqrt(), self.spread);
        let cos_cone = cos_spread * cos_width - sin_spread * width;
        let sin_cone = sin_spread * cos_width + cos_spread * width;
        // Largest cosine that any normal can make with a direction to x, rounding on the safe side.
        let largest = if sin_cone <= 0.0 || cosine >= cos_cone {
            1.0
        } else {
            (cosine * cos_cone + (1.0 - cosine * cosine).sqrt() * sin_cone + 1e-6).min(1.0)
        };
        self.area * largest.max(0.0) / (distance * distance)
    }
}

/// Halves the facets at the median along the longest side of their bounds until there are `parts` groups.
fn split(facets: &mut [Facet], first: usize, parts: usize, out: &mut Vec<Cluster>) {
    if parts <= 1 || facets.len() <= 1 {
        out.push(Cluster::new(facets, first));
        return;
    }
    let middle_of = |f: &Facet| f.corner + (f.edges[0] + f.edges[1]) / 3.0;
    let lo = facets.iter().map(middle_of).fold(DVec3::INFINITY, DVec3::min);
    let hi = facets.iter().map(middle_of).fold(DVec3::NEG_INFINITY, DVec3::max);
    let axis = (hi - lo).max_position();
    let half = facets.len() / 2;
    facets.select_nth_unstable_by(half, |a, b| middle_of(a)[axis].total_cmp(&middle_of(b)[axis]));
    let (left, right) = facets.split_at_mut(half);
    split(left, first, parts / 2, out);
    split(right, first + half, parts - parts / 2, out);
}
