//! The image in the making.

use super::Settings;
use super::path::{Sample, Tracer};
use crate::scene::camera::View;
use crate::shade::world::World;
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

/// An image in the making: sums over passes of one sample a pixel.
pub struct Accumulator {
    pixels: Vec<PixelSums>,
    samples: u32,
}

/// Mean and variance of the mean, pixel by pixel.
#[derive(Clone, Debug, Default)]
pub struct ReferenceImage {
    /// Mean radiance, and the share of the pixel that geometry covers.
    pub mean: Vec<Vec4>,
    /// Variance of the mean, each channel, as if samples were independent. They are spread more evenly than that, so it is
    /// an upper bound on average; 0 after a single sample.
    pub variance: Vec<Vec3>,
    /// Whether a pixel counts in comparisons: covered in every sample, no emitter seen directly, and no edge through a
    /// centre at which it is sampled, where raster and ray may show different sides.
    pub mask: Vec<bool>,
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
    /// Nothing sampled yet.
    #[must_use]
    pub fn new(view: &View) -> Self {
        Self { pixels: vec![PixelSums::default(); view.size.pixels()], samples: 0 }
    }

    /// Samples taken a pixel.
    #[must_use]
    pub const fn samples(&self) -> u32 {
        self.samples
    }

    /// Takes one more sample a pixel on the current thread pool; the same whatever the number of threads. `stop` is asked
    /// before each row: a pass that it breaks off is left out entirely.
    pub fn pass(&mut self, world: &World<'_>, view: &View, settings: Settings, stop: impl Fn() -> bool + Sync) -> Pass {
        let (width, index) = (view.size.width, self.samples);
        let rows: Vec<Option<(Vec<Sample>, u64)>> = (0..view.size.height)
            .into_par_iter()
            .map(|y| {
                (!stop()).then(|| {
                    let mut tracer = Tracer::new(world, settings);
                    let samples = (0..width).map(|x| tracer.pixel(view, [x, y], index)).collect();
                    (samples, tracer.rays())
                })
            })
            .collect();
        let Some(rows) = rows.into_iter().collect::<Option<Vec<_>>>() else { return Pass { rays: 0, finished: false } };
        for (row, (samples, _)) in self.pixels.chunks_mut(width as usize).zip(&rows) {
            row.iter_mut().zip(samples).for_each(|(pixel, sample)| pixel.add(sample));
        }
        self.samples += 1;
        Pass { rays: rows.iter().map(|(_, rays)| rays).sum(), finished: true }
    }

    /// The image so far.
    #[must_use]
    pub fn image(&self) -> ReferenceImage {
        let n = f64::from(self.samples.max(1));
        let mean = |p: &PixelSums| (p.sum / n).as_vec3().extend((f64::from(p.hits) / n) as f32);
        let variance = |p: &PixelSums| {
            let m = p.sum / n;
            ((p.square / n - m * m).max(DVec3::ZERO) / (n - 1.0).max(1.0)).as_vec3()
        };
        let counts = |p: &PixelSums| p.hits == self.samples && p.emitters == 0 && !p.tied;
        ReferenceImage {
            mean: self.pixels.iter().map(mean).collect(),
            variance: self.pixels.iter().map(variance).collect(),
            mask: self.pixels.iter().map(counts).collect(),
        }
    }
}

impl PixelSums {
    fn add(&mut self, sample: &Sample) {
        let radiance = sample.radiance.as_dvec3();
        self.sum += radiance;
        self.square += radiance * radiance;
        self.hits += u32::from(sample.hit);
        self.emitters += u32::from(sample.emits);
        self.tied |= sample.tied;
    }
}
