//! Reflection: f_r = f_d + f_s, a diffuse part and a highlight by the material's model (docs/method/reflection.md).
//!
//! What a model has to tell, and who asks:
//!
//! | | Function | Callers |
//! |---|---|---|
//! | evaluate | [`Lobe::value`], sr⁻¹, light from one direction | `light`, `cache::luminance`, `reference::surface` |
//! | sample | [`Lobe::sample`], [`sample_diffuse`] | `reference::surface`, `light` |
//! | density | [`Lobe::density`], sr⁻¹ | `reference::surface`, `light`, to weigh samples of lights against it |
//! | albedo | [`Reflectance::albedo`] of both parts, [`Lobe::albedo`] towards the eye | `estimate::surface`, `reference::surface` |
//! | polygon | [`Lobe::as_phong`], [`GgxLobe::transformed_cosine`], in closed form | `light::area_specular` |
//! | light vector | [`Lobe::over_spread_light`], approximately | `estimate::light_vector` |
//! | diffuse part | [`Gloss::diffuse_in`], [`Gloss::diffuse_out`]: what the highlight leaves to it | `cache::luminance`, `reference::surface` |
//!
//! A [`Gloss`] is what a material says of the highlight at a point; seen by an eye it is a [`Lobe`].

mod directions;
pub mod ggx;
mod ggx_table;
pub mod phong;
mod reflectance;
mod spread_light;

pub use directions::sample_diffuse;
pub use ggx::{GgxLobe, Microfacets, TransformedCosine, diffuse_out_table};
pub use ggx_table::{LEAST_ROUGHNESS, SIZE as TABLE_SIZE};
pub use reflectance::{Reflectance, mean_f0};
pub use spread_light::SpreadLight;

use crate::math::phong_polygon;
use glam::Vec3;

/// The highlight of a surface, whoever looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Gloss {
    /// Normalised Phong; what is to be multiplied by k_s.
    Phong {
        /// Exponent s.
        shininess: f32,
        /// Whether it is meant to mirror: see [`crate::scene::material::Phong::mirror`].
        mirror: bool,
    },
    /// GGX microfacets, Fresnel factor included.
    Ggx(Microfacets),
}

impl Gloss {
    /// The highlight on a surface of unit `normal` in the unit direction `to_eye`.
    #[must_use]
    #[inline]
    pub fn seen(self, normal: Vec3, to_eye: Vec3) -> Lobe {
        match self {
            Self::Phong { shininess, .. } => Lobe::Phong(PhongLobe { normal, to_eye, shininess }),
            Self::Ggx(facets) => Lobe::Ggx(GgxLobe::new(facets, normal, to_eye)),
        }
    }

    /// Whether its highlight shows direct light only.
    #[must_use]
    pub const fn is_mirror(self) -> bool {
        matches!(self, Self::Phong { mirror: true, .. })
    }

    /// Exponent of the Phong lobe that is about as wide: GGX of α falls about the half vector as cosⁿ with n = 2/α² − 2, which is
    /// a quarter of that about the mirrored eye.
    #[must_use]
    pub fn exponent(self) -> f32 {
        match self {
            Self::Phong { shininess, .. } => shininess,
            Self::Ggx(facets) => facets.exponent(),
        }
    }

    /// What the diffuse part counts times for light at `cosine` to the normal, a number: what the highlight leaves of it, 1 on
    /// average over an even hemisphere.
    #[must_use]
    #[inline]
    pub fn diffuse_in(self, cosine: f32) -> f32 {
        match self {
            Self::Phong { .. } => 1.0,
            Self::Ggx(facets) => facets.diffuse_in(cosine),
        }
    }

