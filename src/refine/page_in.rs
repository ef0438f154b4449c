//! Faces that come into view again: what was spilled of their clusters is read and taken in, instead of traced anew.

use super::engine::Engine;
use super::memory::Block;
use crate::cache::block::{BlockLayer, ClusterId, Shape};
use crate::cache::ids::{NodeId, SlotId, VertexId};
use crate::cache::record::{Validity, Vertices};
use crate::scene::FaceId;
use crate::trace::within;

/// Clusters that are read at a time.
const AT_ONCE: usize = 64;
/// Splits above a node at most: no face is split so often.
const DEEPEST: u8 = 40;

/// A node that is to be as a shape says: face and node by their places there.
#[derive(Clone, Copy)]
struct Place {
    id: NodeId,
    face: usize,
    node: usize,
    /// Pixels that it covers, about.
    pixels: f32,
}

impl Engine {
    /// Takes in what was spilled of faces that come into view. What is on disk stays there, for the other faces of their clusters.
    pub(super) fn page_in(&mut self, faces: &[(FaceId, u32)]) {
        let is_out =
            |face: &FaceId| self.memory.is_spilled(ClusterId::of(*face)) && self.cache.root_of(*face).is_none();
        let wanted: Vec<(FaceId, u32)> = faces.iter().filter(|(face, _)| is_out(face)).copied().collect();
        let mut clusters: Vec<ClusterId> = wanted.iter().map(|(face, _)| ClusterId::of(*face)).collect();
        clusters.sort_unstable();
        clusters.dedup();
        for clusters in clusters.chunks(AT_ONCE) {
            let blocks: Vec<(ClusterId, Vec<Block>)> = within("read pages", || {
                clusters.iter().filter_map(|&cluster| Some((cluster, self.memory.page_in(cluster)?))).collect()
            });
            let pixels = |face: FaceId| {
                let found = wanted.binary_search_by_key(&face, |(face, _)| *face);
                found.ok().map(|index| wanted[index].1 as f32)
            };
            within("take pages in", || self.take_faces(&blocks, pixels));
        }
    }

    /// Takes in what was spilled of a cluster of which other faces are there, so that nothing of it is on disk alone.
    pub(super) fn page_rest_in(&mut self, cluster: ClusterId) {
        if let Some(blocks) = self.memory.page_in(cluster) {
            let faces = cluster.faces(self.scene.triangles.len() as u32);
            let missing: Vec<FaceId> = faces.filter(|&face| self.cache.root_of(face).is_none()).collect();
            self.take_faces(&[(cluster, blocks)], |face| missing.contains(&face).then_some(f32::INFINITY));
        }
        self.memory.forget_spilled(cluster);
    }

    /// Takes clusters in.
    pub(super) fn take_blocks(&mut self, clusters: &[(ClusterId, Vec<Block>)]) {
        self.take_faces(clusters, |_| Some(f32::INFINITY));
    }

    /// Takes the faces of clusters in that are wanted, with the pixels that they cover.
    fn take_faces(&mut self, clusters: &[(ClusterId, Vec<Block>)], wanted: impl Fn(FaceId) -> Option<f32>) {
        let triangles = self.scene.triangles.len() as u32;
        let (mut roots, mut more) = (Vec::new(), Vec::new());
        for (cluster, blocks) in clusters {
            let shape = blocks.iter().find(|block| block.layer == BlockLayer::Shape);
            let Some(Ok(shape)) = shape.map(|block| Shape::of_bytes(&block.bytes, *cluster, triangles)) else {
                continue;
            };
            self.memory.note_there(*cluster);
            roots.extend(self.grow_as(&shape, &wanted));
            let vertices = self.cache.match_vertices(&shape);
            self.enclosed.extend(self.cache.take_progress(&shape, &vertices));
            more.extend(self.take_layers(blocks, &shape, &vertices));
        }
        let midpoints = self.split_beside_finer(&roots);
        self.queue_first_visits(&midpoints);
        self.show_more(more);
    }

