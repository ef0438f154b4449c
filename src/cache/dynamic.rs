//! The cache as a whole, and the dynamic mesh: what is drawn, as slots (values at vertices) and leaves (triangles).

use super::layer::Layer;
use super::pool::Pool;
use super::vertex::{Vertex, VertexId, VertexName, ray_origin};
use super::weld::{Group, Weld};
use crate::scene::{FaceId, Scene, TriangleId};
use glam::Vec3;
use std::collections::HashMap;

/// Index of a vertex slot: position and luminance of one drawn vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct SlotId(pub u32);

/// Index of a leaf triangle of the dynamic mesh, recycled when the leaf goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct LeafId(pub u32);

/// A leaf triangle: its three vertices in the order of the face's corners (front winding), and the face it lies on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Leaf {
    /// Vertices.
    pub slots: [SlotId; 3],
    /// The face.
    pub face: FaceId,
}

/// One shading normal (and exponent) of a vertex, with the luminance shown there.
#[derive(Clone, Copy, Debug)]
pub struct SlotRecord {
    /// The vertex whose samples it shares.
    pub vertex: VertexId,
    /// The vertex's next slot.
    pub next: Option<SlotId>,
    /// Unit shading normal, on the vertex's side.
    pub normal: Vec3,
    /// Phong exponent where the surface is glossy.
    pub shininess: Option<f32>,
    /// Diffuse luminance D last published.
    pub diffuse: Vec3,
    /// Specular luminance S last published.
    pub specular: Vec3,
    /// Whether it has a value at all.
    pub known: bool,
    /// Pixels of the visible faces around it, shared out over their corners.
    pub pixels: f32,
    /// Variance of the luminance of D.
    pub variance: f32,
    /// First leaf corner that uses it, `leaf * 3 + corner`, linked through [`LeafRecord::next_use`].
    first_use: Option<u32>,
}

/// A leaf with the links of the leaves around its vertices.
#[derive(Clone, Copy, Debug)]
pub struct LeafRecord {
    /// The triangle.
    pub leaf: Leaf,
    /// The camera generation in which it was last visible.
    pub generation: u32,
    /// The last batch that redrew it.
    pub batch: u32,
    next_use: [Option<u32>; 3],
}

/// Everything that the engine thread owns: vertices, static meshes, dynamic mesh.
#[derive(Default)]
pub struct Cache {
    /// Base vertices.
    pub vertices: Pool<Vertex>,
    /// One static mesh a light, in the scene's order.
    pub layers: Vec<Layer>,
    /// Drawn vertices.
    pub slots: Pool<SlotRecord>,
    /// Drawn triangles.
    pub leaves: Pool<LeafRecord>,
    names: HashMap<VertexName, VertexId>,
    roots: HashMap<FaceId, LeafId>,
}

impl Cache {
    /// An empty cache for a scene with `lights` lights.
    #[must_use]
    pub fn new(lights: usize) -> Self {
        Self { layers: vec![Layer::default(); lights], ..Self::default() }
    }

    /// The leaf that is the whole of `face`, created with its vertices on first demand.
    pub fn face(&mut self, scene: &Scene, weld: &Weld, face: FaceId, diagonal: f32) -> LeafId {
        if let Some(&leaf) = self.roots.get(&face) {
            return leaf;
        }
        let slots = [0, 1, 2].map(|corner| self.corner_slot(scene, weld, face, corner, diagonal));
        let record = LeafRecord { leaf: Leaf { slots, face }, generation: 0, batch: 0, next_use: [None; 3] };
        let id = LeafId(self.leaves.insert(record));
        self.link(id);
        self.roots.insert(face, id);
        id
    }

