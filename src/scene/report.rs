//! Faults of the input: every one with its place, all reported at once.

use std::fmt;
use std::path::{Path, PathBuf};

/// Where in the input something is wrong.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// File.
    pub file: PathBuf,
    /// Line, from 1; `None` when the whole file is meant.
    pub line: Option<u32>,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.line {
            Some(line) => write!(f, "{}:{line}", self.file.display()),
            None => write!(f, "{}", self.file.display()),
        }
    }
}

/// Whether a fault refuses the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Severity {
    /// The scene can be drawn without it, or with a stand-in.
    Warning,
    /// The scene cannot be drawn.
    Error,
}

/// One thing wrong: what, where, what to do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// Whether it refuses the scene.
    pub severity: Severity,
    /// Where.
    pub place: Place,
    /// What is wrong and what to do, without a full stop at the end.
    pub message: String,
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kind = match self.severity {
            Severity::Warning => "warning",
            Severity::Error => "error",
        };
        write!(f, "{}: {kind}: {}", self.place, self.message)
    }
}

/// The faults found while loading, in the order in which they were found.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Report {
    /// All of them.
    pub faults: Vec<Fault>,
}

impl Report {
    /// Notes a fault that refuses the scene.
    pub fn error(&mut self, file: &Path, line: Option<u32>, message: impl Into<String>) {
        self.push(Severity::Error, file, line, message.into());
    }

    /// Notes a fault that the scene can be drawn with.
    pub fn warn(&mut self, file: &Path, line: Option<u32>, message: impl Into<String>) {
        self.push(Severity::Warning, file, line, message.into());
    }

    fn push(&mut self, severity: Severity, file: &Path, line: Option<u32>, message: String) {
        self.faults.push(Fault { severity, place: Place { file: file.to_owned(), line }, message });
    }

    /// Whether any fault refuses the scene.
    #[must_use]
    pub fn has_errors(&self) -> bool {
        self.faults.iter().any(|f| f.severity == Severity::Error)
    }
}
