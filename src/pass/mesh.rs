//! The luminance mesh as the device knows it: slots, drawn triangles, which drawn triangles are drawn, and what waits to be drawn.

use super::device_array::DeviceArray;
use super::shared::{GpuDrawnTriangle, GpuSlot, NONE};
use crate::error::{Error, Result};
use crate::refine::update::{DrawnId, Patch, Update};
use crate::scene::FaceId;
use crate::vk::Device;
use glam::{Vec3, Vec4};
use std::collections::VecDeque;
use std::ops::Range;

/// Share of a frame's drawn triangles that is kept for new values while new triangles wait.
const VALUES_SHARE: usize = 4;

/// Where a drawn triangle stands.
#[derive(Clone, Copy)]
struct DrawnState {
    /// Whether it is part of the mesh.
    drawn: bool,
    /// Serial of the batch that will draw it for the first time.
    new_in: Option<u32>,
    /// Whether its new values wait.
    waits: bool,
}

impl DrawnState {
    const NONE: Self = Self { drawn: false, new_in: None, waits: false };
}

/// A patch whose triangles change.
#[derive(Clone, Debug)]
pub(super) struct PendingPatch {
    /// Corners of the triangles drawn last, as they were drawn.
    pub old: Vec<[Vec3; 3]>,
    /// Drawn triangles to draw now: a range of [`Batch::new`].
    pub new: Range<usize>,
    /// Whether the pixels of each new drawn triangle are counted by a query.
    pub counted: bool,
}

/// Patches that can be drawn together: none draws over what another of them must find. Values come first.
#[derive(Clone, Debug, Default)]
pub(super) struct Batch {
    /// Drawn triangles of patches with `old == new`, whose triangles stay: of the first batch of a frame only.
    pub values: Vec<u32>,
    /// Drawn triangles of all other patches.
    pub new: Vec<u32>,
    /// Patches of those drawn triangles.
    pub patches: Vec<PendingPatch>,
    /// The update that it began with.
    first_sequence: u64,
}

impl Batch {
    /// Number of patches.
    pub(super) fn patches(&self) -> u32 {
        (self.values.len() + self.patches.len()) as u32
    }

    /// Splits off the first new drawn triangles, about `budget` of them, whole patches only.
    fn split_off_front(&mut self, budget: usize) -> Self {
        let count = self.patches.partition_point(|patch| patch.new.end <= budget);
        let patches: Vec<_> = self.patches.drain(..count).collect();
        let drawn_triangles = patches.last().map_or(0, |patch| patch.new.end);
        for patch in &mut self.patches {
            patch.new = patch.new.start - drawn_triangles..patch.new.end - drawn_triangles;
        }
        let new = self.new.drain(..drawn_triangles).collect();
        Self { values: Vec::new(), new, patches, first_sequence: self.first_sequence }
    }
}

/// The drawn triangles and their slots, with their arrays on the device.
pub(super) struct LuminanceMesh {
    pub slots: DeviceArray<GpuSlot>,
    /// Light vectors of slots, where normal maps turn light; empty elsewhere.
    pub light_vectors: DeviceArray<[f32; 4]>,
    has_light_vectors: bool,
    pub drawn_triangles: DeviceArray<GpuDrawnTriangle>,
    states: Vec<DrawnState>,
    /// How many drawn triangles of each face are part of the mesh.
    of_face: Vec<u32>,
    /// Drawn triangles behind all others that fill faces without any of their own in the next frame.
    filling: Range<u32>,
    /// New triangles that wait, in their order.
    batches: Vec<Batch>,
    /// Drawn triangles on the images whose new values wait: they do not keep triangles, and the count of their pixels, waiting.
    values: VecDeque<u32>,
    /// Serial of the last batch.
    serial: u32,
    /// Number of the last update.
    sequence: u64,
    /// Largest D or S written since the last reset, W·sr⁻¹·m⁻², for the scale of the attachments.
    max_value: f32,
    /// Only a full draw can follow.
    needs_full: bool,
}

