//! What the GPU has drawn and counted comes in: pixels steer refinement.

use super::engine::{Counted, Engine};
use super::update::{LeafId, LeafPixels};
use crate::cache::topology::NodeId;
use glam::Vec3;
use rustc_hash::{FxHashMap, FxHashSet};

/// Pixels of a leaf of the hierarchy, which may be drawn as several triangles.
#[derive(Clone, Copy, Default)]
struct NodePixels {
    pixels: u32,
    ray: Option<Vec3>,
}

/// Pixels of leaves that are looked at where a pixel sees them rather than in the middle.
pub(super) const FEW_PIXELS: u32 = 3;

impl NodePixels {
    fn add(&mut self, counted: &LeafPixels) {
        self.pixels += counted.pixels;
        self.ray = self.ray.or(counted.ray);
    }

    /// The ray of one of its pixels, if they are few.
    fn one_ray(&self) -> Option<Vec3> {
        self.ray.filter(|_| self.pixels <= FEW_PIXELS)
    }
}

impl Engine {
    /// Takes in what the GPU has drawn: triangles that it has replaced can be recycled, counted pixels steer refinement.
    pub fn counted(&mut self, counted: &Counted) {
        self.recycle(counted.sequence);
        // Pixels of another camera say nothing.
        let Some(pixels) = counted.pixels.as_ref().filter(|_| counted.generation == self.generation) else { return };
        if counted.complete {
            self.published.note_counted(counted.sequence);
        }
        let changed = self.recount(counted, pixels);
        self.probe_middles(&changed);
        for leaf in changed {
            self.account(leaf);
            if self.first_visits.is_empty() {
                self.enqueue_split(leaf);
            }
        }
    }

    /// Brings the leaves' pixels up to date; returns the leaves that have others now.
    fn recount(&mut self, counted: &Counted, pixels: &[LeafPixels]) -> Vec<NodeId> {
        let mut by_node: FxHashMap<NodeId, NodePixels> = FxHashMap::default();
        for leaf in pixels {
            if !counted.complete || self.published.is_older(leaf.leaf, counted.sequence) {
                by_node.entry(self.cache.leaves[leaf.leaf.0].node).or_default().add(leaf);
            }
        }
        let listed: FxHashSet<LeafId> = pixels.iter().filter(|_| !counted.complete).map(|leaf| leaf.leaf).collect();
        let mut nodes: Vec<NodeId> = by_node.keys().copied().collect();
        nodes.sort_unstable();
        let mut changed = Vec::new();
        for id in if counted.complete { self.all_visible_leaves() } else { nodes } {
            let drawn = &self.cache.topology.nodes[id.0].drawn;
            let is_counted = |leaf: &LeafId| match counted.complete {
                true => self.published.is_older(*leaf, counted.sequence),
                false => listed.contains(leaf),
            };
            if !drawn.is_empty() && drawn.iter().all(is_counted) {
                let found = by_node.get(&id).copied().unwrap_or_default();
                if self.set_pixels(id, found) {
                    changed.push(id);
                }
            }
        }
        changed
    }

    /// Whether a leaf has other pixels than it was thought to have.
    fn set_pixels(&mut self, id: NodeId, found: NodePixels) -> bool {
        let (pixels, ray) = (found.pixels as f32, found.one_ray());
        let work = &mut self.cache.topology.nodes[id.0].work;
        if (pixels, ray) == (work.pixels, work.ray) {
            return false;
        }
        let difference = pixels - work.pixels;
        (work.pixels, work.ray) = (pixels, ray);
        if difference != 0.0 {
            self.recount_indirect(id, difference);
        }
        true
    }
}
