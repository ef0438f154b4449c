//! Area lights: connected emissive components, their unoccluded irradiance in closed form.

use super::area_distant::Distant;
use super::area_sampler::{Cluster, Sampler};
use super::bounds::LightBounds;
use super::emission::Parts;
use super::facets::{Facet, Facets, Outlines};
use super::lights::Arrival;
use super::quad::QuadLight;
use super::silhouette::Silhouette;
use crate::math::luminance;
use crate::math::polygon::{edge_term, edges};
use crate::scene::{EmissionSide, FaceId, Scene, TriangleId};
use glam::{DVec3, Vec3};
use smallvec::SmallVec;
use std::borrow::Cow;

/// An emissive component, prepared.
#[derive(Clone, Debug)]
pub struct AreaSource {
    outlines: Outlines,
    /// Its silhouettes where it has too many outlines, if it is closed and convex.
    silhouette: Option<Box<Silhouette>>,
    /// Triangles to sample: the scene's own where a texture needs them, else those of the merged polygons.
    pub(super) facets: Facets,
    /// Groups of facets by place and direction, only where there are too many facets to weigh each.
    pub(super) clusters: Vec<Cluster>,
    /// The whole source if it is a parallelogram without a texture.
    pub(super) panel: Option<Box<QuadLight>>,
    pub(super) both_sides: bool,
    /// Area-mean radiance.
    radiance: Vec3,
    pub(super) textured: bool,
    /// Where a texture makes it uneven.
    pub(super) parts: Parts,
    /// Luminance of the mean radiance against the most that any point emits.
    mean_to_peak: f32,
    /// What it sends at most.
    pub(super) bounds: LightBounds,
    pub(super) centre: Vec3,
    pub(super) radius: f32,
    pub(super) distant: Distant,
}

/// Edges of facing polygons above which light is sampled only: what 64 triangles have that nothing merged.
const MAX_EDGES: usize = 192;

/// Distance in radii from which a plane source is sampled by area: d⁻³ varies by less than ±45 % then. Measured on the Cornell
/// box: solid angles halve the variance there for half as much time again.
const FAR: f32 = 8.0;

impl AreaSource {
    /// Prepares a component.
    #[must_use]
    pub fn new(scene: &Scene, triangles: &[TriangleId]) -> Self {
        let own: Vec<Facet> = triangles.iter().filter_map(|&t| Facet::of_scene(scene, t)).collect();
        let outlines = Outlines::new(scene, &own);
        let first = triangles.first().map(|&t| scene.material(t));
        let both_sides = scene.emission_side == EmissionSide::Both;
        let many = outlines.corners.len() > MAX_EDGES;
        let silhouette = if many && !both_sides { Silhouette::new(scene, &own).map(Box::new) } else { None };
        let textured = first.is_some_and(|m| m.map_ke.is_some());
        let parts = if textured { Parts::new(scene, &own) } else { Parts::default() };
        let radiance = if textured { parts.mean() } else { first.map_or(Vec3::ZERO, |m| m.ke) };
        let mut facets = if textured { own } else { outlines.fans(triangles).collect() };
        let clusters = Cluster::build(&mut facets);
        let corners = || triangles.iter().flat_map(|&t| scene.corners(t));
        let lo = corners().fold(Vec3::INFINITY, Vec3::min);
        let hi = corners().fold(Vec3::NEG_INFINITY, Vec3::max);
        let (centre, radius) = ((lo + hi) * 0.5, (hi - lo).length() * 0.5);
        let facets = Facets::new(facets);
        let peak = first.map_or(0.0, |m| luminance(scene.peak_emission(m)));
        Self {
            distant: Distant::new(&outlines, centre, radius),
            panel: if textured { None } else { QuadLight::new(&outlines).map(Box::new) },
            outlines,
            silhouette,
            bounds: LightBounds::of_facets(&facets, (centre, radius), peak, both_sides),
            mean_to_peak: luminance(radiance) / peak.max(f32::MIN_POSITIVE),
            facets,
            clusters,
            both_sides,
            radiance,
            textured,
            parts,
            centre,
            radius,
        }
    }

    /// Area-mean radiance, W·sr⁻¹·m⁻².
    #[must_use]
    pub const fn mean_radiance(&self) -> Vec3 {
        self.radiance
    }

    /// Whether [`Self::closed_form`] answers wherever it is asked.
    #[must_use]
    pub fn has_closed_form(&self) -> bool {
        self.outlines.corners.len() <= MAX_EDGES || self.silhouette.is_some()
    }

