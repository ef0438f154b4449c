//! What the cache knows of a cluster of faces, written as [`Blocks`] and taken back in.

use super::block::{BlockLayer, Blocks, ClusterId, Input, Malformed, NodeShape, Shape, VertexShape, put};
use super::ids::{NodeId, SlotId, VertexId};
use super::store::Cache;
use super::topology::IndirectError;
use super::vertex::Vertex;
use crate::estimate::light_vector::LightVector;
use crate::estimate::visibility::{AreaSum, Origin, Stored, Visibility};
use crate::scene::FaceId;
use glam::Vec3;
use smallvec::SmallVec;
use std::collections::BTreeMap;

/// Bytes that say in which longer form a visibility follows.
const WORD: u8 = 253;
const WHOLE: u8 = 254;

/// Vertices of a shape by what they are in the cache, in the shape's order; `None` for those that it has no more.
pub struct Vertices(Vec<Option<VertexId>>);

/// How a layer's samples are taken in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Validity {
    /// They are of the present lights.
    Current,
    /// They are of a light that has changed since: a guess.
    Outdated,
}

impl Cache {
    /// What is known of the faces of a cluster that are there.
    #[must_use]
    pub fn blocks(&self, cluster: ClusterId, triangles: u32) -> Blocks {
        let faces: Vec<(FaceId, NodeId)> =
            cluster.faces(triangles).filter_map(|face| Some((face, self.root_of(face)?))).collect();
        if faces.is_empty() {
            return Blocks::default();
        }
        let mut vertices = BTreeMap::new();
        let faces = faces.into_iter().map(|(face, root)| (face, self.face_shape(root, &mut vertices))).collect();
        let ids: Vec<VertexId> = vertices.into_values().collect();
        let shape = Shape { faces, vertices: ids.iter().map(|&id| self.vertex_shape(id)).collect() };
        let direct = (0..self.layers.len()).map(|light| Some(self.direct_block(&ids, light))).collect();
        Blocks { shape: shape.to_bytes(), direct, indirect: Some(self.indirect_block(&ids)), size: shape.size() }
    }

    /// The nodes of a tree, breadth first, and its vertices by key.
    fn face_shape(&self, root: NodeId, vertices: &mut BTreeMap<u64, VertexId>) -> Vec<NodeShape> {
        let mut order = vec![root];
        let mut next = 0;
        while let Some(&id) = order.get(next) {
            order.extend(self.topology.children(id));
            next += 1;
        }
        let shape = |&id: &NodeId| {
            for vertex in self.corner_vertices(id) {
                vertices.insert(self.vertices[vertex].key, vertex);
            }
            let node = &self.topology.nodes[id];
            NodeShape {
                split: [!node.is_leaf(), node.indirect_split],
                direct_surplus: node.direct_surplus,
                indirect: [node.indirect.surplus, node.indirect.doubt],
            }
        };
        order.iter().map(shape).collect()
    }

    pub(super) fn vertex_shape(&self, id: VertexId) -> VertexShape {
        let Vertex { key, outdated, progress, .. } = &self.vertices[id];
        let flags = [
            (progress.visited, VertexShape::VISITED),
            (progress.traced, VertexShape::TRACED),
            (progress.covered, VertexShape::COVERED),
            (progress.enclosed, VertexShape::ENCLOSED),
            (*outdated, VertexShape::OUTDATED),
        ];
        let flags = flags.into_iter().filter(|(is, _)| *is).map(|(_, flag)| flag).sum();
        VertexShape { key: *key, flags, normals: self.by_normal(id).into_iter().map(|(bits, _)| bits).collect() }
    }

    /// The first slot of each normal of a vertex, by the normal's bits: slots that differ in their highlights alone know the same.
    fn by_normal(&self, vertex: VertexId) -> SmallVec<[(u32, SlotId); 2]> {
        let mut slots: SmallVec<[(u32, SlotId); 2]> =
            self.slots_of(vertex).map(|slot| (self.slots[slot].normal_bits(), slot)).collect();
        slots.sort_unstable();
        slots.dedup_by_key(|(bits, _)| *bits);
        slots
    }

