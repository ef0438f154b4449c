//! When what is shown of indirect light is smoothed, where somebody looks on.

/// Rays traced before what is shown is smoothed again, against those that it costs as much as: a fifth of the time at first, later less.
const SHARE: u64 = 4;
/// Times in one view after which it comes no more seldom.
const MOST: u64 = 4;

/// When what is shown is smoothed, where somebody looks on.
#[derive(Debug, Default)]
pub struct Smoothing {
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

    /// Has frames smoothed, not only pictures that are kept.
    pub fn of_frames(&mut self) {
        self.frames = true;
    }

    /// Notes that it was done after so many rays, and how many rays that cost as much as.
    pub fn note(&mut self, rays: u64, cost: u64) {
        (self.at, self.times, self.cost) = (rays, self.times + 1, cost);
    }

    /// Whether so many rays were traced that it costs little beside them; if nothing is left to trace, whether any was.
    pub fn is_due(&self, rays: u64, idle: bool) -> bool {
        let least = if idle { 1 } else { SHARE * self.cost * (1 + self.times.min(MOST)) };
        self.frames && rays - self.at >= least
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
