//! Which slots others lie between: lists in two arenas, so that a slot keeps no more than where its list begins.

use super::ids::{BetweenId, Link, SlotId};
use super::pool::reserve;
use super::slot::INSIDE;
use super::store::Cache;

/// Slots that another lies between and that predict it: the ends of the edge that it is the middle of, the corners of
/// the leaf that it lies inside, or coarser base vertices around a base vertex.
#[derive(Clone, Copy, Debug)]
pub struct Between<'a> {
    /// The slots with their weights, of sum 1.
    pub of: &'a [(SlotId, f32)],
    /// Whether they are coarser base vertices around a base vertex.
    pub coarse: bool,
}

impl Between<'_> {
    /// Whether it is between the corners of a leaf.
    pub(super) const fn is_inside_leaf(&self) -> bool {
        !self.coarse && self.of.len() == 3
    }
}

/// Where the list of a slot is: its first entry, its length (three bits), and whether it is a coarse one (one bit).
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Place(u32);

impl Place {
    const fn new(first: usize, len: usize, coarse: bool) -> Self {
        debug_assert!(first < 1 << 28 && len < 8, "a list in place");
        Self((first << 4 | len << 1) as u32 | coarse as u32)
    }

    const fn first(self) -> usize {
        self.0 as usize >> 4
    }

    const fn len(self) -> usize {
        self.0 as usize >> 1 & 7
    }

    const fn is_coarse(self) -> bool {
        self.0 & 1 == 1
    }
}

/// The lists of all slots.
#[derive(Clone, Debug, Default)]
pub struct BetweenLists {
    /// Base vertices with their weights.
    coarse: Vec<(SlotId, f32)>,
    /// Ends of edges and corners of leaves with their weights.
    inside: Vec<(SlotId, f32)>,
    /// By entry of `inside`: the next slot that lies between the same and others.
    next: Vec<Link<BetweenId>>,
}

impl BetweenLists {
    fn get(&self, place: Place) -> Option<Between<'_>> {
        let lists = if place.is_coarse() { &self.coarse } else { &self.inside };
        let of = &lists[place.first()..place.first() + place.len()];
        (!of.is_empty()).then_some(Between { of, coarse: place.is_coarse() })
    }

    fn add(&mut self, between: Between<'_>) -> Place {
        let lists = if between.coarse { &mut self.coarse } else { &mut self.inside };
        let place = Place::new(lists.len(), between.of.len(), between.coarse);
        reserve(lists, between.of.len());
        lists.extend_from_slice(between.of);
        place
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        (self.coarse.capacity() + self.inside.capacity()) * size_of::<(SlotId, f32)>() + self.next.capacity() * 4
    }
}

impl Cache {
    /// The slots that one lies between, if any.
    #[must_use]
    pub fn between(&self, slot: SlotId) -> Option<Between<'_>> {
        self.between.get(self.slots[slot].between)
    }

    /// Notes that a new slot lies between others.
    pub(super) fn note_between(&mut self, slot: SlotId, between: Between<'_>) {
        // Base vertices are predicted all at once, those of a view (`Cache::refresh_predictions`).
        let linked = if between.coarse { &[] } else { between.of };
        reserve(&mut self.between.next, linked.len());
        for (place, (other, _)) in (0..).zip(linked) {
            let first = &mut self.slots[*other].first_between;
            self.between.next.push(std::mem::replace(first, BetweenId(slot.0 * 8 + place).into()));
        }
        let highest = between.of.iter().map(|(other, _)| self.slots[*other].rank).max().unwrap_or(0);
        let record = &mut self.slots[slot];
        if !between.coarse {
            record.rank = (highest + 1).max(INSIDE);
        }
        record.between = self.between.add(between);
    }

    /// Gives the slots that one lies between other weights.
    pub(super) fn weigh_between(&mut self, slot: SlotId, weights: [f32; 3]) {
        let first = self.slots[slot].between.first();
        let list = &mut self.between.inside[first..first + weights.len()];
        list.iter_mut().zip(weights).for_each(|((_, old), new)| *old = new);
    }

    /// The slots that lie between one and others.
    pub(super) fn lying_between(&self, slot: SlotId) -> impl Iterator<Item = SlotId> + '_ {
        let next = |id: &BetweenId| {
            let list = self.slots[SlotId(id.0 / 8)].between;
            self.between.next[list.first() + id.0 as usize % 8].get()
        };
        std::iter::successors(self.slots[slot].first_between.get(), next).map(|id| SlotId(id.0 / 8))
    }
}
