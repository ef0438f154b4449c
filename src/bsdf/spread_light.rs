//! Light that is known by its mean direction and its width only, in a lobe.

use super::GgxLobe;
use glam::Vec3;
use std::f32::consts::{PI, TAU};

/// Light spread about a direction: a von Mises–Fisher lobe exp(κ cos).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpreadLight {
    /// Unit mean direction.
    pub axis: Vec3,
    /// How wide it is, |V|/Φ: 1 from one direction, 1/2 from an even hemisphere.
    pub concentration: f32,
}

/// One direction has no finite sharpness: above this the light is narrower than any highlight.
const SHARPEST: f32 = 0.999_99;
/// Light is no wider than from all around.
const LEAST: f32 = 1e-3;
/// Concentration of an even hemisphere.
const EVEN: f32 = 0.5;

impl SpreadLight {
    /// Sharpness κ of the lobe whose mean direction is as long as the concentration, by the approximation of \[Banerjee05\].
    #[must_use]
    pub fn sharpness(&self) -> f32 {
        sharpness(self.concentration)
    }

    /// The normalised Phong lobe over it, over its irradiance, sr⁻¹. Both are taken as spherical Gaussians, whose product integrates to
    /// one of sharpness sκ/(s+κ): good up to a shininess of 10 to 20 in wide light, beyond which the light within the lobe is not
    /// what one direction and one width can tell.
    pub(super) fn in_phong_lobe(&self, normal: Vec3, to_eye: Vec3, shininess: f32) -> f32 {
        let mirrored = 2.0 * normal.dot(to_eye) * normal - to_eye;
        let height = (shininess + 2.0) / (shininess + 1.0);
        height * product(shininess, self.sharpness(), mirrored.dot(self.axis))
    }

    /// A GGX lobe over it, over its irradiance, sr⁻¹: the lobe in the light's direction, as much wider as the light is, as Gaussians about half
    /// vectors are \[Wang09\]. Light from one direction is exact, and so is that of an even hemisphere, whose factor narrower light takes part
    /// in less and less.
    pub(super) fn in_ggx_lobe(&self, lobe: &GgxLobe) -> Vec3 {
        let seen = |axis: Vec3, concentration: f32| lobe.widened(0.5 / sharpness(concentration)).shape(axis);
        let even = seen(lobe.normal(), EVEN) * PI;
        let share = ((1.0 - self.concentration) / (1.0 - EVEN)).clamp(0.0, 1.0);
        let found = seen(self.axis, self.concentration) * (1.0 + (even.recip() - 1.0) * share);
        let again = lobe.again(lobe.normal().dot(self.axis), self.concentration);
        lobe.albedo_once_of(self.axis, share) * found + again
    }
}

fn sharpness(concentration: f32) -> f32 {
    let r = concentration.clamp(LEAST, SHARPEST);
    r * (3.0 - r * r) / (1.0 - r * r)
}

/// Integral of the product of two normalised spherical Gaussians, sr⁻¹, whose axes have a `cosine` between them.
fn product(a: f32, b: f32, cosine: f32) -> f32 {
    let lambda = a * b / (a + b).max(f32::MIN_POSITIVE);
    // 1 / ∫ exp(λ (cos − 1)) dω; at λ = 0 an even sphere.
    let peak = if lambda > 1e-4 { lambda / (-TAU * (-2.0 * lambda).exp_m1()) } else { 0.5 / TAU };
    peak * (lambda * (cosine - 1.0)).exp()
}