impl LuminanceMesh {
    /// An empty mesh, with light vectors or without.
    pub(super) fn new(device: &Device, has_light_vectors: bool) -> Result<Self> {
        Ok(Self {
            slots: DeviceArray::new(device, "slots")?,
            light_vectors: DeviceArray::new(device, "light vectors")?,
            has_light_vectors,
            drawn_triangles: DeviceArray::new(device, "drawn_triangles")?,
            states: Vec::new(),
            of_face: Vec::new(),
            filling: 0..0,
            batches: Vec::new(),
            values: VecDeque::new(),
            serial: 0,
            sequence: 0,
            max_value: 0.0,
            needs_full: true,
        })
    }

    /// Forgets which drawn triangles are drawn; slots and drawn triangles stay.
    pub(super) fn reset(&mut self) {
        self.drop_pending();
        self.states.fill(DrawnState::NONE);
        self.of_face.clear();
        self.needs_full = true;
        self.max_value = 0.0;
    }

    /// The drawn triangles that make up the mesh, in ascending order.
    pub(super) fn drawn(&self) -> impl Iterator<Item = u32> {
        (0..).zip(&self.states).filter(|(_, state)| state.drawn).map(|(id, _)| id)
    }

    /// Whether a drawn triangle is part of the mesh.
    pub(super) fn is_drawn(&self, drawn_id: u32) -> bool {
        self.states.get(drawn_id as usize).is_some_and(|state| state.drawn)
    }

    /// Whether a face has drawn triangles that are part of the mesh: they cover it.
    pub(super) fn covers(&self, face: FaceId) -> bool {
        self.of_face.get(face.0 as usize).is_some_and(|&count| count > 0)
    }

    /// Fills faces that have no drawn triangles with one each, until the next frame is drawn or the next change comes.
    pub(super) fn fill(&mut self, faces: impl Iterator<Item = (FaceId, [GpuSlot; 3])>) {
        self.drop_filling();
        let first = self.drawn_triangles.len() as u32;
        for (face, corners) in faces {
            let slots = corners.map(|corner| {
                let slot = self.slots.len() as u32;
                self.slots.set(slot, corner);
                self.set_light_vector(slot, Vec4::ZERO);
                slot
            });
            let filling = GpuDrawnTriangle { slots, face: face.0, flat_slot: NONE };
            self.drawn_triangles.set(self.drawn_triangles.len() as u32, filling);
        }
        self.filling = first..self.drawn_triangles.len() as u32;
    }

    /// The drawn triangles that fill faces.
    pub(super) fn filling(&self) -> Range<u32> {
        self.filling.clone()
    }

    /// Takes out what fills faces.
    pub(super) fn drop_filling(&mut self) {
        let filling = std::mem::take(&mut self.filling);
        if let Some(first) = filling.clone().next() {
            let slots = self.slots.len() - 3 * u64::from(filling.end - first);
            self.slots.truncate(slots);
            self.drawn_triangles.truncate(first.into());
        }
    }

    pub(super) const fn max_value(&self) -> f32 {
        self.max_value
    }

    /// Lets nothing but a full draw follow.
    pub(super) const fn require_full(&mut self) {
        self.needs_full = true;
    }

    pub(super) const fn needs_full(&self) -> bool {
        self.needs_full
    }

    pub(super) fn has_pending(&self) -> bool {
        !self.values.is_empty() || self.batches.iter().any(|batch| !batch.new.is_empty())
    }

    /// The last update of which no new triangle waits.
    pub(super) fn drawn_sequence(&self) -> u64 {
        let waiting = self.batches.iter().find(|batch| !batch.new.is_empty());
        waiting.map_or(self.sequence, |batch| batch.first_sequence.saturating_sub(1))
    }

    /// Corner positions of a drawn triangle.
    pub(super) fn corners(&self, drawn_id: u32) -> [Vec3; 3] {
        // Not by `map`, which stays a call of its own.
        let [a, b, c] = self.drawn_triangles.get(drawn_id).slots;
        [self.slots.get(a).position, self.slots.get(b).position, self.slots.get(c).position]
    }

