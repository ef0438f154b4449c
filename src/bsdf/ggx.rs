//! GGX microfacets \[Walter07\] with height-correlated Smith masking \[Heitz14\], Schlick's Fresnel factor \[Schlick94\], and what is
//! scattered more than once between facets \[Kulla17\]: no light is lost, and f_s stays reciprocal.
//!
//! What the highlight of a dielectric does not reflect goes to its diffuse part, f_d = ρ/π T(μ_i) T(μ_o) / T̄ with T = 1 − albedo of
//! the highlight: reciprocal, and a white one reflects all light in any direction.

use super::directions::around;
use super::ggx_table::{Albedo, DIELECTRIC, LEAST_ROUGHNESS, Row, SIZE};
use crate::math::polygon::{Corners, clip, edge_term, edges};
use glam::{DMat3, DVec3, Vec2, Vec3};
use std::f32::consts::{FRAC_1_PI, PI, TAU};

/// Roughness from which on the fit of lobes is off by more than some percent, and they are so wide that a few directions tell them well.
const WIDE: f32 = 0.2;

/// Least cosine to the eye: below it, a shading normal turns away from an eye that sees the surface all the same.
const LEAST_COSINE: f32 = 1e-3;

/// A rough surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Microfacets {
    /// Perceptual roughness, α = roughness².
    roughness: f32,
    /// F₀, reflectance of a facet at normal incidence.
    f0: Vec3,
    row: Row,
}

impl Microfacets {
    /// A surface of perceptual `roughness` from 0 to 1, at least 0.03, whose facets reflect `f0` at normal incidence.
    #[must_use]
    pub fn new(roughness: f32, f0: Vec3) -> Self {
        let roughness = roughness.clamp(LEAST_ROUGHNESS, 1.0);
        Self { roughness, f0, row: Row::of(roughness) }
    }

    /// A dielectric of index of refraction 1.5.
    #[must_use]
    pub fn dielectric(roughness: f32) -> Self {
        Self::new(roughness, Vec3::splat(DIELECTRIC))
    }

    /// Perceptual roughness.
    #[must_use]
    pub const fn roughness(&self) -> f32 {
        self.roughness
    }

    /// F₀.
    #[must_use]
    pub const fn f0(&self) -> Vec3 {
        self.f0
    }

    fn alpha(&self) -> f32 {
        self.roughness * self.roughness
    }

    /// See [`super::Gloss::exponent`].
    #[must_use]
    pub fn exponent(&self) -> f32 {
        ((self.alpha().powi(-2) * 2.0 - 2.0) * 0.25).max(1.0)
    }

    /// Reflectance by facets that single scattering gives an albedo.
    fn reflected_once(&self, albedo: Albedo) -> Vec3 {
        self.f0 * albedo.whole + (Vec3::ONE - self.f0) * albedo.grazing
    }

    /// What of the light that is scattered again leaves the surface: F̄² Ē / (1 − F̄ (1 − Ē)).
    fn scattered_again(&self) -> Vec3 {
        // Mean of Schlick's factor over the hemisphere.
        let mean = self.f0 + (Vec3::ONE - self.f0) / 21.0;
        let escaped = self.row.mean().whole;
        mean * mean * escaped / (Vec3::ONE - mean * (1.0 - escaped))
    }

    /// Albedo of all scattering in a direction at `cosine` to the normal.
    #[must_use]
    pub fn albedo(&self, cosine: f32) -> Vec3 {
        let once = self.row.albedo(cosine);
        self.reflected_once(once) + self.scattered_again() * (1.0 - once.whole)
    }

    /// Its mean over an even hemisphere.
    #[must_use]
    pub fn mean_albedo(&self) -> Vec3 {
        let once = self.row.mean();
        self.reflected_once(once) + self.scattered_again() * (1.0 - once.whole)
    }

    /// See [`super::Gloss::diffuse_in`].
    #[inline]
    pub(super) fn diffuse_in(&self, cosine: f32) -> f32 {
        let dielectric = Self { f0: Vec3::splat(DIELECTRIC), ..*self };
        dielectric.diffuse_out(cosine) / (1.0 - dielectric.mean_albedo().x)
    }

