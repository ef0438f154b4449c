//! Error against CPU time: of the light engine (points that the caller takes) and of the path tracer.

use super::crossing::crossing;
use super::figure::Step;
use super::reference_pixels::ReferencePixels;
use crate::light::context::SceneContext;
use crate::reference::{Accumulator, Settings, random_pixels};
use crate::refine::workers::thread_nanoseconds;
use crate::scene::camera::View;
use rayon::ThreadPool;
use serde::Serialize;

/// An image on its way.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Point {
    /// CPU time spent on the light of the whole image, all threads, seconds.
    pub cpu_seconds: f64,
    /// Rays traced for it.
    pub rays: u64,
    /// relMSE without the reference's own noise; at or below 0 where that is all there is.
    pub relmse: f64,
    /// Root mean square error over the reference's mean, without the reference's own noise.
    pub rmse_over_mean: f64,
    /// Mean FLIP error; `None` where the reference has a part of the pixels only.
    pub flip: Option<f64>,
    /// The same as `rmse_over_mean` as the engine itself estimates it.
    pub estimated_error: Option<f64>,
}

/// Error over CPU time of one method; times rise.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Curve {
    /// What was measured.
    pub points: Vec<Point>,
}

impl Curve {
    /// CPU seconds at which the relMSE is down to `target` for good, between points by the straight line of their logarithms; the
    /// first point's if it starts there, `None` if it was not reached.
    #[must_use]
    pub fn reaches(&self, target: f64) -> Option<f64> {
        let points: Vec<(f64, f64)> = self.points.iter().map(|p| (p.cpu_seconds, p.relmse)).collect();
        crossing(&points, target).map(|crossing| crossing.at)
    }

    /// relMSE after so many CPU seconds, between points by the straight line of their logarithms; `None` before the first point,
    /// after the last, and where nothing but the reference's noise was found.
    #[must_use]
    pub fn relmse_at(&self, cpu_seconds: f64) -> Option<f64> {
        let next = self.points.iter().position(|p| p.cpu_seconds >= cpu_seconds)?;
        let after = self.points[next];
        let before =
            if next == 0 { (after.cpu_seconds <= cpu_seconds).then_some(after)? } else { self.points[next - 1] };
        if before.relmse <= 0.0 || after.relmse <= 0.0 {
            return None;
        }
        let length = (after.cpu_seconds / before.cpu_seconds).ln();
        let share = if length > 0.0 { (cpu_seconds / before.cpu_seconds).ln() / length } else { 0.0 };
        Some(before.relmse * (after.relmse / before.relmse).powf(share))
    }
}

/// What the path tracer took.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PathTracer {
    /// CPU seconds of one sample a pixel of the whole image.
    pub cpu_seconds_a_pass: f64,
    /// Pixels whose error was followed.
    pub pixels: usize,
    /// Error over CPU time.
    #[serde(flatten)]
    pub curve: Curve,
}

impl PathTracer {
    /// CPU seconds to a relMSE, and whether they were found beyond the last point, by the law of independent samples: error times
    /// time is constant.
    #[must_use]
    pub fn reaches(&self, target: f64) -> Option<(f64, bool)> {
        let by_law =
            || self.curve.points.iter().rev().find(|p| p.relmse > 0.0).map(|p| p.cpu_seconds * p.relmse / target);
        self.curve.reaches(target).map(|seconds| (seconds, false)).or_else(|| by_law().map(|seconds| (seconds, true)))
    }

    /// relMSE after so many CPU seconds, beyond the last point by the same law; `None` before the first.
    #[must_use]
    pub fn relmse_at(&self, cpu_seconds: f64) -> Option<f64> {
        let last = self.curve.points.last()?;
        if cpu_seconds <= last.cpu_seconds {
            return self.curve.relmse_at(cpu_seconds);
        }
        (last.relmse > 0.0).then(|| last.relmse * last.cpu_seconds / cpu_seconds)
    }
}

/// What the path tracer's error is followed at, at most: enough for its mean, and so much faster than an image that thousands of
/// samples a pixel are a matter of seconds.
const PIXELS: usize = 16_384;

/// CPU seconds that passes over the whole image are timed for, at least.
const TIMED_SECONDS: f64 = 0.5;

