//! Measurements of the renderer by itself, each a ratio or a cost per unit of work (docs/bench.md).

mod choice;
pub mod convergence;
mod gather;
pub mod plot;
mod rates;
pub mod reference_pixels;
mod surface;

pub use choice::ChoiceCost;
pub use gather::{Errors, Hits, Study};
pub use rates::Rates;

use crate::light::context::SceneContext;
use crate::refine::workers::thread_nanoseconds;
use crate::scene::camera::View;
use rayon::ThreadPool;
use serde::Serialize;

/// What a run measures.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Rays a CPU second.
    pub rates: Rates,
    /// What choosing directions costs, method by method.
    pub choice: Vec<ChoiceCost>,
    /// Errors of the hemisphere methods.
    pub hemisphere: Study,
}

/// Told what is going on; `false` breaks off.
pub type Step<'a> = dyn Fn(&str) -> bool + Sync + 'a;

/// Measures everything: speeds on one thread of their own, errors on the threads of `pool`. `None` if it was broken off.
#[must_use]
pub fn measure(context: &SceneContext<'_>, view: &View, pool: &ThreadPool, step: &Step<'_>) -> Option<Report> {
    let rates = rates::measure(context, view, step)?;
    let choice = choice::measure(step)?;
    let hemisphere = pool.install(|| gather::measure(context, view, step))?;
    Some(Report { rates, choice, hemisphere })
}

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
    fn of(mut values: Vec<f64>) -> Self {
        values.sort_unstable_by(f64::total_cmp);
        let (Some(low), Some(high)) = (values.first(), values.last()) else {
            return Self { median: f64::NAN, spread: f64::NAN };
        };
        let median = f64::midpoint(values[(values.len() - 1) / 2], values[values.len() / 2]);
        Self { median, spread: (high - median).max(median - low) / median }
    }
}

/// CPU seconds of this thread that `work` takes.
fn cpu_seconds(work: impl FnOnce()) -> f64 {
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
