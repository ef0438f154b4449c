//! glTF 2.0 in one binary file. Surfaces are unlit (`KHR_materials_unlit`): `COLOR_0` is the multiplier of k_d that the format means it to
//! be, D over a scale; `_LIGHT` is D itself (docs/bake.md).

use super::base_texture::{BaseTexture, placed_by};
use super::lit_mesh::{LitMesh, Part, Vertex};
use crate::bsdf::{Microfacets, mean_f0};
use crate::error::{Error, Result};
use crate::image::atomic;
use crate::scene::Scene;
use crate::scene::material::{Material, Model};
use crate::scene::texture::Wrap;
use glam::{DVec3, Vec2, Vec3};
use serde_json::{Value, json};
use std::io::{self, Write};
use std::path::Path;

/// Share of the area whose light is no brighter than the scale: what is left, next to lamps, is clipped in `COLOR_0`.
const UNCLIPPED: f64 = 0.99;
/// Kinds of buffer views.
const VERTICES: u32 = 34_962;
const INDICES: u32 = 34_963;
/// Types of components.
const FLOAT: u32 = 5126;
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;

/// Writes the mesh; `scale` is the light that is 1 in `COLOR_0`, W·sr⁻¹·m⁻², or what most of the area stays below.
///
/// # Errors
/// [`Error::Io`] naming the file; [`Error::Usage`] for more than 4 GiB, which the format cannot hold.
pub fn write(path: &Path, scene: &Scene, mesh: &LitMesh, scale: Option<f32>) -> Result<()> {
    let document = Document::new(scene, mesh, scale.unwrap_or_else(|| usual_scale(scene, mesh)));
    let document = document.map_err(|e| Error::io(path, "cannot encode a texture", e))?;
    let mut json = document.json.to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let total = 12 + 8 + json.len() + 8 + document.binary.len();
    let Ok(total) = u32::try_from(total) else {
        let message = "more than 4 GiB, which a .glb cannot hold; bake coarser, or to a .ply";
        return Err(Error::Usage(format!("{}: {message}", path.display())));
    };
    atomic::write(path, |file| {
        let chunk = |kind: &[u8; 4], bytes: &[u8]| [&(bytes.len() as u32).to_le_bytes(), kind.as_slice()].concat();
        file.write_all(b"glTF")?;
        [2, total].iter().try_for_each(|word: &u32| file.write_all(&word.to_le_bytes()))?;
        file.write_all(&chunk(b"JSON", &json))?;
        file.write_all(&json)?;
        file.write_all(&chunk(b"BIN\0", &document.binary))?;
        file.write_all(&document.binary)
    })
}

/// The light that is 1 in `COLOR_0` of a vertex, and what of that shows.
fn multiplied(scene: &Scene, part: &Part, vertex: &Vertex) -> Vec3 {
    let is_emissive = scene.materials[part.material.0 as usize].is_emissive();
    if is_emissive { vertex.radiance } else { vertex.colour * vertex.light }
}

/// The light that 99 % of the area of surfaces that do not emit stays below; 1 without any.
#[must_use]
pub fn usual_scale(scene: &Scene, mesh: &LitMesh) -> f32 {
    let mut light: Vec<(f32, f64)> = Vec::new();
    for part in mesh.parts.iter().filter(|part| !scene.materials[part.material.0 as usize].is_emissive()) {
        light.extend(part.triangles.iter().map(|triangle| {
            let corners = triangle.map(|corner| part.vertices[corner as usize]);
            let [a, b, c] = corners.map(|vertex| vertex.position.as_dvec3());
            let most = corners.map(|v| multiplied(scene, part, &v).max_element()).into_iter().fold(0.0, f32::max);
            (most, (b - a).cross(c - a).length())
        }));
    }
    light.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let all: f64 = light.iter().map(|(_, area)| area).sum();
    let mut below = 0.0;
    let found = light.iter().find(|(_, area)| {
        below += area;
        below >= all * UNCLIPPED
    });
    found.map(|(light, _)| *light).filter(|light| light.is_finite() && *light > 0.0).unwrap_or(1.0)
}

struct Document<'a> {
    scene: &'a Scene,
    mesh: &'a LitMesh,
    scale: f32,
    binary: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    images: Vec<Value>,
    samplers: Vec<Value>,
    json: Value,
}