/// Follows the path tracer until its relMSE is below `enough` or it has taken `limit` CPU seconds, on the threads of `pool`. The
/// cost of a sample is measured on the whole image, where neighbouring pixels find the same nodes in the caches; the error at
/// some of the pixels that count, each with the samples that it gets in a whole image. `None` if it was broken off.
#[must_use]
pub fn path_tracer(
    context: &SceneContext<'_>,
    view: &View,
    settings: Settings,
    reference_pixels: &ReferencePixels,
    pool: &ThreadPool,
    (enough, limit): (f64, f64),
    step: &Step<'_>,
) -> Option<PathTracer> {
    let stop = || !step("path tracer");
    let mut whole = Accumulator::new(view);
    let (mut rays, mut spent) = (0, 0.0);
    while spent < TIMED_SECONDS {
        let (pass, seconds) = timed(pool, || whole.pass(context, view, settings, stop));
        pass.finished.then(|| (rays, spent) = (rays + pass.rays, spent + seconds))?;
    }
    let passes = f64::from(whole.samples());
    let (rays_a_pass, cpu_seconds_a_pass) = (rays as f64 / passes, spent / passes);
    let chosen = chosen(view, reference_pixels);
    let part = reference_pixels.of(&chosen);
    let mut accumulator = Accumulator::over(view, chosen);
    let (mut points, mut spent, mut due) = (Vec::new(), 0.0, 1);
    loop {
        let (pass, seconds) = timed(pool, || accumulator.pass(context, view, settings, stop));
        pass.finished.then(|| spent += seconds)?;
        let samples = accumulator.samples();
        let last = spent >= limit;
        if samples == due || last {
            due *= 2;
            let image: Vec<_> = accumulator.image().mean.iter().map(|m| m.truncate()).collect();
            let error = part.error(&image)?;
            points.push(Point {
                cpu_seconds: f64::from(samples) * cpu_seconds_a_pass,
                rays: (f64::from(samples) * rays_a_pass) as u64,
                relmse: error.relmse,
                rmse_over_mean: error.rmse_over_mean,
                flip: None,
                estimated_error: None,
            });
            if last || error.relmse < enough {
                return Some(PathTracer { cpu_seconds_a_pass, pixels: part.counted(), curve: Curve { points } });
            }
        }
    }
}

/// Pixels that count: all, or about [`PIXELS`] of them at random.
fn chosen(view: &View, reference_pixels: &ReferencePixels) -> Vec<u32> {
    let share = (PIXELS as f64 / reference_pixels.counted() as f64).min(1.0);
    let drawn = random_pixels(view.size, (view.size.pixels() as f64 * share).ceil() as usize);
    reference_pixels.counted_among(&drawn)
}

/// What some work on all threads of a pool returns, and the CPU seconds that it takes of them together.
fn timed<R: Send>(pool: &ThreadPool, work: impl FnOnce() -> R + Send) -> (R, f64) {
    let clock = || pool.broadcast(|_| thread_nanoseconds()).iter().sum::<u64>();
    let start = clock();
    let result = pool.install(work);
    (result, (clock() - start).max(1) as f64 * 1e-9)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(points: &[(f64, f64)]) -> Curve {
        let point = |&(cpu_seconds, relmse)| Point {
            cpu_seconds,
            rays: 0,
            relmse,
            rmse_over_mean: 0.0,
            flip: None,
            estimated_error: None,
        };
        Curve { points: points.iter().map(point).collect() }
    }

    #[track_caller]
    fn close(value: Option<f64>, expected: f64) {
        assert!(value.is_some_and(|v| (v / expected - 1.0).abs() < 1e-9), "{value:?} is not {expected}");
    }

    #[test]
    fn straight_lines_of_logarithms_are_followed() {
        let halving = curve(&[(1.0, 1.0), (4.0, 0.25), (16.0, 0.0625)]);
        close(halving.reaches(0.5), 2.0);
        close(halving.reaches(2.0), 1.0);
        assert_eq!(halving.reaches(0.06), None);
        close(halving.relmse_at(2.0), 0.5);
        close(halving.relmse_at(1.0), 1.0);
        assert_eq!((halving.relmse_at(0.5), halving.relmse_at(17.0)), (None, None));
        // Below the noise it is nowhere in particular.
        assert_eq!(curve(&[(1.0, 1.0), (2.0, -0.1)]).relmse_at(1.5), None);
    }

    #[test]
    fn beyond_the_last_sample_the_law_of_independent_ones_holds() {
        let tracer = |points| PathTracer { cpu_seconds_a_pass: 1.0, pixels: 1, curve: curve(points) };
        let two = tracer(&[(1.0, 1.0), (4.0, 0.2)]);
        assert_eq!(two.reaches(0.2), Some((4.0, false)));
        let (seconds, by_law) = two.reaches(0.1).expect("by the law");
        assert!(by_law && (seconds - 8.0).abs() < 1e-9, "{seconds}");
        close(two.relmse_at(8.0), 0.1);
        assert_eq!(two.relmse_at(0.5), None);
        assert_eq!(tracer(&[]).reaches(0.1), None);
    }
}
