//! When a run ends: its limits, and what is held against them.

use std::time::Duration;

/// Limits of a run: the first that is reached ends it. Without any it ends when nothing is left to do.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Budget {
    /// Wall-clock time since the first light was there.
    pub time: Option<Duration>,
    /// Frames.
    pub frames: Option<u64>,
    /// Rays.
    pub rays: Option<u64>,
    /// Estimated error of the image: RMSE over its mean.
    pub error: Option<f32>,
}

/// Why a run, or a picture of it, ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EndedBy {
    /// The observer asked for it.
    Interrupted,
    /// [`Budget::time`] is over.
    Time,
    /// [`Budget::frames`] are drawn.
    Frames,
    /// [`Budget::rays`] are traced.
    Rays,
    /// [`Budget::error`] is reached.
    Error,
    /// Nothing is left to do.
    Converged,
    /// All pictures of a camera path are there.
    Path,
}

/// How far a run has come.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spent {
    /// Wall-clock time since the first light was there.
    pub time: Duration,
    /// Frames, with the one that is about to be drawn.
    pub frames: u64,
    /// Rays traced.
    pub rays: u64,
    /// Estimated error of the image, if it is known.
    pub error: Option<f32>,
    /// Whether nothing is left to do.
    pub converged: bool,
}

impl Budget {
    /// The same limits; where there are none, an error.
    #[must_use]
    pub fn or_error(self, error: f32) -> Self {
        let unlimited = self.time.is_none() && self.frames.is_none() && self.rays.is_none();
        Self { error: self.error.or(unlimited.then_some(error)), ..self }
    }

    /// What a run may have spent when picture `index` of `of` is done, from what is spent so far: the rest is shared out evenly,
    /// but for the first picture, which starts from nothing. Frames are not counted; the error holds for each picture.
    #[must_use]
    pub fn share(&self, (index, of): (u64, u64), spent: &Spent) -> Self {
        const FIRST_COUNTS_AS: f64 = 8.0;
        let left = of.saturating_sub(index).max(1) as f64;
        let share = if index == 0 { FIRST_COUNTS_AS / (FIRST_COUNTS_AS - 1.0 + left) } else { left.recip() };
        let Spent { time, rays, .. } = *spent;
        Self {
            time: self.time.map(|limit| time + limit.saturating_sub(time).mul_f64(share)),
            frames: None,
            rays: self.rays.map(|limit| rays + (limit.saturating_sub(rays) as f64 * share) as u64),
            error: self.error,
        }
    }

    /// The first limit reached, in the order of [`EndedBy`].
    #[must_use]
    pub fn ended_by(&self, spent: &Spent) -> Option<EndedBy> {
        let reached = [
            (EndedBy::Time, self.time.is_some_and(|limit| spent.time >= limit)),
            (EndedBy::Frames, self.frames.is_some_and(|limit| spent.frames >= limit)),
            (EndedBy::Rays, self.rays.is_some_and(|limit| spent.rays >= limit)),
            (EndedBy::Error, self.error.is_some_and(|limit| spent.error.is_some_and(|error| error <= limit))),
            (EndedBy::Converged, spent.converged),
        ];
        reached.iter().find(|(_, is)| *is).map(|(by, _)| *by)
    }
}

impl EndedBy {
    /// Its name in logs and messages.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Interrupted => "interrupted",
            Self::Time => "time",
            Self::Frames => "frames",
            Self::Rays => "rays",
            Self::Error => "error",
            Self::Converged => "converged",
            Self::Path => "path",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn spent(seconds: u64, rays: u64) -> Spent {
        Spent { time: Duration::from_secs(seconds), frames: 1, rays, error: None, converged: false }
    }

    #[test]
    fn budgets_are_shared_out_among_pictures() {
        let seconds = |n| Some(Duration::from_secs(n));
        let budget = Budget { frames: Some(10), rays: Some(1700), time: seconds(17), error: None };
        // The first counts as eight: 8 of 17 parts.
        let first = budget.share((0, 10), &spent(0, 0));
        assert_eq!(first, Budget { time: seconds(8), rays: Some(800), frames: None, error: None });
        let second = budget.share((1, 10), &spent(8, 800));
        assert_eq!((second.time, second.rays), (seconds(9), Some(900)));
        let last = budget.share((9, 10), &spent(20, 1600));
        assert_eq!((last.time, last.rays), (seconds(20), Some(1700)), "what is overspent is gone");
        let by_error = Budget { frames: Some(10), error: Some(0.1), ..Budget::default() }.share((3, 10), &spent(0, 0));
        assert_eq!(by_error, Budget { error: Some(0.1), ..Budget::default() }, "frames are no limit for a picture");
        let alone = budget.share((0, 1), &spent(0, 0));
        assert_eq!((alone.time, alone.rays), (seconds(17), Some(1700)), "one picture has all");
    }

    #[test]
    fn a_run_without_limits_ends_by_error() {
        let least = |budget: Budget| budget.or_error(0.01).error;
        assert_eq!(least(Budget::default()), Some(0.01));
        assert_eq!(least(Budget { rays: Some(1), ..Budget::default() }), None);
        assert_eq!(least(Budget { rays: Some(1), error: Some(0.2), ..Budget::default() }), Some(0.2));
        assert_eq!(Budget::default().ended_by(&Spent { error: Some(0.0), ..spent(9, 9) }), None, "no limit, no end");
    }

    #[test]
    fn the_first_limit_in_order_ends_a_run() {
        let all = Budget { time: Some(Duration::from_secs(2)), frames: Some(3), rays: Some(5), error: Some(0.1) };
        let mut spent = Spent { time: Duration::from_secs(2), frames: 3, rays: 5, error: Some(0.1), converged: true };
        assert_eq!(all.ended_by(&spent), Some(EndedBy::Time));
        spent.time = Duration::from_millis(1999);
        assert_eq!(all.ended_by(&spent), Some(EndedBy::Frames));
        spent.frames = 2;
        assert_eq!(all.ended_by(&spent), Some(EndedBy::Rays));
        spent.rays = 4;
        assert_eq!(all.ended_by(&spent), Some(EndedBy::Error));
        spent.error = None;
        assert_eq!(all.ended_by(&spent), Some(EndedBy::Converged), "an error that is not known reaches nothing");
        spent.converged = false;
        assert_eq!(all.ended_by(&spent), None);
    }
}
