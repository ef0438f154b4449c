//! What the GPU has drawn and counted comes in: pixels steer refinement.

use super::engine::{Counted, Engine};
use super::update::DrawnPixels;
use super::view::FEW_PIXELS;
use crate::cache::ids::{DrawnId, NodeId};
use glam::Vec3;
use rustc_hash::{FxHashMap, FxHashSet};

/// Pixels of a leaf of the hierarchy, which may be drawn as several triangles.
#[derive(Clone, Copy, Default)]
struct NodePixels {
    pixels: u32,
    ray: Option<Vec3>,
}

impl NodePixels {
    fn add(&mut self, counted: &DrawnPixels) {
        self.pixels += counted.pixels;
        self.ray = self.ray.or(counted.ray);
    }

    /// The ray of one of its pixels, if they are few.
    fn one_ray(&self) -> Option<Vec3> {
        self.ray.filter(|_| self.pixels <= FEW_PIXELS)
    }
}

impl Engine {
    /// Takes in what the GPU has drawn: triangles that it has replaced can be recycled, counted pixels steer
    /// refinement.
    pub fn counted(&mut self, counted: &Counted) {
        self.publisher.recycle(&mut self.cache, counted.sequence);
        // Pixels of another camera say nothing.
        let Some(pixels) = counted.pixels.as_ref().filter(|_| counted.generation == self.view.generation) else {
            return;
        };
        let changed = self.recount(counted, pixels);
        if counted.complete {
            self.publisher.note_counted(counted.sequence);
        }
        for leaf in changed {
            self.account(leaf);
            if self.is_complete() {
                self.enqueue_leaf(leaf);
            }
        }
    }

    /// Brings the leaves' pixels up to date; returns the leaves that have others now.
    fn recount(&mut self, counted: &Counted, pixels: &[DrawnPixels]) -> Vec<NodeId> {
        let due = if counted.complete { self.publisher.due_for_count(counted.sequence) } else { self.listed(pixels) };
        let mut by_node: FxHashMap<NodeId, NodePixels> =
            due.into_iter().map(|id| (id, NodePixels::default())).collect();
        let is_new =
            |leaf: &&DrawnPixels| !counted.complete || self.publisher.is_uncounted(leaf.drawn, counted.sequence);
        for leaf in pixels.iter().filter(is_new) {
            if let Some(found) = by_node.get_mut(&self.cache.drawn.triangles[leaf.drawn].node) {
                found.add(leaf);
            }
        }
        let mut found: Vec<(NodeId, NodePixels)> = by_node.into_iter().collect();
        found.sort_unstable_by_key(|(id, _)| *id);
        found.retain(|&(id, found)| self.is_seen(id) && self.set_pixels(id, found));
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
        !self.cache.drawn.of_node(id).is_empty() && self.view.sees(id)
    }

    /// Whether a leaf has other pixels than it was thought to have.
    fn set_pixels(&mut self, id: NodeId, found: NodePixels) -> bool {
        let (pixels, ray) = (found.pixels as f32, found.one_ray());
        let leaf = &mut self.view.leaves[id];
        if (pixels, ray) == (leaf.pixels, leaf.ray) {
            return false;
        }
        let difference = pixels - leaf.pixels;
        (leaf.pixels, leaf.ray) = (pixels, ray);
        if difference != 0.0 {
            self.recount_indirect(id, difference);
        }
        true
    }
}
