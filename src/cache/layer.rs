//! What is known of one light group, sparse over vertices and slots.
//!
//! A light's layer is coarser than the drawn mesh: where a node's corners agree that the light is fully visible or
//! fully hidden, vertices below it take that over without a ray.

use super::ids::{SlotId, VertexId};
use super::sparse::Sparse;
use super::visibility_table::VisibilityTable;
use crate::estimate::visibility::AreaSum;

/// What is known of one light group.
#[derive(Clone, Debug, Default)]
pub struct Layer {
    /// By vertex.
    pub visibility: VisibilityTable,
    /// By slot; written for area lights only. For the others direction, distance and emission are analytic, so a
    /// change of the light's colour or power costs no ray.
    pub sums: Sparse<SlotId, AreaSum>,
}

impl Layer {
    /// Forgets what is known at a vertex and its one slot.
    pub(super) fn forget(&mut self, vertex: VertexId, slot: SlotId) {
        self.visibility.reset(vertex);
        self.sums.reset(slot);
    }
}
