//! The light engine: it owns the cache, decides what to trace next, and tells the GPU what changed.

mod above;
mod audit;
mod counts;
pub mod engine;
mod hidden;
mod highlights;
mod image_error;
mod indirect;
mod indirect_priority;
pub mod nice;
pub mod options;
pub mod priority;
mod publish;
pub mod queue;
mod refinement;
mod relight;
pub mod thread;
pub mod update;
pub mod workers;
