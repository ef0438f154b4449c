//! Mean reflectances: how much of D and S a pixel of a face shows.

use crate::math::luminance;
use crate::scene::material::{Material, Model};
use crate::scene::{FaceId, Scene};
use glam::Vec3;

/// Mean reflectances of each material, as luminances: how much of D and S a pixel shows.
#[derive(Clone, Debug)]
pub struct Reflectances {
    by_material: Vec<[f32; 2]>,
}

impl Reflectances {
    /// Means over the textures.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        let of = |m: &Material| {
            let texture = m.map_kd.as_ref().map_or(Vec3::ONE, |map| scene.texture(map).mean());
            let kd = luminance(m.kd * texture);
            match &m.model {
                Model::Phong(phong) => [kd, luminance(phong.ks)],
                // S of it comes with its Fresnel factor.
                Model::MetallicRoughness(model) => [kd * (1.0 - model.metallic), 1.0],
            }
        };
        Self { by_material: scene.materials.iter().map(of).collect() }
    }

    /// Luminance shown on a face of D and S, W·sr⁻¹·m⁻².
    #[must_use]
    pub fn shown(&self, scene: &Scene, face: FaceId, diffuse: Vec3, specular: Vec3) -> f32 {
        let [kd, ks] = self.of_face(scene, face);
        kd * luminance(diffuse) + ks * luminance(specular)
    }

    /// Of D and of S on a face.
    #[must_use]
    pub fn of_face(&self, scene: &Scene, face: FaceId) -> [f32; 2] {
        let [kd, ks] = self.by_material[scene.triangle_materials[face.triangle().0 as usize].0 as usize];
        let colour = scene.colour_at(face.triangle(), 1.0 / 3.0, 1.0 / 3.0);
        [kd * luminance(colour), ks]
    }

    /// Square of the share of D's noise that a face shows.
    #[must_use]
    pub fn noise_gain(&self, scene: &Scene, face: FaceId) -> f32 {
        self.of_face(scene, face)[0].powi(2)
    }
}