    /// Whether the whole source is one polygon that looks small from `x`: then its points are about equally bright.
    pub(super) fn is_far(&self, x: Vec3) -> bool {
        self.outlines.polygons.len() == 1 && (self.centre - x).length() > FAR * self.radius
    }

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

    /// Solid angle that `area` takes at the point of a facet `offset` away; `None` where that faces away.
    pub(super) fn solid_angle_of(&self, facet: &Facet, offset: DVec3, area: f64) -> Option<f64> {
        let squared = offset.length_squared();
        let cosine = -facet.normal.dot(offset) / squared.sqrt();
        let cosine = if self.both_sides { cosine.abs() } else { cosine };
        (cosine > 0.0).then(|| cosine * area / squared)
    }

    /// Radiance of the point of a facet `offset` away.
    pub(super) fn radiance_at(&self, scene: &Scene, facet: &Facet, at: [f64; 2], offset: DVec3) -> Vec3 {
        if !self.textured {
            return self.radiance;
        }
        let back = facet.normal.dot(offset) > 0.0;
        scene.emitted_at(FaceId::new(facet.id, back), at[0] as f32, at[1] as f32)
    }

    /// Light of that point if it stands for the solid angle `measure`.
    pub(super) fn seen(&self, scene: &Scene, facet: &Facet, at: [f64; 2], offset: DVec3, measure: f64) -> Arrival {
        let distance = offset.length();
        Arrival {
            direction: (offset / distance).as_vec3(),
            distance: distance as f32,
            facing: self.radiance_at(scene, facet, at, offset) * measure as f32,
            measure: measure as f32,
        }
    }

    /// A sphere that holds the source: centre and radius.
    #[must_use]
    pub const fn sphere(&self) -> (Vec3, f32) {
        (self.centre, self.radius)
    }

    /// The unoccluded light at `x` in closed form; `None` where more outlines face `x` than 64 unmerged triangles have and the
    /// source is not convex: then sample. Zero in the plane of the source and behind it.
    #[must_use]
    pub fn closed_form(&self, x: Vec3) -> Option<ClosedForm<'_>> {
        self.form(x, MAX_EDGES)
    }

    /// The closed form unless it has more than `max_edges`.
    pub(super) fn form(&self, x: Vec3, max_edges: usize) -> Option<ClosedForm<'_>> {
        let x = x.as_dvec3();
        let mut form = ClosedForm { radiance: self.radiance, polygons: SmallVec::new(), terms: SmallVec::new() };
        if let Some(silhouette) = &self.silhouette {
            let outline = silhouette.from(x)?;
            if let Some(&first) = outline.first() {
                form.push(first - x, Cow::Owned(outline.iter().map(|&p| p - first).collect()), 1.0);
            }
            return Some(form);
        }
        for polygon in &self.outlines.polygons {
            let base = polygon.base - x;
            let height = -polygon.normal.dot(base);
            if height == 0.0 || (height < 0.0 && !self.both_sides) {
                continue;
            }
            if form.terms.len() + polygon.corners.len() > max_edges {
                return None;
            }
            form.push(base, Cow::Borrowed(&self.outlines.corners[polygon.corners.clone()]), height.signum());
        }
        Some(form)
    }

    /// Unoccluded irradiance at `x` on a surface of unit `normal`: what its closed form there says, in the colours that show there
    /// where a texture makes the source uneven.
    #[must_use]
    pub fn irradiance(&self, form: &ClosedForm<'_>, x: Vec3, normal: Vec3) -> Vec3 {
        let seen = if self.textured { self.parts.seen(x, normal, self.both_sides) } else { None };
        seen.unwrap_or(self.radiance) * form.form_factor(normal)
    }

    /// What the luminance of the unoccluded irradiance at `x` on a surface of unit `normal` is, up to a factor of two or so beside
    /// the source; 0 only where no light can arrive.
    pub(super) fn strength(&self, x: Vec3, normal: Vec3) -> f32 {
        let bound = self.bounds.bound(x, normal) * self.mean_to_peak;
        if bound == 0.0 || !self.is_roughly_distant(x, normal) {
            return bound;
        }
        // The little that a source may send which shows its back with its middles.
        luminance(self.distant_irradiance(x, normal)).max(bound * 1e-6)
    }

    /// Unoccluded irradiance as roughly as that.
    #[must_use]
    pub fn rough_irradiance(&self, x: Vec3, normal: Vec3) -> Vec3 {
        let luminance = luminance(self.radiance);
        if luminance > 0.0 { self.radiance * (self.strength(x, normal) / luminance) } else { Vec3::ZERO }
    }
}