    /// Grows the hierarchy of faces to what a shape says, level by level, so that neighbours need not be split for it; returns their
    /// roots.
    fn grow_as(&mut self, shape: &Shape, wanted: impl Fn(FaceId) -> Option<f32>) -> Vec<NodeId> {
        let (cache, scene, weld) = (&mut self.cache, &self.scene, &mut self.weld);
        let faces = shape.faces().enumerate().filter_map(|(place, face)| Some((place, face, wanted(face)?)));
        let faces: Vec<(usize, FaceId, f32)> = faces.collect();
        let roots: Vec<NodeId> = faces.iter().map(|&(_, face, _)| cache.root(scene, weld, face)).collect();
        let children: Vec<Vec<Option<usize>>> =
            (0..shape.faces().count()).map(|face| shape.first_children(face)).collect();
        let place = |(&(face, _, pixels), &id): (&(usize, FaceId, f32), &NodeId)| Place { id, face, node: 0, pixels };
        let mut level: Vec<Place> = faces.iter().zip(&roots).map(place).collect();
        while !level.is_empty() {
            let mut next = Vec::new();
            // Where memory is short, what another view saw more closely than this one stays on disk.
            let least = if self.is_over_budget() { self.options.min_pixels } else { 0.0 };
            for Place { id, face, node, pixels } in level {
                shape.tell(&mut self.cache, (face, node), id);
                let Some(&Some(first)) = children[face].get(node) else { continue };
                if pixels > least && self.split_again(id) {
                    self.cache.topology.nodes[id].indirect_split = shape.is_indirect_split((face, node));
                    let below = self.cache.topology.children(id).zip(first..);
                    next.extend(below.map(|(id, node)| Place { id, face, node, pixels: pixels * 0.25 }));
                }
            }
            level = next;
        }
        roots
    }

    /// Splits a leaf unless a neighbour is coarser; whether it is split.
    fn split_again(&mut self, id: NodeId) -> bool {
        let topology = &self.cache.topology;
        if !topology.is_leaf(id) {
            return true;
        }
        if topology.nodes[id].level >= DEEPEST || !topology.coarser_neighbours(id).is_empty() {
            return false;
        }
        self.cache.split(id);
        self.publisher.note_redraw(&self.cache, id);
        let beside = self.cache.topology.nodes[id].edges.map(|edge| self.cache.topology.beside(edge));
        beside.into_iter().flatten().for_each(|node| self.publisher.note_redraw(&self.cache, node));
        true
    }

    /// Takes the samples of all layers in; returns the vertices that know more now.
    fn take_layers(&mut self, blocks: &[Block], shape: &Shape, vertices: &Vertices) -> Vec<VertexId> {
        let mut more = Vec::new();
        for Block { layer, bytes, is_current } in blocks.iter().filter(|block| block.layer != BlockLayer::Shape) {
            let validity = if *is_current { Validity::Current } else { Validity::Outdated };
            match self.cache.take_samples((*layer, bytes), validity, (shape, vertices)) {
                Ok(taken) => more.extend(taken),
                Err(_) if matches!(layer, BlockLayer::Direct(_)) => self.cache.miss_layer(vertices),
                Err(_) => {}
            }
        }
        let has = |light: usize| blocks.iter().any(|block| block.layer == BlockLayer::Direct(light as u32));
        if !(0..self.cache.layers.len()).all(has) {
            self.cache.miss_layer(vertices);
        }
        more
    }

    /// Shows what vertices know more that were there before; others are shown once their faces come into view.
    fn show_more(&mut self, mut vertices: Vec<VertexId>) {
        vertices.sort_unstable();
        vertices.dedup();
        let mut slots = self.slots_of_all(&vertices);
        slots.retain(|&slot| self.cache.slots[slot].direct().known);
        self.evaluate(&slots);
        let gathered: Vec<SlotId> = slots.into_iter().filter(|&slot| self.cache.indirect.is_sampled(slot)).collect();
        self.refresh_indirect(&gathered);
    }
}
