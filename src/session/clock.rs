//! When things happened in a run.

use crate::system;
use std::time::{Duration, Instant};

/// A moment of a run.
#[derive(Clone, Copy, Debug)]
pub struct Moment {
    /// By the wall clock.
    pub at: Instant,
    /// CPU time of the process up to then, seconds; `None` where the system does not tell.
    pub cpu_seconds: Option<f64>,
}

impl Moment {
    fn now() -> Self {
        Self { at: Instant::now(), cpu_seconds: system::cpu_seconds() }
    }
}

/// Moments of a run; `None` for what is still to come.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Clock {
    /// When the first frame began.
    first_frame: Option<Instant>,
    /// When the first light was there: what a budget's time counts from.
    first_light: Option<Instant>,
    /// When the last frame began to be drawn, and how long that took.
    drawing: Option<Instant>,
    frame_cost: Duration,
    /// When pictures were made: the first, the first with light, the first in which every visible vertex has a value, the last.
    pub first_picture: Option<Moment>,
    pub lit_picture: Option<Moment>,
    pub complete_picture: Option<Moment>,
    pub last_picture: Option<Moment>,
}

impl Clock {
    pub(super) fn frame_begins(&mut self) {
        self.first_frame.get_or_insert_with(Instant::now);
    }

    pub(super) fn light_is_there(&mut self) {
        self.first_light.get_or_insert_with(Instant::now);
    }

    pub(super) const fn has_light(&self) -> bool {
        self.first_light.is_some()
    }

    /// A frame is done, with a picture or without; when that is, since the first frame began.
    pub(super) fn frame_ends(&mut self, picture: bool, complete: bool) -> Duration {
        let now = Moment::now();
        self.frame_cost = self.drawing.map_or(Duration::ZERO, |drawing| now.at.duration_since(drawing));
        if picture {
            self.last_picture = Some(now);
            self.first_picture.get_or_insert(now);
        }
        if picture && self.first_light.is_some() {
            self.lit_picture.get_or_insert(now);
        }
        if picture && complete {
            self.complete_picture.get_or_insert(now);
        }
        self.first_frame.map_or(Duration::ZERO, |first| now.at.duration_since(first))
    }

    /// Whether a frame would take at most a tenth of the time since the last, if it costs as much as that did.
    pub(super) fn frame_is_cheap(&self) -> bool {
        const SHARE: u32 = 10;
        self.last_picture.is_none_or(|last| last.at.elapsed() >= self.frame_cost * (SHARE - 1))
    }

    /// Notes that a frame begins to be drawn, after all that it shows has arrived.
    pub(super) fn drawing_begins(&mut self) {
        self.drawing = Some(Instant::now());
    }

    /// Whether a picture is due that comes every `refresh`.
    pub(super) fn picture_is_due(&self, refresh: Duration) -> bool {
        self.last_picture.is_none_or(|last| last.at.elapsed() >= refresh)
    }

    /// How long until it is, a millisecond at least; no time before the first.
    pub(super) fn until_picture(&self, refresh: Duration) -> Duration {
        let left = |last: Moment| refresh.saturating_sub(last.at.elapsed()).max(Duration::from_millis(1));
        self.last_picture.map_or(Duration::ZERO, left)
    }

    pub(super) fn since_light(&self) -> Duration {
        since(self.first_light)
    }

    pub(super) fn since_first_frame(&self) -> Duration {
        since(self.first_frame)
    }
}

/// Time since then; none if that is still to come.
fn since(then: Option<Instant>) -> Duration {
    then.map_or(Duration::ZERO, |then| then.elapsed())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_are_due_at_once_and_then_in_turn() {
        let mut clock = Clock::default();
        let long = Duration::from_secs(3600);
        assert_eq!((clock.picture_is_due(long), clock.until_picture(long)), (true, Duration::ZERO));
        clock.frame_begins();
        clock.frame_ends(true, false);
        assert!(!clock.picture_is_due(long) && clock.picture_is_due(Duration::ZERO));
        assert!(clock.until_picture(long) > Duration::from_secs(3000));
        assert_eq!(clock.until_picture(Duration::ZERO), Duration::from_millis(1));
        assert!(!clock.picture_is_due(Duration::MAX), "never");
    }

    #[test]
    fn a_frame_is_cheap_beside_nine_times_its_cost() {
        let mut clock = Clock::default();
        assert!(clock.frame_is_cheap(), "the first");
        clock.frame_ends(true, false);
        assert!(clock.frame_is_cheap(), "it was not drawn");
        clock.frame_cost = Duration::from_secs(3600);
        assert!(!clock.frame_is_cheap());
    }

    #[test]
    fn first_moments_stay() {
        let mut clock = Clock::default();
        assert_eq!((clock.since_light(), clock.since_first_frame()), (Duration::ZERO, Duration::ZERO));
        clock.frame_begins();
        clock.frame_ends(false, true);
        assert!(clock.first_picture.is_none() && clock.complete_picture.is_none());
        clock.frame_ends(true, false);
        assert!(clock.first_picture.is_some() && clock.lit_picture.is_none() && clock.complete_picture.is_none());
        clock.light_is_there();
        clock.frame_ends(false, false);
        assert!(clock.lit_picture.is_none(), "nobody sees it yet");
        clock.frame_ends(true, true);
        clock.frame_ends(true, true);
        let moments = [clock.first_picture, clock.lit_picture, clock.complete_picture, clock.last_picture];
        let [first, lit, complete, last] = moments.map(|moment| moment.expect("a picture").at);
        assert!(first < lit && lit == complete && complete < last, "{moments:?}");
    }
}
