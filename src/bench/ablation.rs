//! What is lost without a piece of the engine: its error after some rays against that with the piece, seed by seed.

use super::figure::Figure;
use super::reference_pixels::ReferencePixels;
use glam::Vec3;
use serde::Serialize;

/// Error of the engine's image after some rays, without the reference's own noise.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Measured {
    /// Rays traced.
    pub rays: u64,
    /// relMSE; at or below 0 where the reference's noise is all there is.
    pub relmse: f64,
    /// The same without the share of the pixels that is worst: single ones may hold most of it.
    pub trimmed: f64,
    /// Mean of image − reference over the reference's mean.
    pub mean_shift: f64,
}

impl Measured {
    /// Measures an image, the worst `trim` of the pixels left out of the trimmed error; `None` where no pixel that counts is finite.
    #[must_use]
    pub fn new(reference_pixels: &ReferencePixels, image: &[Vec3], rays: u64, trim: f64) -> Option<Self> {
        let error = reference_pixels.error(image)?;
        let trimmed = trimmed_mean(reference_pixels.relmse_of_pixels(image), trim);
        Some(Self { rays, relmse: error.relmse, trimmed, mean_shift: error.mean_shift })
    }

    /// What lies a share of the way to another.
    fn towards(self, other: Self, share: f64) -> Self {
        let between = |a: f64, b: f64| a + (b - a) * share;
        Self {
            rays: between(self.rays as f64, other.rays as f64).round() as u64,
            relmse: between(self.relmse, other.relmse),
            trimmed: between(self.trimmed, other.trimmed),
            mean_shift: between(self.mean_shift, other.mean_shift),
        }
    }
}

/// The error after so many rays, between what was measured before and after by the straight line; the first or the last where that is
/// on one side only. Points rise in rays.
#[must_use]
pub fn after_rays(points: &[Measured], rays: u64) -> Option<Measured> {
    let next = points.iter().position(|point| point.rays >= rays);
    match next {
        Some(next) if next > 0 => {
            let (before, after) = (points[next - 1], points[next]);
            Some(before.towards(after, (rays - before.rays) as f64 / (after.rays - before.rays) as f64))
        }
        Some(next) => Some(points[next]),
        None => points.last().copied(),
    }
}

/// Mean of values without the share of them that is greatest.
fn trimmed_mean(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    let kept = values.len() - (values.len() as f64 * share) as usize;
    values[..kept].iter().sum::<f64>() / kept as f64
}

/// A figure over the seeds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Spread {
    /// The median.
    pub median: f64,
    /// The least.
    pub least: f64,
    /// The greatest.
    pub greatest: f64,
}

impl Spread {
    /// From one value a seed; with none, not numbers.
    #[must_use]
    pub fn of(values: &[f64]) -> Self {
        Self {
            median: Figure::of(values.to_vec()).median,
            least: values.iter().copied().fold(f64::NAN, f64::min),
            greatest: values.iter().copied().fold(f64::NAN, f64::max),
        }
    }

    /// Of the ratios of errors without a piece to those with it, seed by seed; `None` where any of the latter is lost in noise.
    #[must_use]
    pub fn of_ratios(without: &[f64], with: &[f64]) -> Option<Self> {
        let ratios: Vec<f64> = without.iter().zip(with).map(|(without, with)| without / with).collect();
        with.iter().all(|with| *with > 0.0).then(|| Self::of(&ratios))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::exr::RgbImage;
    use crate::scene::camera::ImageSize;

    #[test]
    fn the_greatest_are_left_out() {
        let values = || vec![4.0, 1.0, 100.0, 3.0, 2.0];
        assert_eq!([0.0, 0.19, 0.2, 0.5, 0.99].map(|share| trimmed_mean(values(), share)), [22.0, 22.0, 2.5, 2.0, 1.0]);
    }

    #[test]
    fn an_image_is_measured_whole_and_trimmed() {
        // Mean 2, ε 0.04.
        let rgb = [1.0, 1.0, 3.0, 3.0].map(Vec3::splat).to_vec();
        let size = ImageSize { width: 4, height: 1 };
        let reference = RgbImage { size, rgb, variance: None, mask: None, sampled: None };
        let reference_pixels = ReferencePixels::new(reference).unwrap();
        let image = [1.1, 1.0, 3.0, 6.0].map(Vec3::splat);
        let found = Measured::new(&reference_pixels, &image, 7, 0.25).unwrap();
        let (small, large) = (0.01 / 1.04, 9.0 / 9.04);
        assert!((found.relmse - (small + large) / 4.0).abs() < 1e-6, "{found:?}");
        assert!((found.trimmed - small / 3.0).abs() < 1e-6, "{found:?}");
        assert!((found.mean_shift - 3.1 / 4.0 / 2.0).abs() < 1e-6 && found.rays == 7, "{found:?}");
    }

    #[test]
    fn errors_are_those_of_as_many_rays() {
        let point = |rays, relmse| Measured { rays, relmse, trimmed: relmse / 2.0, mean_shift: -relmse };
        let points = [point(100, 1.0), point(200, 0.5), point(300, 0.25)];
        assert_eq!(after_rays(&points, 200), Some(points[1]));
        assert_eq!(after_rays(&points, 250), Some(point(250, 0.375)));
        assert_eq!((after_rays(&points, 50), after_rays(&points, 900)), (Some(points[0]), Some(points[2])));
        assert_eq!(after_rays(&[], 1), None);
    }

    #[test]
    fn ratios_are_of_the_same_seed() {
        let ratios = Spread::of_ratios(&[2.0, 3.0, 16.0], &[1.0, 2.0, 4.0]);
        assert_eq!(ratios, Some(Spread { median: 2.0, least: 1.5, greatest: 4.0 }));
        assert_eq!(Spread::of_ratios(&[1.0, 1.0], &[1.0, 0.0]), None);
        assert_eq!(Spread::of(&[0.5]), Spread { median: 0.5, least: 0.5, greatest: 0.5 });
    }
}
