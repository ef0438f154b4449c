//! Measurements of the renderer by itself, each a ratio or a cost per unit of work (docs/bench.md).

pub mod ablation;
mod choice;
pub mod convergence;
pub mod crossing;
mod figure;
mod gather;
pub mod plot;
mod rates;
pub mod reference_pixels;
mod surface;
pub mod walk;

pub use choice::ChoiceCost;
pub use figure::{Figure, Step};
pub use gather::{Errors, Hits, Study};
pub use rates::Rates;

use crate::light::context::SceneContext;
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

/// Measures everything: speeds on one thread of their own, errors on the threads of `pool`. `None` if it was broken off.
#[must_use]
pub fn measure(context: &SceneContext<'_>, view: &View, pool: &ThreadPool, step: &Step<'_>) -> Option<Report> {
    let rates = rates::measure(context, view, step)?;
    let choice = choice::measure(step)?;
    let hemisphere = pool.install(|| gather::measure(context, view, step))?;
    Some(Report { rates, choice, hemisphere })
}
