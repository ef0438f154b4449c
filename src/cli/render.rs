//! `penombre render`: set up in parallel, run the frame loop, write the images.

use super::args::RenderArgs;
use super::black_picture::Shown;
use super::progress::Progress;
use super::{Outcome, interrupt, numbered, output, scene};
use crate::error::{Error, Result};
use crate::image::exr::{RgbImage, read_rgb};
use crate::log::summary::{Memory, Summary};
use crate::pass::Renderer;
use crate::refine::update::EngineStats;
use crate::scene::Scene;
use crate::scene::load::Loaded;
use crate::scene::report::Severity;
use crate::session::pictures::{Picture, Pictures};
use crate::session::{
    EndedBy, ErrorMeter, FrameReport, Hierarchy, Observer, Opening, PixelCounts, RunLog, Session, Still, Totals,
    thread_count, thread_times,
};
use crate::system;
use crate::vk::Device;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Runs the command; `start` is when the process started.
///
/// # Errors
/// Bad input, no usable device, a lost device, or an output that cannot be written.
pub fn run(args: &RenderArgs, start: Instant) -> Result<Outcome> {
    args.check_outputs()?;
    let reference = args.reference.as_deref().map(|path| read_reference(path, args)).transpose()?;
    let mut options = args.options();
    let gpu = Opening::start(&options)?;
    let loading = Instant::now();
    let mut hierarchy = None;
    let Loaded { scene, report, .. } = scene::load_and_warn_beside(&args.scene, args.verbosity, |geometry| {
        hierarchy = Some(Hierarchy::start(geometry));
    })?;
    let hierarchy = hierarchy.ok_or_else(|| Error::Internal("a scene was loaded without triangles".to_owned()))??;
    let mut summary = Summary::of_this_run();
    summary.times.load = Some(loading.elapsed().as_secs_f64());
    summary.warnings = report.lines(Severity::Warning);
    summary.stand_ins = report.lines(Severity::StandIn);
    summary.origin = scene.origin.to_array();
    let camera = scene::camera(&scene, args.scene.camera.as_deref())?;
    let pictures = Pictures::new(&scene, camera, args.camera_path.as_deref(), args.budget.frames)?;
    let display = args.output.display(&scene.display);
    options.display = Some(display);
    let scene = Arc::new(scene);
    let gpu = gpu.finish()?;
    (summary.times.device, summary.times.pipelines) = (Some(gpu.device_seconds), Some(gpu.pipeline_seconds));
    let bvh_seconds = Arc::clone(&hierarchy.seconds);
    let mut session = gpu.session(&scene, |scene| hierarchy.finish(scene), &options)?;
    let reference = reference.map(|image| ErrorMeter::new(image, display));
    if let Some((compared, all)) = reference.as_ref().filter(|_| !args.verbosity.quiet).map(ErrorMeter::compared) {
        output::report(&format!("--reference: {compared} of {all} pixels compared"));
    }
    summary.warnings.extend(fallbacks(args, session.renderer()));
    let mut making = Making::start(args, &scene, reference, &mut summary)?;
    let by = making.make(&mut session, &pictures)?;
    making.watch.progress.finish();
    let totals = session.totals();
    summary.cpu.threads = thread_times(totals.engine.own_job_seconds);
    let renderer = session.into_renderer();
    summary.times.bvh = bvh_seconds.get().copied();
    finish(args, summary, renderer.device(), &Ended { by, totals, start })?;
    let device = Arc::clone(renderer.device());
    drop(renderer);
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

/// Says what the device cannot do as asked, and what is done instead.
fn fallbacks(args: &RenderArgs, renderer: &Renderer) -> Vec<String> {
    let device = &renderer.device().report().name;
    let inexact = args.pixel_counts == PixelCounts::Query && !renderer.device().report().precise_queries;
    let unequal = args.update.needs_stencil() && !renderer.stencil_works();
    let cases = [
        (inexact, "counts no pixels exactly by query: --pixel-counts image is used"),
        (unequal, "does not redraw triangles at equal depth: --update id is used"),
    ];
    let warnings: Vec<String> = cases.iter().filter(|c| c.0).map(|c| format!("warning: {device} {}", c.1)).collect();
    warnings.iter().for_each(|warning| output::report(warning));
    warnings
}

/// Watches the frames of the run: progress line, frame log, signals.
struct Watch {
    progress: Progress,
    log: Option<RunLog>,
}

impl Observer for Watch {
    fn interrupted(&self) -> bool {
        interrupt::requested()
    }

    fn waits(&mut self, elapsed: Duration) {
        self.progress.waits(elapsed);
    }

    fn works(&mut self, elapsed: Duration, stats: &EngineStats) {
        self.progress.update(elapsed, stats);
    }

    fn frame(&mut self, session: &mut Session, report: &FrameReport) -> Result<()> {
        if let Some(log) = &mut self.log {
            log.row(session, report)?;
        }
        self.progress.update(report.at, &report.engine);
        Ok(())
    }
}

/// The pictures in the making.
struct Making<'a> {
    args: &'a RenderArgs,
    scene: &'a Scene,
    summary: &'a mut Summary,
    watch: Watch,
    /// Whether a picture was doubtful: of those of a path the first speaks for all.
    doubted: bool,
}

