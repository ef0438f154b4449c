//! `penombre render`: set up in parallel, run the frame loop, write the images.

use super::args::{PixelCounts, RenderArgs, thread_count};
use super::progress::Progress;
use super::session::{Ended, Session};
use super::stills::Shot;
use super::yardstick::Yardstick;
use super::{Outcome, interrupt, output, scene, stills};
use crate::error::{Error, Result};
use crate::geom::bvh::Bvh;
use crate::image::exr::{RgbImage, read_rgb};
use crate::image::film;
use crate::log::summary::Summary;
use crate::pass::{Renderer, UpdateMode};
use crate::refine::engine::{Engine, Visible};
use crate::refine::options::Options;
use crate::refine::thread::{EngineThread, Pace};
use crate::refine::workers::Workers;
use crate::scene::camera::View;
use crate::scene::load::Loaded;
use crate::scene::report::Severity;
use crate::scene::{FaceId, Scene};
use crate::vk::{Device, DeviceOptions};
use std::path::Path;
use std::sync::{Arc, OnceLock};
use std::thread::JoinHandle;
use std::time::Instant;

/// Runs the command; `start` is when the process started.
///
/// # Errors
/// Bad input, no usable device, a lost device, or an output that cannot be written.
pub fn run(args: &RenderArgs, start: Instant) -> Result<Outcome> {
    args.check_outputs()?;
    let reference = args.reference.as_deref().map(|path| read_reference(path, args)).transpose()?;
    let gpu = open_gpu(args)?;
    let loading = Instant::now();
    let Loaded { scene, report, .. } = scene::load_and_warn(&args.scene, args.verbosity)?;
    let mut summary = Summary::of_this_run();
    summary.times.load = Some(loading.elapsed().as_secs_f64());
    summary.warnings = report.lines(Severity::Warning);
    summary.stand_ins = report.lines(Severity::StandIn);
    let camera = scene::camera(&scene, args.scene.camera.as_deref())?;
    let display = args.output.display(&scene.display);
    let scene = Arc::new(scene);
    let hierarchy = build_hierarchy(&scene)?;
    let mut gpu = join(gpu)??;
    let view = scene::view(&scene, &camera, &args.scene);
    let faces = prepare(&mut gpu.renderer, &scene, &view, args.output.aa)?;
    let bvh_seconds = Arc::clone(&hierarchy.seconds);
    let engine = start_engine(args, &scene, hierarchy)?;
    engine.set_visible(Visible { generation: 1, eye: view.eye, faces });
    let reference = reference.map(|image| Yardstick::new(image, display));
    let renderer = &mut gpu.renderer;
    let progress = Progress::new(args.verbosity.quiet);
    let mut session = Session { args, renderer, engine, display, reference, progress, start, levels: Vec::new() };
    let ended = session.run()?;
    let shot = Shot { view: &view, camera, display, levels: session.levels };
    summary.warnings.extend(fallbacks(args, &gpu.renderer));
    summary.warnings.extend(write_images(args, &mut gpu.renderer, &shot)?);
    summary.times.bvh = bvh_seconds.get().copied();
    finish(args, summary, &gpu, &ended, start)?;
    let device = Arc::clone(gpu.renderer.device());
    drop(gpu);
    say_what_is_left(&device);
    Ok(if interrupt::requested() { Outcome::Interrupted } else { Outcome::Done })
}

fn read_reference(path: &Path, args: &RenderArgs) -> Result<RgbImage> {
    let image = read_rgb(path)?;
    if image.size == args.scene.size {
        return Ok(image);
    }
    let (is, wanted) = (image.size, args.scene.size);
    Err(Error::Usage(format!(
        "--reference {}: the image is {}x{}, the render {}x{}; make both the same size",
        path.display(),
        is.width,
        is.height,
        wanted.width,
        wanted.height
    )))
}

/// The GPU side, opened while the scene loads.
struct Gpu {
    renderer: Renderer,
    device_seconds: f64,
    pipeline_seconds: f64,
}

