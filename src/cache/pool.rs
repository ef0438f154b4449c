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
pub(super) fn map_bytes<K, V, S>(map: &HashMap<K, V, S>) -> usize {
    map.capacity() * 8 / 7 * (size_of::<(K, V)>() + 1)
}

/// Values addressed by recyclable indices.
#[derive(Clone, Debug)]
pub struct Pool<I, T> {
    items: Vec<T>,
    free: Vec<u32>,
    /// First places of free blocks of four.
    free_fours: Vec<u32>,
    id: PhantomData<I>,
}

impl<I, T> Default for Pool<I, T> {
    fn default() -> Self {
        Self { items: Vec::new(), free: Vec::new(), free_fours: Vec::new(), id: PhantomData }
    }
}

impl<I: Id, T> Pool<I, T> {
    /// Stores a value, in a freed place if there is one.
    pub fn insert(&mut self, value: T) -> I {
        if let Some(number) = self.free.pop() {
            self.items[number as usize] = value;
            return I::new(number);
        }
        reserve(&mut self.items, 1);
        self.items.push(value);
        I::new((self.items.len() - 1) as u32)
    }

    /// Gives a place back. Its value stays readable until it is reused.
    pub fn remove(&mut self, id: I) {
        debug_assert!(!self.free.contains(&id.number()), "index {} freed twice", id.number());
        self.free.push(id.number());
    }

    /// Every index handed out, those of places given back included.
    pub fn ids(&self) -> impl Iterator<Item = I> + use<I, T> {
        (0..self.items.len() as u32).map(I::new)
    }

    /// Number of live values.
    #[must_use]
    pub fn live(&self) -> usize {
        self.items.len() - self.free.len() - 4 * self.free_fours.len()
    }

    /// Bytes held.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.items.capacity() * size_of::<T>() + (self.free.capacity() + self.free_fours.capacity()) * 4
    }
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

impl<I: Id, T> Pool<I, T> {
    /// Stores four values side by side and returns the first's index. They are given back together, so that single free
    /// places never break a block.
    pub fn insert_four(&mut self, values: [T; 4]) -> I {
        let first = match self.free_fours.pop() {
            Some(number) => {
                (number as usize..).zip(values).for_each(|(at, value)| self.items[at] = value);
                number
            }
            None => {
                reserve(&mut self.items, 4);
                self.items.extend(values);
                (self.items.len() - 4) as u32
            }
        };
        I::new(first)
    }

    /// Gives four places back that were stored by [`Self::insert_four`].
    pub fn remove_four(&mut self, first: I) {
        debug_assert!(!self.free_fours.contains(&first.number()), "block {} freed twice", first.number());
        self.free_fours.push(first.number());
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
        self.items.capacity() * size_of::<T>()
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
        assert_eq!((pool.live(), pool.ids().count()), (1, 2));
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
    fn tables_hold_the_default_where_nothing_was_written() {
        let mut table = Table::<VertexId, u32>::default();
        table[VertexId(3)] = 7;
        assert_eq!([2, 3, 100].map(|i| table[VertexId(i)]), [0, 7, 0]);
    }
}
