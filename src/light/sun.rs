//! A disc of even radiance, infinitely far.

use super::arrival::Arrival;
use super::receiver::Receiver;
use crate::math::luminance;
use crate::math::sequence::Sequence;
use glam::Vec3;
use std::f32::consts::{PI, TAU};

/// A disc, prepared for sampling.
#[derive(Clone, Copy, Debug)]
pub struct SunSource {
    /// Unit direction to its middle.
    direction: Vec3,
    /// Cosine, sine and 1 − cosine of half the angle that it takes.
    cosine: f32,
    sine: f32,
    height: f32,
    /// W·sr⁻¹·m⁻².
    radiance: Vec3,
}

/// Square of the half angle, in widths of the lobe, up to which a highlight sees one direction.
const ONE_DIRECTION: f32 = 0.02;
/// Points of the disc that a sharper highlight sees.
const POINTS: u32 = 64;

impl SunSource {
    /// Prepares a disc of `half_angle`, radians, in a unit direction.
    #[must_use]
    pub fn new(direction: Vec3, half_angle: f32, radiance: Vec3) -> Self {
        let (sine, cosine) = half_angle.sin_cos();
        let height = 2.0 * (half_angle * 0.5).sin().powi(2);
        Self { direction, cosine, sine, height, radiance }
    }

    /// Unit direction to its middle.
    #[must_use]
    pub const fn direction(&self) -> Vec3 {
        self.direction
    }

    /// Solid angle, sr.
    #[must_use]
    pub fn solid_angle(&self) -> f32 {
        TAU * self.height
    }

    /// Irradiance on a plane facing it, W·m⁻².
    #[must_use]
    pub fn facing(&self) -> Vec3 {
        self.radiance * (PI * self.sine * self.sine)
    }

    /// Unoccluded irradiance on a surface of unit `normal`, W·m⁻², exactly: what of the disc is above the horizon.
    #[must_use]
    pub fn irradiance(&self, normal: Vec3) -> Vec3 {
        let cosine = normal.dot(self.direction);
        if cosine >= self.sine {
            return self.facing() * cosine;
        }
        if cosine <= -self.sine {
            return Vec3::ZERO;
        }
        // A sphere cut by the horizon, \[Snyder96\].
        let [cosine, sine_of_disc] = [cosine, self.sine].map(f64::from);
        let sine = (1.0 - cosine * cosine).sqrt();
        let cotangent = f64::from(self.cosine) / sine_of_disc;
        let y = (-cotangent * cosine / sine).clamp(-1.0, 1.0);
        let edge = sine * (1.0 - y * y).sqrt();
        let form = (cosine * y.acos() - cotangent * edge) * sine_of_disc * sine_of_disc + (edge / cotangent).atan();
        self.radiance * form.max(0.0) as f32
    }

    /// Upper bound of its luminance, W·m⁻²; 0 only where no light can arrive.
    #[must_use]
    pub fn bound(&self, normal: Vec3) -> f32 {
        let highest = normal.dot(self.direction) + self.sine;
        if highest > 0.0 { luminance(self.facing()) * highest.min(1.0) } else { 0.0 }
    }

    /// About its luminance, W·m⁻²; 0 where the bound is.
    #[must_use]
    pub fn strength(&self, normal: Vec3) -> f32 {
        let bound = self.bound(normal);
        if bound > 0.0 { luminance(self.irradiance(normal)).max(bound * 1e-6) } else { 0.0 }
    }

    /// Whether a unit direction leads to it.
    #[must_use]
    pub fn is_met(&self, direction: Vec3) -> bool {
        // The distance of the ends tells small angles, their cosine does not.
        direction.distance_squared(self.direction) < 2.0 * self.height
    }

