//! The luminance mesh as the device knows it: slots, leaves, which leaves are drawn, and what waits to be drawn.

use super::mirror::Mirror;
use super::shared::{GpuLeaf, GpuSlot};
use crate::error::{Error, Result};
use crate::refine::update::{LeafId, Patch, Update};
use crate::vk::Device;
use glam::Vec3;
use std::ops::Range;

/// No place, no batch.
const NOWHERE: u32 = u32::MAX;

/// Where a leaf stands.
#[derive(Clone, Copy)]
struct LeafState {
    /// Place in `drawn`.
    place: u32,
    /// Serial of the batch that draws it anew.
    new_in: u32,
    /// Serial of the batch that draws its new values.
    values_in: u32,
}

impl LeafState {
    const NONE: Self = Self { place: NOWHERE, new_in: NOWHERE, values_in: NOWHERE };
}

/// A patch whose triangles change.
#[derive(Clone, Debug)]
pub(super) struct PendingPatch {
    /// Corners of the triangles drawn last, as they were drawn.
    pub old: Vec<[Vec3; 3]>,
    /// Leaves to draw now: a range of [`Batch::new`].
    pub new: Range<usize>,
}

/// Patches that can be drawn together: none draws over what another of them must find.
#[derive(Clone, Debug, Default)]
pub(super) struct Batch {
    /// Leaves of patches with `old == new`: same triangles, other values.
    pub values: Vec<u32>,
    /// Leaves of all other patches.
    pub new: Vec<u32>,
    /// Patches of those leaves.
    pub patches: Vec<PendingPatch>,
}

/// The mesh with its mirrors on the device.
pub(super) struct LuminanceMesh {
    pub slots: Mirror<GpuSlot>,
    pub leaves: Mirror<GpuLeaf>,
    drawn: Vec<u32>,
    states: Vec<LeafState>,
    batches: Vec<Batch>,
    /// Serial of the last batch.
    serial: u32,
    patches: u32,
    /// Largest D or S written since the last reset, for the scale of the attachments.
    max_value: f32,
    /// Only a full draw can follow.
    needs_full: bool,
}

impl LuminanceMesh {
    pub(super) fn new(device: &Device) -> Result<Self> {
        Ok(Self {
            slots: Mirror::new(device, "slots")?,
            leaves: Mirror::new(device, "leaves")?,
            drawn: Vec::new(),
            states: Vec::new(),
            batches: Vec::new(),
            serial: 0,
            patches: 0,
            max_value: 0.0,
            needs_full: true,
        })
    }

    /// Forgets which leaves are drawn; slots and leaves stay.
    pub(super) fn reset(&mut self) {
        self.drawn.clear();
        self.states.fill(LeafState::NONE);
        self.needs_full = true;
        self.max_value = 0.0;
        self.take_pending();
    }

    /// Leaves that are drawn now, in no order.
    pub(super) fn drawn(&self) -> &[u32] {
        &self.drawn
    }

    /// Whether a leaf is drawn now.
    pub(super) fn is_drawn(&self, leaf: u32) -> bool {
        self.states.get(leaf as usize).is_some_and(|state| state.place != NOWHERE)
    }

    pub(super) const fn max_value(&self) -> f32 {
        self.max_value
    }

    pub(super) const fn needs_full(&self) -> bool {
        self.needs_full
    }

    pub(super) fn has_pending(&self) -> bool {
        !self.batches.is_empty()
    }

    /// Corner positions of a leaf.
    pub(super) fn corners(&self, leaf: u32) -> [Vec3; 3] {
        self.leaves.get(leaf).slots.map(|s| self.slots.get(s).position)
    }

    /// What waits to be drawn, and the number of patches in it; a draw follows.
    pub(super) fn take_pending(&mut self) -> (Vec<Batch>, u32) {
        self.serial += 1;
        (std::mem::take(&mut self.batches), std::mem::take(&mut self.patches))
    }

    /// A full draw follows.
    pub(super) fn take_full(&mut self) -> u32 {
        self.needs_full = false;
        self.take_pending().1
    }

