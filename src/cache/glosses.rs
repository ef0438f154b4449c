//! The highlights of a scene's surfaces: one a material, several where its roughness is textured.

use super::slot::GlossId;
use crate::bsdf::{Gloss, Microfacets, mean_f0};
use crate::math::triangle::nearest_to_origin;
use crate::scene::footprint::Footprint;
use crate::scene::material::{Material, MetallicRoughness, Model};
use crate::scene::{Scene, TriangleId};
use glam::{Vec2, Vec3};
use std::sync::Arc;

/// Roughnesses that a textured one is rounded to: steps of 1/63 are not seen.
const STEPS: u16 = 64;
/// Most highlights of a scene; materials beyond have one of mean roughness.
const MOST: usize = u16::MAX as usize - STEPS as usize;

/// All highlights of a scene.
#[derive(Debug, Default)]
pub(super) struct Glosses {
    scene: Arc<Scene>,
    all: Vec<Gloss>,
    of_material: Vec<Option<OfMaterial>>,
}

/// The highlights of a material.
#[derive(Clone, Copy, Debug)]
struct OfMaterial {
    first: u16,
    is_textured: bool,
}

impl Glosses {
    pub(super) fn new(scene: &Arc<Scene>) -> Self {
        let mut glosses = Self { scene: Arc::clone(scene), ..Self::default() };
        for material in &scene.materials {
            let of_material = glosses.add(material);
            glosses.of_material.push(of_material);
        }
        glosses
    }

    fn add(&mut self, material: &Material) -> Option<OfMaterial> {
        if !material.is_glossy() || self.all.len() >= MOST {
            return None;
        }
        let first = self.all.len() as u16;
        let (before, is_textured) = (self.all.len(), self.add_model(material));
        // One that another material has, too, is kept once: slots are shared where it is the same.
        if !is_textured && let Some(known) = self.all[..before].iter().position(|known| *known == self.all[before]) {
            self.all.truncate(before);
            return Some(OfMaterial { first: known as u16, is_textured });
        }
        Some(OfMaterial { first, is_textured })
    }

    /// Whether there are several.
    fn add_model(&mut self, material: &Material) -> bool {
        let model = match &material.model {
            Model::Phong(phong) => {
                self.all.push(Gloss::Phong { shininess: phong.shininess, mirror: phong.mirror });
                return false;
            }
            Model::MetallicRoughness(model) => model,
        };
        let f0 = mean_f0(&self.scene, material, model);
        let Some(map) = &model.map_roughness else {
            self.all.push(Gloss::Ggx(Microfacets::new(model.roughness, f0)));
            return false;
        };
        if self.all.len() + usize::from(STEPS) > MOST {
            let mean = model.roughness * self.scene.texture(map).mean().y;
            self.all.push(Gloss::Ggx(Microfacets::new(mean, f0)));
            return false;
        }
        let roughness = |step: u16| f32::from(step) / f32::from(STEPS - 1);
        self.all.extend((0..STEPS).map(|step| Gloss::Ggx(Microfacets::new(roughness(step), f0))));
        true
    }

    pub(super) fn get(&self, id: GlossId) -> Gloss {
        self.all[usize::from(id.0)]
    }

    /// The highlight at a place of a triangle, where its surface is glossy; textures filtered over a part of it that is `extent` times as
    /// large.
    pub(super) fn at(&self, triangle: TriangleId, place: Vec3, extent: f32) -> Option<GlossId> {
        let material = self.scene.triangle_materials[triangle.0 as usize];
        let OfMaterial { first, is_textured } = self.of_material[material.0 as usize]?;
        if !is_textured {
            return Some(GlossId(first));
        }
        let Model::MetallicRoughness(model) = &self.scene.material(triangle).model else { return Some(GlossId(first)) };
        Some(GlossId(first + self.step(model, triangle, place, extent)))
    }

    fn step(&self, model: &MetallicRoughness, triangle: TriangleId, place: Vec3, extent: f32) -> u16 {
        let [_, u, v] = nearest_to_origin(self.scene.corners(triangle).map(|corner| corner - place));
        let footprint = Footprint { d_dx: Vec2::X * extent, d_dy: Vec2::Y * extent };
        let [_, roughness] = self.scene.metallic_roughness_over(model, triangle, [u, v], &footprint);
        (roughness.clamp(0.0, 1.0) * f32::from(STEPS - 1)).round() as u16
    }
}