    /// The slot of a face's corner: shared with every facet of the vertex's group of the same normal and gloss.
    fn corner_slot(&mut self, scene: &Scene, weld: &Weld, face: FaceId, corner: usize, diagonal: f32) -> SlotId {
        let (triangle, back) = (face.triangle(), face.is_back());
        let position = scene.triangles[triangle.0 as usize][corner];
        let group = weld.group(scene, position, triangle);
        let name = VertexName { position, back, group: group.index };
        let vertex = match self.names.get(&name) {
            Some(&vertex) => vertex,
            None => self.add_vertex(scene, name, &group, diagonal),
        };
        self.slot(vertex, slot_look(scene, position, triangle, back))
    }

    /// Creates a vertex with the slots of all facets of its group, visible or not: its rays serve them all.
    fn add_vertex(&mut self, scene: &Scene, name: VertexName, group: &Group, diagonal: f32) -> VertexId {
        let position = scene.positions[name.position as usize];
        let vertex = VertexId(self.vertices.insert(Vertex {
            key: name.key(scene),
            origin: ray_origin(position, name.back, group, diagonal),
            position,
            first_slot: None,
            pixels: 0.0,
            stage: 0,
        }));
        self.names.insert(name, vertex);
        for &facet in &group.facets {
            self.slot(vertex, slot_look(scene, name.position, facet, name.back));
        }
        vertex
    }

    /// The slot of a vertex with the given normal and exponent, added if there is none.
    fn slot(&mut self, vertex: VertexId, (normal, shininess): (Vec3, Option<f32>)) -> SlotId {
        // Coplanar facets may differ in the last bits of their normals; 1e-6 is 0.08°.
        let same = |&slot: &SlotId| {
            let record = &self.slots[slot.0];
            record.shininess == shininess && record.normal.dot(normal) > 1.0 - 1e-6
        };
        if let Some(slot) = self.slots_of(vertex).find(same) {
            return slot;
        }
        let slot = SlotId(self.slots.insert(SlotRecord {
            vertex,
            next: self.vertices[vertex.0].first_slot,
            normal,
            shininess,
            diffuse: Vec3::ZERO,
            specular: Vec3::ZERO,
            known: false,
            pixels: 0.0,
            variance: 0.0,
            first_use: None,
        }));
        self.vertices[vertex.0].first_slot = Some(slot);
        slot
    }

    fn link(&mut self, leaf: LeafId) {
        for corner in 0..3 {
            let slot = self.leaves[leaf.0].leaf.slots[corner];
            let previous = self.slots[slot.0].first_use.replace(leaf.0 * 3 + corner as u32);
            self.leaves[leaf.0].next_use[corner] = previous;
        }
    }

    /// The slots of a vertex.
    pub fn slots_of(&self, vertex: VertexId) -> impl Iterator<Item = SlotId> + '_ {
        std::iter::successors(self.vertices[vertex.0].first_slot, |slot| self.slots[slot.0].next)
    }

    /// The leaves that use a slot.
    pub fn leaves_of(&self, slot: SlotId) -> impl Iterator<Item = LeafId> + '_ {
        let next = |&usage: &u32| self.leaves[usage / 3].next_use[usage as usize % 3];
        std::iter::successors(self.slots[slot.0].first_use, next).map(|usage| LeafId(usage / 3))
    }

    /// Bytes held by the cache's structures.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let layers: usize = self.layers.iter().map(|l| l.visibility.bytes() + l.sums.bytes()).sum();
        let maps = self.names.capacity() * size_of::<(VertexName, VertexId)>()
            + self.roots.capacity() * size_of::<(FaceId, LeafId)>();
        layers + maps + self.vertices.bytes() + self.slots.bytes() + self.leaves.bytes()
    }
}

/// Shading normal and exponent of a triangle's corner at `position`, on the given side.
fn slot_look(scene: &Scene, position: u32, triangle: TriangleId, back: bool) -> (Vec3, Option<f32>) {
    let t = triangle.0 as usize;
    let corner = scene.triangles[t].iter().position(|&p| p == position).unwrap_or(0);
    let front = scene.normals[t][corner];
    let material = scene.material(triangle);
    (if back { -front } else { front }, material.is_glossy().then_some(material.shininess))
}
