//! The light engine: it owns the cache, decides what to trace next, and tells the GPU what changed.

pub mod engine;
pub mod nice;
pub mod queue;
pub mod thread;
pub mod update;
pub mod workers;