    pub(super) fn direct_block(&self, vertices: &[VertexId], light: usize) -> Vec<u8> {
        let (layer, mut out) = (&self.layers[light], Vec::with_capacity(vertices.len() * 2));
        for &vertex in vertices {
            let known = layer.visibility.get(vertex);
            match known.stored() {
                Stored::Byte(byte) => out.push(byte),
                Stored::Word(word) => {
                    out.push(WORD);
                    out.extend(word.to_le_bytes());
                }
                Stored::Whole => {
                    out.push(WHOLE);
                    known.to_words().into_iter().for_each(|word| put(&mut out, word));
                }
            }
            let sums: SmallVec<[AreaSum; 2]> =
                self.by_normal(vertex).into_iter().map(|(_, slot)| layer.sums.get(slot)).collect();
            let any = sums.iter().any(|sum| *sum != AreaSum::default());
            if !known.is_known() {
                continue;
            }
            out.push(u8::from(any));
            for AreaSum { visible, unoccluded } in sums.into_iter().filter(|_| any) {
                visible.to_array().into_iter().chain([unoccluded]).for_each(|x| put(&mut out, x.to_bits()));
            }
        }
        out
    }

    pub(super) fn indirect_block(&self, vertices: &[VertexId]) -> Vec<u8> {
        let mut out = Vec::with_capacity(vertices.len() * 12);
        for &vertex in vertices {
            let rays = self.indirect.rays(vertex);
            put(&mut out, rays);
            put(&mut out, self.indirect.expected(vertex).to_bits());
            for (_, slot) in self.by_normal(vertex).into_iter().filter(|_| rays > 0) {
                self.indirect.sum(slot).to_words().into_iter().for_each(|word| put(&mut out, word));
            }
        }
        out
    }

    /// The vertices of a shape whose faces are there, with how far they have come; what lacks of those is taken in.
    pub fn match_vertices(&mut self, shape: &Shape) -> Vertices {
        let mut by_key = BTreeMap::new();
        for root in shape.faces.iter().filter_map(|(face, _)| self.root_of(*face)).collect::<Vec<_>>() {
            self.face_shape(root, &mut by_key);
        }
        let find = |vertex: &VertexShape| by_key.get(&vertex.key).copied();
        Vertices(shape.vertices.iter().map(find).collect())
    }

    /// Has vertices be as far as a shape says, those that were never visited; returns those that were taken for enclosed.
    pub fn take_progress(&mut self, shape: &Shape, vertices: &Vertices) -> Vec<VertexId> {
        let mut enclosed = Vec::new();
        for (of, vertex) in shape.vertices.iter().zip(&vertices.0) {
            let Some(vertex) = vertex.filter(|&id| !self.vertices[id].progress.visited) else { continue };
            let has = |flag: u8| of.flags & flag != 0;
            let record = &mut self.vertices[vertex];
            record.progress.visited = has(VertexShape::VISITED);
            record.progress.traced = has(VertexShape::TRACED);
            record.progress.covered = has(VertexShape::COVERED);
            record.progress.enclosed = has(VertexShape::ENCLOSED);
            record.outdated = has(VertexShape::OUTDATED);
            enclosed.extend(record.progress.enclosed.then_some(vertex));
        }
        enclosed
    }

    /// Notes that samples of a layer are missing: vertices that were visited are to be visited again.
    pub fn miss_layer(&mut self, vertices: &Vertices) {
        for &vertex in vertices.0.iter().flatten() {
            self.vertices[vertex].outdated |= self.vertices[vertex].progress.visited;
        }
    }

    /// Takes a layer's samples in, where they are more than what is there; returns the vertices that know more now.
    ///
    /// # Errors
    /// If the bytes are no such samples: nothing is taken from there on.
    pub fn take_samples(
        &mut self,
        (layer, bytes): (BlockLayer, &[u8]),
        validity: Validity,
        (shape, vertices): (&Shape, &Vertices),
    ) -> Result<Vec<VertexId>, Malformed> {
        let (mut input, mut taken) = (Input(bytes), Vec::new());
        for (of, &vertex) in shape.vertices.iter().zip(&vertices.0) {
            let has_more = match layer {
                BlockLayer::Shape => false,
                BlockLayer::Direct(light) => self.take_direct(&mut input, light as usize, validity, (of, vertex))?,
                BlockLayer::Indirect => self.take_indirect(&mut input, validity, (of, vertex))?,
            };
            taken.extend(vertex.filter(|_| has_more));
        }
        Ok(taken)
    }

