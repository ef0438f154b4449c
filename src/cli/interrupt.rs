//! Ctrl-C and SIGTERM: the first asks for an orderly end, the second ends at once.

use super::output;
use crate::error::{Error, Result};
use crate::image::atomic;
use crate::session::Observer;
use std::sync::atomic::{AtomicBool, Ordering};

/// Exit status of an interrupted command.
pub const EXIT_STATUS: u8 = 130;

static REQUESTED: AtomicBool = AtomicBool::new(false);

/// Whether the user asked for an end: finish the frame, write the outputs, return [`super::Outcome::Interrupted`].
#[must_use]
pub fn requested() -> bool {
    REQUESTED.load(Ordering::Relaxed)
}

/// A session's observer that ends it when a signal comes.
pub struct Signals;

impl Observer for Signals {
    fn interrupted(&self) -> bool {
        requested()
    }
}

/// Installs the handler, once a process.
///
/// # Errors
/// [`Error::Internal`] if the system refuses it or one is there already.
pub fn install() -> Result<()> {
    #[cfg(unix)]
    survive_file_limits()?;
    ctrlc::set_handler(handle).map_err(|e| Error::Internal(format!("no handler for Ctrl-C: {e}")))
}

/// Has a file that grows beyond the limit of the process (`ulimit -f`) be an error of the write, as a full disk is, and not the end.
#[cfg(unix)]
fn survive_file_limits() -> Result<()> {
    let seen = std::sync::Arc::new(AtomicBool::new(false));
    let handler = signal_hook::flag::register(signal_hook::consts::SIGXFSZ, seen);
    handler.map(drop).map_err(|e| Error::Internal(format!("no handler for limits of files: {e}")))
}

/// Runs on a thread of its own, so it may do anything.
fn handle() {
    if REQUESTED.swap(true, Ordering::Relaxed) {
        atomic::remove_temporaries();
        std::process::exit(i32::from(EXIT_STATUS));
    }
    output::report("interrupted: finishing the frame and writing the outputs (once more to stop at once)");
}
