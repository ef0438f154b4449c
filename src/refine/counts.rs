//! What the GPU has drawn and counted comes in: triangles that are not drawn any more can be recycled, and pixels that
//! it counted (by queries or counters, instead of the image's) steer refinement.

use super::engine::{Counted, Engine};
use super::update::DrawnPixels;
use crate::cache::ids::{DrawnId, NodeId};
use rustc_hash::{FxHashMap, FxHashSet};

impl Engine {
    /// Takes in what the GPU has drawn: triangles that it has replaced can be recycled, counted pixels steer
    /// refinement.
    pub fn counted(&mut self, counted: &Counted) {
        self.publisher.recycle(&mut self.cache, counted.sequence);
        // Pixels of another camera say nothing.
        if self.view.listed || counted.pixels.is_empty() || counted.generation != self.view.generation {
            return;
        }
        let leaves = self.recount(&counted.pixels);
        self.account(&leaves);
        if self.is_complete() {
            self.enqueue(&leaves);
        }
    }

    /// Brings the leaves' pixels up to date; returns the leaves that have others now.
    fn recount(&mut self, pixels: &[DrawnPixels]) -> Vec<NodeId> {
        let due = self.listed(pixels).into_iter();
        let mut by_node: FxHashMap<NodeId, u32> = due.map(|id| (id, 0)).collect();
        for counted in pixels {
            if let Some(found) = by_node.get_mut(&self.cache.drawn.triangles[counted.drawn].node) {
                *found += counted.pixels;
            }
        }
        let mut found: Vec<(NodeId, u32)> = by_node.into_iter().collect();
        found.sort_unstable_by_key(|(id, _)| *id);
        found.retain(|&(id, found)| self.is_seen(id) && self.set_pixels(id, found as f32));
        found.into_iter().map(|(id, _)| id).collect()
    }

    /// Nodes all of whose triangles are listed.
    fn listed(&self, pixels: &[DrawnPixels]) -> Vec<NodeId> {
        let listed: FxHashSet<DrawnId> = pixels.iter().map(|pixels| pixels.drawn).collect();
        let mut nodes: Vec<NodeId> = listed.iter().map(|&drawn| self.cache.drawn.triangles[drawn].node).collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes.retain(|&id| self.cache.drawn.of_node(id).iter().all(|drawn| listed.contains(drawn)));
        nodes
    }

    /// Whether a node is a drawn leaf of the present view.
    fn is_seen(&self, id: NodeId) -> bool {
        self.cache.drawn.is_drawn(id) && self.view.sees(id)
    }

    /// Whether a leaf has other pixels than it was thought to have.
    fn set_pixels(&mut self, id: NodeId, pixels: f32) -> bool {
        let leaf = &mut self.view.leaves[id];
        let difference = pixels - std::mem::replace(&mut leaf.pixels, pixels);
        if difference != 0.0 {
            self.recount_indirect(id, difference);
        }
        difference != 0.0
    }
}
