//! Faults of one file, of which those beyond the tenth of a kind are only counted.

use crate::scene::report::{Report, Severity};
use std::path::{Path, PathBuf};

/// Faults of one kind that are listed one by one.
const LISTED: usize = 10;

/// What is wrong with a file.
#[derive(Debug)]
pub(super) struct Faults {
    file: PathBuf,
    report: Report,
    /// Kinds with how many there are, in the order of appearance.
    kinds: Vec<(&'static str, Severity, usize)>,
}

impl Faults {
    /// No faults of `file` yet.
    pub(super) fn new(file: &Path) -> Self {
        Self { file: file.to_owned(), report: Report::default(), kinds: Vec::new() }
    }

    /// Notes a fault that refuses the scene.
    pub(super) fn error(&mut self, kind: &'static str, message: impl Into<String>) {
        if self.is_listed(kind, Severity::Error) {
            self.report.error(&self.file, None, message);
        }
    }

    /// Notes a fault that the scene can be drawn with.
    pub(super) fn warn(&mut self, kind: &'static str, message: impl Into<String>) {
        if self.is_listed(kind, Severity::Warning) {
            self.report.warn(&self.file, None, message);
        }
    }

    /// Notes that a simpler model stands in for what the file asks for.
    pub(super) fn stand_in(&mut self, message: impl Into<String>) {
        self.report.stand_in(&self.file, None, message);
    }

    /// Notes what holds for the whole file.
    pub(super) fn once(&mut self, kind: &'static str, message: impl Into<String>) {
        if self.kinds.iter().all(|(known, ..)| *known != kind) {
            self.warn(kind, message);
        }
    }

    fn is_listed(&mut self, kind: &'static str, severity: Severity) -> bool {
        let at = self.kinds.iter().position(|&(known, of, _)| known == kind && of == severity).unwrap_or_else(|| {
            self.kinds.push((kind, severity, 0));
            self.kinds.len() - 1
        });
        self.kinds[at].2 += 1;
        self.kinds[at].2 <= LISTED
    }

    /// Whether something refuses the scene.
    pub(super) fn has_errors(&self) -> bool {
        self.report.has_errors()
    }

    /// The report, with one line for the hidden faults of each kind.
    pub(super) fn finish(mut self) -> Report {
        for (kind, severity, count) in self.kinds {
            let more = count.saturating_sub(LISTED);
            match severity {
                _ if more == 0 => {}
                Severity::Error => self.report.error(&self.file, None, format!("{kind}: and {more} more like it")),
                _ => self.report.warn(&self.file, None, format!("{kind}: and {more} more like it")),
            }
        }
        self.report
    }
}
