//! Hashes of contents that are kept in files: the same on every machine and in every version of the program.

use glam::{Mat3, Vec2, Vec3};
use std::hash::Hasher as _;
use twox_hash::XxHash3_64;

/// A 64-bit hash (XXH3) in the making, of values as little-endian bytes. Lists are preceded by their lengths, so that no two different
/// runs of values make the same bytes.
#[derive(Clone)]
pub struct ContentHash(XxHash3_64);

/// Bytes that are hashed at a time.
const RUN: usize = 1024;

impl ContentHash {
    /// A hash of something of a kind, which counts, too.
    #[must_use]
    pub fn new(kind: &str) -> Self {
        let mut hash = Self(XxHash3_64::with_seed(0));
        hash.text(kind);
        hash
    }

    /// The hash of all that was added.
    #[must_use]
    pub fn finish(&self) -> u64 {
        self.0.finish()
    }

    /// Adds a number.
    pub fn number(&mut self, number: u64) {
        self.0.write(&number.to_le_bytes());
    }

    /// Adds numbers.
    pub fn numbers(&mut self, numbers: &[u64]) {
        self.number(numbers.len() as u64);
        numbers.iter().for_each(|&number| self.number(number));
    }

    /// Adds bytes.
    pub fn bytes(&mut self, bytes: &[u8]) {
        self.number(bytes.len() as u64);
        self.0.write(bytes);
    }

    /// Adds a text.
    pub fn text(&mut self, text: &str) {
        self.bytes(text.as_bytes());
    }

    /// Adds words of four bytes.
    fn words(&mut self, count: usize, words: impl Iterator<Item = u32>) {
        self.number(count as u64);
        let mut run = [0; RUN];
        let mut filled = 0;
        for word in words {
            run[filled..filled + 4].copy_from_slice(&word.to_le_bytes());
            filled += 4;
            if filled == RUN {
                self.0.write(&run);
                filled = 0;
            }
        }
        self.0.write(&run[..filled]);
    }

    /// Adds indices.
    pub fn indices(&mut self, indices: &[u32]) {
        self.words(indices.len(), indices.iter().copied());
    }

    /// Adds numbers by their bits: a zero that was negative is another.
    pub fn floats(&mut self, floats: &[f32]) {
        self.words(floats.len(), floats.iter().map(|x| x.to_bits()));
    }

    /// Adds points.
    pub fn points(&mut self, points: &[Vec3]) {
        self.words(points.len() * 3, points.iter().flat_map(|p| p.to_array().map(f32::to_bits)));
    }

    /// Adds points in pairs of coordinates.
    pub fn flat_points(&mut self, points: &[Vec2]) {
        self.words(points.len() * 2, points.iter().flat_map(|p| p.to_array().map(f32::to_bits)));
    }

    /// Adds a frame.
    pub fn frame(&mut self, frame: &Mat3) {
        self.floats(&frame.to_cols_array());
    }
}

/// The hash of some hashes of a kind.
#[must_use]
pub fn of_hashes(kind: &str, hashes: &[u64]) -> u64 {
    let mut hash = ContentHash::new(kind);
    hash.numbers(hashes);
    hash.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_values_make_the_same_hash_in_every_version() {
        let mut hash = ContentHash::new("test");
        hash.points(&[Vec3::new(1.0, 2.0, 3.0); 500]);
        hash.indices(&[1, 2, 3]);
        hash.text("light");
        assert_eq!(hash.finish(), 0x371f_daa6_0376_4825, "this number is in users' files");
    }

    #[test]
    fn lists_are_told_apart_by_where_they_end() {
        let of = |lists: &[&[f32]]| {
            let mut hash = ContentHash::new("");
            lists.iter().for_each(|list| hash.floats(list));
            hash.finish()
        };
        assert_ne!(of(&[&[1.0, 2.0], &[3.0]]), of(&[&[1.0], &[2.0, 3.0]]));
        assert_ne!(of(&[&[1.0]]), of(&[&[1.0], &[]]));
        assert_ne!(ContentHash::new("a").finish(), ContentHash::new("b").finish());
        // Runs of bytes do not show.
        let long: Vec<f32> = (0..1000).map(|i| i as f32).collect();
        let mut bytes = ContentHash::new("");
        bytes.number(1000);
        long.iter().for_each(|x| bytes.0.write(&x.to_bits().to_le_bytes()));
        assert_eq!(of(&[&long]), bytes.finish());
    }
}
