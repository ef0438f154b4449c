//! The light engine: it owns the cache, decides what to trace next, and tells the GPU what changed.

pub mod nice;
pub mod update;
