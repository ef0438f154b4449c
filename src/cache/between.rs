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
    /// First entries of lists that were given back, by length: coarse ones, and those inside the faces.
    free: [[Vec<u32>; MOST + 1]; 2],
}

/// Slots that one lies between at most.
const MOST: usize = 6;

impl BetweenLists {
    /// The list at a place, if there is one.
    pub(super) fn get(&self, place: Place) -> Option<Between<'_>> {
        let lists = if place.is_coarse() { &self.coarse } else { &self.inside };
        let of = &lists[place.first()..place.first() + place.len()];
        (!of.is_empty()).then_some(Between { of, coarse: place.is_coarse() })
    }

    /// Adds a list.
    pub(super) fn add(&mut self, between: Between<'_>) -> Place {
        let (lists, len) = (if between.coarse { &mut self.coarse } else { &mut self.inside }, between.of.len());
        let first = match self.free[usize::from(between.coarse)][len].pop() {
            Some(first) => {
                lists[first as usize..first as usize + len].copy_from_slice(between.of);
                first as usize
            }
            None => {
                reserve(lists, len);
                lists.extend_from_slice(between.of);
                lists.len() - len
            }
        };
        if !between.coarse && self.next.len() < self.inside.len() {
            reserve(&mut self.next, len);
            self.next.resize(self.inside.len(), Link::NONE);
        }
        Place::new(first, len, between.coarse)
    }

    /// Gives a list back.
    pub(super) fn remove(&mut self, list: Place) {
        if list.len() > 0 {
            self.free[usize::from(list.is_coarse())][list.len()].push(list.first() as u32);
        }
    }

    /// Sets the next slot that lies between the same as an entry of a list inside the faces and others.
    pub(super) fn link(&mut self, list: Place, entry: usize, next: Link<BetweenId>) {
        self.next[list.first() + entry] = next;
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
        let free: usize = self.free.iter().flatten().map(Vec::capacity).sum();
        let entries = self.coarse.len() + self.inside.len();
        entries * size_of::<(SlotId, f32)>() + (self.next.len() + free) * 4
    }
}
