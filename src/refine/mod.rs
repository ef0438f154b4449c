//! The light engine: it owns the cache, decides what to trace next, and tells the GPU what changed.

mod bands;
mod beside_finer;
mod bring_up_to_date;
mod choose;
mod counts;
mod direct;
mod enclosed;
pub mod engine;
pub mod error_model;
mod gather;
mod hidden_highlights;
pub mod image_error;
mod indirect;
mod indirect_error;
mod judge;
mod large_leaves;
mod miss_rate;
pub mod nice;
pub mod options;
mod pixel_checks;
pub mod pixel_lists;
mod predictions;
mod publisher;
pub mod reflectances;
mod relight;
pub mod replay;
mod rounds;
pub mod scheduler;
#[cfg(test)]
mod testing;
pub mod thread;
pub mod update;
pub mod view;
mod visible;
pub mod visible_faces;
mod work;
pub mod workers;
