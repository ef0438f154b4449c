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
/// Rays traced before what is shown is smoothed again, against those that it costs as much as: a fifth of the time at first, later less.
const SHARE: u64 = 4;
const MOST: u64 = 4;

/// When what is shown is smoothed, where somebody looks on.
#[derive(Debug, Default)]
pub(super) struct Smoothing {
    /// Whether frames are smoothed, not only pictures that are kept.
    frames: bool,
    /// Rays traced when it was done last, or when the view changed: what comes into view has to be answered soon.
    at: u64,
    /// How often in this view.
    times: u64,
    /// Rays that it last cost as much as.
    cost: u64,
}

impl Smoothing {
    /// Notes a new view after so many rays.
    pub fn start_anew(&mut self, rays: u64) {
        (self.at, self.times) = (rays, 0);
    }

    /// Whether so many rays were traced that it costs little beside them; if nothing is left to trace, whether any was.
    fn is_due(&self, rays: u64, idle: bool) -> bool {
        let least = if idle { 1 } else { SHARE * self.cost * (1 + self.times.min(MOST)) };
        self.frames && rays - self.at >= least
    }
}

impl Engine {
    /// Has frames smoothed while they are refined.
    pub fn smooth_frames(&mut self) {
        self.smoothing.frames = true;
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
        self.smoothing = Smoothing { at: self.stats.rays, times: self.smoothing.times + 1, cost, ..self.smoothing };
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_smoothed_the_more_seldom_the_longer_a_view_is_looked_at() {
        let mut smoothing = Smoothing { frames: true, cost: 100, ..Smoothing::default() };
        assert!(!smoothing.is_due(399, false) && smoothing.is_due(400, false));
        smoothing.times = 10;
        assert!(!smoothing.is_due(1999, false) && smoothing.is_due(2000, false));
        smoothing.start_anew(5000);
        assert!(!smoothing.is_due(5399, false) && smoothing.is_due(5400, false));
        assert!(!smoothing.is_due(5000, true) && smoothing.is_due(5001, true), "once more when nothing is left");
        smoothing.frames = false;
        assert!(!smoothing.is_due(u64::MAX, false));
    }
}
