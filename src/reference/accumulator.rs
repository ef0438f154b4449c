//! A reference image while it is sampled: sums of each pixel.

use super::path::{Sample, Tracer};
use super::settings::Settings;
use crate::light::context::SceneContext;
use crate::math::combine;
use crate::scene::camera::{ImageSize, View};
use glam::{DVec3, Vec3, Vec4};
use rayon::prelude::*;

/// Running sums of one pixel, in double precision: a million samples must not drown the next one, nor the variance.
#[derive(Clone, Copy, Debug, Default)]
struct PixelSums {
    sum: DVec3,
    square: DVec3,
    hits: u32,
    emitters: u32,
    tied: bool,
}

/// A reference image while it is sampled: sums over passes of one sample a pixel, of all pixels or of some.
pub struct Accumulator {
    size: ImageSize,
    /// Index of each pixel that is sampled, row by row.
    indices: Vec<u32>,
    /// Sums of each of them.
    pixels: Vec<PixelSums>,
    samples: u32,
}

/// Pixels that a thread samples at a time.
const RUN: usize = 256;

/// `count` pixels of an image (all, if it has no more), drawn uniformly without replacement: always the same ones of an image
/// of this size, so that runs with different random numbers add up; those of a smaller count are among those of a larger.
#[must_use]
pub fn random_pixels(size: ImageSize, count: usize) -> Vec<u32> {
    /// Any number: another one would give another choice.
    const CHOICE: u64 = 0x7069_7865_6c73;
    let mut indices: Vec<u32> = (0..size.pixels() as u32).collect();
    if count < indices.len() {
        indices.select_nth_unstable_by_key(count, |&i| combine(CHOICE, i.into()));
        indices.truncate(count);
        indices.sort_unstable();
    }
    indices
}

/// Mean and variance of the mean, pixel by pixel.
#[derive(Clone, Debug, Default)]
pub struct ReferenceImage {
    /// Mean radiance, W·sr⁻¹·m⁻², and the share of the pixel that geometry covers.
    pub mean: Vec<Vec4>,
    /// Variance of the mean, each channel, (W·sr⁻¹·m⁻²)², as if samples were independent. They are spread more evenly
    /// than that, so it is an upper bound on average; 0 after a single sample.
    pub variance: Vec<Vec3>,
    /// Whether a pixel counts in comparisons: sampled, covered in every sample, no emitter seen directly, and no edge through
    /// a centre at which it is sampled, where raster and ray may show different sides.
    pub mask: Vec<bool>,
    /// Whether a pixel was sampled; all else is 0 where not. `None` if all were.
    pub sampled: Option<Vec<bool>>,
}

/// What a pass did.
#[derive(Clone, Copy, Debug)]
pub struct Pass {
    /// Rays traced.
    pub rays: u64,
    /// Whether it ran to its end.
    pub finished: bool,
}

impl Accumulator {
    /// Nothing sampled yet of an image.
    #[must_use]
    pub fn new(view: &View) -> Self {
        Self::over(view, (0..view.size.pixels() as u32).collect())
    }

    /// Nothing sampled yet of some pixels of an image, by their indices, row by row. Each gets the samples that it would get
    /// among all.
    ///
    /// # Panics
    /// If an index is beyond the image.
    #[must_use]
    pub fn over(view: &View, indices: Vec<u32>) -> Self {
        assert!(indices.iter().all(|&i| (i as usize) < view.size.pixels()), "pixels of the image");
        let pixels = vec![PixelSums::default(); indices.len()];
        Self { size: view.size, indices, pixels, samples: 0 }
    }

    /// Samples taken a pixel.
    #[must_use]
    pub const fn samples(&self) -> u32 {
        self.samples
    }

    /// Takes one more sample a pixel on the current thread pool; the same whatever the number of threads. `stop` is asked
    /// every few pixels: a pass that it breaks off is left out entirely.
    pub fn pass(
        &mut self,
        context: &SceneContext<'_>,
        view: &View,
        settings: Settings,
        stop: impl Fn() -> bool + Sync,
    ) -> Pass {
        let index = self.samples;
        let runs: Vec<Option<(Vec<Sample>, u64)>> = self
            .indices
            .par_chunks(RUN)
            .map(|pixels| {
                (!stop()).then(|| {
                    let mut tracer = Tracer::new(context, settings);
                    let mut samples = Vec::with_capacity(pixels.len());
                    tracer.pixels(view, pixels, index, &mut samples);
                    (samples, tracer.rays())
                })
            })
            .collect();
        let Some(runs) = runs.into_iter().collect::<Option<Vec<_>>>() else { return Pass { rays: 0, finished: false } };
        let samples = runs.iter().flat_map(|(samples, _)| samples);
        self.pixels.iter_mut().zip(samples).for_each(|(pixel, sample)| pixel.add(sample));
        self.samples += 1;
        Pass { rays: runs.iter().map(|(_, rays)| rays).sum(), finished: true }
    }

    /// The pixels that are sampled, by their indices, each with its mean radiance so far, W·sr⁻¹·m⁻², and coverage.
    pub fn means(&self) -> impl Iterator<Item = (u32, Vec4)> {
        let pixels = self.indices.iter().zip(&self.pixels);
        pixels.map(|(&index, pixel)| (index, pixel.mean_and_variance(self.samples).0))
    }

    /// The image so far.
    #[must_use]
    pub fn image(&self) -> ReferenceImage {
        let count = self.size.pixels();
        let complete = self.indices.len() == count;
        let mut image = ReferenceImage {
            mean: vec![Vec4::ZERO; count],
            variance: vec![Vec3::ZERO; count],
            mask: vec![false; count],
            sampled: (!complete).then(|| vec![false; count]),
        };
        for (&i, pixel) in self.indices.iter().zip(&self.pixels) {
            let i = i as usize;
            (image.mean[i], image.variance[i]) = pixel.mean_and_variance(self.samples);
            image.mask[i] = pixel.counts(self.samples);
            if let Some(sampled) = &mut image.sampled {
                sampled[i] = true;
            }
        }
        image
    }
}

impl PixelSums {
    /// Mean radiance, W·sr⁻¹·m⁻², and coverage; variance of the mean, (W·sr⁻¹·m⁻²)².
    fn mean_and_variance(&self, samples: u32) -> (Vec4, Vec3) {
        let n = f64::from(samples.max(1));
        let mean = self.sum / n;
        let variance = (self.square / n - mean * mean).max(DVec3::ZERO) / (n - 1.0).max(1.0);
        (mean.as_vec3().extend((f64::from(self.hits) / n) as f32), variance.as_vec3())
    }

    /// Whether the pixel counts in comparisons.
    const fn counts(&self, samples: u32) -> bool {
        self.hits == samples && self.emitters == 0 && !self.tied
    }

    fn add(&mut self, sample: &Sample) {
        let radiance = sample.radiance.as_dvec3();
        self.sum += radiance;
        self.square += radiance * radiance;
        self.hits += u32::from(sample.hit);
        self.emitters += u32::from(sample.emits);
        self.tied |= sample.tied;
    }
}
