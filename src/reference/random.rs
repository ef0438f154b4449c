//! The random numbers of paths.

use crate::math::{combine, sequence::Sequence};
use glam::Vec2;
use std::cell::OnceCell;

/// The random numbers of one point of a path.
pub struct Random {
    sequence: Sequence,
    index: u32,
    /// [`Self::choices`], once they are asked for.
    choices: OnceCell<[f32; 4]>,
}

impl Random {
    /// Those of the point after `bounces` on path `index` of the pixel of this seed.
    pub fn new(seed: u64, bounces: u32, index: u32) -> Self {
        let seed = if bounces == 0 { seed } else { combine(seed, bounces.into()) };
        Self { sequence: Sequence::new(seed), index, choices: OnceCell::new() }
    }

    pub fn within_pixel(&self) -> Vec2 {
        let [u, v, ..] = self.sequence.point(self.index);
        Vec2::new(u, v)
    }

    /// Chooses a point of the first light (two) and a direction (two): all that most points of a path need.
    pub fn light_and_direction(&self) -> [f32; 4] {
        self.sequence.point_of_set(self.index, 1)
    }

    /// Chooses a point of the light sampled `k`-th, 1 ≤ k < 4.
    pub fn other_light(&self, k: u32) -> [f32; 2] {
        let [u, v, ..] = self.sequence.point_of_set(self.index, 2 + k);
        [u, v]
    }

    /// Chooses one light of many.
    pub fn pick(&self) -> f32 {
        self.choices()[0]
    }

    /// Chooses a lobe.
    pub fn lobe(&self) -> f32 {
        self.choices()[1]
    }

    /// Chooses whether the path goes on.
    pub fn survives(&self) -> f32 {
        self.sequence.independent(self.index)[0]
    }

    fn choices(&self) -> &[f32; 4] {
        self.choices.get_or_init(|| self.sequence.point_of_set(self.index, 2))
    }
}
