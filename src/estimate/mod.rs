//! Estimators: light arriving at a point from one source.
