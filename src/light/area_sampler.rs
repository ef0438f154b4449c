//! Points of an area light as seen from one place: uniform in the solid angle of its triangles, so that no sample
//! outshines the light, or by area in those that look small; by clusters of triangles where there are too many to look
//! at each.

use super::area::AreaSource;
use super::arrival::Arrival;
use super::facet_cluster::Cluster;
use super::facets::{Facet, moved_inside, uniform_barycentrics};
use super::quad::QuadLight;
use crate::math::spherical_triangle::{direction, meet, solid_angle};
use crate::scene::Scene;
use glam::{DVec3, Vec3};
use smallvec::SmallVec;

/// Distance in radii from which a facet is weighed by its middle and sampled by area: unbiased at any distance, and without
/// solid angles. d⁻³ varies by less than ±45 % over it then.
const FAR: f64 = 8.0;

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

impl AreaSource {
    /// Prepares sampling from `x`.
    #[must_use]
    pub fn at(&self, x: Vec3) -> Sampler<'_> {
        Sampler::new(self, x)
    }

    /// The light that arrives at `x` from the point of the source chosen by `u` ∈ [0, 1)² in proportion to area; `None`
    /// where that point faces away. [`Sampler::sample`] has far less variance.
    #[must_use]
    pub fn sample(&self, scene: &Scene, x: Vec3, u: [f32; 2]) -> Option<Arrival> {
        let x = x.as_dvec3();
        let (facet, at) = self.facets.pick(0..self.facets.list.len(), u.map(f64::from))?;
        let offset = facet.from(x, at);
        let measure = self.solid_angle_of(facet, offset, self.facets.area)?;
        Some(self.seen(scene, facet, at, offset, measure))
    }

    /// The light that arrives at a surface at `x` of unit `normal` from the point of the source chosen by `u` ∈ [0,
    /// 1)²; `None` where no light does. The mean of `facing · max(0, n·direction)` over u is the unoccluded irradiance,
    /// as with [`Sampler::sample`]; points that send much are chosen more often where that is cheap. Strata of u are
    /// kept.
    #[must_use]
    pub fn sample_for(&self, scene: &Scene, (x, normal): (Vec3, Vec3), u: [f32; 2]) -> Option<Arrival> {
        let Some(quad) = self.quad_from(x) else { return self.at(x).sample(scene, u) };
        let (measure, offset, distance) = quad.facing(x, normal, self.both_sides)?.sample(u)?;
        let facing = self.mean_radiance() * measure;
        Some(Arrival { direction: offset / distance, distance, facing, measure })
    }

    /// Density with which [`Self::sample_for`] takes the direction of the point of the source that lies `offset` from
    /// x, sr⁻¹; 0 where it never does.
    #[must_use]
    pub fn density_for(&self, (x, normal): (Vec3, Vec3), offset: Vec3) -> f32 {
        let Some(quad) = self.quad_from(x) else { return self.at(x).density(offset) };
        quad.facing(x, normal, self.both_sides).map_or(0.0, |facing| facing.density(offset))
    }

    /// The whole source as a parallelogram, where it is one and `x` is far enough for that.
    fn quad_from(&self, x: Vec3) -> Option<&QuadLight> {
        self.quad.as_deref().filter(|quad| quad.is_far(x))
    }
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

    /// What [`Point::measure`] would be, sr, for the point of a facet `offset` away; `None` where it faces away, and
    /// for clusters.
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

/// Solid angle, sr, of a facet whose plane is `height` from `x`, and whether that is its middle's, good enough from
/// afar.
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
    /// Solid angle that it stands for, sr, the inverse of its density.
    pub measure: f64,
}
