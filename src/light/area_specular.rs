//! Highlights of area lights without occlusion.

use super::area::AreaSource;
use super::area_sampler::Sampler;
use super::arrival::Arrival;
use super::closed_form::{ClosedForm, ProjectedPolygon};
use super::facets::Facet;
use super::receiver::Receiver;
use crate::bsdf::{GgxLobe, Lobe};
use crate::math::luminance;
use crate::math::phong_polygon;
use crate::math::sequence::Sequence;
use crate::math::spherical_triangle::meet;
use crate::scene::Scene;
use glam::{DVec3, Vec3};
use std::f64::consts::FRAC_PI_2;

/// Edges up to which a highlight is integrated: outlines away from the lobe cost little.
const MAX_EDGES: usize = 1536;
/// Logarithm of the share of the lobe's peak that does not show.
const NEGLIGIBLE: f64 = -14.0;
/// Square of a light's half angle up to which its points are about equally bright.
const SMALL: f64 = 0.01;
/// Square of a light's half angle, in widths of the lobe, up to which the lobe is a paraboloid over it.
const SMOOTH: f64 = 0.2;
/// Square of a source's half angle, in widths of the lobe, up to which a highlight sees it as one direction.
const ONE_DIRECTION: f32 = 0.05;
/// Points of a textured light, and as many directions of the lobe, for the colour of its highlight.
const TEXTURE_POINTS: u32 = 128;
/// Points of the light by which the fit of a wide lobe is corrected.
const FIT_POINTS: u32 = 16;
/// Points of the light where there are more edges.
const POINTS: u32 = 256;

impl AreaSource {
    /// Unoccluded highlight ∫ lobe · L cosθ dω of the source, W·sr⁻¹·m⁻². The texture does not colour what is darker
    /// than `floor`, in luminance.
    #[must_use]
    pub fn specular(&self, scene: &Scene, receiver: &Receiver, floor: f32) -> Vec3 {
        match self.form(receiver.x, MAX_EDGES) {
            Some(form) => self.specular_of(scene, &form, receiver, floor),
            None => self.sampled_specular(scene, receiver),
        }
    }

    /// The same from a closed form at the receiver's place, W·sr⁻¹·m⁻².
    #[must_use]
    pub fn specular_of(&self, scene: &Scene, form: &ClosedForm<'_>, receiver: &Receiver, floor: f32) -> Vec3 {
        let x = receiver.x;
        let highlight = self.highlight_of(form, receiver);
        let mean = self.mean_radiance() * highlight;
        if !self.textured || luminance(mean) <= floor {
            return mean;
        }
        let nearest = self.centre.distance(x) - self.radius;
        let parts = if nearest > 0.0 { self.parts.in_lobe(receiver, nearest, self.both_sides) } else { None };
        let seen = parts.or_else(|| self.radiance_in_lobe(scene, &self.at(x), receiver));
        seen.map_or(mean, |seen| seen * highlight)
    }

    /// Unoccluded highlight for radiance 1, a number.
    fn highlight_of(&self, form: &ClosedForm<'_>, receiver: &Receiver) -> Vec3 {
        match &receiver.lobe {
            Lobe::Ggx(ggx) if ggx.is_wide() => {
                let [_, albedo] = form.seen_once(ggx);
                (form.highlight(receiver) + self.misfit(ggx, receiver, albedo)).max(Vec3::ZERO)
            }
            _ => form.highlight(receiver),
        }
    }

    /// What the transformed cosine of a lobe lacks over the source, for radiance 1, by a few points of it: their mean is exact but for how
    /// the difference varies between them, which is little.
    fn misfit(&self, ggx: &GgxLobe, receiver: &Receiver, albedo: Vec3) -> Vec3 {
        let (fit, sampler, sequence) = (ggx.transformed_cosine(), self.at(receiver.x), Sequence::new(2));
        let lacks = |index| {
            let [u, v, ..] = sequence.point(index).map(f64::from);
            let Some(point) = sampler.point([u, v]) else { return Vec3::ZERO };
            let direction = point.offset.normalize().as_vec3();
            let exact = ggx.value_once(direction) * receiver.normal.dot(direction).max(0.0);
            (exact - albedo * fit.value(direction)) * point.measure as f32
        };
        (0..FIT_POINTS).map(lacks).sum::<Vec3>() / FIT_POINTS as f32
    }

    /// Mean radiance, W·sr⁻¹·m⁻², of a textured source weighed by the lobe and the cosine; `None` where no sample meets
    /// both. Points of the light and directions of the lobe, combined by the balance heuristic.
    fn radiance_in_lobe(&self, scene: &Scene, sampler: &Sampler<'_>, receiver: &Receiver) -> Option<Vec3> {
        let (lobe, normal) = (&receiver.lobe, receiver.normal);
        let (mut sum, mut weights) = (DVec3::ZERO, 0.0);
        let mut add = |facet: &Facet, at: [f64; 2], offset: DVec3, measure: f64| {
            let direction = offset.normalize().as_vec3();
            let value = f64::from(luminance(lobe.value(direction)) * direction.dot(normal).max(0.0));
            let weight = value / (measure.recip() + f64::from(lobe.density(direction)));
            sum += self.radiance_at(scene, facet, at, offset).as_dvec3() * weight;
            weights += weight;
        };
        let sequence = Sequence::new(1);
        for index in 0..TEXTURE_POINTS {
            let [u, v, s, t] = sequence.point(index);
            if let Some(point) = sampler.point([u, v].map(f64::from)) {
                add(point.facet, point.at, point.offset, point.measure);
            }
            let direction = lobe.sample([s, t]).as_dvec3();
            for facet in &self.facets.list {
                let corner = facet.from(sampler.x, [0.0, 0.0]);
                let Some(([b, c], distance)) = meet(corner, facet.edges, direction) else { continue };
                let offset = direction * distance;
                if distance > 0.0
                    && b >= 0.0
                    && c >= 0.0
                    && b + c <= 1.0
                    && let Some(measure) = sampler.measure(facet, offset)
                {
                    add(facet, [b, c], offset, measure);
                }
            }
        }
        (weights > f64::MIN_POSITIVE).then(|| (sum / weights).as_vec3())
    }