    /// See [`super::Gloss::diffuse_out`].
    #[inline]
    pub fn diffuse_out(&self, cosine: f32) -> f32 {
        let dielectric = Self { f0: Vec3::splat(DIELECTRIC), ..*self };
        1.0 - dielectric.albedo(cosine.max(0.0)).x
    }

    /// Mean of [`super::Gloss::diffuse_out`].
    #[must_use]
    pub fn mean_diffuse_out(&self) -> f32 {
        1.0 - Self { f0: Vec3::splat(DIELECTRIC), ..*self }.mean_albedo().x
    }
}

/// The highlight of a rough surface as an eye sees it.
#[derive(Clone, Copy, Debug)]
pub struct GgxLobe {
    facets: Microfacets,
    normal: Vec3,
    to_eye: Vec3,
    /// Towards the eye along the surface.
    forward: Vec3,
    /// Cosine to the eye.
    cosine: f32,
    alpha: f32,
    /// Albedo of single scattering towards the eye.
    once: Albedo,
    /// f_ms without the factor 1 − E(μ_i), sr⁻¹.
    again: Vec3,
    /// Share of directions that are drawn for what is scattered again.
    even: f32,
}

/// A linear transform of the clamped cosine that stands for a lobe \[Heitz16\].
#[derive(Clone, Copy, Debug)]
pub struct TransformedCosine {
    inverse: DMat3,
    normal: DVec3,
}

impl GgxLobe {
    /// The lobe of a surface of unit `normal` in the unit direction `to_eye`.
    #[must_use]
    pub fn new(facets: Microfacets, normal: Vec3, to_eye: Vec3) -> Self {
        let height = normal.dot(to_eye);
        let forward = (to_eye - normal * height).try_normalize().unwrap_or_else(|| normal.any_orthonormal_vector());
        let cosine = height.clamp(LEAST_COSINE, 1.0);
        let to_eye = if height < LEAST_COSINE {
            forward * (1.0 - LEAST_COSINE * LEAST_COSINE).sqrt() + normal * LEAST_COSINE
        } else {
            to_eye
        };
        let once = facets.row.albedo(cosine);
        let lost = 1.0 - facets.row.mean().whole;
        let scattered = facets.scattered_again() * (1.0 - once.whole);
        let albedo = (facets.reflected_once(once) + scattered).max_element();
        let even = if albedo > 0.0 { (scattered.max_element() / albedo).clamp(0.0, 1.0) } else { 0.0 };
        let again = if lost > 1e-5 { scattered * (FRAC_1_PI / lost) } else { Vec3::ZERO };
        Self { facets, normal, to_eye, forward, cosine, alpha: facets.alpha(), once, again, even }
    }

    /// f_s for light from the unit direction `to_light`, sr⁻¹.
    #[must_use]
    #[inline]
    pub fn value(&self, to_light: Vec3) -> Vec3 {
        let cosine = self.normal.dot(to_light);
        if cosine <= 0.0 {
            return Vec3::ZERO;
        }
        self.value_once(to_light) + self.again * (1.0 - self.facets.row.albedo(cosine).whole)
    }

    /// The part of it that is scattered once, sr⁻¹.
    #[must_use]
    #[inline]
    pub fn value_once(&self, to_light: Vec3) -> Vec3 {
        let cosine = self.normal.dot(to_light);
        if cosine <= 0.0 {
            return Vec3::ZERO;
        }
        let half = (self.to_eye + to_light).normalize_or(self.normal);
        let masked = 1.0 / (1.0 + self.shadowed(self.cosine) + self.shadowed(cosine));
        let fresnel = self.facets.f0 + (Vec3::ONE - self.facets.f0) * grazing(self.to_eye.dot(half));
        fresnel * (self.distribution(half) * masked / (4.0 * self.cosine * cosine))
    }

