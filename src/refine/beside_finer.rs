//! Faces that come into view beside finer ones: they are split until neighbours are within one level of each other.

use super::engine::Engine;
use super::work::{Grown, SplitLeaf};
use crate::cache::ids::{NodeId, SlotId, VertexId};

impl Engine {
    /// Splits what lies below roots, and what must be split with it, beside edges that neighbours have split twice.
    /// Returns the slots of midpoints that are to be visited.
    pub(super) fn split_beside_finer(&mut self, roots: &[NodeId]) -> Vec<SlotId> {
        let (mut grown, mut next) = (Grown::default(), roots.to_vec());
        while let Some(node) = next.pop() {
            if self.cache.topology.is_beside_much_finer(node) {
                self.split(node, &mut grown);
            }
            next.extend(self.cache.topology.children(node));
        }
        grown.splits.iter().for_each(|leaf| self.hand_view_down(leaf));
        let vertices: Vec<VertexId> = grown.jobs.iter().map(|job| job.vertex).collect();
        // With the corners of the faces, which most of them lie between.
        vertices.iter().for_each(|&vertex| self.cache.vertices[vertex].progress.visited = false);
        self.slots_of_all(&vertices)
    }

    /// Hands what the view makes of a leaf that was split down to its children; they are queued with what came into view.
    fn hand_view_down(&mut self, leaf: &SplitLeaf) {
        self.view.hand_pixels_down(leaf.node, leaf.split.children);
        self.checks.hand_down(leaf.node, leaf.split.children, &self.cache, &mut self.view);
        self.image.replace(&mut self.view.leaves[leaf.node].accounted, None);
        self.forget_inside(leaf.node);
        let face = self.cache.topology.nodes[leaf.node].face;
        self.waiting.add(self.cache.root_of(face));
    }
}