impl<'a> Document<'a> {
    fn new(scene: &'a Scene, mesh: &'a LitMesh, scale: f32) -> io::Result<Self> {
        let (binary, views, accessors, images, samplers) = Default::default();
        let mut document = Self { scene, mesh, scale, binary, views, accessors, images, samplers, json: Value::Null };
        let primitives: Vec<Value> =
            mesh.parts.iter().enumerate().map(|(index, part)| document.primitive(index, part)).collect();
        let materials = mesh.parts.iter().map(|part| document.material(&scene.materials[part.material.0 as usize]));
        let materials = materials.collect::<io::Result<Vec<Value>>>()?;
        document.json = document.root(primitives, materials);
        Ok(document)
    }

    fn root(&self, primitives: Vec<Value>, materials: Vec<Value>) -> Value {
        let mut node = json!({ "mesh": 0, "name": "lit" });
        if self.mesh.origin != DVec3::ZERO {
            node["translation"] = json!(self.mesh.origin.to_array());
        }
        let lights = self.mesh.lights.iter().enumerate().map(|(index, name)| {
            let attribute = attribute_of(index, name.as_ref());
            name.as_ref()
                .map_or_else(|| json!({ "attribute": attribute }), |n| json!({ "attribute": attribute, "name": n }))
        });
        let extras = json!({ "penombre": {
            "scale": self.scale,
            "unit": "W/(sr m2): _LIGHT = D, COLOR_0 = min(1, D / scale)",
            "lights": lights.collect::<Vec<Value>>(),
        } });
        let mut root = json!({
            "asset": { "version": "2.0", "generator": concat!("penombre ", env!("CARGO_PKG_VERSION")) },
            "extensionsUsed": ["KHR_materials_unlit"],
            "scene": 0,
            "scenes": [{ "nodes": [0] }],
            "nodes": [node],
            "meshes": [{ "name": "lit", "primitives": primitives, "extras": extras }],
            "materials": materials,
            "accessors": self.accessors,
            "bufferViews": self.views,
            "buffers": [{ "byteLength": self.binary.len() }],
        });
        if !self.images.is_empty() {
            root["images"] = json!(self.images);
            root["samplers"] = json!(self.samplers);
            root["textures"] = (0..self.images.len()).map(|i| json!({ "source": i, "sampler": i })).collect();
        }
        root
    }

    /// Adds bytes as a buffer view; returns its number.
    fn view(&mut self, bytes: impl Iterator<Item = u8>, target: Option<u32>) -> usize {
        let start = self.binary.len();
        self.binary.extend(bytes);
        let mut view = json!({ "buffer": 0, "byteOffset": start, "byteLength": self.binary.len() - start });
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        self.views.push(view);
        self.views.len() - 1
    }

