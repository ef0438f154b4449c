//! Estimators and the path tracer against closed forms.

#[path = "../support/mod.rs"]
mod support;

mod hemisphere;
mod photometry;
mod progressive;
mod reference;
mod reference_sky;
