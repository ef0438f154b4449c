//! The radiance grid's cells by their keys: open addressing with each cell beside its key, so that a look-up waits for memory once.

use glam::Vec3;

/// What paths have told of a cell.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cell {
    /// Sum of the radiance that they found, W·sr⁻¹·m⁻².
    pub sum: Vec3,
    /// How many they are.
    pub paths: u32,
}

/// A place of the table.
#[derive(Clone, Copy, Debug)]
struct Slot {
    key: u64,
    cell: Cell,
}

/// Stands where there is no key; it is none itself.
const FREE: u64 = u64::MAX;
/// The table is at most three quarters full, and grows by a half.
const FULL: [usize; 2] = [3, 4];
/// Places of the smallest table.
const FEWEST: usize = 64;

/// Cells by keys less than [`u64::MAX`].
#[derive(Clone, Debug, Default)]
pub struct CellTable {
    slots: Vec<Slot>,
    used: usize,
}

impl CellTable {
    /// How many cells there are.
    pub const fn len(&self) -> usize {
        self.used
    }

    /// The cell of a key.
    #[inline]
    pub fn get(&self, key: u64) -> Option<&Cell> {
        let slot = &self.slots[self.place(key)?];
        (slot.key == key).then_some(&slot.cell)
    }

    /// The same, to be changed.
    pub fn get_mut(&mut self, key: u64) -> Option<&mut Cell> {
        let place = self.place(key)?;
        let slot = &mut self.slots[place];
        (slot.key == key).then_some(&mut slot.cell)
    }

    /// The cell of a key, made if there is none.
    pub fn get_or_make(&mut self, key: u64) -> &mut Cell {
        if (self.used + 1) * FULL[1] > self.slots.len() * FULL[0] {
            self.grow();
        }
        // It has places, and so one for the key.
        let place = self.place(key).unwrap_or_default();
        let slot = &mut self.slots[place];
        if slot.key == FREE {
            slot.key = key;
            self.used += 1;
        }
        &mut slot.cell
    }

    /// All cells.
    pub fn cells_mut(&mut self) -> impl Iterator<Item = &mut Cell> {
        self.slots.iter_mut().map(|slot| &mut slot.cell)
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
            let found = self.slots.get(place)?.key;
            if found == key || found == FREE {
                return Some(place);
            }
            place = if place + 1 < count { place + 1 } else { 0 };
        }
    }

    fn grow(&mut self) {
        let count = (self.slots.len() * 3 / 2).max(FEWEST);
        let old = std::mem::replace(&mut self.slots, vec![Slot { key: FREE, cell: Cell::default() }; count]);
        for slot in old.into_iter().filter(|slot| slot.key != FREE) {
            if let Some(place) = self.place(slot.key) {
                self.slots[place] = slot;
            }
        }
    }
}

/// The place of a key among `count`: a share of them as the key's hash is of all numbers.
#[inline]
fn home(key: u64, count: usize) -> usize {
    // 2⁶⁴ over the golden ratio; the upper half of the product stirs the bits of the whole key into the lower.
    const FACTOR: u128 = 0x9E37_79B9_7F4A_7C15;
    let product = u128::from(key) * FACTOR;
    let hash = (product >> 64) as u64 ^ product as u64;
    ((u128::from(hash) * count as u128) >> 64) as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::combine;
    use std::collections::HashMap;

    #[test]
    fn it_holds_what_a_map_holds() {
        let (mut table, mut map) = (CellTable::default(), HashMap::new());
        assert_eq!((table.get(0), table.len()), (None, 0));
        for i in 0..20_000_u64 {
            // Some come often, some are far apart, some side by side.
            let key = if i % 3 == 0 { i % 500 } else { combine(1, i % 7000) >> 9 };
            let cell = table.get_or_make(key);
            cell.paths += 1;
            cell.sum.x += i as f32;
            let entry: &mut Cell = map.entry(key).or_default();
            entry.paths += 1;
            entry.sum.x += i as f32;
        }
        assert_eq!(table.len(), map.len());
        assert!(map.iter().all(|(&key, cell)| table.get(key) == Some(cell)));
        assert!((0..5000).all(|i| table.get(combine(2, i) >> 9).is_none()));
        assert_eq!(table.get_mut(combine(2, 0) >> 9), None);
        assert_eq!(table.cells_mut().map(|cell| cell.paths).sum::<u32>(), 20_000);
    }

    #[test]
    fn neighbouring_cells_are_found_after_few_places() {
        let mut table = CellTable::default();
        let keys: Vec<u64> = (0..64_u64.pow(3)).map(|i| (i >> 12) << 32 | (i >> 6 & 63) << 16 | i & 63).collect();
        for &key in &keys {
            table.get_or_make(key);
        }
        let count = table.slots.len();
        let steps = |key: u64| (table.place(key).expect("it is there") + count - home(key, count)) % count;
        let mean = keys.iter().map(|&key| steps(key) as f64).sum::<f64>() / keys.len() as f64;
        assert!(mean < 2.0, "{mean} places on the way");
        assert!(table.bytes() < keys.len() * 50, "{} bytes", table.bytes());
    }
}
