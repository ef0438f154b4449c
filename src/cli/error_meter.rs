//! The reference of `render --reference`: error columns of the frame log.

use crate::error::{Error, Result};
use crate::image::exr::RgbImage;
use crate::image::flip;
use crate::image::metrics::{Epsilon, compare};
use crate::log::frame_log::FrameError;
use crate::pass::Layers;
use crate::scene::Display;
use glam::Vec3;
use std::time::{Duration, Instant};

/// FLIP is measured when this many times its own duration has passed since the last time: it may cost 5 % of the run.
const FLIP_PAUSE: u32 = 20;

/// A reference image, as radiance and as displayed.
pub struct ErrorMeter {
    image: RgbImage,
    /// Which pixels count; `None` if all do.
    counted: Option<Vec<bool>>,
    display: Display,
    displayed: Vec<[u8; 3]>,
    flip_due: Option<Instant>,
}

impl ErrorMeter {
    /// Measures against `image`, displayed as the run's pictures are.
    #[must_use]
    pub fn new(image: RgbImage, display: Display) -> Self {
        let (counted, displayed) = (image.counted(), flip::displayed(&image.rgb, &display));
        Self { image, counted, display, displayed, flip_due: None }
    }

    /// How many pixels are compared of how many, for the user.
    #[must_use]
    pub fn describe(&self) -> String {
        let all = self.image.size.pixels();
        let counted = self.counted.as_ref().map_or(all, |flags| flags.iter().filter(|&&counts| counts).count());
        format!("--reference: {counted} of {all} pixels compared")
    }

    /// Error of a frame over the pixels that count. FLIP when it is due, and in the `last` one; never against a reference that
    /// has a part of the pixels only, since it looks at their surroundings.
    ///
    /// # Errors
    /// [`Error::Usage`] when no pixel is left to count.
    pub fn measure(&mut self, frame: &Layers, last: bool) -> Result<FrameError> {
        let pixels: Vec<Vec3> = frame.combined.iter().map(|&[r, g, b, _]| Vec3::new(r, g, b)).collect();
        let mask = self.counted.as_deref();
        let metrics = compare(&pixels, &self.image.rgb, mask, Epsilon::default())
            .ok_or_else(|| Error::Usage("--reference: no pixel left to compare".to_owned()))?;
        let due = self.image.sampled.is_none() && (last || self.flip_due.is_none_or(|due| Instant::now() >= due));
        let flip = if due { self.flip(&pixels) } else { None };
        Ok(FrameError { rmse: metrics.rmse, relmse: metrics.relmse, flip })
    }

    fn flip(&mut self, pixels: &[Vec3]) -> Option<f64> {
        let start = Instant::now();
        let map = flip::error_map(&flip::displayed(pixels, &self.display), &self.displayed, self.image.size);
        let pause = (start.elapsed() * FLIP_PAUSE).min(Duration::from_secs(3600));
        self.flip_due = Some(Instant::now() + pause);
        flip::mean(&map, self.counted.as_deref())
    }
}
