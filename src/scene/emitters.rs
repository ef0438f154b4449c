//! Area lights: one for each connected component of emissive triangles of one material.

use super::light::{Light, LightKind};
use super::union::Union;
use super::{Scene, TriangleId};
use rustc_hash::FxHashMap;

/// The area lights of a scene, ordered by their first triangle. Triangles are connected when they share a welded
/// position and their material. Named after the material, numbered from 1 where it has several.
pub(super) fn find(scene: &Scene) -> Vec<Light> {
    let lights = |&t: &u32| {
        let material = scene.material(TriangleId(t));
        material.is_emissive() && !material.unlit
    };
    let emissive: Vec<u32> = (0..scene.triangles.len() as u32).filter(lights).collect();
    let mut union = Union::new(emissive.len());
    let mut first_at: FxHashMap<(u32, u32), u32> = FxHashMap::default();
    for (k, &t) in emissive.iter().enumerate() {
        let material = scene.triangle_materials[t as usize].0;
        for position in scene.triangles[t as usize] {
            let other = *first_at.entry((material, position)).or_insert(k as u32);
            union.join(other, k as u32);
        }
    }
    let mut components: Vec<(u32, Vec<TriangleId>)> = Vec::new();
    let mut component_of: FxHashMap<u32, usize> = FxHashMap::default();
    for (k, &t) in emissive.iter().enumerate() {
        let component = *component_of.entry(union.root(k as u32)).or_insert_with(|| {
            components.push((scene.triangle_materials[t as usize].0, Vec::new()));
            components.len() - 1
        });
        components[component].1.push(TriangleId(t));
    }
    name(scene, components)
}

fn name(scene: &Scene, components: Vec<(u32, Vec<TriangleId>)>) -> Vec<Light> {
    let mut total: FxHashMap<u32, u32> = FxHashMap::default();
    components.iter().for_each(|(material, _)| *total.entry(*material).or_default() += 1);
    let mut used: FxHashMap<u32, u32> = FxHashMap::default();
    let light = |(material, triangles): (u32, Vec<TriangleId>)| {
        let number = used.entry(material).or_default();
        *number += 1;
        let base = &scene.materials[material as usize].name;
        let name = if total[&material] > 1 { format!("{base} {number}") } else { base.clone() };
        Light { name, kind: LightKind::Area { triangles } }
    };
    components.into_iter().map(light).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::material::{Material, MaterialId};
    use glam::Vec3;

    #[test]
    fn components_are_split_by_material_and_connection() {
        let lamp = |name: &str, ke: f32| Material { ke: Vec3::splat(ke), ..Material::grey(name) };
        let sign = Material { unlit: true, ..lamp("sign", 1.0) };
        let scene = Scene {
            // A strip of two, a lone one touching nothing, a dark one, one of another material touching the strip, and one that lights nothing.
            triangles: vec![[0, 1, 2], [5, 6, 7], [2, 1, 3], [3, 4, 1], [2, 3, 8], [8, 9, 10]],
            triangle_materials: [0, 0, 0, 1, 2, 3].map(MaterialId).to_vec(),
            materials: vec![lamp("lamp", 1.0), lamp("wall", 0.0), lamp("other", 2.0), sign],
            ..Scene::default()
        };
        let found: Vec<(String, Vec<u32>)> = find(&scene)
            .into_iter()
            .map(|light| match light.kind {
                LightKind::Area { triangles } => (light.name, triangles.iter().map(|t| t.0).collect()),
                other => panic!("{other:?}"),
            })
            .collect();
        let expected = [("lamp 1", vec![0, 2]), ("lamp 2", vec![1]), ("other", vec![4])];
        assert_eq!(found, expected.map(|(n, t)| (n.to_owned(), t)));
    }
}
