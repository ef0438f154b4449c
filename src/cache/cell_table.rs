//! The radiance grid's cells by their keys: open addressing with each cell beside its key, so that a look-up waits for memory once.

use super::cell::Cell;
use crate::math::mix;

/// Bits of a key; 0 is none.
pub const KEY_BITS: u32 = 34;

/// A place of the table: a key in the lowest bits, 0 where there is none, then its cell.
#[derive(Clone, Copy, Debug, Default)]
struct Slot([u32; 3]);

/// Bits of a key in a slot's second word.
const REST: u32 = KEY_BITS - u32::BITS;
/// Bits of a cell there.
const LOW: u32 = u32::BITS - REST;
const _: () = assert!(KEY_BITS + Cell::BITS <= 96);

impl Slot {
    #[inline]
    const fn key(self) -> u64 {
        let Self([low, middle, _]) = self;
        low as u64 | (middle as u64 & ((1 << REST) - 1)) << u32::BITS
    }

    #[inline]
    const fn cell(self) -> Cell {
        let Self([_, middle, high]) = self;
        Cell::from_bits((middle >> REST) as u64 | (high as u64) << LOW)
    }

    #[inline]
    const fn new(key: u64, cell: Cell) -> Self {
        let bits = cell.bits();
        Self([key as u32, (key >> u32::BITS) as u32 | (bits as u32) << REST, (bits >> LOW) as u32])
    }

    const fn is_free(self) -> bool {
        self.key() == 0
    }
}

/// The table is at most four fifths full, and grows by a quarter.
const FULL: [usize; 2] = [4, 5];
/// Places of the smallest table.
const FEWEST: usize = 64;

/// Cells by keys from 1 to 2³⁴ − 1.
#[derive(Clone, Debug, Default)]
pub struct CellTable {
    slots: Vec<Slot>,
    used: usize,
}

impl CellTable {
    /// Bytes that a cell takes at most: just after the table has grown.
    pub const MOST_BYTES: usize = (size_of::<Slot>() * FULL[1]).div_ceil(FULL[0]) * 5 / 4;

    /// How many cells there are.
    pub const fn len(&self) -> usize {
        self.used
    }

    /// The cell of a key.
    #[inline]
    pub fn get(&self, key: u64) -> Option<Cell> {
        let slot = self.slots[self.place(key)?];
        (slot.key() == key).then(|| slot.cell())
    }

    /// Changes the cell of a key if there is one.
    pub fn change(&mut self, key: u64, change: impl FnOnce(Cell) -> Cell) {
        if let Some(place) = self.place(key)
            && self.slots[place].key() == key
        {
            self.slots[place] = Slot::new(key, change(self.slots[place].cell()));
        }
    }

    /// Changes the cell of a key, made if there is none.
    pub fn change_or_make(&mut self, key: u64, change: impl FnOnce(Cell) -> Cell) {
        debug_assert!(key != 0 && key >> KEY_BITS == 0, "a key");
        if (self.used + 1) * FULL[1] > self.slots.len() * FULL[0] {
            self.grow();
        }
        // It has places, and so one for the key.
        let place = self.place(key).unwrap_or_default();
        let slot = &mut self.slots[place];
        self.used += usize::from(slot.is_free());
        *slot = Slot::new(key, change(slot.cell()));
    }

    /// Changes all cells.
    pub fn change_all(&mut self, change: impl Fn(Cell) -> Cell) {
        let used = self.slots.iter_mut().filter(|slot| !slot.is_free());
        used.for_each(|slot| *slot = Slot::new(slot.key(), change(slot.cell())));
    }

    /// Bytes held.
    pub const fn bytes(&self) -> usize {
        self.slots.capacity() * size_of::<Slot>()
    }

    /// Where the key is, or would be: the first place with it or free from its own on. `None` in a table without places.
    #[inline]
    fn place(&self, key: u64) -> Option<usize> {
        let count = self.slots.len();
        let mut place = home(key, count);
        loop {
            let found = self.slots.get(place)?.key();
            if found == key || found == 0 {
                return Some(place);
            }
            place = if place + 1 < count { place + 1 } else { 0 };
        }
    }

    fn grow(&mut self) {
        let count = (self.slots.len() * 5 / 4).max(FEWEST);
        let old = std::mem::replace(&mut self.slots, vec![Slot::default(); count]);
        for slot in old.into_iter().filter(|slot| !slot.is_free()) {
            if let Some(place) = self.place(slot.key()) {
                self.slots[place] = slot;
            }
        }
    }
}

/// The place of a key among `count`: a share of them as the key's hash is of all numbers.
#[inline]
fn home(key: u64, count: usize) -> usize {
    ((u128::from(mix(key)) * count as u128) >> 64) as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::combine;
    use glam::Vec3;
    use std::collections::HashMap;

    #[test]
    fn it_holds_what_a_map_holds() {
        let (mut table, mut map) = (CellTable::default(), HashMap::new());
        assert_eq!((table.get(1), table.len()), (None, 0));
        for i in 0..20_000_u64 {
            // Some come often, some are far apart, some side by side.
            let key = 1 + if i % 3 == 0 { i % 500 } else { combine(1, i % 7000) >> 31 };
            let change = |cell: Cell| cell.with(Vec3::new(i as f32, 1.0, 0.0), key);
            table.change_or_make(key, change);
            let entry: &mut Cell = map.entry(key).or_default();
            *entry = change(*entry);
        }
        assert_eq!(table.len(), map.len());
        assert!(map.iter().all(|(&key, cell)| table.get(key) == Some(*cell)));
        assert!((0..5000).all(|i| table.get(combine(2, i) >> 30 | 1 << 33).is_none() || map.len() > 9000));
        table.change(1 << 33, |_| unreachable!("no such cell"));
        table.change_all(|cell| cell.scaled(Vec3::ZERO));
        assert_eq!(map.keys().map(|&key| table.get(key).map_or(0, Cell::paths)).sum::<u32>(), 20_000);
        assert!(map.keys().all(|&key| table.get(key).is_some_and(|cell| cell.mean() == Vec3::ZERO)));
    }

    #[test]
    fn keys_and_cells_of_all_bits_do_not_touch() {
        let full = Cell::from_bits((1 << Cell::BITS) - 1);
        for (key, cell) in [((1 << KEY_BITS) - 1, Cell::default()), (1, full), ((1 << KEY_BITS) - 1, full)] {
            let slot = Slot::new(key, cell);
            assert_eq!((slot.key(), slot.cell()), (key, cell));
        }
        assert!(Slot::default().is_free() && size_of::<Slot>() == 12);
    }

    #[test]
    fn neighbouring_cells_are_found_after_few_places() {
        let mut table = CellTable::default();
        let keys: Vec<u64> =
            (0..64_u64.pow(3)).map(|i| 1 << 33 | (i >> 12) << 20 | (i >> 6 & 63) << 10 | i & 63).collect();
        for &key in &keys {
            table.change_or_make(key, |cell| cell);
        }
        let count = table.slots.len();
        let steps = |key: u64| (table.place(key).expect("it is there") + count - home(key, count)) % count;
        let mean = keys.iter().map(|&key| steps(key) as f64).sum::<f64>() / keys.len() as f64;
        assert!(mean < 3.0, "{mean} places on the way");
        assert!(table.bytes() < keys.len() * 20, "{} bytes", table.bytes());
    }
}
