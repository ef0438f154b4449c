//! Estimators: light arriving at a vertex from each source.

pub mod direct;
pub mod luminance;
pub mod world;
