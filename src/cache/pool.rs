//! Arenas and tables with typed indices: what every structure of the cache is stored in.

use super::ids::Id;
use std::collections::HashMap;
use std::marker::PhantomData;
use std::ops::{Index, IndexMut};

/// Makes room for more items. Capacity grows by an eighth, not twofold: half of it would lie idle in the mean, and large blocks
/// are moved by the page tables, not copied.
pub(super) fn reserve<T>(items: &mut Vec<T>, more: usize) {
    const LEAST: usize = 64;
    if items.capacity() - items.len() < more {
        items.reserve_exact(more.max(items.len() / 8).max(LEAST));
    }
}

/// Bytes of a hash map: a byte beside each place, of which an eighth stays free.
pub fn map_bytes<K, V, S>(map: &HashMap<K, V, S>) -> usize {
    map.capacity() * 8 / 7 * (size_of::<(K, V)>() + 1)
}

/// Values addressed by recyclable indices.
#[derive(Clone, Debug)]
pub struct Pool<I, T> {
    items: Vec<T>,
    /// A bit for each place: whether its value is alive.
    alive: Vec<u64>,
    /// Free places, and first places of free blocks of two and four.
    free: [Vec<u32>; 3],
    /// How many values are alive.
    live: usize,
    id: PhantomData<I>,
}

/// Places of the free lists' blocks.
const BLOCKS: [usize; 3] = [1, 2, 4];
/// Bits a word of the marks of what is alive.
const WORD: usize = u64::BITS as usize;

impl<I, T> Default for Pool<I, T> {
    fn default() -> Self {
        Self { items: Vec::new(), alive: Vec::new(), free: Default::default(), live: 0, id: PhantomData }
    }
}

impl<I: Id, T> Pool<I, T> {
    /// Stores a value, in a freed place if there is one.
    pub fn insert(&mut self, value: T) -> I {
        self.insert_block([value])
    }

    /// Stores two values side by side and returns the first's index. They are given back together.
    pub fn insert_two(&mut self, values: [T; 2]) -> I {
        self.insert_block(values)
    }

    /// Stores four values side by side and returns the first's index. They are given back together, so that single free
    /// places never break a block.
    pub fn insert_four(&mut self, values: [T; 4]) -> I {
        self.insert_block(values)
    }

    fn insert_block<const N: usize>(&mut self, values: [T; N]) -> I {
        let first = match self.free_block(list_of(N)) {
            Some(number) => {
                (number as usize..).zip(values).for_each(|(at, value)| self.items[at] = value);
                number
            }
            None => {
                reserve(&mut self.items, N);
                self.items.extend(values);
                (self.items.len() - N) as u32
            }
        };
        (0..N).for_each(|at| self.mark(first as usize + at));
        I::new(first)
    }

    /// A free block of a list; if there is none, half of one of the next list.
    fn free_block(&mut self, list: usize) -> Option<u32> {
        let first = self.free.get_mut(list)?.pop();
        first.or_else(|| {
            let larger = self.free_block(list + 1)?;
            self.free[list].push(larger + BLOCKS[list] as u32);
            Some(larger)
        })
    }

    /// Makes the largest blocks of places that were given back and lie side by side.
    pub fn join_free(&mut self) {
        let lists = self.free.each_mut().map(std::mem::take).into_iter().zip(BLOCKS);
        let places = |(list, block): (Vec<u32>, usize)| {
            list.into_iter().flat_map(move |first| first..first + block as u32).collect::<Vec<_>>()
        };
        let mut all: Vec<u32> = lists.flat_map(places).collect();
        all.sort_unstable();
        for run in all.chunk_by(|a, b| a + 1 == *b) {
            let mut rest = run;
            for (list, block) in self.free.iter_mut().zip(BLOCKS).rev() {
                let (blocks, left) = rest.split_at(rest.len() / block * block);
                list.extend(blocks.iter().step_by(block));
                rest = left;
            }
        }
        // The lowest are used first, so that what is used stays together.
        self.free.iter_mut().for_each(|list| list.reverse());
    }

