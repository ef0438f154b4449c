//! What errors are measured against: the pixels of a reference that count, and how noisy it is itself.

use crate::image::exr::RgbImage;
use crate::image::metrics::{Epsilon, compare, own_noise};
use glam::Vec3;

/// A reference with the pixels that count.
#[derive(Clone, Debug)]
pub struct ReferencePixels {
    image: RgbImage,
    counts: Vec<bool>,
    /// Mean over the pixels and channels that count.
    mean: f64,
    epsilon: Epsilon,
    /// What the reference's own noise makes of relMSE and of the mean square error.
    noise: (f64, f64),
}

/// Error of an image, the reference's own noise taken off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Error {
    /// relMSE; at or below 0 where the reference's noise is all there is.
    pub relmse: f64,
    /// Root mean square error over the reference's mean; 0 there.
    pub rmse_over_mean: f64,
    /// Mean of image − reference over the reference's mean.
    pub mean_shift: f64,
}

impl ReferencePixels {
    /// Measures against the pixels of a reference that count; `None` where none is left, or all are black.
    #[must_use]
    pub fn new(image: RgbImage) -> Option<Self> {
        let counts = image.counted().unwrap_or_else(|| vec![true; image.size.pixels()]);
        let metrics = compare(&image.rgb, &image.rgb, Some(&counts), Epsilon::default())?;
        let mean = metrics.reference_mean;
        let epsilon = Epsilon::Absolute(Epsilon::default().resolve(mean) as f32);
        let reference_pixels = Self { image, counts, mean, epsilon, noise: (0.0, 0.0) };
        (mean > 0.0).then(|| reference_pixels.with_noise())
    }

    fn with_noise(mut self) -> Self {
        let variance = self.image.variance.as_ref();
        let noise = variance.and_then(|v| own_noise(&self.image.rgb, v, Some(&self.counts), self.epsilon));
        self.noise = noise.map_or((0.0, 0.0), |noise| (noise.relmse, noise.mean_square));
        self
    }

    /// The same with no other pixels than these, relative to the same mean.
    #[must_use]
    pub fn of(&self, pixels: &[u32]) -> Self {
        let mut part = self.clone();
        part.counts.fill(false);
        pixels.iter().for_each(|&i| part.counts[i as usize] = self.counts[i as usize]);
        part.with_noise()
    }

    /// Those of some pixels that count.
    #[must_use]
    pub fn counted_among(&self, pixels: &[u32]) -> Vec<u32> {
        pixels.iter().copied().filter(|&i| self.counts[i as usize]).collect()
    }

    /// Pixels that count.
    #[must_use]
    pub fn counted(&self) -> usize {
        self.counts.iter().filter(|&&counts| counts).count()
    }

    /// Which pixels count.
    #[must_use]
    pub fn counts(&self) -> &[bool] {
        &self.counts
    }

    /// relMSE that the reference's own noise makes, by its variance.
    #[must_use]
    pub const fn own_relmse(&self) -> f64 {
        self.noise.0
    }

    /// The reference.
    #[must_use]
    pub const fn image(&self) -> &RgbImage {
        &self.image
    }

    /// Error of an image of the same size; `None` where no pixel that counts is finite.
    ///
    /// # Panics
    /// If the image has another number of pixels.
    #[must_use]
    pub fn error(&self, image: &[Vec3]) -> Option<Error> {
        let metrics = compare(image, &self.image.rgb, Some(&self.counts), self.epsilon)?;
        let (relmse, mean_square) = self.noise;
        Some(Error {
            relmse: metrics.relmse - relmse,
            rmse_over_mean: (metrics.rmse.powi(2) - mean_square).max(0.0).sqrt() / self.mean,
            mean_shift: metrics.mean_shift / self.mean,
        })
    }

    /// relMSE of each pixel that counts and is finite, the reference's own noise taken off, in their order: the mean is that of
    /// [`Self::error`].
    ///
    /// # Panics
    /// If the image has another number of pixels.
    #[must_use]
    pub fn relmse_of_pixels(&self, image: &[Vec3]) -> Vec<f64> {
        assert_eq!(image.len(), self.counts.len(), "images of one size");
        let reference = &self.image.rgb;
        let variance = |i: usize| self.image.variance.as_ref().map_or(Vec3::ZERO, |variance| variance[i]);
        let epsilon = self.epsilon.resolve(self.mean);
        let relmse = |i: usize| {
            let of_channel = |c: usize| {
                let [x, r, v] = [image[i], reference[i], variance(i)].map(|value| f64::from(value[c]));
                ((x - r).powi(2) - v) / (r * r + epsilon)
            };
            (0..3).map(of_channel).sum::<f64>() / 3.0
        };
        let counts = |i: &usize| self.counts[*i] && image[*i].is_finite() && reference[*i].is_finite();
        (0..image.len()).filter(counts).map(relmse).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::camera::ImageSize;

    fn reference_pixels() -> ReferencePixels {
        let size = ImageSize { width: 3, height: 1 };
        let rgb = vec![Vec3::ONE, Vec3::splat(3.0), Vec3::splat(50.0)];
        let variance = Some(vec![Vec3::splat(0.04), Vec3::splat(0.12), Vec3::ONE]);
        let image = RgbImage { size, rgb, variance, mask: Some(vec![true, true, false]), sampled: None };
        ReferencePixels::new(image).expect("pixels")
    }

    #[test]
    fn the_noise_of_the_reference_is_taken_off() {
        let reference_pixels = reference_pixels();
        // Mean 2, ε 0.04.
        assert_eq!((reference_pixels.counted(), reference_pixels.mean), (2, 2.0));
        assert!((reference_pixels.own_relmse() - (0.04 / 1.04 + 0.12 / 9.04) / 2.0).abs() < 1e-8);
        let error = reference_pixels.error(&[Vec3::splat(2.0), Vec3::splat(3.0), Vec3::ZERO]).expect("pixels");
        assert!((error.relmse - ((1.0 - 0.04) / 1.04 - 0.12 / 9.04) / 2.0).abs() < 1e-8, "{error:?}");
        assert!((error.rmse_over_mean - (0.5_f64 - 0.08).sqrt() / 2.0).abs() < 1e-8, "{error:?}");
        assert!((error.mean_shift - 0.25).abs() < 1e-8, "{error:?}");
        let of_pixels = reference_pixels.relmse_of_pixels(&[Vec3::splat(2.0), Vec3::splat(3.0), Vec3::ZERO]);
        assert_eq!(of_pixels.len(), 2);
        assert!((of_pixels.iter().sum::<f64>() / 2.0 - error.relmse).abs() < 1e-8, "{of_pixels:?}");
        let same = reference_pixels.error(&reference_pixels.image.rgb).expect("pixels");
        assert_eq!((same.relmse, same.rmse_over_mean), (-reference_pixels.own_relmse(), 0.0));
    }

    #[test]
    fn a_part_is_related_to_the_whole_mean() {
        let reference_pixels = reference_pixels();
        assert_eq!(reference_pixels.counted_among(&[0, 1, 2]), [0, 1]);
        let part = reference_pixels.of(&[0, 2]);
        assert_eq!((part.counted(), part.mean), (1, 2.0));
        let error = part.error(&[Vec3::splat(2.0), Vec3::ZERO, Vec3::ZERO]).expect("pixels");
        assert!((error.relmse - (1.0 - 0.04) / 1.04).abs() < 1e-7, "{error:?}");
        let black = RgbImage { rgb: vec![Vec3::ZERO; 3], ..reference_pixels.image };
        assert!(ReferencePixels::new(black).is_none());
    }
}
