//! Indirect light smoothed to be shown.

use super::engine::Engine;
use crate::cache::adaptive_mean::AdaptiveMeans;
use crate::cache::ids::{SlotId, VertexId};
use crate::cache::pieces::Piece;
use crate::cache::smoothed::{Means, Place};

/// Means that take some hundred microseconds.
const FEW: usize = 32;

/// Rays that a mean, and a place between means, cost as much as, about.
const RAYS_A_MEAN: u64 = 25;
const RAYS_A_PLACE: u64 = 2;
impl Engine {
    /// Has frames smoothed while they are refined.
    pub fn smooth_frames(&mut self) {
        self.smoothing.of_frames();
    }

    /// Smooths what frames show if it is time to.
    pub(super) fn smooth_in_time(&mut self) -> Vec<SlotId> {
        let is_due = self.is_complete() && self.smoothing.is_due(self.stats.rays, self.is_idle());
        if is_due { self.smooth() } else { Vec::new() }
    }

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
        let cost = slots.samples.len() as u64 * RAYS_A_MEAN + slots.places.len() as u64 * RAYS_A_PLACE;
        self.smoothing.note(self.stats.rays, cost);
        let Some(means) = AdaptiveMeans::new(&slots.samples, self.scale) else { return Vec::new() };
        let numbers: Vec<usize> = (0..slots.samples.len()).collect();
        let of = |run: &[usize]| run.iter().map(|&number| means.of(number)).collect::<Vec<_>>();
        let samples = self.workers.map_chunks(&numbers, FEW, of).concat();
        let groups = slots.groups(self.scale);
        let between = |group: &Vec<u32>| {
            let places: Vec<Place> = group.iter().map(|&number| slots.places[number as usize]).collect();
            means.between(&places, &samples)
        };
        let found = self.workers.map_chunks(&groups, FEW, |run| run.iter().map(between).collect::<Vec<_>>()).concat();
        let mut places = vec![None; slots.places.len()];
        for (group, found) in groups.iter().zip(found) {
            group.iter().zip(found).for_each(|(&number, light)| places[number as usize] = light);
        }
        self.cache.show_smoothed(&slots, &Means { samples, places })
    }
}