    /// What has waited longest, about `budget` drawn triangles of it, triangles before values; a draw follows.
    pub(super) fn take_pending(&mut self, budget: usize) -> Vec<Batch> {
        let kept = self.values.len().min(budget / VALUES_SHARE);
        let mut taken = self.take_batches(budget - kept);
        let new: usize = taken.iter().map(|batch| batch.new.len()).sum();
        let values = self.take_values(budget.saturating_sub(new));
        for id in taken.iter().flat_map(|batch| &batch.new) {
            self.states[*id as usize].new_in = None;
        }
        match taken.first_mut() {
            Some(batch) => batch.values = values,
            None => taken.push(Batch { values, ..Batch::default() }),
        }
        taken
    }

    /// The first batches that wait, about `budget` drawn triangles of them.
    fn take_batches(&mut self, budget: usize) -> Vec<Batch> {
        let mut left = budget;
        let whole = self.batches.iter().take_while(|batch| match left.checked_sub(batch.new.len()) {
            Some(rest) => {
                left = rest;
                true
            }
            None => false,
        });
        let whole = whole.count();
        let mut taken: Vec<Batch> = self.batches.drain(..whole).collect();
        match self.batches.first_mut() {
            Some(batch) => {
                let part = batch.split_off_front(left);
                // A patch larger than all there is room for goes alone.
                let first = batch.patches.first().filter(|_| part.new.is_empty() && taken.is_empty());
                let alone = first.map(|patch| patch.new.end);
                taken.push(alone.map_or(part, |drawn_triangles| batch.split_off_front(drawn_triangles)));
                // What is drawn of the last batch may change again: later changes wait in another.
                self.start_batch();
            }
            None => self.serial += 1,
        }
        taken
    }

    /// The first drawn triangles whose values wait, at most `budget`. Those that are no longer part of the mesh, or whose turn to be drawn is
    /// still to come, are dropped.
    fn take_values(&mut self, budget: usize) -> Vec<u32> {
        let mut taken = Vec::with_capacity(budget.min(self.values.len()));
        while let Some(id) = self.values.front().copied().filter(|_| taken.len() < budget) {
            self.values.pop_front();
            let state = &mut self.states[id as usize];
            state.waits = false;
            if state.drawn && state.new_in.is_none() {
                taken.push(id);
            }
        }
        taken
    }

    /// Forgets what waits.
    fn drop_pending(&mut self) -> u32 {
        self.serial += 1;
        let mut patches = self.values.len();
        for id in self.values.drain(..) {
            self.states[id as usize].waits = false;
        }
        for batch in self.batches.drain(..) {
            patches += batch.patches.len();
            batch.new.into_iter().for_each(|id| self.states[id as usize].new_in = None);
        }
        patches as u32
    }

    /// A full draw follows; returns the number of patches that it spares.
    pub(super) fn take_full(&mut self) -> u32 {
        self.needs_full = false;
        self.drop_pending()
    }

    /// Takes a batch of changes in: slots, drawn triangles, then patches. Old triangles are read before they are overwritten.
    pub(super) fn apply(&mut self, update: &Update) -> Result<()> {
        self.sequence = update.sequence;
        self.drop_filling();
        if self.needs_full {
            return self.take_over(update);
        }
        let mut structural = Vec::new();
        for patch in &update.patches {
            let (old, new) = (drawn_ids(update, &patch.old)?, drawn_ids(update, &patch.new)?);
            let changes = old != new;
            structural.push(changes.then(|| old.iter().map(|id| self.corners(id.0)).collect::<Vec<_>>()));
        }
        self.take_values_in(update);
        for (id, drawn) in &update.drawn_triangles {
            self.define(id.0, GpuDrawnTriangle::from(drawn));
        }
        for (patch, old_corners) in update.patches.iter().zip(structural) {
            match old_corners {
                Some(corners) => self.replace(update, patch, corners)?,
                None => drawn_ids(update, &patch.new)?.iter().for_each(|id| self.refresh(id.0)),
            }
        }
        Ok(())
    }