/// The unoccluded light of an area source at a point, for any normal there.
#[derive(Clone, Debug)]
pub struct ClosedForm<'a> {
    radiance: Vec3,
    polygons: SmallVec<[ProjectedPolygon<'a>; 4]>,
    /// Terms of the edges of all polygons (unit radiance), in order.
    terms: SmallVec<[DVec3; 24]>,
}

/// A polygon that faces the point.
#[derive(Clone, Debug)]
pub(super) struct ProjectedPolygon<'a> {
    /// From the point to the first corner.
    pub base: DVec3,
    /// All corners relative to the first.
    pub corners: Cow<'a, [DVec3]>,
    /// 1 where the front is seen, −1 for the back.
    pub sign: f64,
    vector: DVec3,
}

impl<'a> ClosedForm<'a> {
    fn push(&mut self, base: DVec3, corners: Cow<'a, [DVec3]>, sign: f64) {
        let first = self.terms.len();
        self.terms.extend(edges(&corners).map(|(a, b)| edge_term(base + a, b - a) * sign));
        let vector = self.terms[first..].iter().sum();
        self.polygons.push(ProjectedPolygon { base, corners, sign, vector });
    }

    /// Area-mean radiance of the source, W·sr⁻¹·m⁻².
    #[must_use]
    pub const fn mean_radiance(&self) -> Vec3 {
        self.radiance
    }

    /// The light vector of the whole source, not clipped to any horizon, for its mean radiance's luminance, W·m⁻².
    #[must_use]
    pub fn vector(&self) -> Vec3 {
        let sum: DVec3 = self.polygons.iter().map(|p| p.vector).sum();
        (sum * f64::from(luminance(self.radiance))).as_vec3()
    }

    /// Irradiance on a surface of unit `normal` from what lies above its horizon, W·m⁻².
    #[must_use]
    pub fn irradiance(&self, normal: Vec3) -> Vec3 {
        self.radiance * self.form_factor(normal)
    }

    /// The same for radiance 1.
    pub(super) fn form_factor(&self, normal: Vec3) -> f32 {
        let normal = normal.as_dvec3();
        self.polygons().map(|(polygon, terms)| polygon.irradiance(terms, normal)).sum::<f64>() as f32
    }

    /// The polygons that face the point, with the terms of their edges.
    pub(super) fn polygons(&self) -> impl Iterator<Item = (&ProjectedPolygon<'a>, &[DVec3])> {
        self.polygons.iter().scan(&self.terms[..], |terms, polygon| {
            let (own, rest) = terms.split_at(polygon.corners.len());
            *terms = rest;
            Some((polygon, own))
        })
    }
}

impl ProjectedPolygon<'_> {
    /// A cone from the point that holds the polygon: its axis, and the cosine of its half angle (−1 around the point).
    pub(super) fn cone(&self) -> (DVec3, f64) {
        let middle = self.base + self.corners.iter().sum::<DVec3>() / self.corners.len() as f64;
        let Some(axis) = middle.try_normalize() else { return (DVec3::Z, -1.0) };
        let cosine = |&r: &DVec3| (self.base + r).dot(axis) / (self.base + r).length();
        let least = self.corners.iter().map(cosine).fold(1.0, f64::min);
        (axis, if least > 0.0 { least } else { -1.0 })
    }

    /// Irradiance for radiance 1; `terms` are those of the whole edges, reused for edges above the horizon.
    pub(super) fn irradiance(&self, terms: &[DVec3], normal: DVec3) -> f64 {
        let offset = normal.dot(self.base);
        let height = |r: DVec3| offset + normal.dot(r);
        let (lowest, highest) = self
            .corners
            .iter()
            .map(|&r| height(r))
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), h| (lo.min(h), hi.max(h)));
        if highest <= 0.0 {
            return 0.0;
        }
        if lowest >= 0.0 {
            return self.vector.dot(normal).max(0.0);
        }
        let (mut sum, mut setting, mut rising) = (0.0, DVec3::ZERO, DVec3::ZERO);
        let term = |a: DVec3, b: DVec3| (edge_term(self.base + a, b - a) * self.sign).dot(normal);
        for ((a, b), whole) in edges(&self.corners).zip(terms) {
            let (ha, hb) = (height(a), height(b));
            let crossing = a + (b - a) * (ha / (ha - hb));
            match (ha >= 0.0, hb >= 0.0) {
                (true, true) => sum += whole.dot(normal),
                (true, false) => {
                    setting = crossing;
                    sum += term(a, setting);
                }
                (false, true) => {
                    rising = crossing;
                    sum += term(rising, b);
                }
                (false, false) => {}
            }
        }
        // The polygon is convex: one edge along the horizon closes what is left of it.
        (sum + term(setting, rising)).max(0.0)
    }
}
