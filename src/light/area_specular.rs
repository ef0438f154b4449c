//! Highlights of area lights without occlusion.

use super::area::{AreaSource, ClosedForm, ProjectedPolygon};
use super::area_sampler::Sampler;
use super::facets::Facet;
use crate::bsdf::lobe;
use crate::math::luminance;
use crate::math::phong_polygon::Lobe;
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
/// Where a highlight is seen.
#[derive(Clone, Copy, Debug)]
pub struct Receiver {
    /// Place.
    pub x: Vec3,
    /// Unit normal.
    pub normal: Vec3,
    /// Unit direction to the eye.
    pub to_eye: Vec3,
    /// Exponent of the lobe.
    pub shininess: f32,
}

/// Points of a textured light, and as many directions of the lobe, for the colour of its highlight.
const TEXTURE_POINTS: u32 = 128;
/// Points of the light where there are more edges.
const POINTS: u32 = 256;

impl AreaSource {
    /// Unoccluded highlight ∫ lobe · L cosθ dω of the source (method 2). The texture does not colour what is darker than
    /// `floor`, in luminance.
    #[must_use]
    pub fn specular(&self, scene: &Scene, receiver: &Receiver, floor: f32) -> Vec3 {
        match self.form(receiver.x, MAX_EDGES) {
            Some(form) => self.specular_of(scene, &form, receiver, floor),
            None => self.sampled_specular(scene, receiver),
        }
    }

    /// The same from a closed form at the receiver's place.
    #[must_use]
    pub fn specular_of(&self, scene: &Scene, form: &ClosedForm<'_>, receiver: &Receiver, floor: f32) -> Vec3 {
        let Receiver { x, normal, to_eye, shininess } = *receiver;
        let highlight = form.highlight(normal, to_eye, shininess);
        let mean = self.mean_radiance() * highlight;
        if !self.textured || luminance(mean) <= floor {
            return mean;
        }
        let phong = phong_lobe(normal, to_eye, shininess);
        let nearest = self.centre.distance(x) - self.radius;
        let parts = if nearest > 0.0 { self.parts.in_lobe(x, nearest, &phong, self.both_sides) } else { None };
        let seen = parts.or_else(|| self.radiance_in_lobe(scene, &self.at(x), &phong));
        seen.map_or(mean, |seen| seen * highlight)
    }

    /// Mean radiance of a textured source weighed by the lobe and the cosine; `None` where no sample meets both. Points of
    /// the light and directions of the lobe, combined by the balance heuristic.
    fn radiance_in_lobe(&self, scene: &Scene, sampler: &Sampler<'_>, phong: &Lobe) -> Option<Vec3> {
        let (mut sum, mut weights) = (DVec3::ZERO, 0.0);
        let mut add = |facet: &Facet, at: [f64; 2], offset: DVec3, measure: f64| {
            let direction = offset.normalize();
            let cosine = direction.dot(phong.axis);
            let value = phong.value(cosine) * direction.dot(phong.normal).max(0.0);
            let weight = value / (measure.recip() + phong.density(cosine));
            sum += self.radiance_at(scene, facet, at, offset).as_dvec3() * weight;
            weights += weight;
        };
        let sequence = Sequence::new(1);
        for index in 0..TEXTURE_POINTS {
            let [u, v, s, t] = sequence.point(index).map(f64::from);
            if let Some(point) = sampler.point([u, v]) {
                add(point.facet, point.at, point.offset, point.measure);
            }
            let direction = phong.direction([s, t]);
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

    fn sampled_specular(&self, scene: &Scene, receiver: &Receiver) -> Vec3 {
        let Receiver { x, normal, to_eye, shininess } = *receiver;
        let sampler = self.at(x);
        let sequence = Sequence::new(0);
        let value = |index| {
            let [u, v, ..] = sequence.point(index);
            sampler.sample(scene, [u, v]).map_or(Vec3::ZERO, |a| {
                a.facing * normal.dot(a.direction).max(0.0) * lobe(shininess, normal, a.direction, to_eye)
            })
        };
        (0..POINTS).map(value).sum::<Vec3>() / POINTS as f32
    }
}

fn phong_lobe(normal: Vec3, to_eye: Vec3, shininess: f32) -> Lobe {
    let (n, eye) = (normal.as_dvec3(), to_eye.as_dvec3());
    Lobe { normal: n, axis: (n * (2.0 * n.dot(eye)) - eye).normalize_or(n), shininess: f64::from(shininess) }
}

impl ClosedForm<'_> {
    /// Unoccluded highlight for the source's mean radiance; exact (1e-4) for any exponent and size of light.
    #[must_use]
    pub fn specular(&self, normal: Vec3, to_eye: Vec3, shininess: f32) -> Vec3 {
        self.mean_radiance() * self.highlight(normal, to_eye, shininess)
    }

    /// The same for radiance 1.
    fn highlight(&self, normal: Vec3, to_eye: Vec3, shininess: f32) -> f32 {
        if shininess == 0.0 {
            return self.form_factor(normal) / std::f32::consts::PI;
        }
        let phong = phong_lobe(normal, to_eye, shininess);
        let sum: f64 = self.polygons().map(|(polygon, terms)| highlight(&phong, polygon, terms)).sum();
        sum.max(0.0) as f32
    }
}

/// Highlight of a polygon of radiance 1: nil outside the lobe; the lobe's mean over it if that is smooth there; else the contour integral.
fn highlight(phong: &Lobe, polygon: &ProjectedPolygon<'_>, terms: &[DVec3]) -> f64 {
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
