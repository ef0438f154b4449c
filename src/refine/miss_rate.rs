//! How likely leaves are to hide a shadow: learnt from leaves that nothing but that chance had split.

/// Square error, relative to what a leaf shows, that is expected where nothing has been seen.
#[derive(Clone, Copy, Debug)]
pub struct MissRate {
    sum: f64,
    count: f64,
    /// What was expected when the queue's keys were last computed.
    queued: f32,
}

/// Before anything is known: a tenth of the leaves would be off by 1 %.
const PRIOR: f64 = 1e-5;
/// Leaves that the prior counts for.
const PRIOR_COUNT: f64 = 64.0;
/// Most that one leaf can tell: the middles of a leaf in shadow may be brighter than it by any factor.
const MOST: f32 = 1.0;
/// Leaves that the expectation is a mean of.
const MEMORY: f64 = 256.0;
/// Rise of the expectation at which keys are computed anew.
const RISEN: f32 = 2.0;

impl Default for MissRate {
    fn default() -> Self {
        Self::new(PRIOR, PRIOR_COUNT)
    }
}

impl MissRate {
    /// Nothing learnt yet: `prior` is expected, as if `count` leaves had told.
    #[must_use]
    pub const fn new(prior: f64, count: f64) -> Self {
        Self { sum: prior * count, count, queued: prior as f32 }
    }

    /// Notes what a leaf that showed no error turned out to hide: square error over square of what it showed.
    pub fn note(&mut self, found: f32) {
        // Leaves get smaller, and what they hide rarer: those of long ago are forgotten.
        let kept = (MEMORY / (self.count + 1.0)).min(1.0);
        self.sum = (self.sum + f64::from(found.min(MOST))) * kept;
        self.count = (self.count + 1.0) * kept;
    }

    /// Expected square error of a leaf against the square of what it shows.
    #[must_use]
    pub fn expected(&self) -> f32 {
        (self.sum / self.count) as f32
    }

    /// Whether so much more is expected than when the queue's keys were computed that they are due again.
    pub fn has_risen(&mut self) -> bool {
        let risen = self.expected() > RISEN * self.queued;
        if risen {
            self.queued = self.expected();
        }
        risen
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_found_is_expected_again() {
        let mut hidden = MissRate::default();
        assert!((hidden.expected() / 1e-5 - 1.0).abs() < 1e-3 && !hidden.has_risen());
        for i in 0..10_000 {
            hidden.note(if i % 100 == 0 { 5.0 } else { 0.0 });
        }
        assert!((hidden.expected() / 0.01 - 1.0).abs() < 0.3, "{}", hidden.expected());
        assert!(hidden.has_risen() && !hidden.has_risen());
        (0..3_000).for_each(|_| hidden.note(0.0));
        assert!(hidden.expected() < 1e-6, "what was found long ago is forgotten");
    }
}