    /// The same where facets reflect all light, over its albedo, sr⁻¹.
    pub(super) fn shape(&self, to_light: Vec3) -> f32 {
        let white = Self { facets: Microfacets { f0: Vec3::ONE, ..self.facets }, ..*self };
        white.value_once(to_light).x / self.once.whole.max(f32::MIN_POSITIVE)
    }

    /// Share of facets of normal `half`, D, sr⁻¹.
    fn distribution(&self, half: Vec3) -> f32 {
        let a2 = self.alpha * self.alpha;
        let cosine = self.normal.dot(half).max(0.0);
        // 1 − cos² without cancellation: α² goes down to 10⁻⁶.
        let below = self.normal.cross(half).length_squared() + a2 * cosine * cosine;
        a2 / (PI * below * below)
    }

    /// Smith's Λ.
    fn shadowed(&self, cosine: f32) -> f32 {
        let tangent2 = (1.0 - cosine * cosine).max(0.0) / (cosine * cosine);
        0.5 * ((1.0 + self.alpha * self.alpha * tangent2).sqrt() - 1.0)
    }

    /// A unit direction by `u` ∈ [0, 1)²: mirrored at a visible normal \[Heitz18\], or by the cosine for what is scattered again; it
    /// may point below the surface.
    #[must_use]
    pub fn sample(&self, [u, v]: [f32; 2]) -> Vec3 {
        if u < self.even {
            return around(self.normal, (u / self.even).sqrt(), v);
        }
        let half = self.visible_normal([(u - self.even) / (1.0 - self.even), v]);
        half * (2.0 * self.to_eye.dot(half)) - self.to_eye
    }

    fn visible_normal(&self, [u, v]: [f32; 2]) -> Vec3 {
        let across = self.normal.cross(self.forward);
        let sine = (1.0 - self.cosine * self.cosine).max(0.0).sqrt();
        let eye = Vec3::new(self.alpha * sine, 0.0, self.cosine).normalize();
        let second = Vec3::new(-eye.z, 0.0, eye.x);
        let disc = Vec2::from_angle(TAU * v) * u.sqrt();
        let share = 0.5 * (1.0 + eye.z);
        let along = (1.0 - share) * (1.0 - disc.x * disc.x).max(0.0).sqrt() + share * disc.y;
        let up = (1.0 - disc.x * disc.x - along * along).max(0.0).sqrt();
        let n = Vec3::Y * disc.x + second * along + eye * up;
        let n = Vec3::new(self.alpha * n.x, self.alpha * n.y, n.z.max(0.0));
        (self.forward * n.x + across * n.y + self.normal * n.z).normalize_or(self.normal)
    }

    /// Density with which [`Self::sample`] takes a unit direction, sr⁻¹.
    #[must_use]
    pub fn density(&self, to_light: Vec3) -> f32 {
        let half = self.to_eye + to_light;
        let Some(half) = half.try_normalize() else { return 0.0 };
        let by_cosine = self.normal.dot(to_light).max(0.0) * FRAC_1_PI;
        if self.normal.dot(half) <= 0.0 {
            return self.even * by_cosine;
        }
        let by_facets = self.distribution(half) / ((1.0 + self.shadowed(self.cosine)) * 4.0 * self.cosine);
        self.even * by_cosine + (1.0 - self.even) * by_facets
    }

    /// Share of even light that it sends to the eye.
    #[must_use]
    pub fn albedo(&self) -> Vec3 {
        self.facets.albedo(self.cosine)
    }

    /// See [`super::Lobe::exponent`].
    pub(super) fn exponent(&self) -> f32 {
        self.facets.exponent()
    }

    /// Unit normal of the surface.
    pub(super) const fn normal(&self) -> Vec3 {
        self.normal
    }

    /// The lobe of facets whose α² is larger by `more`.
    pub(super) fn widened(&self, more: f32) -> Self {
        let squared = self.alpha * self.alpha + more;
        Self::new(Microfacets::new(squared.sqrt().sqrt(), self.facets.f0), self.normal, self.to_eye)
    }

    /// Albedo towards the eye of light that is scattered once.
    #[must_use]
    pub fn albedo_once(&self) -> Vec3 {
        self.facets.reflected_once(self.once)
    }

