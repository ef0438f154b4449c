//! What a scene is made of, by hashes: what light that was computed for it depends on, and what of it changed since an earlier run.
//!
//! Cameras, image size and display are no part of it: no light depends on them. Names are not hashed, they are for messages.

use super::content_lights::{Emissions, of_light};
use super::material::{Material, MaterialId, Model, TextureMap};
use super::texture::{Encoding, Texture, Wrap};
use super::{Scene, TriangleId};
use crate::math::content_hash::{ContentHash, of_hashes};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;

pub use super::content_lights::Part;

/// The version of what is computed of it: another one makes all that is kept outdated.
const VERSION: u64 = 1;

/// What a scene is made of.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Content {
    /// Number of triangles.
    pub triangles: u64,
    /// Where surfaces are, with their cut-outs and shading normals, and how they may share vertices.
    pub geometry: u64,
    /// How surfaces reflect: colours, textures and all that materials say, and which triangle has which.
    pub surfaces: u64,
    /// Materials, in the scene's order.
    pub materials: Vec<Part>,
    /// Textures.
    pub textures: Vec<Part>,
    /// Lights.
    pub lights: Vec<Part>,
}

impl Content {
    /// Looks at a scene.
    #[must_use]
    pub fn of(scene: &Scene) -> Self {
        let textures: Vec<u64> = scene.textures.par_iter().map(of_texture).collect();
        let of_map = |map: &TextureMap| of_placed(map, &textures);
        let materials: Vec<u64> = scene.materials.par_iter().map(|m| of_material(m, &of_map)).collect();
        let emissions =
            Emissions { scene, materials: scene.materials.iter().map(|m| of_emission(m, &of_map)).collect() };
        let lights = scene.lights.par_iter().map(|light| of_light(light, &emissions));
        let part = |(name, hash): (&str, u64)| Part { name: name.to_owned(), hash, place: hash };
        Self {
            triangles: scene.triangles.len() as u64,
            geometry: of_geometry(scene, &of_map),
            surfaces: of_surfaces(scene, &materials),
            materials: scene.materials.iter().map(|m| &*m.name).zip(materials.iter().copied()).map(part).collect(),
            textures: scene.textures.iter().map(file_name).zip(textures.iter().copied()).map(part).collect(),
            lights: lights.collect(),
        }
    }

    /// The key of what depends on geometry alone.
    #[must_use]
    pub fn shape_key(&self) -> u64 {
        of_hashes("shape", &[VERSION, self.geometry])
    }

    /// The key of direct light of some lights that share a visible fraction, as indices into the scene's. What a single one emits makes
    /// no difference if it is of a single direction.
    #[must_use]
    pub fn direct_key(&self, lights: &[u32]) -> u64 {
        let of = |&light: &u32| {
            self.lights.get(light as usize).map_or(0, |part| if lights.len() > 1 { part.hash } else { part.place })
        };
        let mut hashes = vec![VERSION, self.geometry];
        hashes.extend(lights.iter().map(of));
        of_hashes("direct", &hashes)
    }

    /// The key of light that bounced, gathered by a method of some name.
    #[must_use]
    pub fn indirect_key(&self, method: &str) -> u64 {
        let mut hash = ContentHash::new("indirect");
        hash.numbers(&[VERSION, self.geometry, self.surfaces]);
        let lights: Vec<u64> = self.lights.iter().map(|light| light.hash).collect();
        hash.numbers(&lights);
        hash.text(method);
        hash.finish()
    }
}

/// Wherever it lies.
fn file_name(texture: &Texture) -> &str {
    texture.name().rsplit(['/', '\\']).next().unwrap_or_default()
}

fn of_texture(texture: &Texture) -> u64 {
    let mut hash = ContentHash::new("texture");
    let [width, height] = texture.extents()[0];
    hash.indices(&[
        width,
        height,
        match texture.encoding() {
            Encoding::Srgb => 0,
            Encoding::SharedExponent => 1,
            Encoding::Linear => 2,
        },
    ]);
    // Other levels are made of the first.
    let first = width as usize * height as usize;
    hash.bytes(texture.texels().get(..first).unwrap_or(texture.texels()).as_flattened());
    hash.finish()
}

fn of_placed(map: &TextureMap, textures: &[u64]) -> u64 {
    let wrap = |wrap: Wrap| match wrap {
        Wrap::Repeat => 0,
        Wrap::Clamp => 1,
        Wrap::Mirror => 2,
    };
    let mut hash = ContentHash::new("map");
    hash.number(textures[map.texture.0 as usize]);
    hash.floats(&map.matrix.to_cols_array());
    hash.floats(&map.offset.to_array());
    hash.indices(&map.wrap.map(wrap));
    hash.finish()
}

fn of_maps<'a>(
    maps: impl IntoIterator<Item = Option<&'a TextureMap>>,
    of_map: &impl Fn(&TextureMap) -> u64,
) -> Vec<u64> {
    maps.into_iter().flat_map(|map| [u64::from(map.is_some()), map.map_or(0, of_map)]).collect()
}

