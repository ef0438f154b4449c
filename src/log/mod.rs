//! Frame log and run summary.

pub mod frame_log;
pub mod summary;
pub mod trace_file;