fn open_gpu(args: &RenderArgs) -> Result<JoinHandle<Result<Gpu>>> {
    let options = DeviceOptions { device: args.device.device.clone(), validation: None };
    let size = args.scene.size;
    spawn("penombre-gpu-setup", move || {
        let start = Instant::now();
        let device = Device::new(&options)?;
        let device_seconds = start.elapsed().as_secs_f64();
        let renderer = Renderer::new(device, size)?;
        let pipeline_seconds = start.elapsed().as_secs_f64() - device_seconds;
        Ok(Gpu { renderer, device_seconds, pipeline_seconds })
    })
}

/// A hierarchy in the making.
struct Hierarchy {
    thread: JoinHandle<Bvh>,
    seconds: Arc<OnceLock<f64>>,
}

fn build_hierarchy(scene: &Arc<Scene>) -> Result<Hierarchy> {
    let seconds = Arc::new(OnceLock::new());
    let (scene, done) = (Arc::clone(scene), Arc::clone(&seconds));
    let thread = spawn("penombre-bvh", move || {
        let start = Instant::now();
        let bvh = Bvh::build(&scene);
        let _ = done.set(start.elapsed().as_secs_f64());
        bvh
    })?;
    Ok(Hierarchy { thread, seconds })
}

fn start_engine(args: &RenderArgs, scene: &Arc<Scene>, hierarchy: Hierarchy) -> Result<EngineThread> {
    let no_threads = |e: &dyn std::fmt::Display| Error::Exhausted(format!("cannot start threads: {e}"));
    let workers = Workers::new(thread_count(args.engine.threads)).map_err(|e| no_threads(&e))?;
    let pace = if args.engine.deterministic { Pace::Stepped } else { Pace::Free };
    let (scene, options) = (Arc::clone(scene), refinement_options(args, scene));
    EngineThread::spawn(pace, move || {
        // A panic of the builder has ended the process in the panic hook; an empty tree never gets used.
        let bvh = hierarchy.thread.join().unwrap_or_else(|_| Bvh::build(&Scene::default()));
        Engine::new(scene, Arc::new(bvh), workers, options)
    })
    .map_err(|e| no_threads(&e))
}

fn refinement_options(args: &RenderArgs, scene: &Scene) -> Options {
    let display = args.output.display(&scene.display);
    let image = args.scene.size.width.max(args.scene.size.height) as f32;
    let refinement = &args.refinement;
    Options {
        seed: args.engine.seed,
        indirect: !refinement.direct_only,
        filter: !refinement.no_filter,
        hemisphere: refinement.hemisphere,
        priority: refinement.priority,
        min_pixels: refinement.min_pixels,
        contrast: refinement.contrast,
        // What covers a few pixels where the whole scene fills the image; nearer to the eye, what does so there.
        shadow_size: refinement.shadow_size.unwrap_or(scene.diagonal() * SHADOW_PIXELS / image),
        shadow_pixels: refinement.shadow_size.map_or(SHADOW_AREA, |_| f32::INFINITY),
        white: (-display.exposure).exp2(),
        tolerance: TOLERANCE,
    }
}

/// Default size of the smallest shadow wanted, pixels.
const SHADOW_PIXELS: f32 = 12.0;
/// Default pixels of the largest leaf that may hide a shadow: half a square of that size.
const SHADOW_AREA: f32 = SHADOW_PIXELS * SHADOW_PIXELS / 2.0;
/// Error of a pixel against the image's mean at which refinement ends.
const TOLERANCE: f32 = 2.5e-4;

fn spawn<T: Send + 'static>(name: &str, work: impl FnOnce() -> T + Send + 'static) -> Result<JoinHandle<T>> {
    let spawned = std::thread::Builder::new().name(name.to_owned()).spawn(work);
    spawned.map_err(|e| Error::Exhausted(format!("cannot start a thread: {e}")))
}

fn join<T>(thread: JoinHandle<T>) -> Result<T> {
    thread.join().map_err(|_| Error::Internal("a set-up thread panicked".to_owned()))
}

