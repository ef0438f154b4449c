//! Vertices inside something: none of their rays found any light, no light reaches them, and neighbours do see light.
//! Where a surface runs into a wall its light must not fade towards what is behind.

use super::engine::Engine;
use super::indirect_error::PROOF_OF_DARKNESS;
use super::options::Piece;
use crate::cache::ids::{NodeId, SlotId, VertexId};
use crate::geom::Ray;
use glam::Vec3;
use smallvec::SmallVec;

/// Direct light of a vertex against the light around it up to which it may be enclosed.
const FAINT: f32 = 0.02;

impl Engine {
    /// Finds vertices inside something: none of their rays found any light, no light reaches them, and neighbours do
    /// see light. Where a surface runs into a wall its light must not fade towards what is behind.
    pub(super) fn find_enclosed(&mut self, vertices: &[VertexId]) {
        if self.options.without.has(Piece::Enclosed) {
            return;
        }
        let mut rest = vertices;
        // What one shows that is found to be enclosed may darken others.
        while let Some(found) = self.find_next_enclosed(rest) {
            rest = &rest[found + 1..];
        }
    }

    /// Finds the first of vertices that lies inside something; returns its place.
    fn find_next_enclosed(&mut self, vertices: &[VertexId]) -> Option<usize> {
        let dark = self.workers.map(vertices, |vertex| self.has_found_no_light(vertex));
        for place in dark.into_iter().zip(0..).filter_map(|(is_dark, place)| is_dark.then_some(place)) {
            let vertex = vertices[place];
            let slots: Vec<SlotId> = self.cache.slots_of(vertex).collect();
            let nodes = self.nodes_around(&slots);
            if self.is_enclosed(vertex, &slots, &nodes) {
                self.enclosed.push(vertex);
                let progress = &mut self.cache.vertices[vertex].progress;
                (progress.covered, progress.enclosed) = (true, true);
                self.refresh_indirect(&slots);
                self.account(&nodes);
                self.enqueue(&nodes);
                return Some(place);
            }
        }
        None
    }

    /// Whether a vertex that nothing covers, as far as is known, has sent rays that have found no light.
    fn has_found_no_light(&self, vertex: VertexId) -> bool {
        let dark = |slot: SlotId| self.cache.slots[slot].indirect().diffuse == Vec3::ZERO;
        let sampled = self.cache.indirect.rays(vertex) > 0 && !self.cache.vertices[vertex].progress.covered;
        sampled && self.cache.slots_of(vertex).all(dark)
    }

    /// Whether a vertex that has seen no light lies inside something: neighbours do see light, and either it has
    /// looked often enough or something stands between it and one of those.
    fn is_enclosed(&mut self, vertex: VertexId, slots: &[SlotId], nodes: &[NodeId]) -> bool {
        // What was put off is guessed: a little direct light proves nothing.
        let direct = slots.iter().map(|s| self.cache.slots[*s].direct().diffuse.max_element()).fold(0.0, f32::max);
        let is_lit = |slot: &SlotId| {
            let light = self.cache.slots[*slot].indirect();
            light.diffuse.max_element() * FAINT > direct && !light.stale
        };
        let corners = nodes.iter().flat_map(|n| self.cache.topology.nodes[*n].corners).filter(is_lit);
        let mut lit: SmallVec<[VertexId; 8]> = corners.map(|slot| self.cache.slots[slot].vertex).collect();
        lit.sort_unstable();
        lit.dedup();
        if self.cache.indirect.rays(vertex) >= PROOF_OF_DARKNESS {
            return !lit.is_empty();
        }
        self.stats.rays += lit.len() as u64;
        let origin_of = |vertex: VertexId| self.cache.vertices[vertex].shading_point().origin;
        lit.into_iter().any(|other| self.is_cut_off(origin_of(other), origin_of(vertex)))
    }

    /// Whether something stands between two places.
    fn is_cut_off(&self, from: Vec3, to: Vec3) -> bool {
        let (length, direction) = ((to - from).length(), (to - from).normalize_or_zero());
        direction != Vec3::ZERO && self.bvh.occluded(&self.scene, &Ray { origin: from, direction, t_max: length })
    }
}
