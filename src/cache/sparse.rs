//! Values at scattered indices: only those that were written take room.

use super::ids::Id;
use std::marker::PhantomData;

/// Values at scattered indices, in pages that hold those written side by side.
#[derive(Clone, Debug)]
pub struct Sparse<I, T> {
    pages: Vec<Page<T>>,
    /// Values that there is room for.
    room: usize,
    id: PhantomData<I>,
}

/// Indices a page: the bits of its mask.
pub(super) const PAGE: usize = u64::BITS as usize;
/// Values by which a page grows.
const MORE: usize = 4;

/// The values of 64 indices as far as they are written, in order.
#[derive(Clone, Debug)]
pub(super) struct Page<T> {
    /// Bit i is set where the value of the page's index i is written.
    written: u64,
    values: Vec<T>,
}

impl<T> Default for Page<T> {
    fn default() -> Self {
        Self { written: 0, values: Vec::new() }
    }
}

impl<T> Page<T> {
    /// Where the value of an index is or would be.
    const fn rank(&self, at: usize) -> usize {
        (self.written & ((1 << at) - 1)).count_ones() as usize
    }

    const fn has(&self, at: usize) -> bool {
        self.written >> at & 1 == 1
    }

    /// The value of an index, if it is written.
    pub(super) fn get(&self, at: usize) -> Option<&T> {
        self.has(at).then(|| &self.values[self.rank(at)])
    }

    /// The value of an index, `first` where none is written, to write; and how many more values there is room for now.
    pub(super) fn entry(&mut self, at: usize, first: impl FnOnce() -> T) -> (&mut T, usize) {
        let (rank, before) = (self.rank(at), self.values.capacity());
        if !self.has(at) {
            if self.values.len() == before {
                self.values.reserve_exact(MORE);
            }
            self.values.insert(rank, first());
            self.written |= 1 << at;
        }
        let grown = self.values.capacity() - before;
        (&mut self.values[rank], grown)
    }

    /// Takes the value of an index out; returns it, and for how many values fewer there is room now.
    pub(super) fn remove(&mut self, at: usize) -> Option<(T, usize)> {
        self.has(at).then(|| {
            let (rank, before) = (self.rank(at), self.values.capacity());
            self.written &= !(1 << at);
            let value = self.values.remove(rank);
            if before - self.values.len() >= 2 * MORE {
                self.values.shrink_to(self.values.len().next_multiple_of(MORE));
            }
            (value, before - self.values.capacity())
        })
    }
}

impl<I, T> Default for Sparse<I, T> {
    fn default() -> Self {
        Self { pages: Vec::new(), room: 0, id: PhantomData }
    }
}

impl<I: Id, T: Default + Copy> Sparse<I, T> {
    /// The value at `id`, the default where none was written.
    #[must_use]
    pub fn get(&self, id: I) -> T {
        let page = self.pages.get(id.index() / PAGE);
        page.and_then(|page| page.get(id.index() % PAGE)).copied().unwrap_or_default()
    }

    /// The value at `id`, to write.
    pub fn entry(&mut self, id: I) -> &mut T {
        let page = id.index() / PAGE;
        if page >= self.pages.len() {
            self.pages.resize_with(page + 1, Page::default);
        }
        let (value, grown) = self.pages[page].entry(id.index() % PAGE, T::default);
        self.room += grown;
        value
    }

    /// Changes the value at `id`; the default takes no room where none was written.
    pub fn update(&mut self, id: I, change: impl FnOnce(&mut T))
    where
        T: PartialEq,
    {
        let before = self.get(id);
        let mut value = before;
        change(&mut value);
        if value != before {
            *self.entry(id) = value;
        }
    }

    /// Back to the default.
    pub fn reset(&mut self, id: I) {
        if let Some(page) = self.pages.get_mut(id.index() / PAGE)
            && let Some((_, given_back)) = page.remove(id.index() % PAGE)
        {
            self.room -= given_back;
        }
    }

    /// Whether nothing was ever written.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.pages.is_empty()
    }

    /// Visits the values that were written, with their indices.
    pub fn for_each_mut(&mut self, mut visit: impl FnMut(I, &mut T)) {
        for (page, first) in self.pages.iter_mut().zip((0..).step_by(PAGE)) {
            let written = (0..PAGE).filter(|at| page.written >> at & 1 == 1);
            page.values.iter_mut().zip(written).for_each(|(value, at)| visit(I::new(first + at as u32), value));
        }
    }

    /// Bytes held.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.pages.capacity() * size_of::<Page<T>>() + self.room * size_of::<T>()
    }
}

#[cfg(test)]
mod tests {
    use super::super::ids::VertexId;
    use super::*;
    use crate::math::mix;
    use std::collections::BTreeMap;

    #[test]
    fn only_what_is_written_takes_room() {
        let mut sparse = Sparse::<VertexId, u32>::default();
        let far = VertexId(100_000);
        assert_eq!(sparse.get(far), 0);
        *sparse.entry(far) = 5;
        assert_eq!((sparse.get(far), sparse.get(VertexId(99_999))), (5, 0));
        assert!(sparse.bytes() < 60_000, "{}", sparse.bytes());
    }

    /// Against a map, written and reset in any order.
    #[test]
    fn values_are_found_where_they_were_written() {
        let (mut sparse, mut map) = (Sparse::<VertexId, u64>::default(), BTreeMap::new());
        for step in 0..2000 {
            let (id, value) = (VertexId((mix(step) % 200) as u32), mix(step + 1_000_000));
            if value % 4 == 0 {
                sparse.reset(id);
                map.remove(&id);
            } else {
                *sparse.entry(id) = value;
                map.insert(id, value);
            }
        }
        assert!((0..300).map(VertexId).all(|id| sparse.get(id) == map.get(&id).copied().unwrap_or_default()));
        let mut visited = Vec::new();
        sparse.for_each_mut(|id, value| visited.push((id, *value)));
        assert_eq!(visited, map.into_iter().collect::<Vec<_>>());
    }
}