    /// Takes changes in that a full draw will show, whatever they replace.
    fn take_over(&mut self, update: &Update) -> Result<()> {
        self.drop_pending();
        self.take_values_in(update);
        for (id, drawn) in &update.drawn_triangles {
            self.drawn_triangles.set(id.0, GpuDrawnTriangle::from(drawn));
        }
        for patch in &update.patches {
            drawn_ids(update, &patch.old)?.iter().for_each(|id| self.set_drawn(id.0, patch.face, false));
            drawn_ids(update, &patch.new)?.iter().for_each(|id| self.set_drawn(id.0, patch.face, true));
        }
        Ok(())
    }

    fn take_values_in(&mut self, update: &Update) {
        for (id, slot) in &update.slots {
            self.max_value = self.max_value.max(slot.diffuse.max_element()).max(slot.specular.max_element());
            self.slots.set(id.0, GpuSlot::from(slot));
            self.set_light_vector(id.0, slot.light_vector);
        }
    }

    fn set_light_vector(&mut self, slot: u32, vector: Vec4) {
        if self.has_light_vectors {
            self.light_vectors.set(slot, vector.to_array());
        }
    }

    fn state(&mut self, drawn_id: u32) -> &mut DrawnState {
        let index = drawn_id as usize;
        if index >= self.states.len() {
            self.states.resize(index + 1, DrawnState::NONE);
        }
        &mut self.states[index]
    }

    /// Takes a drawn triangle of a face into the mesh, or out of it.
    fn set_drawn(&mut self, drawn_id: u32, face: FaceId, drawn: bool) {
        let before = std::mem::replace(&mut self.state(drawn_id).drawn, drawn);
        let index = face.0 as usize;
        if index >= self.of_face.len() {
            self.of_face.resize(index + 1, 0);
        }
        let count = &mut self.of_face[index];
        *count = match (before, drawn) {
            (false, true) => *count + 1,
            (true, false) => count.saturating_sub(1),
            _ => *count,
        };
    }

    fn define(&mut self, id: u32, drawn: GpuDrawnTriangle) {
        let known = self.drawn_triangles.get(id);
        if drawn != known && self.state(id).new_in.is_some() {
            // The drawn triangle was recycled before it was drawn: its batch can no longer be.
            self.needs_full = true;
        }
        self.drawn_triangles.set(id, drawn);
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
        self.batches.push(Batch { first_sequence: self.sequence, ..Batch::default() });
    }

    /// The values of a drawn triangle changed, its triangle did not. One that is still to be drawn will have them.
    fn refresh(&mut self, drawn_id: u32) {
        let state = self.state(drawn_id);
        if state.drawn && state.new_in.is_none() && !std::mem::replace(&mut state.waits, true) {
            self.values.push_back(drawn_id);
        }
    }

    /// Other triangles cover a region.
    fn replace(&mut self, update: &Update, patch: &Patch, old: Vec<[Vec3; 3]>) -> Result<()> {
        self.batch();
        let gone = drawn_ids(update, &patch.old)?;
        let serial = self.serial;
        if gone.iter().any(|id| self.state(id.0).new_in == Some(serial)) {
            // What it marks is drawn only by this batch.
            self.start_batch();
        }
        gone.iter().for_each(|id| self.set_drawn(id.0, patch.face, false));
        let serial = self.serial;
        let new = drawn_ids(update, &patch.new)?;
        if new.is_empty() && gone.iter().any(|id| self.state(id.0).new_in.is_some()) {
            // What is dropped waits to be drawn, and its slots are used for something else: its batch can no longer be.
            self.needs_full = true;
        }
        for id in new {
            self.set_drawn(id.0, patch.face, true);
            self.state(id.0).new_in = Some(serial);
        }
        let batch = self.batch();
        let start = batch.new.len();
        batch.new.extend(new.iter().map(|id| id.0));
        batch.patches.push(PendingPatch { old, new: start..start + new.len(), counted: false });
        Ok(())
    }
}

fn drawn_ids<'u>(update: &'u Update, range: &Range<u32>) -> Result<&'u [DrawnId]> {
    let drawn_triangles = update.patch_triangles.get(range.start as usize..range.end as usize);
    drawn_triangles.ok_or_else(|| Error::Internal("a patch names drawn_triangles outside its update".to_owned()))
}
