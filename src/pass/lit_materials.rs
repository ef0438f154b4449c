//! Materials as the device reads them: the scene's, and a copy for each area light, whose emission changes with the light.

use super::shared::GpuMaterial;
use super::texture_maps::TextureMaps;
use crate::bsdf::mean_f0;
use crate::scene::light::{LightKind, LightState};
use crate::scene::material::{Material, Model};
use crate::scene::{Scene, TriangleId};
use glam::Vec3;

/// The list of materials, and who uses which.
pub(super) struct LitMaterials {
    /// As loaded.
    list: Vec<GpuMaterial>,
    /// The light of each material of the list from `scene_materials` on, as an index into the scene's.
    lights: Vec<usize>,
    scene_materials: usize,
}

impl LitMaterials {
    /// The list for a scene, and the entry that each triangle uses.
    pub(super) fn new(scene: &Scene, maps: &TextureMaps) -> (Self, Vec<u32>) {
        let mut of_triangle: Vec<u32> = scene.triangle_materials.iter().map(|material| material.0).collect();
        let mut list: Vec<GpuMaterial> = scene.materials.iter().map(|m| GpuMaterial::new(scene, m, maps)).collect();
        let mut lights = Vec::new();
        for (index, light) in scene.lights.iter().enumerate() {
            let LightKind::Area { triangles } = &light.kind else { continue };
            let Some(&TriangleId(first)) = triangles.first() else { continue };
            list.push(list[of_triangle[first as usize] as usize]);
            lights.push(index);
            triangles.iter().for_each(|t| of_triangle[t.0 as usize] = list.len() as u32 - 1);
        }
        (Self { list, lights, scene_materials: scene.materials.len() }, of_triangle)
    }

    /// The list as it is when the scene's lights are in these states; those that are not given are as loaded.
    pub(super) fn lit(&self, states: &[LightState]) -> Vec<GpuMaterial> {
        let mut list = self.list.clone();
        for (material, &light) in list[self.scene_materials..].iter_mut().zip(&self.lights) {
            let LightState { factor, .. } = states.get(light).copied().unwrap_or_default();
            material.ke = (Vec3::from(material.ke) * factor).to_array();
        }
        list
    }
}

impl GpuMaterial {
    fn new(scene: &Scene, material: &Material, maps: &TextureMaps) -> Self {
        let rough = match &material.model {
            Model::Phong(_) => None,
            Model::MetallicRoughness(model) => Some(model),
        };
        Self {
            kd: material.kd.to_array(),
            map_kd: maps.index(material.map_kd.as_ref()),
            ks: material.phong().ks.to_array(),
            map_d: maps.index(material.map_d.as_ref()),
            ke: material.ke.to_array(),
            map_ke: maps.index(material.map_ke.as_ref()),
            f0: rough.map_or([0.0; 3], |model| mean_f0(scene, material, model).to_array()),
            map_metallic: maps.index(rough.and_then(|model| model.map_metallic.as_ref())),
            metallic: rough.map_or(-1.0, |model| model.metallic),
            roughness: rough.map_or(0.0, |model| model.roughness),
            map_roughness: maps.index(rough.and_then(|model| model.map_roughness.as_ref())),
            map_normal: maps.index(material.map_normal.as_ref().map(|normal| &normal.map)),
            normal_scale: material.map_normal.map_or(0.0, |normal| normal.scale),
            padding: [0; 3],
        }
    }
}
