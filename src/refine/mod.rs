//! The light engine: it owns the cache, decides what to trace next, and tells the GPU what changed.

mod counts;
pub mod engine;
pub mod error_model;
mod highlights;
mod image_error;
mod indirect;
mod indirect_error;
mod miss_rate;
pub mod nice;
pub mod options;
mod pixel_checks;
mod predictions;
mod publish;
pub mod queue;
mod refinement;
mod relight;
pub mod thread;
pub mod update;
pub mod workers;