    /// The same of light of which the lobe sees a `share` of 1, from about a unit direction: what reflects at grazing angles is that
    /// direction's where the share is small, the lobe's where it is all.
    #[must_use]
    pub fn albedo_once_of(&self, to_light: Vec3, share: f32) -> Vec3 {
        let half = (self.to_eye + to_light).normalize_or(self.normal);
        let there = grazing(self.to_eye.dot(half));
        let mean = self.once.grazing / self.once.whole.max(f32::MIN_POSITIVE);
        let grazing = (there + (mean - there) * share.clamp(0.0, 1.0)) * self.once.whole;
        self.facets.reflected_once(Albedo { grazing, ..self.once })
    }

    /// f_s of what is scattered again, for light spread evenly about a direction at `cosine` to the normal, sr⁻¹; `concentration`
    /// is 1 for light from there alone, 1/2 for that of an even hemisphere.
    #[must_use]
    pub fn again(&self, cosine: f32, concentration: f32) -> Vec3 {
        let mean = 1.0 - self.facets.row.mean().whole;
        let there = 1.0 - self.facets.row.albedo(cosine.max(0.0)).whole;
        self.again * (mean + (there - mean) * (2.0 * concentration - 1.0).clamp(0.0, 1.0))
    }

    /// Whether it is so wide that a few directions tell it well.
    #[must_use]
    pub fn is_wide(&self) -> bool {
        self.facets.roughness >= WIDE
    }

    /// Its fit by a transformed cosine.
    #[must_use]
    pub fn transformed_cosine(&self) -> TransformedCosine {
        let (normal, forward) = (self.normal.as_dvec3(), self.forward.as_dvec3());
        let to_frame = DMat3::from_cols(forward, normal.cross(forward), normal).transpose();
        TransformedCosine { inverse: self.facets.row.inverse(self.alpha, self.cosine) * to_frame, normal }
    }
}

impl TransformedCosine {
    /// The lobe with the cosine in a unit direction, over its albedo, sr⁻¹.
    #[must_use]
    pub fn value(&self, to_light: Vec3) -> f32 {
        if self.normal.dot(to_light.as_dvec3()) <= 0.0 {
            return 0.0;
        }
        let turned = self.inverse * to_light.as_dvec3();
        let squared = turned.length_squared();
        let value = turned.z.max(0.0) * self.inverse.determinant().abs() / (squared * squared);
        (value / std::f64::consts::PI) as f32
    }

    /// ∫ over the convex polygon `base + relative[i]` seen from the origin, counter-clockwise (for the other sense: its negative), of
    /// the lobe with the cosine, over its albedo: 1 over the whole sphere.
    #[must_use]
    pub fn over_polygon(&self, base: DVec3, relative: &[DVec3]) -> f64 {
        let above = clip(base, relative, self.normal);
        let (base, turned) = (self.inverse * base, above.iter().map(|&r| self.inverse * r).collect::<Corners>());
        let lit = clip(base, &turned, DVec3::Z);
        edges(&lit).map(|(a, b)| edge_term(base + a, b - a).z).sum::<f64>() / std::f64::consts::PI
    }
}

/// [`super::Gloss::diffuse_out`] of dielectrics as shaders look it up: by roughness from [`LEAST_ROUGHNESS`] to 1, then by √(1 − μ).
#[must_use]
pub fn diffuse_out_table() -> Vec<f32> {
    let steps = || (0..SIZE).map(|i| i as f32 / (SIZE - 1) as f32);
    let roughness = |x: f32| LEAST_ROUGHNESS + x * (1.0 - LEAST_ROUGHNESS);
    let row = |x: f32| steps().map(move |y| Microfacets::dielectric(roughness(x)).diffuse_out(1.0 - y * y));
    steps().flat_map(row).collect()
}

/// (1 − cosθ)⁵.
#[inline]
fn grazing(cosine: f32) -> f32 {
    (1.0 - cosine.clamp(0.0, 1.0)).powi(5)
}

#[cfg(test)]
mod tests;
