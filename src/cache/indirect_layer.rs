//! What is gathered of indirect light: sums of light vectors at vertices, sparse over vertices and slots.

use super::ids::{SlotId, VertexId};
use super::kept_luminance::KeptLuminance;
use super::previous_lighting::{Gathers, PreviousLighting};
use super::slot::Luminance;
use super::sparse::Sparse;
use crate::estimate::light_vector::LightVector;
use glam::Vec3;

/// Light vectors, sparse over vertices and slots.
#[derive(Clone, Debug, Default)]
pub struct IndirectLayer {
    /// Rays gathered so far, by vertex, and sums over them, by slot: one set of rays serves all normals of a vertex.
    pub(super) gathers: Gathers,
    /// What was gathered before the lights changed.
    pub(super) previous: PreviousLighting,
    /// Whether what is shown leans on neighbours while rays are few.
    pub filter: bool,
    /// Whether base slots have changed since predictions of others were last brought up to date: one coarse vertex
    /// predicts hundreds.
    pub(super) stale: bool,
    /// D to show of slots that smoothing changed (docs/method/indirect-light.md), W·sr⁻¹·m⁻².
    smoothed: Sparse<SlotId, KeptLuminance>,
}

/// Which of the values that there are of its indirect light a slot shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShownAs {
    /// Smoothed between samples.
    Smoothed,
    /// What it gathered, or what others predict, as it is kept.
    Kept,
    /// What is to be expected where nothing is known.
    Expected,
}

/// New rays of one vertex.
#[derive(Clone, Copy, Debug)]
pub struct Round {
    /// The vertex.
    pub vertex: VertexId,
    /// Where it lay, scene units.
    pub position: Vec3,
    /// How many rays.
    pub rays: u32,
    /// How many entries of the results' sums belong to it.
    pub sums: u32,
}

impl IndirectLayer {
    /// Rays gathered at a vertex.
    #[must_use]
    pub fn rays(&self, vertex: VertexId) -> u32 {
        self.gathers.rays.get(vertex)
    }

    /// Whether any vertex has gathered, under these lights or others.
    #[must_use]
    pub fn has_gathered(&self) -> bool {
        !self.gathers.rays.is_empty() || self.previous.bytes() > 0
    }

    /// Whether a slot has gathered anything itself. (A look that was added after its vertex's last round has not.)
    #[must_use]
    pub fn is_sampled(&self, slot: SlotId) -> bool {
        self.gathers.sums.get(slot).samples() > 0
    }

    /// What a slot has gathered.
    #[must_use]
    pub fn sum(&self, slot: SlotId) -> LightVector {
        self.gathers.sums.get(slot)
    }

    /// Adds a round.
    pub fn add(&mut self, round: Round, sums: &[(SlotId, LightVector)]) {
        if self.gathers.rays.get(round.vertex) == 0 {
            self.previous.note_gathered(round.vertex);
        }
        *self.gathers.rays.entry(round.vertex) += round.rays;
        for (slot, sum) in sums {
            self.gathers.sums.entry(*slot).add(sum);
        }
    }

    /// Replaces what a vertex has gathered: rays, with what is expected of it ([`Self::note_expected`]), and the sums of its slots.
    pub(super) fn replace(&mut self, vertex: VertexId, (rays, expected): (u32, f32), sums: &[(SlotId, LightVector)]) {
        if self.gathers.rays.get(vertex) == 0 {
            self.previous.note_gathered(vertex);
        }
        *self.gathers.rays.entry(vertex) = rays;
        self.gathers.expected.update(vertex, |square| *square = expected);
        sums.iter().for_each(|(slot, sum)| *self.gathers.sums.entry(*slot) = *sum);
    }

    /// Vertices that gathered before the lights changed, and not since.
    #[must_use]
    pub const fn outdated(&self) -> u64 {
        self.previous.outdated
    }

    /// D to show of a slot, W·sr⁻¹·m⁻², if smoothing changed it.
    #[must_use]
    pub(super) fn smoothed(&self, slot: SlotId) -> Option<Vec3> {
        let Luminance { diffuse, known, .. } = self.smoothed.get(slot).get();
        known.then_some(diffuse)
    }

    /// Takes D to show of a slot; returns whether it is another now.
    pub(super) fn show_smoothed(&mut self, slot: SlotId, diffuse: Option<Vec3>) -> bool {
        let shown = |diffuse| KeptLuminance::new(Luminance { diffuse, known: true, ..Luminance::default() });
        let (before, now) = (self.smoothed.get(slot), diffuse.map_or(KeptLuminance::default(), shown));
        if before != now {
            *self.smoothed.entry(slot) = now;
        }
        before != now
    }

    /// Forgets all that smoothing changed.
    pub(super) fn forget_smoothed(&mut self) {
        self.smoothed = Sparse::default();
    }

    /// Forgets what was gathered at a vertex of one slot.
    pub fn forget(&mut self, vertex: VertexId, slot: SlotId) {
        if self.gathers.rays.get(vertex) == 0 {
            self.previous.note_gathered(vertex);
        }
        self.gathers.forget(vertex, slot);
        self.smoothed.reset(slot);
        self.previous.forget(vertex, slot);
    }

    /// Gives back what a vertex and its slots hold, which are gone.
    pub(super) fn remove(&mut self, vertex: VertexId, slots: &[SlotId]) {
        if self.gathers.rays.get(vertex) == 0 {
            self.previous.note_gathered(vertex);
        }
        self.gathers.remove(vertex, slots);
        self.previous.remove(vertex, slots);
        slots.iter().for_each(|&slot| self.smoothed.reset(slot));
    }

    /// Notes how far a midpoint is expected to deviate from what the ends of its edge predict, or a vertex inside a
    /// leaf from what its corners do: square of a luminance, (W·sr⁻¹·m⁻²)².
    pub fn note_expected(&mut self, vertex: VertexId, square: f32) {
        *self.gathers.expected.entry(vertex) = square;
    }

    /// How far a midpoint is expected to deviate: square of a luminance, (W·sr⁻¹·m⁻²)².
    #[must_use]
    pub fn expected(&self, vertex: VertexId) -> f32 {
        self.gathers.expected.get(vertex)
    }

    /// Bytes held.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.gathers.bytes() + self.previous.bytes() + self.smoothed.bytes()
    }

    /// Rays of a vertex's next round that would be its first under the present lights, `least` or more.
    #[must_use]
    pub fn first_rays(&self, vertex: VertexId, least: u32) -> u32 {
        self.previous.first_rays(vertex, least)
    }
}
