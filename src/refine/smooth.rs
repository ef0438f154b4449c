//! Indirect light smoothed to be shown.

use super::engine::Engine;
use crate::cache::adaptive_mean::AdaptiveMeans;
use crate::cache::ids::{SlotId, VertexId};
use crate::cache::pieces::Piece;
use crate::cache::smoothed::Means;
use glam::Vec3;

/// Means that take some hundred microseconds.
const FEW: usize = 32;

impl Engine {
    /// Smooths what the view shows of indirect light; returns the slots that show something else now.
    pub(super) fn smooth(&mut self) -> Vec<SlotId> {
        let is_wanted = self.options.indirect && self.cache.indirect.filter;
        if !is_wanted || self.cache.without.has(Piece::Smoothing) {
            return Vec::new();
        }
        let mut base: Vec<VertexId> = self.predictions.base().collect();
        // Those that predict others first.
        base.reverse();
        let slots = self.cache.to_smooth(base.into_iter());
        let Some(means) = AdaptiveMeans::new(&slots.samples, self.scale) else { return Vec::new() };
        let numbers: Vec<usize> = (0..slots.samples.len()).collect();
        let of = |run: &[usize]| run.iter().map(|&number| means.of(number)).collect::<Vec<_>>();
        let samples = self.workers.map_chunks(&numbers, FEW, of).concat();
        let between = |&(position, normal): &(Vec3, Vec3)| means.between(position, normal, &samples);
        let between = |run: &[(Vec3, Vec3)]| run.iter().map(between).collect::<Vec<_>>();
        let places = self.workers.map_chunks(&slots.places, FEW, between).concat();
        self.cache.show_smoothed(&slots, &Means { samples, places })
    }
}
