//! Which slots others lie between: lists in two arenas, so that a slot keeps no more than where its list begins.

use super::ids::{BetweenId, Link, SlotId};
use super::pool::reserve;

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
    /// The list at a place, if there is one.
    pub(super) fn get(&self, place: Place) -> Option<Between<'_>> {
        let lists = if place.is_coarse() { &self.coarse } else { &self.inside };
        let of = &lists[place.first()..place.first() + place.len()];
        (!of.is_empty()).then_some(Between { of, coarse: place.is_coarse() })
    }

    /// Adds a list.
    pub(super) fn add(&mut self, between: Between<'_>) -> Place {
        let lists = if between.coarse { &mut self.coarse } else { &mut self.inside };
        let place = Place::new(lists.len(), between.of.len(), between.coarse);
        reserve(lists, between.of.len());
        lists.extend_from_slice(between.of);
        place
    }

    /// Links the next entry of lists inside the faces.
    pub(super) fn link(&mut self, next: Link<BetweenId>) {
        reserve(&mut self.next, 1);
        self.next.push(next);
    }

    /// The next slot that lies between the same as an entry of a list and others.
    pub(super) fn next(&self, list: Place, entry: usize) -> Option<BetweenId> {
        self.next[list.first() + entry].get()
    }

    /// Gives the slots of a list inside the faces other weights.
    pub(super) fn weigh(&mut self, list: Place, weights: [f32; 3]) {
        let list = &mut self.inside[list.first()..list.first() + weights.len()];
        list.iter_mut().zip(weights).for_each(|((_, old), new)| *old = new);
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        (self.coarse.capacity() + self.inside.capacity()) * size_of::<(SlotId, f32)>() + self.next.capacity() * 4
    }
}
