//! The frame log of a run, with its error columns.

use super::Session;
use super::error_meter::ErrorMeter;
use super::frame::FrameReport;
use crate::error::Result;
use crate::log::frame_log::FrameLog;
use std::path::Path;

/// A log being written.
pub struct RunLog {
    log: FrameLog,
    /// Reference of the same view.
    reference: Option<ErrorMeter>,
}

impl RunLog {
    /// Starts a log.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`] if it cannot be written.
    pub fn create(path: &Path, reference: Option<ErrorMeter>) -> Result<Self> {
        Ok(Self { log: FrameLog::create(path, reference.is_some())?, reference })
    }

    /// Writes the row of the frame that a session has just drawn; its error, if it made a picture.
    ///
    /// # Errors
    /// The log cannot be written, the device is lost, or no pixel is left to compare.
    pub fn row(&mut self, session: &mut Session, report: &FrameReport) -> Result<()> {
        let error = match &mut self.reference {
            Some(reference) if report.combined => {
                Some(reference.measure(&session.renderer_mut().read_layers()?, report.ended_by.is_some())?)
            }
            _ => None,
        };
        self.log.record(&report.record(session.memory_bytes(), error))
    }
}
