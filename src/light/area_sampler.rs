//! Points of an area light as seen from one place: uniform in the solid angle of its triangles, so that no sample outshines
//! the light, or by area in those that look small; by groups of triangles where there are too many to look at each.

use super::area::AreaSource;
use super::facets::{Facet, moved_inside, uniform_barycentrics};
use super::lights::Arrival;
use crate::math::spherical_triangle::{direction, meet, solid_angle};
use crate::scene::Scene;
use glam::{DVec3, Vec3};
use smallvec::SmallVec;
use std::ops::Range;

/// Facets up to which the solid angle of each is computed (a closed surface shows half of them).
const MAX_FACETS: usize = 128;
/// Distance in radii from which a facet is weighed by its middle and sampled by area: unbiased at any distance, and without
/// solid angles. d⁻³ varies by less than ±45 % over it then.
const FAR: f64 = 8.0;
/// Largest number of groups.
const CLUSTERS: usize = 64;

/// Neighbouring facets, weighed together.
#[derive(Clone, Debug)]
pub struct Cluster {
    /// In the source's facets.
    facets: Range<usize>,
    area: f64,
    centre: DVec3,
    radius: f64,
    /// Axis of the cone of the normals, and cosine and sine of its half angle.
    axis: DVec3,
    spread: [f64; 2],
}

/// Sampling of a source from one point.
#[derive(Clone, Debug)]
pub struct Sampler<'a> {
    source: &'a AreaSource,
    pub(super) x: DVec3,
    by: Choose,
    /// Facets with their solid angles, or clusters with their bounds, as running sums.
    choices: SmallVec<[Choice; 8]>,
    total: f64,
}

/// What points are chosen by.
#[derive(Clone, Copy, Debug)]
enum Choose {
    /// Area of the whole source.
    Area,
    /// Solid angle of a facet, then uniformly in it, or by area where it is far.
    SolidAngle,
    /// Bound of a cluster, then area.
    Cluster,
}

#[derive(Clone, Copy, Debug)]
struct Choice {
    index: usize,
    weight: f64,
    /// Whether points of the facet are uniform by area rather than by solid angle.
    by_area: bool,
    /// Sum of the weights up to this one.
    until: f64,
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
    fn weight(&self, x: DVec3, both_sides: bool) -> f64 {
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

impl<'a> Sampler<'a> {
    /// Weighs the source's facets or clusters as seen from `x`.
    #[must_use]
    pub(super) fn new(source: &'a AreaSource, x: Vec3) -> Self {
        let mut sampler =
            Self { source, x: x.as_dvec3(), by: Choose::Area, choices: SmallVec::new(), total: source.facets.area };
        if !source.clusters.is_empty() {
            sampler.weigh_clusters();
        } else if !source.is_far(x) {
            sampler.weigh_facets();
        }
        sampler
    }

    fn weigh_clusters(&mut self) {
        (self.by, self.total) = (Choose::Cluster, 0.0);
        for (index, cluster) in self.source.clusters.iter().enumerate() {
            self.push(index, cluster.weight(self.x, self.source.both_sides), true);
        }
    }

    fn weigh_facets(&mut self) {
        (self.by, self.total) = (Choose::SolidAngle, 0.0);
        for (index, facet) in self.source.facets.list.iter().enumerate() {
            let height = -facet.normal.dot(facet.corner - self.x);
            if height > 0.0 || (height < 0.0 && self.source.both_sides) {
                let (weight, far) = facet_weight(facet, self.x, height.abs());
                self.push(index, weight, far);
            }
        }
    }

    fn push(&mut self, index: usize, weight: f64, by_area: bool) {
        if weight > 0.0 {
            self.total += weight;
            self.choices.push(Choice { index, weight, by_area, until: self.total });
        }
    }

    /// The light that arrives from the point of the source chosen by `u` ∈ [0, 1)²; `None` where that point faces away, or
    /// all do. The mean of `facing · max(0, n·direction)` over u is the unoccluded irradiance. Strata of u are kept.
    #[must_use]
    pub fn sample(&self, scene: &Scene, u: [f32; 2]) -> Option<Arrival> {
        let point = self.point(u.map(f64::from))?;
        Some(self.source.seen(scene, point.facet, point.at, point.offset, point.measure))
    }

    /// The point that [`Self::sample`] takes.
    pub(super) fn point(&self, [u, v]: [f64; 2]) -> Option<Point<'a>> {
        let facets = &self.source.facets;
        if let Choose::Area = self.by {
            return self.of_area(facets.pick(0..facets.list.len(), [u, v])?, self.total);
        }
        let target = u * self.total;
        let position = self.choices.partition_point(|c| c.until <= target);
        let choice = self.choices.get(position.min(self.choices.len().checked_sub(1)?))?;
        let within = (1.0 - (choice.until - target) / choice.weight).clamp(0.0, 1.0);
        if let Choose::SolidAngle = self.by {
            return self.in_facet(choice, [within, v]);
        }
        let cluster = &self.source.clusters[choice.index];
        let found = facets.pick(cluster.facets.clone(), [within, v])?;
        self.of_area(found, cluster.area * self.total / choice.weight)
    }

    fn in_facet(&self, choice: &Choice, u: [f64; 2]) -> Option<Point<'a>> {
        let facet = &self.source.facets.list[choice.index];
        let corner = facet.corner - self.x;
        let towards = if choice.by_area { None } else { direction(corner, facet.edges, choice.weight, u) };
        let Some((at, _)) = towards.and_then(|d| meet(corner, facet.edges, d)) else {
            return self.of_area((facet, uniform_barycentrics(u)), facet.area * self.total / choice.weight);
        };
        let at = moved_inside(at);
        let offset = facet.from(self.x, at);
        (offset != DVec3::ZERO).then_some(Point { facet, at, offset, measure: self.total })
    }

