//! What the GPU is told: slots written, patches to redraw, and when the triangles that they replace may be recycled.

use super::engine::Engine;
use super::update::{DrawnId, EngineStats, Patch, Slot, Update};
use super::workers::thread_nanoseconds;
use crate::cache::dynamic::{COVERED_WEIGHT, SlotId};
use crate::cache::pool::Sparse;
use crate::cache::topology::NodeId;
use std::collections::VecDeque;

/// What has been published and what is due.
#[derive(Default)]
pub struct Published {
    /// Slots evaluated since the last update.
    pub changed: Vec<SlotId>,
    /// Nodes whose triangles are no longer right.
    redraw: Vec<NodeId>,
    /// Number of the last update.
    sequence: u64,
    /// The last update that changed triangles, and the last whose triangles' pixels are counted.
    redrawn: u64,
    counted: u64,
    /// The last update that showed a new view.
    viewed: u64,
    batch: u32,
    /// Triangles out of use, with the update that replaced them.
    retired: VecDeque<(u64, DrawnId)>,
    /// Update that first drew each triangle.
    born: Sparse<u64>,
    /// Nodes whose triangles' pixels are not known, with the update that draws them, in its order.
    uncounted: VecDeque<(u64, NodeId)>,
}

impl Published {
    /// Notes that the pixels of all triangles are known as update `sequence` left them.
    pub(super) fn note_counted(&mut self, sequence: u64) {
        self.counted = sequence;
    }

    /// Whether the pixels of a triangle, which update `sequence` or an earlier one has drawn, are known for the first time.
    #[must_use]
    pub(super) fn is_uncounted(&self, leaf: DrawnId, sequence: u64) -> bool {
        let born = self.born.get(leaf.0);
        born > 0 && born <= sequence && (born > self.counted || self.counted <= self.viewed)
    }

    /// Takes the nodes whose triangles update `sequence` or an earlier one has drawn since pixels were last counted.
    pub(super) fn due_for_count(&mut self, sequence: u64) -> Vec<NodeId> {
        let due = self.uncounted.partition_point(|(drawn, _)| *drawn <= sequence);
        self.uncounted.drain(..due).map(|(_, node)| node).collect()
    }
}

impl Engine {
    /// Notes that a node's triangles must be drawn anew; a node that never was drawn is part of one that was.
    pub(super) fn note_redraw(&mut self, node: NodeId) {
        if !self.cache.topology.nodes[node.0].drawn.is_empty() {
            self.published.redraw.push(node);
        }
    }

    /// Takes the triangles of a node out of use: the update in the making replaces them.
    pub(super) fn retire_drawn(&mut self, node: NodeId) -> Vec<DrawnId> {
        let old = std::mem::take(&mut self.cache.topology.nodes[node.0].drawn);
        for &leaf in &old {
            self.cache.retire_drawn_triangle(leaf);
            self.published.retired.push_back((self.published.sequence + 1, leaf));
        }
        old
    }

    /// Gives a leaf its triangles.
    pub(super) fn draw_node(&mut self, node: NodeId) {
        let triangles = self.cache.triangulate(node);
        let flat = self.error_model().settled(node);
        let leaves: Vec<DrawnId> = triangles.into_iter().map(|slots| self.cache.add_drawn(slots, flat, node)).collect();
        for leaf in &leaves {
            *self.published.born.entry(leaf.0) = self.published.sequence + 1;
        }
        self.cache.topology.nodes[node.0].drawn = leaves;
        if self.options.counted {
            self.published.uncounted.push_back((self.published.sequence + 1, node));
        }
    }

    /// The update that shows everything visible anew.
    pub(super) fn full_update(&mut self, leaves: &[NodeId], slots: &[SlotId]) -> Update {
        self.published.changed.clear();
        self.published.sequence += 1;
        (self.published.redrawn, self.published.viewed) = (self.published.sequence, self.published.sequence);
        self.published.uncounted = leaves.iter().map(|&leaf| (self.published.sequence, leaf)).collect();
        let mut update = self.empty_update();
        update.slots = slots.iter().map(|&s| (s, self.slot(s))).collect();
        for &node in leaves {
            let start = update.patch_triangles.len() as u32;
            self.list(&mut update, node);
            let end = update.patch_triangles.len() as u32;
            let face = self.cache.topology.nodes[node.0].face;
            update.patches.push(Patch { face, old: start..start, new: start..end });
        }
        update.stats = self.current_stats();
        update
    }

    /// The update with everything that changed since the last.
    pub(super) fn publish(&mut self) -> Update {
        self.published.batch += 1;
        let mut update = Update::default();
        self.redraw_nodes(&mut update);
        self.published.sequence += 1;
        (update.generation, update.sequence) = (self.generation, self.published.sequence);
        let mut slots = std::mem::take(&mut self.published.changed);
        slots.sort_unstable();
        slots.dedup();
        if self.first_visits.is_empty() {
            self.enqueue_vertices(&slots);
        }
        self.value_patches(&mut update, &slots);
        update.slots = slots.iter().map(|&s| (s, self.slot(s))).collect();
        if cfg!(debug_assertions) {
            self.cache.validate();
        }
        update.stats = self.current_stats();
        update
    }

