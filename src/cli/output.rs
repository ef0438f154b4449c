//! Text for the user, on streams that may be closed.

use crate::error::{Error, Result};
use std::io::{self, Write as _};
use std::path::Path;

/// Prints `text` on standard output. A reader that has gone away (`penombre info | head -1`) is no error.
///
/// # Errors
/// [`Error::Io`] for anything else, such as a full disk.
pub fn print(text: &str) -> Result<()> {
    let mut stdout = io::stdout().lock();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Err(e) if e.kind() != io::ErrorKind::BrokenPipe => {
            Err(Error::io(Path::new("standard output"), "cannot write", e))
        }
        _ => Ok(()),
    }
}

/// Prints `text` and a line end on standard error; if that fails there is nobody left to tell.
pub fn report(text: &str) {
    let _ = writeln!(io::stderr().lock(), "{text}");
}

/// Prints why a command failed.
pub fn error(error: &Error) {
    match error {
        // These already say what they are, each fault with its place.
        Error::Input(_) | Error::Internal(_) => report(&error.to_string()),
        _ => report(&format!("error: {error}")),
    }
}
