//! Materials: the part of MTL that the reflection model uses.

use super::texture::{TextureId, Wrap};
use glam::{Mat2, Vec2, Vec3};

/// Index into [`super::Scene::materials`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct MaterialId(pub u32);

/// A texture as a material looks it up: at matrix · uv + offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureMap {
    /// The texture.
    pub texture: TextureId,
    /// How often it repeats over a unit of u and v (`-s`), and how it is turned (`KHR_texture_transform`).
    pub matrix: Mat2,
    /// What is added then (`-o`).
    pub offset: Vec2,
    /// What shows outside of [0, 1], along u and along v (`-clamp`).
    pub wrap: [Wrap; 2],
}

impl From<TextureId> for TextureMap {
    /// The texture by the coordinates as they are, repeated.
    fn from(texture: TextureId) -> Self {
        Self { texture, matrix: Mat2::IDENTITY, offset: Vec2::ZERO, wrap: [Wrap::Repeat; 2] }
    }
}

impl TextureMap {
    /// Where the texture is looked up for texture coordinates `uv`.
    #[must_use]
    #[inline]
    pub fn place(&self, uv: Vec2) -> Vec2 {
        self.matrix * uv + self.offset
    }
}

/// A material: a diffuse part and a highlight, by the parameters of its [`Model`].
///
/// The loader guarantees all values finite and ≥ 0, and that no model reflects more than arrives. Triangles of materials
/// that cannot be drawn yet (glass) never reach the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// The name in the file.
    pub name: String,
    /// Linear, without unit, multiplied by `map_kd` where there is one: diffuse reflectance k_d (`Kd`) of a Phong material, base
    /// colour of a metallic-roughness one.
    pub kd: Vec3,
    /// How it reflects.
    pub model: Model,
    /// Emitted radiance (`Ke`), W·sr⁻¹·m⁻².
    pub ke: Vec3,
    /// What is seen of `ke` lights nothing (`KHR_materials_unlit`).
    pub unlit: bool,
    /// Texture of `kd`, at most 1.
    pub map_kd: Option<TextureMap>,
    /// Emission texture, which `ke` is multiplied by; it may be brighter than 1.
    pub map_ke: Option<TextureMap>,
    /// Cut-out mask (one channel, linear): opaque at ≥ 0.5.
    pub map_d: Option<TextureMap>,
    /// Normals in the frame of the texture coordinates.
    pub map_normal: Option<NormalMap>,
}

/// How a material reflects.
#[derive(Clone, Debug, PartialEq)]
pub enum Model {
    /// Physically normalised Phong, f_r = k_d/π + k_s (s+2)/(2π) max(0, r·ω)^s  [FP03 §4.3], k_d + k_s ≤ 1 in each channel.
    Phong(Phong),
    /// Lambert under GGX microfacets, by metalness and roughness, as glTF 2.0 defines them (docs/method/reflection.md).
    MetallicRoughness(MetallicRoughness),
}

/// The highlight of a Phong material.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Phong {
    /// Specular reflectance k_s (`Ks`), linear, without unit.
    pub ks: Vec3,
    /// Phong exponent s (`Ns`).
    pub shininess: f32,
    /// Whether it is meant to mirror (illum 3 and 5, or s > 1000): until there are reflections its highlight shows light
    /// straight from the sources only.
    pub mirror: bool,
}

/// Metalness and roughness.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MetallicRoughness {
    /// 0 dielectric, with the base colour as its diffuse one, to 1 metal, with the base colour as its F₀ (`Pm`).
    pub metallic: f32,
    /// Perceptual roughness, 0 to 1: α of GGX is its square (`Pr`).
    pub roughness: f32,
    /// What `metallic` is multiplied by: the blue channel of a linear texture.
    pub map_metallic: Option<TextureMap>,
    /// What `roughness` is multiplied by: the green channel of a linear texture.
    pub map_roughness: Option<TextureMap>,
}

/// A normal map: linear RGB in [0, 1] for x (along u), y (along v, up) and z (out of the surface) in [−1, 1].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormalMap {
    /// The texture.
    pub map: TextureMap,
    /// What x and y count times.
    pub scale: f32,
}

impl Default for Model {
    /// Without a highlight.
    fn default() -> Self {
        Self::Phong(Phong::default())
    }
}

impl Model {
    /// Phong with a highlight of reflectance `ks` and exponent `shininess`, and no mirror.
    #[must_use]
    pub const fn phong(ks: Vec3, shininess: f32) -> Self {
        Self::Phong(Phong { ks, shininess, mirror: false })
    }
}

impl Material {
    /// A diffuse grey material, what a face without a material gets.
    #[must_use]
    pub fn grey(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            kd: Vec3::splat(0.8),
            model: Model::default(),
            ke: Vec3::ZERO,
            unlit: false,
            map_kd: None,
            map_ke: None,
            map_d: None,
            map_normal: None,
        }
    }

    /// The textures that it uses.
    pub fn maps(&self) -> impl Iterator<Item = &TextureMap> {
        let rough = match &self.model {
            Model::Phong(_) => [None, None],
            Model::MetallicRoughness(model) => [model.map_metallic.as_ref(), model.map_roughness.as_ref()],
        };
        let normal = self.map_normal.as_ref().map(|normal| &normal.map);
        let colours = [self.map_kd.as_ref(), self.map_ke.as_ref(), self.map_d.as_ref(), normal];
        colours.into_iter().chain(rough).flatten()
    }

    /// Whether it is of the metallic-roughness model.
    #[must_use]
    pub const fn is_metallic_roughness(&self) -> bool {
        matches!(self.model, Model::MetallicRoughness(_))
    }

    /// Whether the material emits light.
    #[must_use]
    pub fn is_emissive(&self) -> bool {
        self.ke.max_element() > 0.0
    }

    /// Whether the material reflects a highlight.
    #[must_use]
    pub fn is_glossy(&self) -> bool {
        match &self.model {
            Model::Phong(phong) => phong.ks.max_element() > 0.0,
            Model::MetallicRoughness(_) => true,
        }
    }

    /// The highlight of a Phong material; none for another.
    #[must_use]
    pub fn phong(&self) -> Phong {
        match &self.model {
            Model::Phong(phong) => *phong,
            Model::MetallicRoughness(_) => Phong::default(),
        }
    }
}
