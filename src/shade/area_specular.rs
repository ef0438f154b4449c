//! Highlights of area lights without occlusion.

use super::area::{AreaSource, ClosedForm, Seen};
use super::phong::lobe;
use crate::math::phong_polygon::Lobe;
use crate::math::sequence::Sequence;
use crate::scene::Scene;
use glam::{DVec3, Vec3};
use std::f64::consts::FRAC_PI_2;

/// Edges up to which a highlight is integrated: outlines away from the lobe cost little.
const MAX_EDGES: usize = 1536;
/// Logarithm of the share of the lobe's peak that does not show.
const NEGLIGIBLE: f64 = -14.0;
/// Square of a light's half angle, in widths of the lobe, up to which the lobe is constant over it (to about 1e-3).
const CONSTANT: f64 = 2e-3;
/// Points of the light where there are more edges.
const POINTS: u32 = 256;

impl AreaSource {
    /// Unoccluded highlight ∫ lobe · L cosθ dω of the source at `x` (method 2); `normal` and `to_eye` are unit.
    #[must_use]
    pub fn specular(&self, scene: &Scene, x: Vec3, normal: Vec3, to_eye: Vec3, shininess: f32) -> Vec3 {
        match self.form(x, MAX_EDGES) {
            Some(form) => form.specular(normal, to_eye, shininess),
            None => self.sampled_specular(scene, x, normal, to_eye, shininess),
        }
    }

    fn sampled_specular(&self, scene: &Scene, x: Vec3, normal: Vec3, to_eye: Vec3, shininess: f32) -> Vec3 {
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

impl ClosedForm<'_> {
    /// Unoccluded highlight for the source's mean radiance; exact (1e-4) for any exponent and size of light.
    #[must_use]
    pub fn specular(&self, normal: Vec3, to_eye: Vec3, shininess: f32) -> Vec3 {
        if shininess == 0.0 {
            return self.irradiance(normal) / std::f32::consts::PI;
        }
        let (n, eye): (DVec3, DVec3) = (normal.as_dvec3(), to_eye.as_dvec3());
        let axis = (n * (2.0 * n.dot(eye)) - eye).normalize_or(n);
        let phong = Lobe { normal: n, axis, shininess: f64::from(shininess) };
        let sum: f64 = self.polygons().map(|(polygon, terms)| highlight(&phong, polygon, terms)).sum();
        self.mean_radiance() * sum.max(0.0) as f32
    }
}

/// Highlight of a polygon of radiance 1: nil outside the lobe; one value of the lobe if that does not change over the
/// polygon; else the contour integral.
fn highlight(phong: &Lobe, polygon: &Seen<'_>, terms: &[DVec3]) -> f64 {
    let (middle, least) = polygon.cone();
    let cosine = middle.dot(phong.axis);
    let nearest = cosine.clamp(-1.0, 1.0).acos() - least.acos();
    if nearest > 0.0 && phong.shininess * nearest.min(FRAC_PI_2).cos().ln() < NEGLIGIBLE {
        return 0.0;
    }
    // 2 (1 − cos ρ) s is the square of the cone's half angle in widths of the lobe.
    let above_horizon = || middle.dot(phong.normal) > (1.0 - least * least).max(0.0).sqrt();
    if 2.0 * (1.0 - least) * (phong.shininess + 1.0) < CONSTANT && above_horizon() {
        return polygon.irradiance(terms, phong.normal) * phong.value(cosine);
    }
    polygon.sign * phong.over_polygon(polygon.base, polygon.corners)
}