    fn mark(&mut self, at: usize) {
        if at / WORD >= self.alive.len() {
            reserve(&mut self.alive, 1);
            self.alive.push(0);
        }
        self.alive[at / WORD] |= 1 << (at % WORD);
        self.live += 1;
    }

    /// Gives a place back. Its value stays readable until it is reused.
    pub fn remove(&mut self, id: I) {
        self.retire(id);
        self.recycle(id);
    }

    /// Gives two places back that were stored by [`Self::insert_two`].
    pub fn remove_two(&mut self, first: I) {
        self.remove_block(first, 2);
    }

    /// Gives four places back that were stored by [`Self::insert_four`].
    pub fn remove_four(&mut self, first: I) {
        self.remove_block(first, 4);
    }

    fn remove_block(&mut self, first: I, places: usize) {
        (0..places as u32).for_each(|at| self.retire(I::new(first.number() + at)));
        self.free[list_of(places)].push(first.number());
    }

    /// Takes a value out of use whose place may not be used again before [`Self::recycle`] gives it back.
    pub fn retire(&mut self, id: I) {
        debug_assert!(self.is_alive(id), "index {} given back twice", id.number());
        self.alive[id.index() / WORD] &= !(1 << (id.index() % WORD));
        self.live -= 1;
    }

    /// Gives the place of a retired value back.
    pub fn recycle(&mut self, id: I) {
        debug_assert!(!self.is_alive(id), "index {} is in use", id.number());
        self.free[list_of(1)].push(id.number());
    }

    /// Whether a value is in use.
    #[must_use]
    pub fn is_alive(&self, id: I) -> bool {
        self.alive.get(id.index() / WORD).is_some_and(|word| word >> (id.index() % WORD) & 1 == 1)
    }

    /// The indices of the values that are alive.
    pub fn ids(&self) -> impl Iterator<Item = I> + use<I, T> {
        let alive: Vec<u64> = self.alive.clone();
        (0..self.items.len()).filter(move |at| alive[at / WORD] >> (at % WORD) & 1 == 1).map(|at| I::new(at as u32))
    }

    /// Number of values that are alive.
    #[must_use]
    pub const fn live(&self) -> usize {
        self.live
    }

    /// Places that can be used again.
    #[must_use]
    pub fn free_places(&self) -> usize {
        self.free.iter().zip(BLOCKS).map(|(list, places)| list.len() * places).sum()
    }

    /// Bytes held. What there is room for beyond was never written, and takes no memory.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let free: usize = self.free.iter().map(|list| list.capacity() * 4).sum();
        self.items.len() * size_of::<T>() + self.alive.len() * 8 + free
    }

    /// Places, in use or free.
    #[must_use]
    pub const fn places(&self) -> usize {
        self.items.len()
    }

    /// How many places will be added for so many blocks of one, two and four.
    #[must_use]
    pub fn growth(&self, blocks: [usize; 3]) -> usize {
        let (mut added, mut from_larger) = (0, 0);
        for ((free, wanted), places) in self.free.iter().zip(blocks).zip(BLOCKS).rev() {
            let there = free.len() + 2 * from_larger;
            added += wanted.saturating_sub(there) * places;
            from_larger = there.saturating_sub(wanted);
        }
        added
    }
}

/// Which free list holds blocks of so many places.
const fn list_of(places: usize) -> usize {
    places.trailing_zeros() as usize
}

impl<I: Id, T> Index<I> for Pool<I, T> {
    type Output = T;

    fn index(&self, id: I) -> &T {
        &self.items[id.index()]
    }
}

impl<I: Id, T> IndexMut<I> for Pool<I, T> {
    fn index_mut(&mut self, id: I) -> &mut T {
        &mut self.items[id.index()]
    }
}

