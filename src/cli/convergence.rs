//! `penombre bench convergence`: the error of the light engine and of the path tracer against CPU time.

use super::args::SceneArgs;
use super::args::bench::ConvergenceArgs;
use super::convergence_report::{Document, targets};
use super::engine_run::{Measuring, combined, follow, nothing_to_compare};
use super::progress::{measuring, say};
use super::{Outcome, output, scene};
use crate::bench::convergence::{Curve, Point, path_tracer};
use crate::bench::reference_pixels::ReferencePixels;
use crate::error::{Error, Result};
use crate::geom::bvh::Bvh;
use crate::image::exr::read_rgb;
use crate::image::{atomic, flip};
use crate::light::context::SceneContext;
use crate::light::lights::Lights;
use crate::reference::{Filter, Settings, Strategy, Transport};
use crate::refine::update::EngineStats;
use crate::scene::Display;
use crate::scene::load::Loaded;
use crate::session::{Observer, Opening, Session};
use glam::Vec3;
use std::sync::Arc;

/// Errors are measured at these times and their tenfolds, CPU seconds.
const TIMES: [f64; 13] = [1.0, 1.2, 1.4, 1.7, 2.0, 2.5, 3.0, 3.6, 4.3, 5.0, 6.0, 7.0, 8.5];

/// Runs the command.
///
/// # Errors
/// Bad input, no usable device, a lost device, or a plot that cannot be written.
pub fn run(args: &ConvergenceArgs) -> Result<Outcome> {
    args.check()?;
    let reference = read_rgb(&args.reference)?;
    let size = reference.size;
    let reference_pixels = ReferencePixels::new(reference).ok_or_else(|| {
        Error::Usage(format!("{}: no pixel is left to compare, or all are black", args.reference.display()))
    })?;
    let options = args.options(size);
    let gpu = Opening::start(&options)?;
    let scene_args = SceneArgs { path: args.scene.clone(), camera: args.camera.clone(), size, up: args.up };
    let Loaded { scene, .. } = scene::load_and_warn(&scene_args, args.cpu.verbosity)?;
    let camera = scene::camera(&scene, args.camera.as_deref())?;
    let view = scene::view(&scene, &camera, &scene_args);
    let scene = Arc::new(scene);
    let bvh = Arc::new(Bvh::build(&scene));
    let shared = Arc::clone(&bvh);
    let mut session = gpu.finish()?.session(&scene, move |_: &_| shared, &options)?;
    let device = session.renderer().device().report().name.clone();
    session.look(&view, &[])?;
    let progress = measuring(args.cpu.verbosity.quiet);
    let limit = args.time.as_secs_f64();
    let mut race = Race::new(&reference_pixels, scene.display, limit);
    let going_on = |stats: &EngineStats| say(&progress, &format!("light engine, {:.1} CPU s", stats.cpu_seconds));
    if !follow(&mut session, &mut race, &going_on)? {
        return Ok(Outcome::Interrupted);
    }
    let curve = Curve { points: race.points };
    // The device's threads must not run beside the path tracer.
    drop(session);
    let (lights, pool) = (Lights::new(&scene), args.cpu.pool()?);
    let context = SceneContext::new(&scene, &bvh, &lights, args.cpu.seed, scene.scale());
    let enough = targets().fold(f64::INFINITY, f64::min);
    let step = |what: &str| say(&progress, what);
    let tracer = path_tracer(&context, &view, settings(args), &reference_pixels, &pool, (enough, limit), &step);
    progress.finish_and_clear();
    let Some(tracer) = tracer else { return Ok(Outcome::Interrupted) };
    let document = Document::new(args, &scene, &device, &reference_pixels, curve, tracer);
    if let Some(path) = &args.plot {
        atomic::write(path, |file| std::io::Write::write_all(file, document.plot().as_bytes()))?;
    }
    output::print(&if args.json { document.json()? } else { document.text() })?;
    Ok(Outcome::Done)
}

/// What the path tracer computes, for a reference of the same kind.
const fn settings(args: &ConvergenceArgs) -> Settings {
    let transport = match (args.refinement.direct_only, args.match_method) {
        (true, _) => Transport::Direct,
        (_, true) => Transport::Method,
        _ => Transport::Full,
    };
    Settings { filter: Filter::Point, transport, strategy: Strategy::Both }
}

/// Errors of the engine over CPU time, until the limit or until nothing is left to do.
struct Race<'a> {
    reference_pixels: &'a ReferencePixels,
    display: Display,
    /// The reference as it is displayed, for FLIP, where it has all pixels.
    displayed: Option<Vec<[u8; 3]>>,
    /// When the error is next due to be measured, CPU seconds.
    due: f64,
    /// CPU seconds.
    limit: f64,
    points: Vec<Point>,
}

impl Observer for Race<'_> {
    fn wants_picture(&mut self, stats: &EngineStats) -> bool {
        (stats.cpu_seconds >= self.due || self.is_last(stats)) && stats.rays > 0
    }
}

impl Measuring for Race<'_> {
    fn measure(&mut self, session: &mut Session, stats: &EngineStats) -> Result<()> {
        self.due = next_time(stats.cpu_seconds);
        let point = self.point(&combined(session)?, stats)?;
        self.points.push(point);
        Ok(())
    }

    fn is_last(&self, stats: &EngineStats) -> bool {
        stats.cpu_seconds >= self.limit || stats.converged
    }
}

impl<'a> Race<'a> {
    fn new(reference_pixels: &'a ReferencePixels, display: Display, limit: f64) -> Self {
        let image = reference_pixels.image();
        let displayed = image.sampled.is_none().then(|| flip::displayed(&image.rgb, &display));
        Self { reference_pixels, display, displayed, due: 0.0, limit, points: Vec::new() }
    }

    fn point(&self, image: &[Vec3], stats: &EngineStats) -> Result<Point> {
        let error = self.reference_pixels.error(image).ok_or_else(nothing_to_compare)?;
        let flip = self.displayed.as_deref().and_then(|reference| {
            let displayed = flip::displayed(image, &self.display);
            flip::mean(
                &flip::error_map(&displayed, reference, self.reference_pixels.image().size),
                Some(self.reference_pixels.counts()),
            )
        });
        Ok(Point {
            cpu_seconds: stats.cpu_seconds,
            rays: stats.rays,
            relmse: error.relmse,
            rmse_over_mean: error.rmse_over_mean,
            flip,
            estimated_error: stats.estimated_error.map(f64::from),
        })
    }
}

/// The first of [`TIMES`], tenfolds included, after `now`, CPU seconds.
fn next_time(now: f64) -> f64 {
    let decade = 10_f64.powf(now.max(1e-6).log10().floor());
    let next = TIMES.into_iter().chain([10.0]).map(|t| t * decade).find(|&t| t > now);
    next.unwrap_or(20.0 * decade)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_measured_at_round_times() {
        let close =
            |now: f64, then: f64| assert!((next_time(now) / then - 1.0).abs() < 1e-9, "{now} {}", next_time(now));
        close(2.2e-6, 2.5e-6);
        close(0.09, 0.1);
        close(0.101, 0.12);
        close(0.29, 0.3);
        close(9.0, 10.0);
        close(10.5, 12.0);
    }
}
