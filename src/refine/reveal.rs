//! Faces that come into view: they are drawn, with what is known or guessed of their light, and their vertices queued to be visited. Where
//! somebody looks on, a view that shows many new ones does not wait for all: the largest come first, and the renderer fills the others meanwhile.

use super::engine::Engine;
use crate::cache::ids::{NodeId, SlotId, VertexId};
use crate::scene::FaceId;
use std::time::{Duration, Instant};

/// Faces that are revealed at a time: enough for all threads.
const FACES: usize = 64;
/// What is spent in each batch on faces that a view did not wait for.
const A_BATCH: Duration = Duration::from_millis(6);

impl Engine {
    /// Reveals faces by their places in the list of visible ones, and those that still wait for it: as many as a view waits for.
    pub(super) fn reveal_in_turn(&mut self, mut indices: Vec<usize>, time: Duration) {
        let waiting = std::mem::take(&mut self.unrevealed);
        indices.extend(waiting.into_iter().filter_map(|face| self.view.faces.index_of(face)));
        indices.sort_unstable();
        indices.dedup();
        let faces = self.view.faces.all();
        indices.sort_by_key(|&index| faces[index].pixels);
        self.unrevealed = indices.into_iter().map(|index| faces[index].face).collect();
        self.reveal_for(time);
    }

    /// Reveals a part of the faces that wait for it, and more until there is a vertex to visit.
    pub(super) fn reveal_some(&mut self) {
        self.reveal_for(A_BATCH);
        while !self.unrevealed.is_empty() && self.scheduler.first_visits() == 0 {
            self.reveal_for(Duration::ZERO);
        }
    }

    /// Reveals all faces that wait for it.
    pub(super) fn reveal_all(&mut self) {
        self.reveal_for(Duration::MAX);
    }

    /// Reveals faces, a few at least, those last in the list first.
    fn reveal_for(&mut self, time: Duration) {
        let start = Instant::now();
        let mut slots = Vec::new();
        while !self.unrevealed.is_empty() {
            let first = self.unrevealed.len().saturating_sub(FACES);
            let faces: Vec<FaceId> = self.unrevealed.drain(first..).collect();
            let mut indices: Vec<usize> = faces.into_iter().filter_map(|face| self.view.faces.index_of(face)).collect();
            indices.sort_unstable();
            slots.extend(self.reveal(&indices));
            if start.elapsed() >= time {
                break;
            }
        }
        if !slots.is_empty() {
            self.queue_first_visits(&slots);
        }
    }

    /// Whether a face was never drawn, or has leaves at whose corners nothing was ever visited, or not since a light moved.
    pub(super) fn is_new(&self, root: NodeId) -> bool {
        let is_visited = |vertex: &VertexId| !self.cache.vertices[*vertex].is_due();
        let mut leaves = Vec::new();
        self.cache.topology.leaves(root, &mut leaves);
        // All of a face is drawn or nothing; a leaf as part of what was split since.
        let parent = |node: &NodeId| self.cache.topology.nodes[*node].parent.get();
        let mut above = std::iter::successors(leaves.first().copied(), parent);
        let is_drawn = above.any(|node| self.cache.drawn.is_drawn(node));
        !is_drawn || !leaves.iter().all(|&leaf| self.cache.corner_vertices(leaf).iter().all(is_visited))
    }

    /// Draws faces that came into view, with what is known of their light already; returns the slots that they are drawn with.
    pub(super) fn reveal(&mut self, indices: &[usize]) -> Vec<SlotId> {
        let roots: Vec<NodeId> = indices.iter().map(|&index| self.view.faces.all()[index].root).collect();
        let midpoints = self.split_beside_finer(&roots);
        let leaves = self.give_pixels(indices);
        for &leaf in &leaves {
            self.publisher.draw_revealed(&mut self.cache, &self.view, leaf);
        }
        let mut slots = self.drawn_slots(&leaves);
        slots.extend(midpoints);
        slots.sort_unstable();
        slots.dedup();
        self.place_revealed(&slots);
        // S of those known is for another eye.
        let is_due = |&slot: &SlotId| {
            let record = &self.cache.slots[slot];
            !record.direct().known || record.gloss().is_some()
        };
        let due: Vec<SlotId> = slots.iter().copied().filter(is_due).collect();
        self.evaluate(&due);
        self.refresh_unseen(&slots);
        let faces: Vec<FaceId> = indices.iter().map(|&index| self.view.faces.all()[index].face).collect();
        self.note_specular(&faces);
        self.publisher.note_changed(&slots);
        self.look_for_highlights(&leaves);
        self.account(&leaves);
        self.waiting.add(roots);
        slots
    }

    /// Slots that leaves are drawn with.
    pub(super) fn drawn_slots(&self, leaves: &[NodeId]) -> Vec<SlotId> {
        let drawn = leaves.iter().flat_map(|&leaf| self.cache.drawn.of_node(leaf));
        let slots = drawn.flat_map(|drawn| self.cache.drawn.triangles[drawn].all_slots());
        let corners = leaves.iter().flat_map(|&leaf| self.cache.topology.nodes[leaf].corners);
        let mut slots: Vec<SlotId> = slots.chain(corners).collect();
        slots.sort_unstable();
        slots.dedup();
        slots
    }

    /// Has coarser vertices predict those of slots, so that they show something before they have gathered.
    fn place_revealed(&mut self, slots: &[SlotId]) {
        if self.options.indirect && self.cache.indirect.has_gathered() {
            let record = |&slot: &SlotId| &self.cache.slots[slot];
            let base = slots.iter().map(record).filter(|record| record.is_base());
            let mut vertices: Vec<VertexId> = base.map(|record| record.vertex).collect();
            vertices.sort_unstable();
            vertices.dedup();
            self.predictions.place(&mut self.cache, &vertices, &self.workers);
        }
    }
}
