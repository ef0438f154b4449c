//! Frame log and run summary.

pub mod frame_log;
pub mod summary;
