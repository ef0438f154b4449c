//! Figures of repeated measurements, and how long work takes.

use crate::refine::workers::thread_nanoseconds;
use serde::Serialize;

/// Told what is going on; `false` breaks off.
pub type Step<'a> = dyn Fn(&str) -> bool + Sync + 'a;

/// A figure measured several times.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Figure {
    /// The median.
    pub median: f64,
    /// Distance of the furthest from it, against the median: what to think of the second digit.
    pub spread: f64,
}

impl Figure {
    /// From repetitions; the order is lost. With none, not a number.
    #[must_use]
    pub fn of(mut values: Vec<f64>) -> Self {
        values.sort_unstable_by(f64::total_cmp);
        let (Some(low), Some(high)) = (values.first(), values.last()) else {
            return Self { median: f64::NAN, spread: f64::NAN };
        };
        let median = f64::midpoint(values[(values.len() - 1) / 2], values[values.len() / 2]);
        Self { median, spread: (high - median).max(median - low) / median.abs() }
    }
}

/// CPU seconds of this thread that `work` takes.
pub(super) fn cpu_seconds(work: impl FnOnce()) -> f64 {
    let start = thread_nanoseconds();
    work();
    // Never 0, so that rates stay finite.
    (thread_nanoseconds() - start).max(1) as f64 * 1e-9
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_are_medians() {
        assert_eq!(Figure::of(vec![3.0, 1.0, 2.0]), Figure { median: 2.0, spread: 0.5 });
        assert_eq!(Figure::of(vec![4.0, 2.0]), Figure { median: 3.0, spread: 1.0 / 3.0 });
        assert!(Figure::of(Vec::new()).median.is_nan());
    }
}