    fn accessor(&mut self, view: usize, kind: u32, of: &str, count: usize, more: &[(&str, Value)]) -> usize {
        let mut accessor = json!({ "bufferView": view, "componentType": kind, "type": of, "count": count });
        more.iter().for_each(|(key, value)| accessor[*key] = value.clone());
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    fn floats<const N: usize>(
        &mut self,
        values: impl ExactSizeIterator<Item = [f32; N]>,
        more: &[(&str, Value)],
    ) -> usize {
        let count = values.len();
        let view = self.view(values.flatten().flat_map(f32::to_le_bytes), Some(VERTICES));
        self.accessor(view, FLOAT, if N == 2 { "VEC2" } else { "VEC3" }, count, more)
    }

    fn primitive(&mut self, material: usize, part: &Part) -> Value {
        let vertices = &part.vertices;
        let bounds =
            |of: fn(Vec3, Vec3) -> Vec3| json!(vertices.iter().map(|v| v.position).reduce(of).map(|v| v.to_array()));
        let bounds = [("min", bounds(Vec3::min)), ("max", bounds(Vec3::max))];
        let colours = vertices.iter().flat_map(|vertex| {
            let colour = multiplied(self.scene, part, vertex) / self.scale;
            // What is not a number counts as 0.
            let of = |c: f32| (c.clamp(0.0, 1.0) * 65535.0 + 0.5) as u16;
            let [r, g, b] = colour.to_array().map(of);
            [r, g, b, u16::MAX].into_iter().flat_map(u16::to_le_bytes)
        });
        let colours: Vec<u8> = colours.collect();
        let mut attributes = json!({
            "POSITION": self.floats(vertices.iter().map(|v| v.position.to_array()), &bounds),
            "NORMAL": self.floats(vertices.iter().map(|v| v.normal.to_array()), &[]),
            "_LIGHT": self.floats(vertices.iter().map(|v| v.light.to_array()), &[]),
        });
        let view = self.view(colours.into_iter(), Some(VERTICES));
        let normalised = [("normalized", json!(true))];
        attributes["COLOR_0"] = json!(self.accessor(view, UNSIGNED_SHORT, "VEC4", vertices.len(), &normalised));
        if let Some(map) = placed_by(&self.scene.materials[part.material.0 as usize]) {
            // As the map places them, with v down.
            let place = |uv: Vec2| map.place(uv);
            let uvs = vertices.iter().map(|v| place(v.uv)).map(|uv| [uv.x, 1.0 - uv.y]);
            attributes["TEXCOORD_0"] = json!(self.floats(uvs, &[]));
        }
        for (index, light) in part.lights.iter().enumerate() {
            let attribute = attribute_of(index, self.mesh.lights.get(index).and_then(Option::as_ref));
            attributes[attribute] = json!(self.floats(light.iter().map(Vec3::to_array), &[]));
        }
        let corners = part.triangles.iter().flatten().flat_map(|corner| corner.to_le_bytes());
        let view = self.view(corners, Some(INDICES));
        let indices = self.accessor(view, UNSIGNED_INT, "SCALAR", part.triangles.len() * 3, &[]);
        json!({ "attributes": attributes, "indices": indices, "material": material, "mode": 4 })
    }

    fn material(&mut self, material: &Material) -> io::Result<Value> {
        // Of what emits, vertices hold all that leaves it.
        let factor = if material.is_emissive() { Vec3::ONE } else { factor(self.scene, material) };
        let [r, g, b] = factor.clamp(Vec3::ZERO, Vec3::ONE).to_array();
        let mut surface = json!({ "baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.0, "roughnessFactor": 1.0 });
        let texture = BaseTexture::of(self.scene, material).filter(|_| !material.is_emissive());
        if let (Some(texture), Some(map)) = (texture, placed_by(material)) {
            surface["baseColorTexture"] = json!({ "index": self.images.len() });
            let png = texture.png()?;
            let view = self.view(png.into_iter(), None);
            self.images.push(json!({ "bufferView": view, "mimeType": "image/png", "name": material.name }));
            let [s, t] = map.wrap.map(|wrap| match wrap {
                Wrap::Repeat => 10_497,
                Wrap::Clamp => 33_071,
                Wrap::Mirror => 33_648,
            });
            self.samplers.push(json!({ "magFilter": 9729, "minFilter": 9987, "wrapS": s, "wrapT": t }));
        }
        let mut value = json!({
            "name": material.name,
            "pbrMetallicRoughness": surface,
            "extensions": { "KHR_materials_unlit": {} },
        });
        if material.map_d.is_some() && !material.is_emissive() {
            value["alphaMode"] = json!("MASK");
            value["alphaCutoff"] = json!(0.5);
        }
        Ok(value)
    }
}

/// The attribute that holds the light of a name, or what bounces.
fn attribute_of(index: usize, name: Option<&String>) -> String {
    if name.is_some() { format!("_LIGHT_{index}") } else { "_LIGHT_INDIRECT".to_owned() }
}

/// What a material's base texture is multiplied by: k_d on average over all directions that it is seen from.
fn factor(scene: &Scene, material: &Material) -> Vec3 {
    match &material.model {
        Model::Phong(_) => material.kd,
        Model::MetallicRoughness(model) => {
            let rough = model.map_roughness.as_ref().map_or(1.0, |map| scene.texture(map).mean().y);
            let facets = Microfacets::new(model.roughness * rough, mean_f0(scene, material, model));
            // Metalness that is textured is in the texture.
            let diffuse = if model.map_metallic.is_some() { 1.0 } else { 1.0 - model.metallic };
            material.kd * diffuse * facets.mean_diffuse_out()
        }
    }
}
