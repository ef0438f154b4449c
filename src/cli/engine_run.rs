//! The engine's run that is measured against a reference. Batches of fixed work, frames between them: nothing runs beside the engine,
//! so that its CPU time is its own, and the same seed gives the same images.

use crate::error::{Error, Result};
use crate::refine::update::EngineStats;
use crate::session::{Observer, Session};
use glam::Vec3;

/// Whoever measures a run: each frame that it wants a picture of.
pub trait Measuring: Observer {
    /// Takes what the picture shows.
    ///
    /// # Errors
    /// The picture cannot be read or compared.
    fn measure(&mut self, session: &mut Session, stats: &EngineStats) -> Result<()>;

    /// Whether the run ends with the frame.
    fn is_last(&self, stats: &EngineStats) -> bool;
}

/// Steps a session until its measuring is done, or broken off: `false` then.
///
/// # Errors
/// As [`Session::step`], or what could not be measured.
pub fn follow(
    session: &mut Session,
    measuring: &mut impl Measuring,
    goes_on: &dyn Fn(&EngineStats) -> bool,
) -> Result<bool> {
    loop {
        let stats = session.step(measuring)?.engine;
        if measuring.wants_picture(&stats) {
            measuring.measure(session, &stats)?;
        }
        if !goes_on(&stats) {
            return Ok(false);
        }
        if measuring.is_last(&stats) {
            return Ok(true);
        }
    }
}

/// The picture of a session's last frame, W·sr⁻¹·m⁻².
///
/// # Errors
/// The device is lost.
pub fn combined(session: &mut Session) -> Result<Vec<Vec3>> {
    let combined = session.renderer_mut().read_layers()?.combined;
    Ok(combined.iter().map(|&[r, g, b, _]| Vec3::new(r, g, b)).collect())
}

/// No pixel that counts is finite.
#[must_use]
pub fn nothing_to_compare() -> Error {
    Error::Usage("no pixel is left to compare".to_owned())
}
