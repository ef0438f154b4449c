//! Estimators: what is kept of light arriving at a point from one source.

pub mod visibility;
