//! A queue by keys that are mostly far from the greatest: a heap for each eighth of an octave, so that what is taken moves but the few
//! entries of its own band instead of a path through all.

use std::collections::BinaryHeap;

/// Entries in their order, which is first of all that of their keys: these are positive.
#[derive(Debug)]
pub struct Bands<E> {
    /// By the upper bits of the keys.
    heaps: Vec<BinaryHeap<E>>,
    /// The band of the greatest entry, if there is one.
    greatest: usize,
    len: usize,
}

/// Bits of a key below those that name its band: of a positive one its exponent and three more.
const WITHIN: u32 = f32::MANTISSA_DIGITS - 1 - 3;

/// Entries by which a heap grows at least; beyond them it grows by an eighth, like all tables.
const LEAST: usize = 16;

impl<E: Ord> Default for Bands<E> {
    fn default() -> Self {
        Self { heaps: Vec::new(), greatest: 0, len: 0 }
    }
}

impl<E: Ord> Bands<E> {
    /// Adds an entry with its key.
    pub fn push(&mut self, key: f32, entry: E) {
        let band = (key.to_bits() >> WITHIN) as usize;
        if band >= self.heaps.len() {
            self.heaps.resize_with(band + 1, BinaryHeap::new);
        }
        let heap = &mut self.heaps[band];
        if heap.len() == heap.capacity() {
            heap.reserve_exact((heap.len() / 8).max(LEAST));
        }
        heap.push(entry);
        self.greatest = if self.len == 0 { band } else { self.greatest.max(band) };
        self.len += 1;
    }

    /// The greatest entry.
    pub fn peek(&self) -> Option<&E> {
        self.heaps.get(self.greatest)?.peek()
    }

    /// Takes the greatest entry.
    pub fn pop(&mut self) -> Option<E> {
        let heap = self.heaps.get_mut(self.greatest)?;
        let entry = heap.pop()?;
        self.len -= 1;
        if heap.is_empty() {
            // Bands above the greatest are seldom needed again.
            *heap = BinaryHeap::new();
            while self.len > 0 && self.heaps[self.greatest].is_empty() {
                self.greatest -= 1;
            }
        }
        Some(entry)
    }

    /// Whether there is none.
    pub const fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let entries: usize = self.heaps.iter().map(BinaryHeap::capacity).sum();
        entries * size_of::<E>() + self.heaps.capacity() * size_of::<BinaryHeap<E>>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::mix;

    /// Against one heap; keys over many octaves, equal ones, and infinite ones.
    #[test]
    fn entries_come_in_the_order_of_one_heap() {
        let (mut bands, mut heap) = (Bands::default(), BinaryHeap::new());
        for step in 0..5000_u64 {
            let random = mix(step);
            if random % 5 < 3 {
                let key = match random >> 8 & 15 {
                    0 => f32::INFINITY,
                    octave => (1.0 + (random >> 16 & 31) as f32 / 32.0) * 2.0_f32.powi(octave as i32 * 4 - 40),
                };
                let entry = (key.to_bits(), step);
                bands.push(key, entry);
                heap.push(entry);
            } else {
                assert_eq!(bands.pop(), heap.pop());
            }
            assert_eq!((bands.peek(), bands.is_empty()), (heap.peek(), heap.is_empty()));
        }
        assert!(heap.len() > 100);
        while let Some(entry) = heap.pop() {
            assert_eq!(bands.pop(), Some(entry));
        }
        assert!(bands.pop().is_none() && bands.is_empty());
    }
}