    /// [`Self::diffuse_in`] of light spread about a direction at `cosine` to the normal; `concentration` is 1 for light from there alone,
    /// 1/2 for that of an even hemisphere.
    #[must_use]
    #[inline]
    pub fn diffuse_in_spread(self, cosine: f32, concentration: f32) -> f32 {
        match self {
            Self::Phong { .. } => 1.0,
            Self::Ggx(facets) => 1.0 + (facets.diffuse_in(cosine) - 1.0) * (2.0 * concentration - 1.0).clamp(0.0, 1.0),
        }
    }

    /// The same towards an eye at `cosine` to the normal: the share of the diffuse reflectance that it sees.
    #[must_use]
    #[inline]
    pub fn diffuse_out(self, cosine: f32) -> f32 {
        match self {
            Self::Phong { .. } => 1.0,
            Self::Ggx(facets) => facets.diffuse_out(cosine),
        }
    }
}

/// A highlight as an eye sees it.
#[derive(Clone, Copy, Debug)]
pub enum Lobe {
    /// Normalised Phong.
    Phong(PhongLobe),
    /// GGX microfacets.
    Ggx(GgxLobe),
}

/// A Phong lobe and its eye.
#[derive(Clone, Copy, Debug)]
pub struct PhongLobe {
    normal: Vec3,
    to_eye: Vec3,
    shininess: f32,
}

impl Lobe {
    /// f_s / k_s for light from the unit direction `to_light`, sr⁻¹.
    #[must_use]
    #[inline]
    pub fn value(&self, to_light: Vec3) -> Vec3 {
        match self {
            Self::Phong(p) => Vec3::splat(phong::lobe(p.shininess, p.normal, to_light, p.to_eye)),
            Self::Ggx(ggx) => ggx.value(to_light),
        }
    }

    /// A unit direction chosen by `u` ∈ [0, 1)² about in proportion to the lobe; it may point below the surface.
    #[must_use]
    pub fn sample(&self, u: [f32; 2]) -> Vec3 {
        match self {
            Self::Phong(p) => phong::sample_lobe(p.shininess, p.normal, p.to_eye, u),
            Self::Ggx(ggx) => ggx.sample(u),
        }
    }

    /// Density with which [`Self::sample`] takes a unit direction, sr⁻¹.
    #[must_use]
    pub fn density(&self, to_light: Vec3) -> f32 {
        match self {
            Self::Phong(p) => phong::lobe_density(p.shininess, phong::lobe(p.shininess, p.normal, to_light, p.to_eye)),
            Self::Ggx(ggx) => ggx.density(to_light),
        }
    }

    /// Share of even light that it sends to the eye: of Phong roughly, as the lobe's part above the horizon.
    #[must_use]
    pub fn albedo(&self) -> Vec3 {
        match self {
            Self::Phong(p) => Vec3::splat(p.normal.dot(p.to_eye).max(0.0)),
            Self::Ggx(ggx) => ggx.albedo(),
        }
    }

    /// Exponent of the Phong lobe that is about as wide.
    #[must_use]
    pub fn exponent(&self) -> f32 {
        match self {
            Self::Phong(p) => p.shininess,
            Self::Ggx(ggx) => ggx.exponent(),
        }
    }

    /// The Phong lobe, if it is one, for its closed forms.
    #[must_use]
    pub fn as_phong(&self) -> Option<phong_polygon::Lobe> {
        let Self::Phong(PhongLobe { normal, to_eye, shininess }) = *self else { return None };
        let (n, eye) = (normal.as_dvec3(), to_eye.as_dvec3());
        let axis = (n * (2.0 * n.dot(eye)) - eye).normalize_or(n);
        Some(phong_polygon::Lobe { normal: n, axis, shininess: f64::from(shininess) })
    }

    /// What it reflects of spread light, over the light's irradiance, sr⁻¹.
    #[must_use]
    pub fn over_spread_light(&self, light: &SpreadLight) -> Vec3 {
        match self {
            Self::Phong(p) => Vec3::splat(light.in_phong_lobe(p.normal, p.to_eye, p.shininess)),
            Self::Ggx(ggx) => light.in_ggx_lobe(ggx),
        }
    }
}
