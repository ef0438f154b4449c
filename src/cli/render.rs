//! `penombre render`: set up in parallel, run the frame loop, write the images.

use super::args::RenderArgs;
use super::black_picture::Shown;
use super::kept::Kept;
use super::progress::Progress;
use super::{Outcome, interrupt, numbered, output, scene, trace};
use crate::error::{Error, Result};
use crate::image::exr::{RgbImage, read_rgb};
use crate::log::summary::Summary;
use crate::pass::Renderer;
use crate::refine::update::EngineStats;
use crate::scene::Scene;
use crate::scene::load::Loaded;
use crate::scene::report::Severity;
use crate::session::pictures::{Picture, Pictures};
use crate::session::{
    EndedBy, ErrorMeter, FrameReport, Hierarchy, Observer, Opening, Options, PixelCounts, RunLog, Session, Still,
    thread_times,
};
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
    trace::traced(args.trace.as_deref(), || render(args, start))
}

fn render(args: &RenderArgs, start: Instant) -> Result<Outcome> {
    let reference = args.reference.as_deref().map(|path| read_reference(path, args)).transpose()?;
    let kept = Kept::open(&args.cache, args.memory.budget(), args.verbosity.quiet)?;
    let mut options = Options { store: kept.store(), ..args.options() };
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
    let mut making = Making::start(args, (&scene, kept), reference, &mut summary)?;
    let by = making.make(&mut session, &pictures)?;
    making.watch.progress.finish();
    let Watch { kept, warnings, .. } = making.watch;
    summary.warnings.extend(warnings);
    let totals = session.totals();
    summary.cpu.threads = thread_times(totals.engine.own_job_seconds);
    let renderer = session.into_renderer();
    // The engine has ended.
    let (light, warnings) = kept.close();
    summary.kept = light;
    summary.warnings.extend(warnings);
    summary.times.bvh = bvh_seconds.get().copied();
    totals.summarise(&mut summary, renderer.device(), &options, start);
    finish(args, summary, by, totals.engine.estimated_error)?;
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
    kept: Kept,
    /// What was warned of it.
    warnings: Vec<String>,
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
        self.warnings.extend(self.kept.say(|line| self.progress.report(line)));
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
    /// Whether it was said that there is too little memory, or will be, likewise.
    short_of_memory: bool,
    foreseen: bool,
}

impl<'a> Making<'a> {
    /// Starts the log.
    fn start(
        args: &'a RenderArgs,
        (scene, kept): (&'a Scene, Kept),
        reference: Option<ErrorMeter>,
        summary: &'a mut Summary,
    ) -> Result<Self> {
        let log = args.log.as_deref().map(|path| RunLog::create(path, reference)).transpose()?;
        let watch = Watch { progress: Progress::new(args.verbosity.quiet), log, kept, warnings: Vec::new() };
        Ok(Self { args, scene, summary, watch, doubted: false, short_of_memory: false, foreseen: false })
    }

    /// Makes all pictures and writes each when it is done; a signal makes the present one the last. Why the last ended.
    fn make(&mut self, session: &mut Session, pictures: &Pictures) -> Result<EndedBy> {
        for index in 0..pictures.count() {
            let picture = pictures.picture(index, self.scene);
            self.surviving(session, |session, _| session.show(&picture))?;
            self.foresee(session, &picture);
            self.watch.progress.picture(picture.index, picture.of);
            let by = self.surviving(session, Session::run)?;
            let still = self.surviving(session, |session, _| session.still())?;
            self.write(&still, &picture)?;
            if !self.doubted
                && let Some(doubt) = session.unfinished(by).or_else(|| black(&still, self.scene, &picture))
            {
                self.doubted = true;
                self.warn(&format!("warning: {}{doubt}", picture.prefix()));
            }
            if let Some(doubt) = session.memory_doubt().filter(|_| !std::mem::replace(&mut self.short_of_memory, true))
            {
                self.warn(&format!("warning: {}{doubt}", picture.prefix()));
            }
            if interrupt::requested() || pictures.count() == 1 {
                return Ok(by);
            }
        }
        Ok(EndedBy::Path)
    }

    /// Notes how much memory the light of a picture will take, and says so if it is more than there is.
    fn foresee(&mut self, session: &Session, picture: &Picture) {
        let memory = &mut self.summary.memory_forecast;
        *memory = (*memory).max(session.forecast());
        if let Some(doubt) = session.short_forecast().filter(|_| !std::mem::replace(&mut self.foreseen, true)) {
            self.warn(&format!("warning: {}{doubt}", picture.prefix()));
        }
    }

    /// Does something with the session; once more if the device is lost meanwhile.
    fn surviving<R>(
        &mut self,
        session: &mut Session,
        mut what: impl FnMut(&mut Session, &mut dyn Observer) -> Result<R>,
    ) -> Result<R> {
        let fault = match what(session, &mut self.watch) {
            Err(fault) => fault,
            done => return done,
        };
        let said = format!("warning: {fault}; it was opened again");
        session.recover(fault)?;
        self.warn(&said);
        what(session, &mut self.watch)
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
    let shown = Shown { scene, view, display: *display, lights: &picture.lights, combined, layers };
    shown.why_black().map(|why| format!("the picture is black: {why}"))
}

/// Prints what was not destroyed, where the validation layers listen (`PENOMBRE_VALIDATION=1`); their own messages are
/// printed as they come.
fn say_what_is_left(device: &Device) {
    if device.validates() {
        device.live_objects().iter().for_each(|object| output::report(&format!("vulkan: not destroyed: {object}")));
    }
}

/// Writes the run summary beside the log and says what was done.
fn finish(args: &RenderArgs, mut summary: Summary, by: EndedBy, estimated_error: Option<f32>) -> Result<()> {
    summary.ended_by = Some(by.name().to_owned());
    if !args.verbosity.quiet {
        output::report(&summary.line(estimated_error));
    }
    if args.verbosity.verbose {
        summary.details().iter().for_each(|line| output::report(line));
    }
    args.log.as_deref().map_or(Ok(()), |log| summary.write(&Summary::path_beside(log)))
}
