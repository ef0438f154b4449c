//! What a material reflects at a point of the scene.

use super::ggx_table::DIELECTRIC;
use super::{Gloss, Microfacets};
use crate::scene::footprint::Footprint;
use crate::scene::material::{Material, MetallicRoughness, Model};
use crate::scene::{Scene, TriangleId};
use glam::Vec3;

/// What a material reflects at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reflectance {
    /// Diffuse reflectance, before the highlight takes its share.
    pub kd: Vec3,
    /// What the lobe of `gloss` is multiplied by.
    pub ks: Vec3,
    /// The highlight, where there is one.
    pub gloss: Option<Gloss>,
}

impl Reflectance {
    /// At barycentrics (`u`, `v`) of a triangle, textures filtered over a footprint about them.
    #[must_use]
    pub fn at(scene: &Scene, triangle: TriangleId, [u, v]: [f32; 2], footprint: &Footprint) -> Self {
        let material = scene.material(triangle);
        let colour = scene.kd_over(triangle, u, v, footprint);
        match &material.model {
            Model::Phong(phong) if phong.ks == Vec3::ZERO => Self { kd: colour, ks: Vec3::ZERO, gloss: None },
            Model::Phong(phong) => {
                let gloss = Gloss::Phong { shininess: phong.shininess, mirror: phong.mirror };
                Self { kd: colour, ks: phong.ks, gloss: Some(gloss) }
            }
            Model::MetallicRoughness(model) => {
                let [metallic, roughness] = scene.metallic_roughness_over(model, triangle, [u, v], footprint);
                Self::metallic_roughness(colour, metallic, roughness)
            }
        }
    }

    /// Of the metallic-roughness model.
    #[must_use]
    pub fn metallic_roughness(colour: Vec3, metallic: f32, roughness: f32) -> Self {
        let gloss = Gloss::Ggx(Microfacets::new(roughness, f0(colour, metallic)));
        Self { kd: colour * (1.0 - metallic), ks: Vec3::ONE, gloss: Some(gloss) }
    }

    /// What of D leaves on average over all directions: k_d, less what a microfacet highlight takes.
    #[must_use]
    pub fn leaving_diffusely(&self) -> Vec3 {
        match self.gloss {
            Some(Gloss::Ggx(facets)) => self.kd * facets.mean_diffuse_out(),
            None | Some(Gloss::Phong { .. }) => self.kd,
        }
    }

    /// Share of even light that is reflected into all directions: of a Phong highlight ⅔ k_s, as of a sharp one; of a mirror none, until
    /// there are reflections.
    #[must_use]
    pub fn albedo(&self) -> Vec3 {
        match self.gloss {
            None | Some(Gloss::Phong { mirror: true, .. }) => self.kd,
            Some(Gloss::Phong { .. }) => self.kd + self.ks * (2.0 / 3.0),
            Some(Gloss::Ggx(facets)) => self.kd * facets.mean_diffuse_out() + facets.mean_albedo(),
        }
    }
}

/// F₀ by base colour and metalness.
fn f0(colour: Vec3, metallic: f32) -> Vec3 {
    Vec3::splat(DIELECTRIC).lerp(colour, metallic)
}

/// F₀ that slots of a material are lit with: of its mean colour, where that or the metalness is textured.
#[must_use]
pub fn mean_f0(scene: &Scene, material: &Material, model: &MetallicRoughness) -> Vec3 {
    let mean = |map: &Option<crate::scene::material::TextureMap>| {
        map.as_ref().map_or(Vec3::ONE, |map| scene.texture(map).mean())
    };
    f0(material.kd * mean(&material.map_kd), model.metallic * mean(&model.map_metallic).z)
}
