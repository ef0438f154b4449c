//! The light vector of a point: sums over samples of the light above it, so that more can always be added.
//!
//! V = ∫ L ω dω over the hemisphere above a normal n [ZSP98] [FP03 §2.1]. Its component along n is the irradiance; against
//! the fluence Φ = ∫ L dω its length tells how wide the light is: |V|/Φ is 1 for a single direction, 1/2 for an even
//! hemisphere.

use super::hemisphere::Sample;
use crate::math::luminance;
use glam::Vec3;
use std::f32::consts::TAU;

/// Light gathered at one point for one normal.
///
/// All fields are sums over samples, so adding rounds is adding vectors: rounds count by their rays.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LightVector {
    /// Σ L cosθ w: irradiance, W·m⁻².
    irradiance: Vec3,
    /// Σ (Y cosθ w)²: of the luminance.
    squares: f32,
    /// Σ Y ω w: luminance by direction.
    vector: Vec3,
    /// Σ Y w: fluence of the luminance.
    fluence: f32,
    /// Number of samples.
    samples: u32,
}

impl LightVector {
    /// Adds a sample of a gather for the unit `normal`; one below its horizon counts as dark.
    #[inline]
    pub fn push(&mut self, normal: Vec3, sample: &Sample) {
        self.samples += 1;
        let cosine = normal.dot(sample.direction);
        if cosine > 0.0 {
            let weighted = sample.radiance * sample.weight;
            let y = luminance(weighted);
            self.irradiance += weighted * cosine;
            self.squares += (y * cosine) * (y * cosine);
            self.vector += sample.direction * y;
            self.fluence += y;
        }
    }

    /// Adds the samples of another vector of the same point and normal.
    pub fn add(&mut self, other: &Self) {
        self.irradiance += other.irradiance;
        self.squares += other.squares;
        self.vector += other.vector;
        self.fluence += other.fluence;
        self.samples += other.samples;
    }

    /// Number of samples so far.
    #[must_use]
    pub const fn samples(&self) -> u32 {
        self.samples
    }

    /// Irradiance on the surface, W·m⁻²; 0 without samples.
    #[must_use]
    pub fn irradiance(&self) -> Vec3 {
        self.irradiance / self.count()
    }

    /// The light vector by luminance, W·m⁻²: its component along the normal is the luminance of the irradiance, the rest
    /// is how the irradiance changes as the surface turns (the rotational gradient of \[Ward\]).
    #[must_use]
    pub fn vector(&self) -> Vec3 {
        self.vector / self.count()
    }

    /// Fluence of the luminance over the hemisphere, W·m⁻².
    #[must_use]
    pub fn fluence(&self) -> f32 {
        self.fluence / self.count()
    }

    /// Variance of the luminance of [`Self::irradiance`], (W·m⁻²)²; infinite with fewer than two samples.
    ///
    /// That of independent samples times [`stratification_gain`]: an expectation over many points, not a bound for one.
    /// It holds for rounds of [`super::hemisphere::Method::Stratified`]; the other methods' error is no variance.
    #[must_use]
    pub fn variance_of_mean(&self) -> f32 {
        if self.samples < 2 {
            return f32::INFINITY;
        }
        let n = self.samples as f32;
        let mean = luminance(self.irradiance) / n;
        let variance = (self.squares / n - mean * mean).max(0.0) * n / (n - 1.0);
        variance / n * stratification_gain(self.samples)
    }

    /// How wide the light is, |V|/Φ: 1 from one direction, 1/2 from an even hemisphere, 0 from a ring at the horizon.
    #[must_use]
    pub fn concentration(&self) -> f32 {
        if self.fluence > 0.0 { (self.vector.length() / self.fluence).min(1.0) } else { 0.0 }
    }

    /// Sharpness κ of the von Mises–Fisher lobe exp(κ cos) whose mean direction is as long as [`Self::concentration`],
    /// by the approximation of \[Banerjee05\].
    #[must_use]
    pub fn sharpness(&self) -> f32 {
        // One direction has no finite sharpness: above this the lobe is narrower than any highlight.
        const SHARPEST: f32 = 0.999_99;
        let r = self.concentration().min(SHARPEST);
        r * (3.0 - r * r) / (1.0 - r * r)
    }

    /// The specular luminance towards the eye, W·sr⁻¹·m⁻²: the normalised Phong lobe over light of this irradiance,
    /// spread as a von Mises–Fisher lobe of this vector's direction and width.
    ///
    /// `normal` and `to_eye` are unit. Both lobes are taken as spherical Gaussians, whose product integrates to one of
    /// sharpness sκ/(s+κ). It is an approximation: good up to a shininess of 10 to 20 in wide light, beyond which the light
    /// within the lobe is not what one direction and one width can tell.
    #[must_use]
    pub fn specular(&self, normal: Vec3, to_eye: Vec3, shininess: f32) -> Vec3 {
        let Some(axis) = self.vector.try_normalize() else { return Vec3::ZERO };
        let kappa = self.sharpness();
        let lambda = shininess * kappa / (shininess + kappa).max(f32::MIN_POSITIVE);
        // 1 / ∫ exp(λ (cos − 1)) dω; at λ = 0 an even sphere.
        let peak = if lambda > 1e-4 { lambda / (-TAU * (-2.0 * lambda).exp_m1()) } else { 0.5 / TAU };
        let mirrored = 2.0 * normal.dot(to_eye) * normal - to_eye;
        let height = (shininess + 2.0) / (shininess + 1.0) * peak;
        self.irradiance() * (height * (lambda * (mirrored.dot(axis) - 1.0)).exp())
    }

    /// What sums are divided by; 1 without samples, when all of them are 0.
    fn count(&self) -> f32 {
        self.samples.max(1) as f32
    }
}

/// Variance of the mean of `n` stratified samples against that of independent ones, on average over points of a scene:
/// n^-0.3, as measured (docs/bench.md).
#[must_use]
pub fn stratification_gain(n: u32) -> f32 {
    (n.max(1) as f32).powf(-0.3)
}
