//! Frame log and run summary.
