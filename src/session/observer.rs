//! Who watches a run, and may end it.

use super::Session;
use super::frame::FrameReport;
use crate::error::Result;
use crate::refine::update::EngineStats;
use std::time::Duration;

/// What a session asks and tells while it runs; every part has a default that wants nothing.
pub trait Observer {
    /// Whether the run is to end after the present frame. Asked once a frame, and while the first one waits.
    fn interrupted(&self) -> bool {
        false
    }

    /// Told, several times a second, that the first frame still waits for the engine to be made, and for how long it has.
    fn waits(&mut self, _elapsed: Duration) {}

    /// Told, several times a second, how far the engine is while no frame is drawn.
    fn works(&mut self, _elapsed: Duration, _stats: &EngineStats) {}

    /// Whether the coming frame is to show all that is known, in a picture, whatever is due. Asked once a frame, with the engine's
    /// totals.
    fn wants_picture(&mut self, _stats: &EngineStats) -> bool {
        false
    }

    /// Told of each frame by [`Session::run`]; the session can be looked at and read.
    ///
    /// # Errors
    /// What the observer cannot do, such as writing a log, ends the run.
    fn frame(&mut self, _session: &mut Session, _report: &FrameReport) -> Result<()> {
        Ok(())
    }
}

/// Nobody: the run ends by its budget.
#[derive(Clone, Copy, Debug, Default)]
pub struct Unobserved;

impl Observer for Unobserved {}
