//! The errors that end a command, and the exit status of each.

use crate::scene::report::Report;
use std::path::{Path, PathBuf};

/// Why a command ended without doing what it was asked.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A wrong option or combination of options.
    #[error("{0}")]
    Usage(String),
    /// A scene or image that cannot be used; every fault is listed.
    #[error("{}", list_faults(.0))]
    Input(Report),
    /// A file that cannot be read or written.
    #[error("{}: {doing}: {source}", .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What failed, e.g. "cannot read".
        doing: &'static str,
        /// The system's reason.
        source: std::io::Error,
    },
    /// No usable Vulkan device, or a feature is lacking; the message says what to install.
    #[error("{0}")]
    NoDevice(String),
    /// No window can be opened: no display, or a library of the window system is missing; the message says what to install.
    #[error("{0}")]
    NoWindow(String),
    /// The device was lost: what was sent to it can be sent to another.
    #[error("{0}")]
    DeviceLost(String),
    /// Memory or threads ran out.
    #[error("{0}")]
    Exhausted(String),
    /// A fault of the program.
    #[error("internal error: {0}; please report it with the command line")]
    Internal(String),
}

/// Result of everything that can end a command.
pub type Result<T, E = Error> = std::result::Result<T, E>;

impl Error {
    /// The process exit status (interface: 2 usage or input, 3 device, 4 exhausted, 70 internal).
    #[must_use]
    pub const fn exit_status(&self) -> u8 {
        match self {
            Self::Usage(_) | Self::Input(_) | Self::Io { .. } => 2,
            Self::NoDevice(_) | Self::NoWindow(_) => 3,
            Self::DeviceLost(_) | Self::Exhausted(_) => 4,
            Self::Internal(_) => 70,
        }
    }

    /// An I/O error with its file; `doing` as in "cannot read".
    #[must_use]
    pub fn io(path: &Path, doing: &'static str, source: std::io::Error) -> Self {
        Self::Io { path: path.to_owned(), doing, source }
    }
}

fn list_faults(report: &Report) -> String {
    let lines: Vec<String> = report.faults.iter().map(ToString::to_string).collect();
    lines.join("\n")
}
