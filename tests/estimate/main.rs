//! Estimators and the path tracer against closed forms.

#[path = "../support/mod.rs"]
mod support;

mod hemisphere;
mod progressive;
mod reference;
mod reference_sky;
