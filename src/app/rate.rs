//! How fast pictures come: what a clock tells, and no script played without one shows.

use crate::pass::FrameStats;

/// How fast pictures come.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rate {
    /// Pictures a second.
    pub pictures: f64,
    /// Milliseconds that the last took, without waiting for the display.
    pub frame_ms: f64,
    /// Rays a second.
    pub rays: f64,
    /// What the passes took when they last ran.
    pub passes: PassTimes,
    /// Memory of the process, bytes.
    pub resident: Option<u64>,
}

/// Milliseconds of the passes when they last ran, by the device's clock.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PassTimes {
    /// Of the visibility pass.
    pub visibility: Option<f64>,
    /// Of the colour pass.
    pub colour: Option<f64>,
    /// Of the luminance pass.
    pub luminance: Option<f64>,
    /// Of the combine pass.
    pub combine: Option<f64>,
}

impl PassTimes {
    /// Takes in those that ran in a frame.
    pub fn note(&mut self, frame: &FrameStats) {
        self.visibility = frame.visibility_ms.or(self.visibility);
        self.colour = frame.colour_ms.or(self.colour);
        self.luminance = frame.luminance_ms.or(self.luminance);
        self.combine = frame.combine_ms.or(self.combine);
    }
}
