//! Highlights of area lights without occlusion.

use super::area::{AreaSource, ClosedForm};
use super::phong::lobe;
use crate::math::phong_polygon::Lobe;
use crate::math::sequence::Sequence;
use crate::scene::Scene;
use glam::{DVec3, Vec3};

/// Points of the light where there is no closed form.
const POINTS: u32 = 256;

impl AreaSource {
    /// Unoccluded highlight ∫ lobe · L cosθ dω of the source at `x` (method 2); `normal` and `to_eye` are unit.
    #[must_use]
    pub fn specular(&self, scene: &Scene, x: Vec3, normal: Vec3, to_eye: Vec3, shininess: f32) -> Vec3 {
        match self.closed_form(x) {
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
        let sum: f64 = self.polygons().iter().map(|p| p.sign * phong.over_polygon(p.base, p.corners)).sum();
        self.mean_radiance() * sum.max(0.0) as f32
    }
}