    /// Unoccluded highlight, W·sr⁻¹·m⁻², of a distant source that sends `irradiance`, W·m⁻²; `None` where the lobe sees
    /// its width or texture.
    #[must_use]
    pub fn distant_specular(&self, receiver: &Receiver, irradiance: Vec3) -> Option<Vec3> {
        let offset = self.centre - receiver.x;
        let half_angle = self.radius * self.radius / offset.length_squared();
        let narrow = !self.textured && half_angle * (receiver.lobe.exponent() + 2.0) < ONE_DIRECTION;
        narrow.then(|| irradiance * receiver.lobe.value(offset.normalize()))
    }

    /// Unoccluded highlight in the source's mean colour, W·sr⁻¹·m⁻²; `None` where the source has no closed form.
    pub(super) fn mean_specular(&self, receiver: &Receiver) -> Option<Vec3> {
        let Receiver { x, normal, .. } = *receiver;
        if self.is_distant(x, normal) {
            let distant = self.distant_specular(receiver, self.distant_irradiance(x, normal));
            if distant.is_some() {
                return distant;
            }
        }
        self.closed_form(x).map(|form| form.specular(receiver))
    }

    fn sampled_specular(&self, scene: &Scene, receiver: &Receiver) -> Vec3 {
        let sampler = self.at(receiver.x);
        let sequence = Sequence::new(0);
        let value = |index| {
            let [u, v, ..] = sequence.point(index);
            let seen = |a: Arrival| a.irradiance(receiver.normal) * receiver.lobe.value(a.direction);
            sampler.sample(scene, [u, v]).map_or(Vec3::ZERO, seen)
        };
        (0..POINTS).map(value).sum::<Vec3>() / POINTS as f32
    }
}

impl ClosedForm<'_> {
    /// Unoccluded highlight for the source's mean radiance, W·sr⁻¹·m⁻²: of a Phong lobe exact (1e-4) for any exponent and size of
    /// light, of GGX by its transformed cosine.
    #[must_use]
    pub fn specular(&self, receiver: &Receiver) -> Vec3 {
        self.mean_radiance() * self.highlight(receiver)
    }

    /// The same for radiance 1, a number.
    fn highlight(&self, receiver: &Receiver) -> Vec3 {
        match &receiver.lobe {
            Lobe::Ggx(ggx) => self.ggx_highlight(ggx, receiver.normal),
            lobe => Vec3::splat(lobe.as_phong().map_or(0.0, |phong| self.phong_highlight(&phong))),
        }
    }

    fn phong_highlight(&self, phong: &phong_polygon::Lobe) -> f32 {
        if phong.shininess == 0.0 {
            return self.form_factor(phong.normal.as_vec3()) / std::f32::consts::PI;
        }
        let sum: f64 = self.polygons().map(|(polygon, terms)| highlight(phong, polygon, terms)).sum();
        sum.max(0.0) as f32
    }

    fn ggx_highlight(&self, ggx: &GgxLobe, normal: Vec3) -> Vec3 {
        let [share, albedo] = self.seen_once(ggx);
        let (direction, concentration) = self.spread();
        share * albedo + ggx.again(normal.dot(direction), concentration) * self.form_factor(normal)
    }

    /// Share of a lobe that the light takes by its transformed cosine, and the albedo of single scattering of its light.
    fn seen_once(&self, ggx: &GgxLobe) -> [Vec3; 2] {
        let fit = ggx.transformed_cosine();
        let share = |polygon: &ProjectedPolygon<'_>| polygon.sign * fit.over_polygon(polygon.base, &polygon.corners);
        let share = self.polygons().map(|(polygon, _)| share(polygon)).sum::<f64>().max(0.0) as f32;
        [Vec3::splat(share), ggx.albedo_once_of(self.spread().0, share)]
    }
}

/// Highlight of a polygon of radiance 1: nil outside the lobe; the lobe's mean over it if that is smooth there; else the contour integral.
fn highlight(phong: &phong_polygon::Lobe, polygon: &ProjectedPolygon<'_>, terms: &[DVec3]) -> f64 {
    let (middle, least) = polygon.cone();
    let cosine = middle.dot(phong.axis);
    let nearest = cosine.clamp(-1.0, 1.0).acos() - least.acos();
    if nearest > 0.0 && phong.shininess * nearest.min(FRAC_PI_2).cos().ln() < NEGLIGIBLE {
        return 0.0;
    }
    let squared_angle = 2.0 * (1.0 - least);
    let above_horizon = || middle.dot(phong.normal) > (1.0 - least * least).max(0.0).sqrt();
    if squared_angle < SMALL && squared_angle * (phong.shininess + 1.0) < SMOOTH && above_horizon() {
        // Mean over the polygon from its middle and its corners: exact to second order for affine regular n-gons.
        let n = polygon.corners.len() as f64;
        let share = (2.0 + (std::f64::consts::TAU / n).cos()) / 6.0;
        let at_corner = |&r: &DVec3| phong.value((polygon.base + r).normalize().dot(phong.axis));
        let corners = polygon.corners.iter().map(at_corner).sum::<f64>() / n;
        let mean = phong.value(cosine) * (1.0 - share) + corners * share;
        return polygon.irradiance(terms, phong.normal) * mean;
    }
    polygon.sign * phong.over_polygon(polygon.base, &polygon.corners)
}
