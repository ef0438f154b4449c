//! `penombre bench convergence`: the error of the light engine and of the path tracer against CPU time.

use super::args::bench::ConvergenceArgs;
use super::args::{EngineArgs, SceneArgs};
use super::convergence_report::{Document, targets};
use super::setup::{self, EngineSetup};
use super::{Outcome, interrupt, output, scene};
use crate::bench::convergence::{Curve, Point, path_tracer};
use crate::bench::reference_pixels::ReferencePixels;
use crate::error::{Error, Result};
use crate::image::exr::read_rgb;
use crate::image::{atomic, flip};
use crate::light::context::SceneContext;
use crate::light::lights::Lights;
use crate::pass::{FrameOptions, Renderer, RendererOptions, UpdateMode};
use crate::reference::{Filter, Settings, Strategy, Transport};
use crate::refine::engine::{Counted, Visible};
use crate::refine::thread::EngineThread;
use crate::refine::update::{EngineStats, Update};
use crate::scene::Display;
use crate::scene::load::Loaded;
use glam::Vec3;
use indicatif::ProgressBar;
use std::sync::Arc;

/// Rays of a batch of the engine, as under `render --deterministic`.
const BATCH: u64 = 20_000;
/// Rays between two frames at most: pixels are counted that often, as a few times a second in `render`.
const MOST_A_FRAME: u64 = 400_000;
/// Frames are drawn when this share of the rays so far has been added.
const GROWTH: u64 = 16;
/// Errors are measured at these times and their tenfolds, CPU seconds.
const TIMES: [f64; 13] = [1.0, 1.2, 1.4, 1.7, 2.0, 2.5, 3.0, 3.6, 4.3, 5.0, 6.0, 7.0, 8.5];
/// First camera generation of a run.
const GENERATION: u32 = 1;

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
    let gpu = setup::open_gpu(&args.device, size, RendererOptions::new)?;
    let scene_args = SceneArgs { path: args.scene.clone(), camera: args.camera.clone(), size, up: args.up };
    let Loaded { scene, .. } = scene::load_and_warn(&scene_args, args.cpu.verbosity)?;
    let camera = scene::camera(&scene, args.camera.as_deref())?;
    let view = scene::view(&scene, &camera, &scene_args);
    let scene = Arc::new(scene);
    let bvh = setup::build_hierarchy(&scene)?.finish();
    let mut gpu = gpu.finish()?;
    gpu.renderer.load(&scene)?;
    gpu.renderer.resize(size)?;
    let device = gpu.renderer.device().report().name.clone();
    let shared = Arc::clone(&bvh);
    let engine = engine_setup(args, &scene_args, scene.display).start(&scene, move || shared)?;
    let faces = setup::visible_faces(&mut gpu.renderer, &view, 1)?;
    let visible = Visible { generation: GENERATION, eye: view.eye, view: Some(view), faces };
    let progress = super::bench::progress(args.cpu.verbosity);
    let race = Race {
        reference_pixels: &reference_pixels,
        display: scene.display,
        limit: args.time.as_secs_f64(),
        progress: &progress,
    };
    let Some(curve) = race.run(&mut gpu.renderer, engine, visible)? else { return Ok(Outcome::Interrupted) };
    // The device's threads must not run beside the path tracer.
    drop(gpu);
    let (lights, pool) = (Lights::new(&scene), args.cpu.pool()?);
    let context = SceneContext::new(&scene, &bvh, &lights, args.cpu.seed, scene.scale());
    let enough = targets().fold(f64::INFINITY, f64::min);
    let step = |what: &str| say(&progress, what);
    let tracer = path_tracer(&context, &view, settings(args), &reference_pixels, &pool, (enough, race.limit), &step);
    progress.finish_and_clear();
    let Some(tracer) = tracer else { return Ok(Outcome::Interrupted) };
    let document = Document::new(args, &scene, &device, &reference_pixels, curve, tracer);
    if let Some(path) = &args.plot {
        atomic::write(path, |file| std::io::Write::write_all(file, document.plot().as_bytes()))?;
    }
    output::print(&if args.json { document.json()? } else { document.text() })?;
    Ok(Outcome::Done)
}

