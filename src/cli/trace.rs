//! `--trace`: what a command does when, written however it ends.

use super::{Outcome, output};
use crate::error::Result;
use crate::log::trace_file;
use crate::trace;
use std::path::Path;

/// Runs a command; what it does meanwhile is written to a file, if there is to be one.
///
/// # Errors
/// The command's; else [`crate::error::Error::Io`] naming the file.
pub fn traced(path: Option<&Path>, command: impl FnOnce() -> Result<Outcome>) -> Result<Outcome> {
    let Some(path) = path else { return command() };
    trace::start();
    let ended = command();
    let recorded = trace::stop();
    if let Some(note) = trace_file::dropped(&recorded) {
        output::report(&format!("{}: warning: {note}", path.display()));
    }
    let written = trace_file::write(path, &recorded);
    ended.and_then(|outcome| written.map(|()| outcome))
}