impl<'a> Making<'a> {
    /// Starts the log.
    fn start(
        args: &'a RenderArgs,
        scene: &'a Scene,
        reference: Option<ErrorMeter>,
        summary: &'a mut Summary,
    ) -> Result<Self> {
        let log = args.log.as_deref().map(|path| RunLog::create(path, reference)).transpose()?;
        let watch = Watch { progress: Progress::new(args.verbosity.quiet), log };
        Ok(Self { args, scene, summary, watch, doubted: false })
    }

    /// Makes all pictures and writes each when it is done; a signal makes the present one the last. Why the last ended.
    fn make(&mut self, session: &mut Session, pictures: &Pictures) -> Result<EndedBy> {
        for index in 0..pictures.count() {
            let picture = pictures.picture(index, self.scene);
            session.show(&picture)?;
            self.watch.progress.picture(picture.index, picture.of);
            let by = session.run(&mut self.watch)?;
            let still = session.still()?;
            self.write(&still, &picture)?;
            if !self.doubted
                && let Some(doubt) = session.unfinished(by).or_else(|| black(&still, self.scene, &picture))
            {
                self.doubted = true;
                self.warn(&format!("warning: {}{doubt}", picture.prefix()));
            }
            if interrupt::requested() || pictures.count() == 1 {
                return Ok(by);
            }
        }
        Ok(EndedBy::Path)
    }

    fn write(&mut self, still: &Still, picture: &Picture) -> Result<()> {
        let comments = self.args.image_options() + &picture.label();
        for path in &self.args.output.paths {
            let path = numbered::file(path, picture);
            if let Some(warning) = still.write(&path, &comments)? {
                self.warn(&format!("{}: warning: {warning}", path.display()));
            }
        }
        Ok(())
    }

    fn warn(&mut self, line: &str) {
        self.watch.progress.report(line);
        self.summary.warnings.push(line.to_owned());
    }
}

/// What is to be said of a black picture; `None` if it is none.
fn black(still: &Still, scene: &Scene, picture: &Picture) -> Option<String> {
    let Still { view, display, combined, layers, .. } = still;
    let shown = Shown { scene, view, display: *display, factors: &picture.factors, combined, layers };
    shown.why_black().map(|why| format!("the picture is black: {why}"))
}

/// Prints what was not destroyed, where the validation layers listen (`PENOMBRE_VALIDATION=1`); their own messages are
/// printed as they come.
fn say_what_is_left(device: &Device) {
    if device.validates() {
        device.live_objects().iter().for_each(|object| output::report(&format!("vulkan: not destroyed: {object}")));
    }
}

/// How the run ended.
struct Ended {
    by: EndedBy,
    totals: Totals,
    /// When the process started.
    start: Instant,
}

impl Ended {
    /// Fills in when frames were there, and the end, which is now.
    fn clocks(&self, summary: &mut Summary) {
        let Totals { first_picture, lit_picture, complete_picture, last_picture, engine, .. } = self.totals;
        let (times, cpu) = (&mut summary.times, &mut summary.cpu);
        for (moment, wall, cpu) in [
            (first_picture, &mut times.first_frame, &mut cpu.first_frame),
            (lit_picture, &mut times.lit_frame, &mut cpu.lit_frame),
            (complete_picture, &mut times.complete_frame, &mut cpu.complete_frame),
            (last_picture, &mut times.last_frame, &mut cpu.last_frame),
        ] {
            *wall = moment.map(|moment| moment.at.duration_since(self.start).as_secs_f64());
            *cpu = moment.and_then(|moment| moment.cpu_seconds);
        }
        times.total = Some(self.start.elapsed().as_secs_f64());
        cpu.total = system::cpu_seconds();
        cpu.light = engine.cpu_seconds;
    }
}

/// Writes the run summary beside the log and says what was done.
fn finish(args: &RenderArgs, mut summary: Summary, device: &Device, ended: &Ended) -> Result<()> {
    let (device, memory_on_device) = (device.report(), device.memory_bytes());
    let Totals { frames, ahead, engine, elapsed, .. } = ended.totals;
    let rate = |seconds: f64| (seconds > 0.0).then(|| engine.rays as f64 / seconds);
    summary.device.clone_from(&device.name);
    summary.driver.clone_from(&device.driver);
    summary.formats = serde_json::to_value(&device.formats).unwrap_or_default();
    summary.seed = args.engine.seed;
    summary.threads = thread_count(args.engine.threads);
    summary.size = [args.scene.size.width, args.scene.size.height];
    ended.clocks(&mut summary);
    summary.memory = Memory {
        triangles: engine.triangles,
        cache_bytes: engine.cache_bytes,
        device_bytes: memory_on_device,
        peak_bytes: system::peak_memory(),
    };
    summary.frames = frames;
    summary.ahead = ahead;
    summary.rays = engine.rays;
    summary.rays_per_second = rate(elapsed.as_secs_f64());
    summary.rays_per_cpu_second = rate(engine.cpu_seconds);
    summary.ended_by = Some(ended.by.name().to_owned());
    if !args.verbosity.quiet {
        output::report(&summary.line(engine.estimated_error));
    }
    if args.verbosity.verbose {
        summary.details().iter().for_each(|line| output::report(line));
    }
    args.log.as_deref().map_or(Ok(()), |log| summary.write(&Summary::path_beside(log)))
}
