//! Mean reflectances: how much of D and S a pixel of a face shows.

use crate::bsdf::{Microfacets, mean_f0};
use crate::math::luminance;
use crate::scene::material::{Material, Model};
use crate::scene::{FaceId, Scene};
use glam::Vec3;

/// Mean reflectances of each material, as luminances: how much of D and S a pixel shows.
#[derive(Clone, Debug)]
pub struct Reflectances {
    /// Of D, of S, and of what S of the metallic-roughness model is of D, about.
    by_material: Vec<[f32; 3]>,
}

impl Reflectances {
    /// Means over the textures.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        let of = |m: &Material| {
            let texture = m.map_kd.as_ref().map_or(Vec3::ONE, |map| scene.texture(map).mean());
            let kd = luminance(m.kd * texture);
            match &m.model {
                Model::Phong(phong) => [kd, luminance(phong.ks), 0.0],
                // S of it comes with its Fresnel factor, and counts as D does.
                Model::MetallicRoughness(model) => {
                    let facets = Microfacets::new(model.roughness, mean_f0(scene, m, model));
                    [kd * (1.0 - model.metallic), 1.0, luminance(facets.mean_albedo())]
                }
            }
        };
        Self { by_material: scene.materials.iter().map(of).collect() }
    }

    /// The same where nobody sees highlights, and D is shown by itself, too.
    #[must_use]
    pub fn without_highlights(&self) -> Self {
        /// Of D on black.
        const LEAST: f32 = 0.05;
        Self { by_material: self.by_material.iter().map(|[kd, ..]| [kd.max(LEAST), 0.0, 0.0]).collect() }
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
        let [kd, ks, _] = self.of_material(scene, face);
        let colour = scene.colour_at(face.triangle(), 1.0 / 3.0, 1.0 / 3.0);
        [kd * luminance(colour), ks]
    }

    fn of_material(&self, scene: &Scene, face: FaceId) -> [f32; 3] {
        self.by_material[scene.triangle_materials[face.triangle().0 as usize].0 as usize]
    }

    /// Share of D's noise that a face shows: metals show that of S alone.
    #[must_use]
    pub fn of_noise(&self, scene: &Scene, face: FaceId) -> f32 {
        self.of_face(scene, face)[0] + self.of_material(scene, face)[2]
    }

    /// Its square.
    #[must_use]
    pub fn noise_gain(&self, scene: &Scene, face: FaceId) -> f32 {
        self.of_noise(scene, face).powi(2)
    }
}