/// Says what the device cannot do as asked, and what is done instead.
fn fallbacks(args: &RenderArgs, renderer: &Renderer) -> Vec<String> {
    let device = &renderer.device().report().name;
    let inexact = args.pixel_counts == PixelCounts::Query && !renderer.device().report().precise_queries;
    let unequal = args.update == UpdateMode::Stencil && !renderer.stencil_works();
    let cases = [
        (inexact, "counts no pixels exactly by query: --pixel-counts histogram is used"),
        (unequal, "does not redraw triangles at equal depth: --update id is used"),
    ];
    let warnings: Vec<String> = cases.iter().filter(|c| c.0).map(|c| format!("warning: {device} {}", c.1)).collect();
    warnings.iter().for_each(|warning| output::report(warning));
    warnings
}

/// Uploads the scene and finds what the camera sees: the union over the jitters of the written image, pixels averaged.
fn prepare(renderer: &mut Renderer, scene: &Scene, view: &View, aa: u32) -> Result<Vec<(FaceId, u32)>> {
    renderer.load(scene)?;
    renderer.resize(view.size)?;
    let offsets = film::jitter(aa);
    let mut all: Vec<(FaceId, u32)> = Vec::new();
    for &offset in offsets.iter().rev() {
        renderer.set_view(view, offset);
        all.extend(renderer.visibility()?);
    }
    if aa > 1 {
        renderer.set_view(view, glam::Vec2::ZERO);
        all.extend(renderer.visibility()?);
    }
    all.sort_unstable();
    let mut merged: Vec<(FaceId, u32)> = Vec::with_capacity(all.len());
    for (face, pixels) in all {
        match merged.last_mut() {
            Some((last, sum)) if *last == face => *sum += pixels,
            _ => merged.push((face, pixels)),
        }
    }
    let redraws = if aa > 1 { aa + 1 } else { 1 };
    merged.iter_mut().for_each(|(_, pixels)| *pixels = pixels.div_ceil(redraws));
    Ok(merged)
}

/// Writes all outputs; returns warnings.
fn write_images(args: &RenderArgs, renderer: &mut Renderer, shot: &Shot<'_>) -> Result<Vec<String>> {
    let still = stills::take(renderer, shot, args.output.aa)?;
    let mut warnings = Vec::new();
    for path in &args.output.paths {
        if let Some(warning) = still.write(path, &args.image_options())? {
            let warning = format!("{}: warning: {warning}", path.display());
            output::report(&warning);
            warnings.push(warning);
        }
    }
    Ok(warnings)
}

/// Prints what was not destroyed, where the validation layers listen (`PENOMBRE_VALIDATION=1`); their own messages are
/// printed as they come.
fn say_what_is_left(device: &Device) {
    if device.validates() {
        device.live_objects().iter().for_each(|object| output::report(&format!("vulkan: not destroyed: {object}")));
    }
}

/// Writes the run summary beside the log and says what was done.
fn finish(args: &RenderArgs, mut summary: Summary, gpu: &Gpu, ended: &Ended, start: Instant) -> Result<()> {
    let device = gpu.renderer.device().report();
    summary.device.clone_from(&device.name);
    summary.driver.clone_from(&device.driver);
    summary.formats = serde_json::to_value(&device.formats).unwrap_or_default();
    summary.seed = args.engine.seed;
    summary.threads = thread_count(args.engine.threads);
    summary.size = [args.scene.size.width, args.scene.size.height];
    summary.times.device = Some(gpu.device_seconds);
    summary.times.pipelines = Some(gpu.pipeline_seconds);
    summary.times.first_frame = Some(ended.first_frame);
    summary.times.complete_frame = ended.complete_frame;
    summary.times.total = Some(start.elapsed().as_secs_f64());
    summary.frames = ended.frames;
    summary.rays = ended.engine.rays;
    summary.rays_per_second = (ended.elapsed > 0.0).then(|| ended.engine.rays as f64 / ended.elapsed);
    summary.rays_per_cpu_second =
        (ended.engine.cpu_seconds > 0.0).then(|| ended.engine.rays as f64 / ended.engine.cpu_seconds);
    summary.ended_by = Some(ended.by.to_owned());
    if !args.verbosity.quiet {
        output::report(&summary.line(ended.engine.estimated_error));
    }
    if args.verbosity.verbose {
        summary.details().iter().for_each(|line| output::report(line));
    }
    args.log.as_deref().map_or(Ok(()), |log| summary.write(&Summary::path_beside(log)))
}
