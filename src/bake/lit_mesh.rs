//! The mesh of a bake: vertices with all that files hold of them, a part a material.

use super::barycentric;
use super::drawn::{Drawn, Places};
use super::fill::SlotLight;
use super::mend::mend;
use crate::bsdf::Reflectance;
use crate::scene::footprint::Footprint;
use crate::scene::material::MaterialId;
use crate::scene::{FaceId, Scene};
use glam::{DVec3, Vec2, Vec3};
use rustc_hash::FxHashMap;

/// What a mesh is made of.
pub struct Source<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// All triangles.
    pub drawn: Vec<Drawn>,
    /// Where slots are.
    pub places: Places,
}

/// A vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vertex {
    /// Position, scene units.
    pub position: Vec3,
    /// Unit shading normal, on the side of the triangle.
    pub normal: Vec3,
    /// Texture coordinates (v up); 0 where the material has no texture.
    pub uv: Vec2,
    /// Vertex colour of the scene, linear; 1 without any.
    pub colour: Vec3,
    /// D, W·sr⁻¹·m⁻².
    pub light: Vec3,
    /// What leaves diffusely: L_e + k_d D, W·sr⁻¹·m⁻².
    pub radiance: Vec3,
}

/// The triangles of a material.
#[derive(Clone, Debug)]
pub struct Part {
    /// The material.
    pub material: MaterialId,
    /// Vertices; slots that triangles share are shared.
    pub vertices: Vec<Vertex>,
    /// By light of [`LitMesh::lights`], then by vertex: its part of D, W·sr⁻¹·m⁻².
    pub lights: Vec<Vec<Vec3>>,
    /// Triangles, counter-clockwise seen from the side that they are of.
    pub triangles: Vec<[u32; 3]>,
}

/// A lit mesh.
#[derive(Clone, Debug)]
pub struct LitMesh {
    /// Its parts, in the order of the scene's materials.
    pub parts: Vec<Part>,
    /// Whose light is kept by itself: names of lights, then `None` for what bounces.
    pub lights: Vec<Option<String>>,
    /// Vertices of the engine whose light is taken from their surroundings, and all that are used.
    pub filled: [usize; 2],
    /// Where its origin is in the coordinates of the files.
    pub origin: DVec3,
}

impl LitMesh {
    /// Puts the mesh together; `lights` names the layers of `light` after the first.
    #[must_use]
    pub fn new(mut source: Source, mut light: SlotLight, lights: Vec<Option<String>>) -> Self {
        let slots: Vec<[u32; 3]> = source.drawn.iter().map(|drawn| drawn.slots).collect();
        let filled = light.fill(&slots);
        source.drawn = mend(source.scene, source.drawn, &mut source.places, &mut light);
        let mut used: Vec<u32> = slots.into_iter().flatten().collect();
        used.sort_unstable();
        used.dedup();
        let mut parts: Vec<PartInMaking> = (0..source.scene.materials.len() as u32).map(PartInMaking::new).collect();
        let mut finest = vec![0; light.weights.len()];
        for Drawn { level, slots, .. } in &source.drawn {
            slots.iter().for_each(|&slot| finest[slot as usize] = (*level).max(finest[slot as usize]));
        }
        for drawn in &source.drawn {
            let material = source.scene.triangle_materials[drawn.face.triangle().0 as usize];
            parts[material.0 as usize].add(&source, &light, &finest, drawn);
        }
        Self {
            parts: parts.into_iter().map(|p| p.part).filter(|part| !part.triangles.is_empty()).collect(),
            lights,
            filled: [filled, used.len()],
            origin: source.scene.origin,
        }
    }

    /// Number of vertices.
    #[must_use]
    pub fn vertex_count(&self) -> usize {
        self.parts.iter().map(|part| part.vertices.len()).sum()
    }

    /// Number of triangles.
    #[must_use]
    pub fn triangle_count(&self) -> usize {
        self.parts.iter().map(|part| part.triangles.len()).sum()
    }
}

/// A vertex by what makes it one: slot, texture coordinates, vertex colour.
type Key = (u32, [u32; 5]);

struct PartInMaking {
    part: Part,
    index: FxHashMap<Key, u32>,
}

impl PartInMaking {
    fn new(material: u32) -> Self {
        let part =
            Part { material: MaterialId(material), vertices: Vec::new(), lights: Vec::new(), triangles: Vec::new() };
        Self { part, index: FxHashMap::default() }
    }

    fn add(&mut self, source: &Source, light: &SlotLight, finest: &[u8], drawn: &Drawn) {
        let [a, b, c] = drawn.slots.map(|slot| self.vertex(source, light, finest[slot as usize], drawn.face, slot));
        self.part.triangles.push(if drawn.face.is_back() { [a, c, b] } else { [a, b, c] });
    }

    fn vertex(&mut self, source: &Source, light: &SlotLight, level: u8, face: FaceId, slot: u32) -> u32 {
        let (scene, triangle) = (source.scene, face.triangle());
        let position = source.places.position(slot);
        let weights = barycentric::weights(scene.corners(triangle), position);
        let is_textured = scene.material(triangle).maps().next().is_some();
        let uvs = scene.uvs[triangle.0 as usize].map(|uv| uv.to_array());
        let uv = if is_textured { Vec2::from_array(barycentric::interpolate(weights, uvs)) } else { Vec2::ZERO };
        let colours = scene.colours.get(triangle.0 as usize).map(|corners| corners.map(|colour| colour.to_array()));
        let colour = colours.map_or(Vec3::ONE, |c| Vec3::from_array(barycentric::interpolate(weights, c)));
        let bits = [uv.x, uv.y, colour.x, colour.y, colour.z].map(f32::to_bits);
        let next = self.part.vertices.len() as u32;
        let index = *self.index.entry((slot, bits)).or_insert(next);
        if index == next {
            let layers: Vec<Vec3> = light.layers.iter().map(|layer| layer[slot as usize]).collect();
            let [_, u, v] = weights.map(|w| w as f32);
            let radiance = leaving(scene, face, [u, v], level, layers[0]);
            let normal = source.places.normal(slot);
            self.part.vertices.push(Vertex { position, normal, uv, colour, light: layers[0], radiance });
            self.part.lights.resize_with(layers.len() - 1, Vec::new);
            self.part.lights.iter_mut().zip(&layers[1..]).for_each(|(light, value)| light.push(*value));
        }
        index
    }
}

/// What leaves a face diffusely, textures filtered over its triangles of a level, W·sr⁻¹·m⁻².
fn leaving(scene: &Scene, face: FaceId, at: [f32; 2], level: u8, light: Vec3) -> Vec3 {
    let size = 0.5_f32.powi(i32::from(level));
    let footprint = Footprint { d_dx: Vec2::X * size, d_dy: Vec2::Y * size };
    let reflectance = Reflectance::at(scene, face.triangle(), at, &footprint);
    let [u, v] = at;
    scene.emitted_over(face, u, v, &footprint) + reflectance.leaving_diffusely() * light
}