    /// Replaces the triangles of nodes that were split or whose edges changed.
    fn redraw_nodes(&mut self, update: &mut Update) {
        let mut nodes = std::mem::take(&mut self.published.redraw);
        nodes.sort_unstable();
        nodes.dedup();
        let mut fresh = Vec::new();
        for node in nodes {
            let old = self.retire_drawn(node);
            let mut leaves = Vec::new();
            self.cache.topology.leaves(node, &mut leaves);
            let start = update.patch_triangles.len() as u32;
            update.patch_triangles.extend(old);
            let middle = update.patch_triangles.len() as u32;
            for leaf in leaves {
                self.draw_node(leaf);
                self.list(update, leaf);
                let drawn = &self.cache.topology.nodes[leaf.0].drawn;
                fresh.extend(drawn.iter().flat_map(|l| self.cache.drawn[l.0].triangle.all_slots()));
            }
            let end = update.patch_triangles.len() as u32;
            let record = &self.cache.topology.nodes[node.0];
            if record.work.generation == self.generation {
                update.patches.push(Patch { face: record.face, old: start..middle, new: middle..end });
                self.published.redrawn = self.published.sequence + 1;
            }
        }
        // Looks at a midpoint that only a neighbour had needed so far.
        fresh.retain(|slot| !self.cache.slots[slot.0].direct.known);
        fresh.sort_unstable();
        fresh.dedup();
        self.evaluate(&fresh);
    }

    /// Lists a leaf's triangles with their definitions.
    fn list(&self, update: &mut Update, node: NodeId) {
        for &leaf in &self.cache.topology.nodes[node.0].drawn {
            update.drawn_triangles.push((leaf, self.cache.drawn[leaf.0].triangle));
            update.patch_triangles.push(leaf);
        }
    }

    /// Patches of triangles whose values alone changed.
    fn value_patches(&mut self, update: &mut Update, slots: &[SlotId]) {
        for &slot in slots {
            let leaves: Vec<DrawnId> = self.cache.drawn_with(slot).collect();
            for leaf in leaves {
                let record = &mut self.cache.drawn[leaf.0];
                let node = &self.cache.topology.nodes[record.node.0];
                let visible = node.work.generation == self.generation;
                let is_new = self.published.born.get(leaf.0) == self.published.sequence;
                let seen = std::mem::replace(&mut record.batch, self.published.batch) == self.published.batch;
                if visible && !is_new && !seen {
                    let i = update.patch_triangles.len() as u32;
                    update.patch_triangles.push(leaf);
                    update.patches.push(Patch { face: node.face, old: i..i + 1, new: i..i + 1 });
                }
            }
        }
    }

    /// Gives back the triangles that update `sequence` or an earlier one has replaced on the GPU.
    pub(super) fn recycle(&mut self, sequence: u64) {
        while let Some(&(replaced, leaf)) = self.published.retired.front() {
            if replaced > sequence {
                break;
            }
            self.published.retired.pop_front();
            *self.published.born.entry(leaf.0) = 0;
            self.cache.drawn.remove(leaf.0);
        }
    }

    fn empty_update(&self) -> Update {
        Update { generation: self.generation, sequence: self.published.sequence, ..Update::default() }
    }

    fn slot(&self, slot: SlotId) -> Slot {
        let record = &self.cache.slots[slot.0];
        let vertex = &self.cache.vertices[record.vertex.0];
        let weight = match (record.direct.known, vertex.progress.covered) {
            (false, _) => 0.0,
            (true, false) => 1.0,
            (true, true) => COVERED_WEIGHT,
        };
        Slot { position: vertex.position, weight, diffuse: record.diffuse(), specular: record.specular() }
    }

    fn current_stats(&mut self) -> EngineStats {
        // The engine's own thread waits while its workers trace.
        let own = thread_nanoseconds().saturating_sub(self.born) as f64 * 1e-9;
        self.stats.cpu_seconds = self.workers.cpu_seconds() + own;
        self.stats.triangles = self.cache.drawn.live() as u64 - self.published.retired.len() as u64;
        self.stats.cache_bytes = self.cache.bytes() as u64;
        self.stats.unlit = self.first_visits.len() as u64;
        self.stats.complete = self.first_visits.is_empty();
        self.stats.estimated_error =
            if self.stats.complete { self.image.relative(self.checks.expected()) } else { None };
        let awaits_counts = self.options.counted && self.published.counted < self.published.redrawn;
        self.stats.converged = self.is_idle() && !awaits_counts;
        self.stats
    }
}
