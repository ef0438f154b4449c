//! The frame log of what was shown, and the summary beside it.

use crate::error::Result;
use crate::log::summary::Summary;
use crate::session::{FrameReport, RunLog, Session, thread_times};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// A log being written.
pub struct Log {
    rows: RunLog,
    /// What is known before anything is shown.
    summary: Summary,
    path: PathBuf,
    /// When the process was started.
    start: Instant,
}

impl Log {
    /// Starts a log.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`] if it cannot be written.
    pub fn create(path: &Path, summary: Summary, start: Instant) -> Result<Self> {
        Ok(Self { rows: RunLog::create(path, None)?, summary, path: path.to_owned(), start })
    }

    /// Writes the row of the frame that a session has just drawn.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`] if it cannot be written.
    pub fn frame(&mut self, session: &mut Session, report: &FrameReport) -> Result<()> {
        self.rows.row(session, report)
    }

    /// Writes the summary of a session that is over.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`] naming the file.
    pub fn finish(mut self, session: &Session) -> Result<()> {
        let totals = session.totals();
        self.summary.cpu.threads = thread_times(totals.engine.own_job_seconds);
        totals.summarise(&mut self.summary, session.renderer().device(), session.options(), self.start);
        self.summary.write(&Summary::path_beside(&self.path))
    }
}
