//! A first look between the corners of large leaves. Walls end behind frames and under floors, where their corners lie in the dark; what
//! the leaf shows would be as dark until its turn to be split comes, by the miss rate alone.

use super::engine::Engine;
use super::options::{Piece, Priority};
use crate::cache::ids::NodeId;
use crate::cache::visibility_probe::{Mismatch, mismatch};

/// Pixels of a large leaf.
const LARGE: f32 = 64.0;
/// Pixels of it that are looked at.
const LOOKS: usize = 4;

/// What was found between the corners.
#[derive(Clone, Copy, Debug, Default)]
struct Found {
    /// Luminance of D by which a pixel differs most from what the corners say, W·sr⁻¹·m⁻².
    most: f32,
    /// Share of the pixels that differ.
    share: f32,
}

impl Engine {
    /// Looks at a few pixels of those leaves that are large and whose corners agree.
    pub(super) fn look_inside(&mut self, leaves: &[NodeId]) {
        let large: Vec<NodeId> = leaves.iter().copied().filter(|&leaf| self.is_large_and_agrees(leaf)).collect();
        let found = self.workers.map_counting(&large, |&leaf, rays| self.found_inside(leaf, rays));
        self.stats.rays += found.rays;
        for (leaf, Found { most, share }) in large.into_iter().zip(found.results) {
            self.view.hidden.update(leaf, |hidden| (hidden.mismatch, hidden.mismatch_share) = (most, share));
        }
    }

    fn is_large_and_agrees(&self, id: NodeId) -> bool {
        let leaf = &self.view.leaves[id];
        let corners = self.cache.topology.nodes[id].corners;
        leaf.pixels >= LARGE
            && !leaf.checked
            && self.options.priority == Priority::Error
            && !self.options.without.has(Piece::Checks)
            && self.cache.topology.is_leaf(id)
            && self.view.sees(id)
            && corners.iter().all(|&slot| self.cache.slots[slot].direct().known)
            && {
                let model = self.error_model();
                !model.is_hard(id, &model.leaf(id))
            }
    }

    fn found_inside(&self, id: NodeId, rays: &mut u64) -> Found {
        let Some(span) = self.view.span(id) else { return Found::default() };
        let (context, pixels) = (self.context(), self.view.lists.of(span));
        let step = pixels.len().div_ceil(LOOKS).max(1);
        let looks = pixels.iter().skip(step / 2).step_by(step);
        let differs: Vec<f32> = looks
            .map(|pixel| {
                let Mismatch { luminance, .. } = mismatch(&context, &self.cache, (id, pixel.weights()), 0, rays);
                luminance
            })
            .collect();
        let count = differs.iter().filter(|luminance| **luminance > 0.0).count();
        let most = differs.iter().copied().fold(0.0, f32::max);
        Found { most, share: count as f32 / differs.len().max(1) as f32 }
    }
}