    fn take_direct(
        &mut self,
        input: &mut Input<'_>,
        light: usize,
        validity: Validity,
        (of, vertex): (&VertexShape, Option<VertexId>),
    ) -> Result<bool, Malformed> {
        let known = match input.byte()? {
            WORD => {
                let word = u64::from_le_bytes(input.take()?);
                let known = Visibility::of_word(word);
                if known.stored() != Stored::Word(word) {
                    return Err(Malformed);
                }
                known
            }
            WHOLE => {
                let mut words = [0; 5];
                for word in &mut words {
                    *word = input.word()?;
                }
                Visibility::of_words(words).ok_or(Malformed)?
            }
            byte => Visibility::of_byte(byte),
        };
        let mut sums: SmallVec<[AreaSum; 2]> = SmallVec::new();
        if known.is_known() && input.byte()? != 0 {
            for _ in &of.normals {
                sums.push(area_sum(input)?);
            }
        }
        let layer = self.layers.get(light).ok_or(Malformed)?;
        let Some(vertex) = vertex else { return Ok(false) };
        let is_guess = validity == Validity::Outdated && known.is_known();
        let known = if is_guess { Visibility::taken_over(Origin::Deferred, known.fraction()) } else { known };
        self.vertices[vertex].outdated |= is_guess;
        if known.worth() <= layer.visibility.get(vertex).worth() {
            return Ok(false);
        }
        self.layers[light].visibility.set(vertex, known);
        let slots: SmallVec<[SlotId; 4]> = self.slots_of(vertex).collect();
        for (&bits, sum) in of.normals.iter().zip(sums).filter(|_| !is_guess) {
            for &slot in slots.iter().filter(|&&slot| self.slots[slot].normal_bits() == bits) {
                *self.layers[light].sums.entry(slot) = sum;
            }
        }
        Ok(true)
    }

    fn take_indirect(
        &mut self,
        input: &mut Input<'_>,
        validity: Validity,
        (of, vertex): (&VertexShape, Option<VertexId>),
    ) -> Result<bool, Malformed> {
        let (rays, expected) = (input.word()?, f32::from_bits(input.word()?));
        if !(expected >= 0.0 && expected.is_finite()) {
            return Err(Malformed);
        }
        let mut sums: SmallVec<[LightVector; 2]> = SmallVec::new();
        for _ in of.normals.iter().filter(|_| rays > 0) {
            let mut words = [0; LightVector::WORDS];
            for word in &mut words {
                *word = input.word()?;
            }
            sums.push(LightVector::of_words(words).ok_or(Malformed)?);
        }
        let Some(vertex) = vertex else { return Ok(false) };
        if validity == Validity::Outdated || rays <= self.indirect.rays(vertex) {
            if expected > 0.0 && validity == Validity::Current && self.indirect.expected(vertex) == 0.0 {
                self.indirect.note_expected(vertex, expected);
            }
            return Ok(false);
        }
        let slots: SmallVec<[SlotId; 4]> = self.slots_of(vertex).collect();
        let mut by_slot: SmallVec<[(SlotId, LightVector); 4]> = SmallVec::new();
        for (&bits, &sum) in of.normals.iter().zip(&sums) {
            let same = slots.iter().filter(|&&slot| self.slots[slot].normal_bits() == bits);
            by_slot.extend(same.map(|&slot| (slot, sum)));
        }
        self.indirect.replace(vertex, (rays, expected), &by_slot);
        Ok(true)
    }
}

fn area_sum(input: &mut Input<'_>) -> Result<AreaSum, Malformed> {
    let mut values = [0.0; 4];
    for value in &mut values {
        *value = f32::from_bits(input.word()?);
    }
    let is_sum = values.iter().all(|value| *value >= 0.0 && value.is_finite());
    let [r, g, b, unoccluded] = values;
    is_sum.then_some(AreaSum { visible: Vec3::new(r, g, b), unoccluded }).ok_or(Malformed)
}

impl Shape {
    /// Its faces.
    pub fn faces(&self) -> impl Iterator<Item = FaceId> + '_ {
        self.faces.iter().map(|(face, _)| *face)
    }

    /// Where the children of each node of a face are among these, the first of four; `None` for leaves.
    #[must_use]
    pub fn first_children(&self, face: usize) -> Vec<Option<usize>> {
        let mut next = 1;
        let mut first = |node: &NodeShape| {
            node.split[0].then(|| {
                next += 4;
                next - 4
            })
        };
        self.faces.get(face).map_or_else(Vec::new, |(_, nodes)| nodes.iter().map(&mut first).collect())
    }

    /// Tells a node what is known of its errors.
    pub fn tell(&self, cache: &mut Cache, (face, node): (usize, usize), id: NodeId) {
        if let Some(of) = self.faces.get(face).and_then(|(_, nodes)| nodes.get(node)) {
            let record = &mut cache.topology.nodes[id];
            record.direct_surplus = of.direct_surplus;
            let [surplus, doubt] = of.indirect;
            record.indirect = IndirectError { surplus, doubt };
        }
    }

    /// Whether a node is split in the indirect layer.
    #[must_use]
    pub fn is_indirect_split(&self, (face, node): (usize, usize)) -> bool {
        self.faces.get(face).and_then(|(_, nodes)| nodes.get(node)).is_some_and(|node| node.split[1])
    }
}
