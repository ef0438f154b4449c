//! `penombre render`: set up in parallel, run the frame loop, write the images.

use super::args::{PixelCounts, RenderArgs, thread_count};
use super::error_meter::ErrorMeter;
use super::pictures::{Picture, Pictures};
use super::progress::Progress;
use super::session::{Ended, Session};
use super::setup::{self, EngineSetup};
use super::stills::{Shot, Still};
use super::{Outcome, interrupt, output, scene, stills};
use crate::error::{Error, Result};
use crate::image::exr::{RgbImage, read_rgb};
use crate::log::summary::Summary;
use crate::pass::{Renderer, RendererOptions, UpdateMode};
use crate::refine::engine::Visible;
use crate::scene::camera::View;
use crate::scene::load::Loaded;
use crate::scene::report::Severity;
use crate::scene::{Display, Scene};
use crate::vk::Device;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

/// Runs the command; `start` is when the process started.
///
/// # Errors
/// Bad input, no usable device, a lost device, or an output that cannot be written.
pub fn run(args: &RenderArgs, start: Instant) -> Result<Outcome> {
    args.check_outputs()?;
    let reference = args.reference.as_deref().map(|path| read_reference(path, args)).transpose()?;
    let gpu = setup::open_gpu(&args.device, args.scene.size, renderer_options(args))?;
    let loading = Instant::now();
    let Loaded { scene, report, .. } = scene::load_and_warn(&args.scene, args.verbosity)?;
    let mut summary = Summary::of_this_run();
    summary.times.load = Some(loading.elapsed().as_secs_f64());
    summary.warnings = report.lines(Severity::Warning);
    summary.stand_ins = report.lines(Severity::StandIn);
    summary.origin = scene.origin.to_array();
    let camera = scene::camera(&scene, args.scene.camera.as_deref())?;
    let pictures = Pictures::new(args, &scene, camera)?;
    let display = args.output.display(&scene.display);
    let scene = Arc::new(scene);
    let hierarchy = setup::build_hierarchy(&scene)?;
    let mut gpu = gpu.finish()?;
    gpu.renderer.load(&scene)?;
    gpu.renderer.resize(args.scene.size)?;
    let bvh_seconds = Arc::clone(&hierarchy.seconds);
    let engine = engine_setup(args, display).start(&scene, || hierarchy.finish())?;
    let reference = reference.map(|image| ErrorMeter::new(image, display));
    if let Some(reference) = reference.as_ref().filter(|_| !args.verbosity.quiet) {
        output::report(&reference.describe());
    }
    let renderer = &mut gpu.renderer;
    summary.warnings.extend(fallbacks(args, renderer));
    let progress = Progress::new(args.verbosity.quiet);
    let mut session = Session { args, renderer, engine, display, reference, progress, start, levels: Vec::new() };
    let ended = make(&mut session, &scene, &pictures, &mut summary)?;
    drop(session);
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

const fn engine_setup(args: &RenderArgs, display: Display) -> EngineSetup {
    EngineSetup {
        size: args.scene.size,
        display,
        engine: args.engine,
        refinement: args.refinement,
        filter: !args.no_filter,
        counted: matches!(args.pixel_counts, PixelCounts::Histogram),
    }
}

/// What the renderer is made for; `id` is what the stencil modes fall back to.
fn renderer_options(args: &RenderArgs) -> impl FnOnce(&Device) -> Result<RendererOptions> + use<> {
    let (depth, atomic_counts) = (args.depth, args.pixel_counts == PixelCounts::Atomic);
    let modes = if args.update == UpdateMode::Id { vec![args.update] } else { vec![args.update, UpdateMode::Id] };
    move |device| Ok(RendererOptions { depth: depth.on(device)?, modes, count_writes: false, atomic_counts })
}

/// Says what the device cannot do as asked, and what is done instead.
fn fallbacks(args: &RenderArgs, renderer: &Renderer) -> Vec<String> {
    let device = &renderer.device().report().name;
    let inexact = args.pixel_counts == PixelCounts::Query && !renderer.device().report().precise_queries;
    let unequal = args.update.needs_stencil() && !renderer.stencil_works();
    let cases = [
        (inexact, "counts no pixels exactly by query: --pixel-counts histogram is used"),
        (unequal, "does not redraw triangles at equal depth: --update id is used"),
    ];
    let warnings: Vec<String> = cases.iter().filter(|c| c.0).map(|c| format!("warning: {device} {}", c.1)).collect();
    warnings.iter().for_each(|warning| output::report(warning));
    warnings
}

/// A picture that is about to be made.
struct Aimed {
    picture: Picture,
    view: View,
    visible: Visible,
}

/// Points the renderer's camera at a picture.
fn aim(session: &mut Session<'_>, scene: &Scene, picture: Picture) -> Result<Aimed> {
    let args = session.args;
    let view = scene::view(scene, &picture.camera, &args.scene);
    let faces = setup::visible_faces(session.renderer, &view, args.output.aa)?;
    let generation = u32::try_from(picture.index + 1).unwrap_or(u32::MAX);
    Ok(Aimed { picture, view, visible: Visible { generation, eye: view.eye, view: Some(view), faces } })
}

/// Makes all pictures and writes each when it is done; a signal makes the present one the last.
fn make(session: &mut Session<'_>, scene: &Scene, pictures: &Pictures, summary: &mut Summary) -> Result<Ended> {
    let mut aimed = aim(session, scene, pictures.picture(0, scene))?;
    let mut run = session.start()?;
    // Of the pictures of a path the first that is doubtful speaks for all.
    let mut doubted = false;
    loop {
        let Aimed { picture, view, visible } = aimed;
        let by = session.draw(&mut run, &picture, visible)?;
        let shot = Shot {
            view: &view,
            camera: picture.camera,
            origin: scene.origin,
            display: session.display,
            levels: &session.levels,
        };
        let still = stills::take(session.renderer, &shot, session.args.output.aa)?;
        let comments = session.args.image_options() + &picture.label();
        for path in &session.args.output.paths {
            let path = pictures.file(path, &picture);
            if let Some(warning) = still.write(&path, &comments)? {
                warn(session, summary, &format!("{}: warning: {warning}", path.display()));
            }
        }
        if !doubted && let Some(doubt) = run.unfinished(by).or_else(|| black(&still, scene, &picture)) {
            doubted = true;
            warn(session, summary, &format!("warning: {}{doubt}", picture.prefix()));
        }
        let next = picture.index + 1;
        if next == pictures.count() || interrupt::requested() {
            session.progress.finish();
            let all = pictures.count() > 1 && !interrupt::requested();
            return Ok(run.ended(if all { "path" } else { by }, session.start));
        }
        aimed = aim(session, scene, pictures.picture(next, scene))?;
    }
}

/// What is to be said of a black picture; `None` if it is none.
fn black(still: &Still<'_>, scene: &Scene, picture: &Picture) -> Option<String> {
    still.shown(scene, &picture.factors).why_black().map(|why| format!("the picture is black: {why}"))
}

fn warn(session: &Session<'_>, summary: &mut Summary, line: &str) {
    session.progress.report(line);
    summary.warnings.push(line.to_owned());
}

/// Prints what was not destroyed, where the validation layers listen (`PENOMBRE_VALIDATION=1`); their own messages are
/// printed as they come.
fn say_what_is_left(device: &Device) {
    if device.validates() {
        device.live_objects().iter().for_each(|object| output::report(&format!("vulkan: not destroyed: {object}")));
    }
}

/// Writes the run summary beside the log and says what was done.
fn finish(args: &RenderArgs, mut summary: Summary, gpu: &setup::Gpu, ended: &Ended, start: Instant) -> Result<()> {
    let device = gpu.renderer.device().report();
    summary.device.clone_from(&device.name);
    summary.driver.clone_from(&device.driver);
    summary.formats = serde_json::to_value(&device.formats).unwrap_or_default();
    summary.seed = args.engine.seed;
    summary.threads = thread_count(args.engine.threads);
    summary.size = [args.scene.size.width, args.scene.size.height];
    summary.times.device = Some(gpu.device_seconds);
    summary.times.pipelines = Some(gpu.pipeline_seconds);
    summary.times.first_frame = ended.first_frame;
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
