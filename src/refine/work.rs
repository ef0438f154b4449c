//! The work of a batch: what was chosen, what the hierarchy grew by, and what has changed.

use crate::cache::direct::Job;
use crate::cache::ids::{NodeId, SlotId, VertexId};
use crate::cache::split::Split;

/// Tasks chosen for a batch, by kind.
#[derive(Debug, Default)]
pub struct Work {
    /// Vertices visited for the first time; nothing else is done in such a batch.
    pub first_visits: Vec<VertexId>,
    /// Leaves to split.
    pub splits: Vec<NodeId>,
    /// Leaves to sample where their one pixel sees them.
    pub pixel_samples: Vec<NodeId>,
    /// Leaves whose pixels are checked.
    pub checks: Vec<NodeId>,
    /// Vertices whose lights are traced further.
    pub visits: Vec<Job>,
    /// Leaves of the indirect layer whose middles are to be sampled.
    pub refined: Vec<NodeId>,
    /// Vertices whose rays of indirect light are to be doubled.
    pub gathers: Vec<VertexId>,
    /// Rays of direct light that this takes, roughly.
    pub direct_rays: f32,
    /// Rays of indirect light that this takes, roughly.
    pub gather_rays: u32,
}

impl Work {
    /// Number of tasks.
    #[must_use]
    pub const fn tasks(&self) -> usize {
        self.direct_tasks() + self.refined.len() + self.gathers.len()
    }

    /// Number of tasks on direct light.
    #[must_use]
    pub const fn direct_tasks(&self) -> usize {
        let of_leaves = self.splits.len() + self.pixel_samples.len() + self.checks.len();
        self.first_visits.len() + of_leaves + self.visits.len()
    }

    /// Whether there is nothing to do.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.tasks() == 0
    }
}

/// A leaf split in this batch.
#[derive(Clone, Copy, Debug)]
pub struct SplitLeaf {
    /// The leaf.
    pub node: NodeId,
    /// Its children, and the slots in the middle of its edges.
    pub split: Split,
    /// Square of its reference luminance, (W·sr⁻¹·m⁻²)², if nothing but the miss rate had it split.
    pub by_miss_rate: Option<f32>,
}

/// What the hierarchy grew by.
#[derive(Debug, Default)]
pub struct Grown {
    /// Leaves that were split.
    pub splits: Vec<SplitLeaf>,
    /// Slots of pixel vertices that were there before.
    pub kept: Vec<SlotId>,
    /// Vertices to visit.
    pub jobs: Vec<Job>,
}

/// Direct light that has changed.
#[derive(Debug, Default)]
pub struct Lit {
    /// Whether nothing but first visits was done.
    pub first_visits: bool,
    /// Whether some of them were visited before a light moved, so that leaves may lie around them that were split.
    pub outdated: bool,
    /// Leaves that were split.
    pub splits: Vec<SplitLeaf>,
    /// Leaves that were sampled where their one pixel sees them.
    pub pixel_samples: Vec<NodeId>,
    /// Leaves whose pixels are to be checked.
    pub checks: Vec<NodeId>,
    /// Slots that were evaluated.
    pub slots: Vec<SlotId>,
}

/// Indirect light that has changed.
#[derive(Debug, Default)]
pub struct GatheredLight {
    /// Vertices that have gathered, in ascending order.
    pub vertices: Vec<VertexId>,
    /// Leaves of the indirect layer that were refined.
    pub refined: Vec<NodeId>,
}
