//! Low-discrepancy points: Owen-scrambled Sobol (crate `sobol_burley`), so that any prefix is stratified and rounds
//! can go on where the last one stopped.

use super::combine;

/// Points of a scrambled sequence fixed by a seed.
#[derive(Clone, Copy, Debug)]
pub struct Sequence {
    seed: u32,
}

/// Number of points of one sequence; later indices belong to the next one.
const LENGTH: u32 = 1 << 16;

impl Sequence {
    /// The sequence of a 64-bit seed.
    #[must_use]
    pub const fn new(seed: u64) -> Self {
        Self { seed: (seed ^ (seed >> 32)) as u32 }
    }

    /// Point `index`, all four coordinates in [0, 1). Past 65,536 points a freshly scrambled sequence goes on.
    #[must_use]
    pub fn point(&self, index: u32) -> [f32; 4] {
        self.point_of_set(index, 0)
    }

    /// Four more coordinates of the same point, independent of those of the other sets.
    #[must_use]
    pub fn point_of_set(&self, index: u32, set: u32) -> [f32; 4] {
        let generation = index / LENGTH;
        let seed = self.seed ^ generation.wrapping_mul(0x9e37_79b9);
        sobol_burley::sample_4d(index % LENGTH, set, seed)
    }

    /// Two numbers in [0, 1) that depend on no other index: for choices that hang on what earlier points found, which the
    /// points of the sequence itself, since they avoid each other, would bias.
    #[must_use]
    pub const fn independent(&self, index: u32) -> [f32; 2] {
        // 24 bits each: all that f32 holds below 1.
        const STEP: f32 = 1.0 / (1 << 24) as f32;
        let bits = combine(self.seed as u64, index as u64);
        [(bits >> 40) as f32 * STEP, (bits >> 8 & 0xff_ffff) as f32 * STEP]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_power_of_two_prefix_is_stratified() {
        for seed in 0..20 {
            let sequence = Sequence::new(seed);
            for n in [4_u32, 16, 64] {
                let mut cells = vec![0; n as usize];
                let side = (n as f32).sqrt();
                for i in 0..n {
                    let [x, y, ..] = sequence.point(i);
                    cells[(y * side) as usize * side as usize + (x * side) as usize] += 1;
                }
                assert!(cells.iter().all(|&c| c == 1), "seed {seed}, {n} points: {cells:?}");
            }
        }
    }

    #[test]
    fn points_beyond_one_sequence_differ() {
        let sequence = Sequence::new(7);
        assert_ne!(sequence.point(0), sequence.point(LENGTH));
    }
}
