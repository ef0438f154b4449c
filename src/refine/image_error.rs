//! Running sums over the visible leaves, in which the image's error is estimated.

use super::priority::LeafLight;
use crate::cache::topology::Work;

/// Sums over the image, weighted by pixels.
#[derive(Clone, Copy, Debug, Default)]
pub struct ImageError {
    pixels: f64,
    light: f64,
    error: f64,
}

impl ImageError {
    /// Replaces what a leaf contributed by what it contributes now; `light` is `None` for one that is no leaf any more or
    /// not visible.
    pub fn replace(&mut self, work: &mut Work, light: Option<LeafLight>) {
        self.pixels -= work.accounted;
        self.light -= work.light;
        self.error -= work.error;
        let pixels = light.map_or(0.0, |_| f64::from(work.pixels));
        work.accounted = pixels;
        work.light = light.map_or(0.0, |l| pixels * f64::from(l.mean));
        work.error = light.map_or(0.0, |l| pixels * f64::from(l.interpolation + l.noise));
        self.pixels += work.accounted;
        self.light += work.light;
        self.error += work.error;
    }

    /// Replaces what a leaf of the mesh of indirect light contributed, `pixels × square error`.
    pub fn replace_indirect(&mut self, accounted: &mut f64, error: f64) {
        self.error += error - *accounted;
        *accounted = error;
    }

    /// Mean shown luminance of the image.
    #[must_use]
    pub fn mean(&self) -> f32 {
        if self.pixels > 0.0 { (self.light / self.pixels).max(0.0) as f32 } else { 0.0 }
    }

    /// Expected RMSE over the mean.
    #[must_use]
    pub fn relative(&self) -> Option<f32> {
        let known = self.pixels > 0.0 && self.light > 0.0;
        known.then(|| ((self.error.max(0.0) / self.pixels).sqrt() / (self.light / self.pixels)) as f32)
    }
}