    /// Radiance from a unit direction, W·sr⁻¹·m⁻².
    #[must_use]
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        if self.is_met(direction) { self.radiance } else { Vec3::ZERO }
    }

    /// The disc with an edge of the width `angle`, radians, in a unit direction, W·sr⁻¹·m⁻²: as `glsl/include/sky.glsl` shows it.
    #[must_use]
    pub fn seen(&self, direction: Vec3, angle: f32) -> Vec3 {
        let inside = (2.0 * self.height).sqrt() - direction.distance(self.direction);
        self.radiance * (inside / angle.max(1e-6) + 0.5).clamp(0.0, 1.0)
    }

    /// The light from the point of the disc chosen by `u` ∈ [0, 1)², evenly.
    #[must_use]
    pub fn sample(&self, [u, v]: [f32; 2]) -> Arrival {
        let below = self.height * u;
        let sine = (below * (2.0 - below)).sqrt();
        let (x, y) = self.direction.any_orthonormal_pair();
        let (sin_turn, cos_turn) = (v * TAU).sin_cos();
        let direction = (self.direction * (1.0 - below) + (x * cos_turn + y * sin_turn) * sine).normalize();
        let measure = self.solid_angle();
        Arrival { direction, distance: f32::INFINITY, facing: self.radiance * measure, measure }
    }

    /// Density with which [`Self::sample`] takes a unit direction, sr⁻¹.
    #[must_use]
    pub fn density(&self, direction: Vec3) -> f32 {
        if self.is_met(direction) { self.solid_angle().recip() } else { 0.0 }
    }

    /// Unoccluded highlight ∫ lobe · L cosθ dω, W·sr⁻¹·m⁻².
    #[must_use]
    pub fn specular(&self, receiver: &Receiver) -> Vec3 {
        let Receiver { normal, lobe, .. } = *receiver;
        if self.sine * self.sine * (lobe.exponent() + 2.0) < ONE_DIRECTION {
            return self.irradiance(normal) * lobe.value(self.direction);
        }
        let sequence = Sequence::new(1);
        let of_point = |index| {
            let [u, v, ..] = sequence.point(index);
            let arrival = self.sample([u, v]);
            arrival.irradiance(normal) * lobe.value(arrival.direction)
        };
        (0..POINTS).map(of_point).sum::<Vec3>() / POINTS as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn irradiance_is_the_mean_over_points_at_any_height() {
        for half_angle in [0.0046_f32, 0.2, 0.9] {
            let sun = SunSource::new(Vec3::new(0.6, 0.8, 0.0), half_angle, Vec3::new(1.0, 2.0, 4.0));
            let across = Vec3::new(-0.8, 0.6, 0.0);
            for height in [-1.5_f32, -0.9, -0.3, 0.0, 0.2, 0.8, 1.2, 3.0] {
                let turn = std::f32::consts::FRAC_PI_2 - height * half_angle;
                let normal = sun.direction() * turn.cos() + across * turn.sin();
                let point = |i| {
                    let [u, v, ..] = Sequence::new(4).point(i);
                    sun.sample([u, v]).irradiance(normal).as_dvec3()
                };
                let mean = ((0..1 << 14).map(point).sum::<DVec3>() / f64::from(1 << 14)).as_vec3();
                let (found, most) = (sun.irradiance(normal), sun.facing() * half_angle.sin());
                assert!((found - mean).abs().cmple(most * 3e-3).all(), "{half_angle} {height}: {found} {mean}");
                assert!(sun.bound(normal) >= luminance(found) * 0.999_99, "{half_angle} {height}");
            }
        }
    }

    #[test]
    fn what_is_drawn_is_met() {
        let sun = SunSource::new(Vec3::new(0.6, 0.8, 0.0), 0.0046, Vec3::ONE);
        let met = (0..1000).filter(|&i| {
            let [u, v, ..] = Sequence::new(4).point(i);
            sun.is_met(sun.sample([u, v]).direction)
        });
        assert!(met.count() > 995);
        assert!(!sun.is_met(Vec3::new(0.61, 0.79, 0.0).normalize()));
        assert!((sun.solid_angle() / (PI * 0.0046 * 0.0046) - 1.0).abs() < 1e-3);
    }
}