fn roughness_of(material: &Material) -> Option<&TextureMap> {
    match &material.model {
        Model::Phong(_) => None,
        Model::MetallicRoughness(model) => model.map_roughness.as_ref(),
    }
}

/// How it reflects, and what its highlight is: what tells whether surfaces share vertices.
fn of_model(material: &Material, of_map: &impl Fn(&TextureMap) -> u64) -> u64 {
    let mut hash = ContentHash::new("model");
    match &material.model {
        Model::Phong(phong) => {
            hash.points(&[phong.ks]);
            hash.floats(&[phong.shininess]);
            hash.number(u64::from(phong.mirror));
        }
        Model::MetallicRoughness(model) => {
            hash.floats(&[model.metallic, model.roughness]);
            hash.numbers(&of_maps([model.map_metallic.as_ref(), model.map_roughness.as_ref()], of_map));
            // The base colour is the highlight's.
            hash.points(&[material.kd]);
            hash.numbers(&of_maps([material.map_kd.as_ref()], of_map));
        }
    }
    hash.finish()
}

fn of_material(material: &Material, of_map: &impl Fn(&TextureMap) -> u64) -> u64 {
    let Material { name: _, kd, model: _, ke, unlit, map_kd, map_ke, map_d, map_normal } = material;
    let mut hash = ContentHash::new("material");
    hash.points(&[*kd, *ke]);
    hash.number(u64::from(*unlit));
    let normal = map_normal.as_ref().map(|normal| &normal.map);
    hash.numbers(&of_maps([map_kd.as_ref(), map_ke.as_ref(), map_d.as_ref(), normal], of_map));
    hash.floats(&[map_normal.as_ref().map_or(0.0, |normal| normal.scale)]);
    hash.number(of_model(material, of_map));
    hash.finish()
}

/// What it emits, without where.
fn of_emission(material: &Material, of_map: &impl Fn(&TextureMap) -> u64) -> u64 {
    let mut hash = ContentHash::new("emission");
    hash.points(&[material.ke]);
    hash.number(u64::from(material.unlit));
    hash.numbers(&of_maps([material.map_ke.as_ref()], of_map));
    hash.finish()
}

/// What rays and the hierarchy of vertices depend on.
fn of_geometry(scene: &Scene, of_map: &impl Fn(&TextureMap) -> u64) -> u64 {
    let mut hash = ContentHash::new("geometry");
    hash.points(&scene.positions);
    hash.indices(scene.triangles.as_flattened());
    hash.points(scene.normals.as_flattened());
    // Triangles with holes, and those whose highlight is told by a texture: those, and where they lie.
    let textured = |m: &Material| {
        let maps = [m.map_d.as_ref(), roughness_of(m)];
        if maps.iter().all(Option::is_none) { 0 } else { of_hashes("textured", &of_maps(maps, of_map)) }
    };
    let masks: Vec<u64> = scene.materials.iter().map(textured).collect();
    for (triangle, uvs) in scene.uvs.iter().enumerate() {
        let mask = masks[scene.triangle_materials[triangle].0 as usize];
        if mask != 0 {
            hash.numbers(&[triangle as u64, mask]);
            hash.flat_points(uvs);
        }
    }
    hash.indices(&alike(scene, of_map));
    // Normal maps turn light, so that its vectors are kept.
    hash.number(u64::from(scene.materials.iter().any(|m| m.map_normal.is_some())));
    let coplanar = (0..scene.triangles.len() as u32).filter_map(|t| Some((t, scene.coplanar.member(TriangleId(t))?)));
    for (triangle, member) in coplanar {
        hash.indices(&[triangle, member.plane, member.ranks[0], member.ranks[1], u32::from(member.along)]);
    }
    hash.finish()
}

/// Which materials have the same highlight: numbers by material, in the order in which triangles have them. Vertices are shared across
/// these, whatever the highlight is.
fn alike(scene: &Scene, of_map: &impl Fn(&TextureMap) -> u64) -> Vec<u32> {
    let model = |material: &Material| if material.is_glossy() { of_model(material, of_map) } else { 0 };
    let models: Vec<u64> = scene.materials.iter().map(model).collect();
    let mut numbers = HashMap::new();
    let number = |material: &MaterialId| {
        let next = numbers.len() as u32;
        *numbers.entry(models[material.0 as usize]).or_insert(next)
    };
    scene.triangle_materials.iter().map(number).collect()
}

/// Colours of all triangles.
fn of_surfaces(scene: &Scene, materials: &[u64]) -> u64 {
    let mut hash = ContentHash::new("surfaces");
    hash.flat_points(scene.uvs.as_flattened());
    hash.points(scene.colours.as_flattened());
    // By content, not by number: materials that no triangle has, and their order, make no difference.
    let mut numbers = HashMap::new();
    let mut used = Vec::new();
    let number = |material: &MaterialId| {
        let content = materials[material.0 as usize];
        *numbers.entry(content).or_insert_with(|| {
            used.push(content);
            used.len() as u32 - 1
        })
    };
    let of_triangles: Vec<u32> = scene.triangle_materials.iter().map(number).collect();
    hash.indices(&of_triangles);
    hash.numbers(&used);
    hash.finish()
}
