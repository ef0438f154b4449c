//! Area lights: connected emissive components, their unoccluded irradiance in closed form.

use super::area_distant::Distant;
use super::arrival::Arrival;
use super::bounds::LightBounds;
use super::closed_form::ClosedForm;
use super::emission::Parts;
use super::facet_cluster::Cluster;
use super::facets::{Facet, Facets, Outlines};
use super::quad::QuadLight;
use super::silhouette::Silhouette;
use crate::math::luminance;
use crate::scene::{EmissionSide, FaceId, Scene, TriangleId};
use glam::{DVec3, Vec3};
use std::borrow::Cow;
use std::f32::consts::PI;

/// An area light, a connected emissive component of the scene, prepared for sampling and for its closed forms.
#[derive(Clone, Debug)]
pub struct AreaSource {
    outlines: Outlines,
    /// Its silhouettes where it has too many outlines, if it is closed and convex.
    silhouette: Option<Box<Silhouette>>,
    /// Triangles to sample: the scene's own where a texture needs them, else those of the merged polygons.
    pub(super) facets: Facets,
    /// Groups of facets by place and direction, only where there are too many facets to weigh each.
    pub(super) clusters: Vec<Cluster>,
    /// The whole source as a parallelogram where it is one without a texture.
    pub(super) quad: Option<Box<QuadLight>>,
    pub(super) both_sides: bool,
    /// Area-mean radiance, W·sr⁻¹·m⁻².
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
            quad: if textured { None } else { QuadLight::new(&outlines).map(Box::new) },
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

    /// Solid angle, sr, that `area` takes at the point of a facet `offset` away; `None` where that faces away.
    pub(super) fn solid_angle_of(&self, facet: &Facet, offset: DVec3, area: f64) -> Option<f64> {
        let squared = offset.length_squared();
        let cosine = -facet.normal.dot(offset) / squared.sqrt();
        let cosine = if self.both_sides { cosine.abs() } else { cosine };
        (cosine > 0.0).then(|| cosine * area / squared)
    }

    /// Radiance of the point of a facet `offset` away, W·sr⁻¹·m⁻².
    pub(super) fn radiance_at(&self, scene: &Scene, facet: &Facet, at: [f64; 2], offset: DVec3) -> Vec3 {
        if !self.textured {
            return self.radiance;
        }
        let back = facet.normal.dot(offset) > 0.0;
        scene.emitted_at(FaceId::new(facet.id, back), at[0] as f32, at[1] as f32)
    }

    /// Light of that point if it stands for the solid angle `measure`, sr.
    pub(super) fn seen(&self, scene: &Scene, facet: &Facet, at: [f64; 2], offset: DVec3, measure: f64) -> Arrival {
        let distance = offset.length();
        Arrival {
            direction: (offset / distance).as_vec3(),
            distance: distance as f32,
            facing: self.radiance_at(scene, facet, at, offset) * measure as f32,
            measure: measure as f32,
        }
    }

    /// A sphere that holds the source: centre and radius, scene units.
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
        let mut form = ClosedForm::new(self.radiance);
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
            if form.edge_count() + polygon.corners.len() > max_edges {
                return None;
            }
            form.push(base, Cow::Borrowed(&self.outlines.corners[polygon.corners.clone()]), height.signum());
        }
        Some(form)
    }

    /// Unoccluded irradiance at `x` on a surface of unit `normal`, W·m⁻²: what its closed form there says, in the
    /// colours that show there where a texture makes the source uneven.
    #[must_use]
    pub fn irradiance(&self, form: &ClosedForm<'_>, x: Vec3, normal: Vec3) -> Vec3 {
        let seen = if self.textured { self.parts.seen(x, normal, self.both_sides) } else { None };
        seen.unwrap_or(self.radiance) * form.form_factor(normal)
    }

    /// What the luminance of the unoccluded irradiance at `x` on a surface of unit `normal` is, W·m⁻², up to a factor
    /// of two or so beside the source; 0 only where no light can arrive.
    pub(super) fn strength(&self, x: Vec3, normal: Vec3) -> f32 {
        let bound = self.bounds.bound(x, normal) * self.mean_to_peak;
        if bound == 0.0 || !self.is_roughly_distant(x, normal) {
            return bound;
        }
        // The little that a source may send which shows its back with its middles.
        luminance(self.distant_irradiance(x, normal)).max(bound * 1e-6)
    }

    /// Unoccluded irradiance, W·m⁻², as roughly as `strength` is.
    #[must_use]
    pub fn rough_irradiance(&self, x: Vec3, normal: Vec3) -> Vec3 {
        let luminance = luminance(self.radiance);
        if luminance > 0.0 { self.radiance * (self.strength(x, normal) / luminance) } else { Vec3::ZERO }
    }

    /// Unoccluded irradiance, W·m⁻², right to a few per cent, and the unit direction to the source's middle; `None` where it is too near for
    /// that.
    #[must_use]
    pub fn from_afar(&self, x: Vec3, normal: Vec3) -> Option<(Vec3, Vec3)> {
        let towards = || (self.centre - x).normalize_or(normal);
        self.is_roughly_distant(x, normal).then(|| (self.distant_irradiance(x, normal), towards()))
    }

    /// Whether the source is so far from `x` that its polygons count as points. One that the horizon of a surface of
    /// unit `normal` may cut never does: what of a polygon shows above it is not its middle's affair.
    #[must_use]
    pub fn is_distant(&self, x: Vec3, normal: Vec3) -> bool {
        self.is_beyond(self.distant.from, x, normal)
    }

    /// Whether [`Self::distant_irradiance`] is right to a few per cent.
    fn is_roughly_distant(&self, x: Vec3, normal: Vec3) -> bool {
        self.is_beyond(self.distant.rough_from, x, normal)
    }

    fn is_beyond(&self, distance: f32, x: Vec3, normal: Vec3) -> bool {
        let offset = self.centre - x;
        offset.length_squared() > distance * distance && offset.dot(normal).abs() > self.radius
    }

    /// Unoccluded irradiance from afar, W·m⁻².
    #[must_use]
    pub fn distant_irradiance(&self, x: Vec3, normal: Vec3) -> Vec3 {
        if (self.centre - x).dot(normal) < 0.0 {
            return Vec3::ZERO;
        }
        self.radiance * self.distant.form_factor(x, normal, self.both_sides)
    }

    /// Radiant flux, W: of one side, which both emit alike.
    pub(super) fn power(&self) -> Vec3 {
        self.radiance * (self.facets.area as f32 * PI)
    }
}