    /// A point that stands for `area`.
    fn of_area(&self, (facet, at): (&'a Facet, [f64; 2]), area: f64) -> Option<Point<'a>> {
        let offset = facet.from(self.x, at);
        let measure = self.source.solid_angle_of(facet, offset, area)?;
        Some(Point { facet, at, offset, measure })
    }

    /// Density with which [`Self::sample`] takes the direction of the point of the source that lies `offset` from x, sr⁻¹;
    /// 0 where it never does.
    #[must_use]
    pub fn density(&self, offset: Vec3) -> f32 {
        let offset = offset.as_dvec3();
        let facets = &self.source.facets.list;
        let measure = match self.by {
            Choose::Area => facets.first().and_then(|facet| self.measure(facet, offset)),
            Choose::SolidAngle => {
                let facing = self.choices.iter().map(|choice| &facets[choice.index]);
                nearest(facing, self.x, offset).and_then(|facet| self.measure(facet, offset))
            }
            Choose::Cluster => self.measure_by_cluster(offset),
        };
        measure.map_or(0.0, |measure| measure.recip() as f32)
    }

    fn measure_by_cluster(&self, offset: DVec3) -> Option<f64> {
        let facets = &self.source.facets.list;
        // Points of single precision lie as far off the facets.
        let slack = (self.x.abs() + offset.abs()).max_element() * 1e-5;
        let holds = |cluster: &Cluster| (self.x + offset).distance(cluster.centre) <= cluster.radius + slack;
        let near = self.choices.iter().map(|c| (c, &self.source.clusters[c.index])).filter(|(_, k)| holds(k));
        let (choice, cluster, facet, _) = near
            .filter_map(|(choice, cluster)| {
                let facet = nearest(facets[cluster.facets.clone()].iter(), self.x, offset)?;
                Some((choice, cluster, facet, misfit(facet, self.x, offset)))
            })
            .min_by(|a, b| a.3.total_cmp(&b.3))?;
        self.source.solid_angle_of(facet, offset, cluster.area * self.total / choice.weight)
    }

    /// What [`Point::measure`] would be for the point of a facet `offset` away; `None` where it faces away, and for
    /// clusters.
    pub(super) fn measure(&self, facet: &Facet, offset: DVec3) -> Option<f64> {
        let of_area = self.source.solid_angle_of(facet, offset, self.total)?;
        match self.by {
            Choose::Area => Some(of_area),
            Choose::SolidAngle => {
                let (weight, far) = facet_weight(facet, self.x, facet.normal.dot(facet.corner - self.x).abs());
                Some(if far { of_area * facet.area / weight } else { self.total })
            }
            Choose::Cluster => None,
        }
    }
}

/// The facet that holds the point `offset` from `x`, rounding aside.
fn nearest<'a>(facets: impl Iterator<Item = &'a Facet>, x: DVec3, offset: DVec3) -> Option<&'a Facet> {
    let fits = facets.map(|facet| (misfit(facet, x, offset), facet));
    fits.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, facet)| facet)
}

/// How far the point `offset` from `x` is from being one of the facet, in barycentrics and along the way; 0 for its points.
fn misfit(facet: &Facet, x: DVec3, offset: DVec3) -> f64 {
    meet(facet.corner - x, facet.edges, offset).map_or(f64::INFINITY, |([s, t], way)| {
        let outside = (-s).max(-t).max(s + t - 1.0).max(0.0);
        outside + (way - 1.0).abs()
    })
}

/// Solid angle of a facet whose plane is `height` from `x`, and whether that is its middle's, good enough from afar.
fn facet_weight(facet: &Facet, x: DVec3, height: f64) -> (f64, bool) {
    let squared = facet.middle.distance_squared(x);
    if squared > FAR * FAR * facet.squared_radius {
        return (facet.area * height / (squared * squared.sqrt()), true);
    }
    (solid_angle(facet.corner - x, facet.edges), false)
}

/// A point chosen on the source.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point<'a> {
    pub facet: &'a Facet,
    /// Barycentrics in it.
    pub at: [f64; 2],
    /// From the receiver.
    pub offset: DVec3,
    /// Solid angle that it stands for, the inverse of its density.
    pub measure: f64,
}