    /// Takes a batch of changes in: slots, leaves, then patches. Old triangles are read before they are overwritten.
    pub(super) fn apply(&mut self, update: &Update) -> Result<()> {
        let mut structural = Vec::new();
        for patch in &update.patches {
            let (old, new) = (leaf_ids(update, &patch.old)?, leaf_ids(update, &patch.new)?);
            let changes = old != new;
            structural.push(changes.then(|| old.iter().map(|l| self.corners(l.0)).collect::<Vec<_>>()));
        }
        for (id, slot) in &update.slots {
            self.max_value = self.max_value.max(slot.diffuse.max_element()).max(slot.specular.max_element());
            self.slots.set(id.0, GpuSlot::from(slot));
        }
        for (id, leaf) in &update.leaves {
            self.define(id.0, GpuLeaf::from(leaf));
        }
        for (patch, old_corners) in update.patches.iter().zip(structural) {
            self.patches += 1;
            match old_corners {
                Some(corners) => self.replace(update, patch, corners)?,
                None => leaf_ids(update, &patch.new)?.iter().for_each(|l| self.refresh(l.0)),
            }
        }
        Ok(())
    }

    fn state(&mut self, leaf: u32) -> &mut LeafState {
        let index = leaf as usize;
        if index >= self.states.len() {
            self.states.resize(index + 1, LeafState::NONE);
        }
        &mut self.states[index]
    }

    fn define(&mut self, id: u32, leaf: GpuLeaf) {
        let known = self.leaves.get(id);
        let first_batch = self.serial + 1 - self.batches.len() as u32;
        let new_in = self.state(id).new_in;
        if leaf != known && new_in != NOWHERE && new_in >= first_batch && self.has_pending() {
            // The leaf was recycled before it was drawn: its batch can no longer be.
            self.needs_full = true;
        }
        self.leaves.set(id, leaf);
    }

    /// The batch that takes more patches.
    fn batch(&mut self) -> &mut Batch {
        if self.batches.is_empty() {
            self.start_batch();
        }
        let last = self.batches.len() - 1;
        &mut self.batches[last]
    }

    fn start_batch(&mut self) {
        self.serial += 1;
        self.batches.push(Batch::default());
    }

    /// The values of a leaf changed, its triangle did not.
    fn refresh(&mut self, leaf: u32) {
        self.batch();
        let serial = self.serial;
        let state = self.state(leaf);
        if state.place == NOWHERE || state.new_in == serial || state.values_in == serial {
            return;
        }
        state.values_in = serial;
        self.batch().values.push(leaf);
    }

    /// Other triangles cover a region.
    fn replace(&mut self, update: &Update, patch: &Patch, old: Vec<[Vec3; 3]>) -> Result<()> {
        self.batch();
        let gone = leaf_ids(update, &patch.old)?;
        let serial = self.serial;
        if gone.iter().any(|l| self.state(l.0).new_in == serial) {
            // What it marks is drawn only by this batch.
            self.start_batch();
        }
        gone.iter().for_each(|l| self.remove(l.0));
        let serial = self.serial;
        let new = leaf_ids(update, &patch.new)?;
        for leaf in new {
            self.insert(leaf.0);
            self.state(leaf.0).new_in = serial;
        }
        let batch = self.batch();
        let start = batch.new.len();
        batch.new.extend(new.iter().map(|l| l.0));
        batch.patches.push(PendingPatch { old, new: start..start + new.len() });
        Ok(())
    }

    fn insert(&mut self, leaf: u32) {
        let place = self.drawn.len() as u32;
        let state = self.state(leaf);
        if state.place == NOWHERE {
            state.place = place;
            self.drawn.push(leaf);
        }
    }

    fn remove(&mut self, leaf: u32) {
        let place = std::mem::replace(&mut self.state(leaf).place, NOWHERE);
        if place != NOWHERE {
            self.drawn.swap_remove(place as usize);
            if let Some(&moved) = self.drawn.get(place as usize) {
                self.state(moved).place = place;
            }
        }
    }
}

fn leaf_ids<'u>(update: &'u Update, range: &Range<u32>) -> Result<&'u [LeafId]> {
    let leaves = update.patch_leaves.get(range.start as usize..range.end as usize);
    leaves.ok_or_else(|| Error::Internal("a patch names leaves outside its update".to_owned()))
}