fn engine_setup(args: &ConvergenceArgs, scene: &SceneArgs, display: Display) -> EngineSetup {
    EngineSetup {
        size: scene.size,
        display,
        engine: EngineArgs { threads: args.cpu.threads, seed: args.cpu.seed, deterministic: true },
        refinement: args.refinement,
        filter: args.filtered,
        counted: true,
    }
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

/// Says what is going on; whether to go on.
fn say(progress: &ProgressBar, what: &str) -> bool {
    progress.set_message(what.to_owned());
    progress.tick();
    !interrupt::requested()
}

/// The engine against a reference. Batches of fixed work, frames between them: nothing runs beside the engine, so that its CPU time is
/// its own, and the same seed gives the same images.
struct Race<'a> {
    reference_pixels: &'a ReferencePixels,
    display: Display,
    /// CPU seconds.
    limit: f64,
    progress: &'a ProgressBar,
}

impl Race<'_> {
    /// Errors over CPU time until the limit, or until nothing is left to do; `None` if it was broken off.
    fn run(&self, renderer: &mut Renderer, engine: EngineThread, visible: Visible) -> Result<Option<Curve>> {
        let image = self.reference_pixels.image();
        let reference = image.sampled.is_none().then(|| flip::displayed(&image.rgb, &self.display));
        let mut points: Vec<Point> = Vec::new();
        engine.set_visible(visible);
        renderer.reset_drawn();
        let (mut stats, mut due, mut first) = (EngineStats::default(), 0.0, true);
        let mut updates = vec![update(&engine)?];
        loop {
            for update in &updates {
                renderer.apply(update)?;
                stats = update.stats;
            }
            let last = stats.cpu_seconds >= self.limit || stats.converged;
            let measured = (stats.cpu_seconds >= due || last) && stats.rays > 0;
            self.frame(renderer, &engine, first, measured)?;
            if measured {
                due = next_time(stats.cpu_seconds);
                points.push(self.point(renderer, &stats, reference.as_deref())?);
            }
            if !say(self.progress, &format!("light engine, {:.1} CPU s", stats.cpu_seconds)) {
                return Ok(None);
            }
            if last {
                return Ok(Some(Curve { points }));
            }
            first = false;
            let batches = (stats.rays / GROWTH).clamp(BATCH, MOST_A_FRAME) / BATCH;
            updates.clear();
            for _ in 0..batches {
                engine.step(BATCH);
                updates.push(update(&engine)?);
            }
        }
    }

    /// Draws what has changed, all of it if it is looked at, and tells the engine how many pixels its triangles have.
    fn frame(&self, renderer: &mut Renderer, engine: &EngineThread, first: bool, measured: bool) -> Result<()> {
        renderer.frame(&FrameOptions {
            colour: first,
            full_luminance: first || measured,
            combine: measured.then_some(self.display),
            update_mode: UpdateMode::Stencil,
            queries: 0,
        })?;
        let pixels = Some(renderer.drawn_counts()?.drawn_triangles);
        let sequence = renderer.drawn_sequence();
        engine.counted(Counted { generation: GENERATION, sequence, pixels, complete: true });
        Ok(())
    }

    fn point(&self, renderer: &mut Renderer, stats: &EngineStats, reference: Option<&[[u8; 3]]>) -> Result<Point> {
        let image: Vec<Vec3> =
            renderer.read_layers()?.combined.iter().map(|&[r, g, b, _]| Vec3::new(r, g, b)).collect();
        let error = self
            .reference_pixels
            .error(&image)
            .ok_or_else(|| Error::Usage("no pixel is left to compare".to_owned()))?;
        let flip = reference.and_then(|reference| {
            let displayed = flip::displayed(&image, &self.display);
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

/// The engine's answer to what was asked last.
fn update(engine: &EngineThread) -> Result<Update> {
    engine.wait().ok_or_else(|| Error::Internal("the light engine has stopped".to_owned()))
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
