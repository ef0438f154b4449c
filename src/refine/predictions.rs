//! Predictions above the geometry in a batch: visible base vertices taken into the coarse-to-fine order, what rests on coarse
//! ones, and predictions brought up to date.

use super::engine::Engine;
use crate::cache::dynamic::SlotId;
use crate::cache::topology::NodeId;
use crate::cache::vertex::VertexId;

/// Rays that are traced for each prediction brought up to date in the long run: oftener cost more than it told.
const RAYS_A_PREDICTION: u64 = 4;
/// Times after which it is done more seldom.
const ALIKE: u64 = 2;

impl Engine {
    /// Takes the visible base vertices that are not yet in the order into it.
    pub(super) fn place_in_coarse_levels(&mut self) {
        let mut slots = Vec::new();
        self.base = self.corners_of_all(&self.roots);
        for &vertex in &self.base {
            if self.cache.slots_of(vertex).any(|slot| self.cache.slots[slot.0].is_unplaced()) {
                self.cache.place_in_coarse_levels(vertex);
                slots.extend(self.cache.slots_of(vertex));
            }
        }
        self.cache.refresh_indirect(&slots, self.eye);
        let rank = |vertex: VertexId| {
            let first = self.cache.vertices[vertex.0].first_slot;
            first.map_or(0, |slot| self.cache.slots[slot.0].rank)
        };
        self.base.sort_by_cached_key(|&vertex| std::cmp::Reverse((rank(vertex), vertex)));
    }

    /// Adds up what rests on the vertices that predict others.
    pub(super) fn spread_importance(&mut self) {
        for vertex in std::mem::take(&mut self.predicting) {
            self.cache.vertices[vertex.0].importance_below = 0.0;
        }
        let mut parents: Vec<(VertexId, f32)> = Vec::new();
        // Finest first: what rests on a vertex rests on those that predict it.
        for &vertex in self.base.iter().filter(|&&vertex| self.cache.indirect.rays(vertex) == 0) {
            parents.clear();
            let of = self.cache.parents_of(vertex);
            parents.extend(of.map(|(slot, weight)| (self.cache.slots[slot.0].vertex, weight.abs())));
            let record = &self.cache.vertices[vertex.0];
            let importance = record.importance + record.importance_below;
            for &(parent, weight) in &parents {
                let below = &mut self.cache.vertices[parent.0].importance_below;
                if *below == 0.0 {
                    self.predicting.push(parent);
                }
                *below += weight * importance;
            }
        }
    }

    /// Brings predictions up to date where enough rays were traced for that to cost little beside them.
    pub(super) fn refresh_predictions_in_time(&mut self) {
        let waiting = self.cache.waiting_predictions();
        // A prediction costs about as much as a ray. The first are rough, and soon replaced; later ones change little.
        let share = (1 + self.predicted / ALIKE).min(RAYS_A_PREDICTION);
        let cost = share * (waiting + self.base.len()) as u64;
        if self.stats.rays - self.predicted_at >= cost {
            self.refresh_waiting_predictions();
        }
    }

    /// Brings predictions up to date if any waits for that.
    pub(super) fn refresh_waiting_predictions(&mut self) {
        if self.cache.waiting_predictions() > 0 {
            self.spread_importance();
            self.refresh_predictions();
        }
    }

    /// Brings predictions up to date, with all that hangs on them.
    pub(super) fn refresh_predictions(&mut self) {
        (self.predicted_at, self.predicted) = (self.stats.rays, self.predicted + 1);
        let written = self.cache.refresh_predictions(self.eye);
        let mut leaves: Vec<NodeId> = self.nodes_around(&written);
        leaves.iter_mut().for_each(|leaf| *leaf = self.cache.topology.indirect_leaf(*leaf));
        leaves.dedup();
        leaves.into_iter().for_each(|leaf| self.account_indirect(leaf));
        let base = |slot: &&SlotId| self.cache.slots[slot.0].is_base();
        let mut vertices: Vec<VertexId> = written.iter().filter(base).map(|s| self.cache.slots[s.0].vertex).collect();
        vertices.extend_from_slice(&self.predicting);
        vertices.sort_unstable();
        vertices.dedup();
        vertices.into_iter().for_each(|vertex| self.enqueue_gather(vertex));
        self.published.changed.extend(written);
    }
}
