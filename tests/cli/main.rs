//! The program as a user or a script drives it.

#[path = "../support/mod.rs"]
mod support;

mod ablation;
mod arguments;
mod black_pictures;
mod clock;
mod compare;
mod convergence;
mod diff;
mod exr;
mod files;
mod kept_light;
mod messages;
mod probe;
mod process;
mod trace;
mod view;
mod window;
