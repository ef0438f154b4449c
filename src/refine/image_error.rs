//! Running sums over the visible leaves, in which the image's error is estimated.

use crate::cache::topology::Work;

/// Sums over the image, weighted by pixels.
#[derive(Clone, Copy, Debug, Default)]
pub struct ImageError {
    pixels: f64,
    light: f64,
    error: f64,
    /// Of what leaves show that may hide something, squared.
    unseen: f64,
}

/// What a leaf adds to the sums, a pixel.
#[derive(Clone, Copy, Debug)]
pub struct LeafError {
    /// Mean shown luminance.
    pub light: f32,
    /// Expected square error.
    pub error: f32,
    /// What it is judged by if it hides something, squared; 0 if it is known to hide nothing.
    pub unseen: f32,
}

impl ImageError {
    /// Replaces what a leaf contributed by what it contributes now; `light` is `None` for one that is no leaf any more or
    /// not visible.
    pub fn replace(&mut self, work: &mut Work, leaf: Option<LeafError>) {
        self.pixels -= work.accounted;
        self.light -= work.light;
        self.error -= work.error;
        self.unseen -= work.unseen;
        let pixels = leaf.map_or(0.0, |_| f64::from(work.pixels));
        work.accounted = pixels;
        work.light = leaf.map_or(0.0, |l| pixels * f64::from(l.light));
        work.error = leaf.map_or(0.0, |l| pixels * f64::from(l.error));
        work.unseen = leaf.map_or(0.0, |l| pixels * f64::from(l.unseen));
        self.pixels += work.accounted;
        self.light += work.light;
        self.error += work.error;
        self.unseen += work.unseen;
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

    /// Expected RMSE over the mean; what is hidden has an expected square error of `hidden` times what it is judged by.
    #[must_use]
    pub fn relative(&self, hidden: f32) -> Option<f32> {
        let known = self.pixels > 0.0 && self.light > 0.0;
        let error = self.error.max(0.0) + f64::from(hidden) * self.unseen.max(0.0);
        known.then(|| ((error / self.pixels).sqrt() / (self.light / self.pixels)) as f32)
    }
}
