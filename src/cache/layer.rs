//! Static meshes: what is known of one light, sparse over vertices and slots.
//!
//! A light's own mesh is coarser than the dynamic one: where a node's corners agree that the light is fully visible or
//! fully hidden, vertices below it take that over without a ray (method 3, the value of a static mesh).

use super::dynamic::SlotId;
use super::pool::Sparse;
use super::vertex::VertexId;
use crate::estimate::visibility::{AreaSum, Visibility};

/// The static mesh of one light.
#[derive(Clone, Debug, Default)]
pub struct Layer {
    /// By vertex.
    pub visibility: Sparse<Visibility>,
    /// By slot; written for area lights only. For the others direction, distance and emission are analytic, so a
    /// change of the light's colour or power costs no ray.
    pub sums: Sparse<AreaSum>,
}

impl Layer {
    /// Forgets what is known at a vertex and its one slot.
    pub(super) fn forget(&mut self, vertex: VertexId, slot: SlotId) {
        self.visibility.reset(vertex.0);
        self.sums.reset(slot.0);
    }
}
