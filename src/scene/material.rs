//! Materials: the part of MTL that the reflection model uses.

use super::texture::{TextureId, Wrap};
use glam::{Vec2, Vec3};

/// Index into [`super::Scene::materials`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct MaterialId(pub u32);

/// A texture as a material looks it up: at uv · scale + offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureMap {
    /// The texture.
    pub texture: TextureId,
    /// How often it repeats over a unit of u and v (`-s`).
    pub scale: Vec2,
    /// What is added to the scaled coordinates (`-o`).
    pub offset: Vec2,
    /// What shows outside of [0, 1] (`-clamp`).
    pub wrap: Wrap,
}

impl From<TextureId> for TextureMap {
    /// The texture by the coordinates as they are, repeated.
    fn from(texture: TextureId) -> Self {
        Self { texture, scale: Vec2::ONE, offset: Vec2::ZERO, wrap: Wrap::Repeat }
    }
}

impl TextureMap {
    /// Where the texture is looked up for texture coordinates `uv`.
    #[must_use]
    #[inline]
    pub fn place(&self, uv: Vec2) -> Vec2 {
        uv * self.scale + self.offset
    }
}

/// A physically normalised Phong material, f_r = k_d/π + k_s (s+2)/(2π) max(0, r·ω)^s  [FP03 §4.3].
///
/// The loader guarantees k_d + k_s ≤ 1 in each channel, all values finite and ≥ 0. Triangles of materials that
/// cannot be drawn yet (glass) never reach the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// The name in the MTL file.
    pub name: String,
    /// Diffuse reflectance k_d (`Kd`), linear, without unit; multiplied by `map_kd` where there is one.
    pub kd: Vec3,
    /// Specular reflectance k_s (`Ks`), linear, without unit.
    pub ks: Vec3,
    /// Phong exponent s (`Ns`).
    pub shininess: f32,
    /// Emitted radiance (`Ke`), W·sr⁻¹·m⁻².
    pub ke: Vec3,
    /// Diffuse texture, at most 1.
    pub map_kd: Option<TextureMap>,
    /// Emission texture, which `ke` is multiplied by; it may be brighter than 1.
    pub map_ke: Option<TextureMap>,
    /// Cut-out mask (one channel, linear): opaque at ≥ 0.5.
    pub map_d: Option<TextureMap>,
    /// Whether it is meant to mirror (illum 3 and 5, or s > 1000): until there are reflections its highlight shows light
    /// straight from the sources only.
    pub mirror: bool,
}

impl Material {
    /// Diffuse reflectance that reflects as much of even light as the highlight does: ⅔ k_s, the mean of cos²θ / cosθ over the
    /// hemisphere, since a sharp normalised lobe reflects k_s cosθ of what comes in at θ. 0 for a mirror, which waits for
    /// reflections.
    #[must_use]
    pub fn highlight_albedo(&self) -> Vec3 {
        if self.mirror { Vec3::ZERO } else { self.ks * (2.0 / 3.0) }
    }

    /// A diffuse grey material, what a face without a material gets.
    #[must_use]
    pub fn grey(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            kd: Vec3::splat(0.8),
            ks: Vec3::ZERO,
            shininess: 0.0,
            ke: Vec3::ZERO,
            map_kd: None,
            map_ke: None,
            map_d: None,
            mirror: false,
        }
    }

    /// Whether the material emits light.
    #[must_use]
    pub fn is_emissive(&self) -> bool {
        self.ke.max_element() > 0.0
    }

    /// Whether the material reflects a highlight.
    #[must_use]
    pub fn is_glossy(&self) -> bool {
        self.ks.max_element() > 0.0
    }
}