/// Values at all indices up to the largest written, the default beyond.
#[derive(Clone, Debug)]
pub struct Table<I, T> {
    items: Vec<T>,
    default: T,
    id: PhantomData<I>,
}

impl<I, T: Default> Default for Table<I, T> {
    fn default() -> Self {
        Self { items: Vec::new(), default: T::default(), id: PhantomData }
    }
}

impl<I, T> Table<I, T> {
    /// Bytes held.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.items.len() * size_of::<T>()
    }

    /// All values up to the largest index written.
    pub fn iter_mut(&mut self) -> impl Iterator<Item = &mut T> {
        self.items.iter_mut()
    }
}

impl<I: Id, T> Index<I> for Table<I, T> {
    type Output = T;

    fn index(&self, id: I) -> &T {
        self.items.get(id.index()).unwrap_or(&self.default)
    }
}

impl<I: Id, T: Clone> IndexMut<I> for Table<I, T> {
    fn index_mut(&mut self, id: I) -> &mut T {
        if id.index() >= self.items.len() {
            let more = id.index() + 1 - self.items.len();
            reserve(&mut self.items, more);
            self.items.resize(id.index() + 1, self.default.clone());
        }
        &mut self.items[id.index()]
    }
}

#[cfg(test)]
mod tests {
    use super::super::ids::VertexId;
    use super::*;

    #[test]
    fn freed_places_are_reused_before_new_ones() {
        let mut pool = Pool::<VertexId, char>::default();
        let (a, b) = (pool.insert('a'), pool.insert('b'));
        pool.remove(a);
        assert_eq!((pool.live(), pool.ids().collect::<Vec<_>>(), pool.free_places()), (1, vec![b], 1));
        assert_eq!(pool.insert('c'), a);
        assert_eq!((pool[a], pool[b], pool.ids().count()), ('c', 'b', 2));
    }

    #[test]
    fn four_stay_side_by_side_whatever_was_freed() {
        let mut pool = Pool::<VertexId, u32>::default();
        let single = pool.insert(0);
        let first = pool.insert_four([1, 2, 3, 4]);
        let second = pool.insert_four([5, 6, 7, 8]);
        pool.remove(single);
        pool.remove_four(first);
        assert_eq!(pool.live(), 4);
        let again = pool.insert_four([10, 11, 12, 13]);
        assert_eq!(again, first, "a freed block is used again");
        let fresh = pool.insert_four([20, 21, 22, 23]);
        let block = |first: VertexId| (0..4).map(|i| pool[VertexId(first.0 + i)]).collect::<Vec<_>>();
        assert_eq!((block(again), block(second)), (vec![10, 11, 12, 13], vec![5, 6, 7, 8]));
        assert_eq!(block(fresh), [20, 21, 22, 23], "the single free place is not among them");
    }

    #[test]
    fn blocks_are_divided_and_joined_again() {
        let mut pool = Pool::<VertexId, u32>::default();
        let first = pool.insert_four([1, 2, 3, 4]);
        pool.remove_four(first);
        assert_eq!((pool.growth([4, 0, 0]), pool.growth([3, 1, 0]), pool.growth([1, 0, 1])), (0, 1, 1));
        let singles: Vec<VertexId> = (0..4).map(|i| pool.insert(i)).collect();
        assert_eq!((pool.places(), pool.growth([0, 0, 1])), (4, 4), "all of the block is in use");
        singles.into_iter().rev().for_each(|id| pool.remove(id));
        assert_eq!(pool.growth([0, 0, 1]), 4);
        pool.join_free();
        assert_eq!((pool.growth([0, 0, 1]), pool.insert_four([5, 6, 7, 8]), pool.places()), (0, first, 4));
    }

    #[test]
    fn tables_hold_the_default_where_nothing_was_written() {
        let mut table = Table::<VertexId, u32>::default();
        table[VertexId(3)] = 7;
        assert_eq!([2, 3, 100].map(|i| table[VertexId(i)]), [0, 7, 0]);
    }
}
