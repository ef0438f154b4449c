//! `penombre compare`: one refinement recorded, replayed in every update mode, reported.

use super::args::{CompareArgs, CompareLimits};
use super::studio::Studio;
use super::{Outcome, interrupt, output, scene};
use crate::compare::cost;
use crate::compare::page::{self, Shot};
use crate::compare::pictures::{Part, Pictures, displayed};
use crate::compare::replay::{self, Truths, replay};
use crate::compare::report::{ModeRow, Report, TiltRow};
use crate::compare::{DepthChoice, Recording};
use crate::error::{Error, Result};
use crate::geom::bvh::Bvh;
use crate::image::{atomic, flip};
use crate::pass::{Depth, DepthFormat, Renderer, RendererOptions, UpdateMode};
use crate::refine::replay::HostMesh;
use crate::scene::Scene;
use crate::vk::{Device, DeviceOptions};
use glam::Vec2;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::fs;
use std::io::Write as _;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

/// The files of figures.
const REPORTS: [&str; 4] = ["report.html", "report.json", "artefacts.csv", "cost.csv"];

/// Runs the command; `start` is when the process started.
///
/// # Errors
/// Bad input, no usable device or one that lacks what was asked for, a lost device, or an output that cannot be written.
pub fn run(args: &CompareArgs, start: Instant) -> Result<Outcome> {
    check_memory(args)?;
    prepare_folder(&args.out)?;
    let device = Device::new(&DeviceOptions { device: args.device.device.clone(), validation: None })?;
    let mut report = new_report(args, &device);
    let depths = depths(args, &device, &mut report)?;
    let modes = modes(args, &device, &mut report)?;
    let scene = scene::load_and_warn(&args.scene(), args.verbosity)?.scene;
    let camera = scene::camera(&scene, args.camera.as_deref())?;
    let bvh = Arc::new(Bvh::build(&scene));
    let studio = Studio { args, scene: Arc::new(scene), bvh, camera };
    let mut run = Run { args, device: Arc::clone(&device), report, shots: Vec::new(), progress: progress(args) };
    let recordings = run.record(&studio)?;
    for (number, &depth) in depths.iter().enumerate() {
        run.compare(&studio.scene, &recordings, depth, &modes, number == 0)?;
    }
    run.progress.finish_and_clear();
    run.finish(start)
}

fn progress(args: &CompareArgs) -> ProgressBar {
    let bar = if args.verbosity.quiet {
        ProgressBar::hidden()
    } else {
        ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr_with_hz(10))
    };
    bar.with_style(ProgressStyle::with_template("{msg}").unwrap_or_else(|_| ProgressStyle::default_bar()))
}

fn prepare_folder(folder: &Path) -> Result<()> {
    fs::create_dir_all(folder).map_err(|e| Error::io(folder, "cannot make the folder", e))?;
    let files = REPORTS.map(|name| folder.join(name));
    atomic::check_writable(&files.each_ref().map(|path| path.as_path()))
}

/// Bytes that full redraws may take on the host: what they show is kept for each comparison.
const MAX_BYTES: u64 = 4 << 30;
/// Bytes of a pixel of those: radiance, and the triangle by depth and by look-up.
const PIXEL_BYTES: u64 = 20;

fn check_memory(args: &CompareArgs) -> Result<()> {
    let comparisons = u64::from(args.recording.updates.div_ceil(args.recording.every));
    let bytes = args.size.pixels() as u64 * PIXEL_BYTES * comparisons;
    if bytes <= MAX_BYTES {
        return Ok(());
    }
    let [needed, allowed] = [bytes, MAX_BYTES].map(|b| b >> 20);
    Err(Error::Usage(format!(
        "{comparisons} comparisons of pictures of this size take {needed} MiB, at most {allowed} are allowed; try a larger \
         --every, fewer --updates or a smaller --size"
    )))
}

fn new_report(args: &CompareArgs, device: &Device) -> Report {
    Report {
        command: std::env::args_os().map(|word| word.to_string_lossy().into_owned()).collect(),
        version: env!("CARGO_PKG_VERSION"),
        scene: args.scene.file_name().unwrap_or_default().to_string_lossy().into_owned(),
        device: Some(device.report().clone()),
        size: [args.size.width, args.size.height],
        updates: args.recording.updates as usize,
        every: args.recording.every as usize,
        rays: args.recording.rays,
        seed: args.recording.seed,
        cost_runs: args.what.runs as usize,
        ..Report::default()
    }
}

/// The depths asked for, each of which the device must have; without any, those that it has.
fn depths(args: &CompareArgs, device: &Device, report: &mut Report) -> Result<Vec<DepthChoice>> {
    let all = DepthFormat::NAMES.map(|(_, format)| format);
    let asked = if args.what.depth_formats.is_empty() { all.as_slice() } else { &args.what.depth_formats };
    let mut choices = Vec::new();
    for &order in &args.what.depth {
        for &format in asked {
            match Depth::new(device, Some(format), order) {
                Ok(_) if choices.contains(&DepthChoice { format, order }) => {}
                Ok(_) => choices.push(DepthChoice { format, order }),
                Err(lacking) if args.what.depth_formats.is_empty() => report.refused.push(lacking.to_string()),
                Err(lacking) => return Err(lacking),
            }
        }
    }
    Ok(choices)
}

/// The modes likewise.
fn modes(args: &CompareArgs, device: &Device, report: &mut Report) -> Result<Vec<UpdateMode>> {
    let asked = if args.what.modes.is_empty() { UpdateMode::ALL.as_slice() } else { &args.what.modes };
    let mut modes = Vec::new();
    for &mode in asked {
        match mode.check(device.report()) {
            Ok(()) if modes.contains(&mode) => {}
            Ok(()) => modes.push(mode),
            Err(lacking) if args.what.modes.is_empty() => report.refused.push(lacking.to_string()),
            Err(lacking) => return Err(lacking),
        }
    }
    Ok(modes)
}

/// A comparison in progress.
struct Run<'a> {
    args: &'a CompareArgs,
    device: Arc<Device>,
    report: Report,
    shots: Vec<Shot>,
    progress: ProgressBar,
}

impl Run<'_> {
    fn say(&self, text: String) {
        self.progress.set_message(text);
        self.progress.tick();
    }

    /// A renderer of the scene; `modes` are those that it is made for.
    fn renderer(&self, scene: &Scene, depth: Depth, modes: Vec<UpdateMode>, count_writes: bool) -> Result<Renderer> {
        let options = RendererOptions { depth, modes, count_writes, ..RendererOptions::new(&self.device)? };
        let mut renderer = Renderer::with_options(Arc::clone(&self.device), self.args.size, options)?;
        renderer.load(scene)?;
        renderer.resize(self.args.size)?;
        Ok(renderer)
    }

    /// Records a refinement a tilt.
    fn record(&mut self, studio: &Studio<'_>) -> Result<Vec<Recording>> {
        let depth = RendererOptions::new(&self.device)?.depth;
        let mut renderer = self.renderer(&studio.scene, depth, vec![UpdateMode::Full], false)?;
        let anchor = studio.anchor(&mut renderer)?;
        let mut recordings = Vec::new();
        for &tilt in &self.args.what.tilts {
            let known = self.report.tilts.iter().any(|row| row.name == tilt.name());
            if known || interrupt::requested() {
                continue;
            }
            self.say(format!("recording: {}", tilt.name()));
            let recording;
            (renderer, recording) = studio.record(renderer, &anchor, tilt)?;
            self.report.tilts.push(TiltRow::new(&recording));
            recordings.push(recording);
        }
        Ok(recordings)
    }

    /// Replays all recordings in all modes on one depth; measures costs and keeps pictures of the first.
    fn compare(
        &mut self,
        scene: &Scene,
        recordings: &[Recording],
        choice: DepthChoice,
        modes: &[UpdateMode],
        is_first: bool,
    ) -> Result<()> {
        let depth = Depth::new(&self.device, Some(choice.format), choice.order)?;
        let mut fitting = modes.to_vec();
        fitting.retain(|mode| depth.check(*mode).is_ok());
        if fitting.is_empty() {
            // Nothing can be compared on this depth: why not, by the first.
            return modes.first().map_or(Ok(()), |mode| depth.check(*mode));
        }
        let mut renderer = self.renderer(scene, depth, fitting.clone(), true)?;
        if !renderer.stencil_works() && fitting.iter().any(|mode| mode.needs_stencil()) {
            fitting.retain(|mode| !mode.needs_stencil());
            let why = "the device does not redraw triangles at exactly equal depth (self-test)";
            self.report.refused.push(format!("{}: stencil modes: {why}", choice.name()));
        }
        for recording in recordings {
            self.replay_all(scene, &mut renderer, recording, choice, &fitting, is_first)?;
        }
        match recordings.first() {
            Some(recording) if is_first => self.measure_costs(scene, &mut renderer, recording, &fitting),
            _ => Ok(()),
        }
    }

    fn replay_all(
        &mut self,
        scene: &Scene,
        renderer: &mut Renderer,
        recording: &Recording,
        choice: DepthChoice,
        modes: &[UpdateMode],
        keeps_pictures: bool,
    ) -> Result<()> {
        let stop = &interrupt::requested;
        let (size, every) = (self.args.size, self.report.every);
        self.say(format!("{} {}: full redraws", recording.tilt, choice.name()));
        let truths = Truths::new(renderer, recording, every, modes.contains(&UpdateMode::Lookup), stop)?;
        let Some(wanted) = truths.last().map(|radiance| displayed(radiance, &scene.display)) else { return Ok(()) };
        let mut outcomes = Vec::new();
        for &mode in modes {
            self.say(format!("{} {}: {}", recording.tilt, choice.name(), mode.name()));
            let outcome = replay(renderer, recording, mode, &truths, stop)?;
            if interrupt::requested() {
                return Ok(());
            }
            let shown = displayed(&outcome.radiance, &scene.display);
            // Most modes end with the very picture.
            let map = if shown == wanted { vec![0.0] } else { flip::error_map(&shown, &wanted, size) };
            self.report.modes.push(ModeRow::new(
                &outcome,
                recording.tilt,
                choice,
                flip::mean(&map, None).unwrap_or(0.0),
            ));
            outcomes.push((outcome, shown));
        }
        self.save_pictures((recording, choice), &outcomes, &wanted, keeps_pictures)
    }

    /// Writes the pictures of a tilt on a depth; those of the first depth go into the page, too.
    fn save_pictures(
        &mut self,
        (recording, choice): (&Recording, DepthChoice),
        outcomes: &[(replay::Outcome, Vec<[u8; 3]>)],
        wanted: &[[u8; 3]],
        keep: bool,
    ) -> Result<()> {
        let size = self.args.size;
        let wrong = |outcome: &replay::Outcome| outcome.counts.stale;
        let Some((_, most)) = outcomes.iter().max_by_key(|(outcome, _)| wrong(outcome)) else { return Ok(()) };
        let part = Part::most_different(size, most, wanted);
        for (outcome, shown) in outcomes {
            let pictures = Pictures::new(size, shown, &outcome.marks, part)?;
            let name = format!("{}_{}_{}", recording.tilt, choice.name(), outcome.mode.name());
            write(&self.args.out.join(format!("{name}.png")), &pictures.image)?;
            write(&self.args.out.join(format!("{name}_mask.png")), &pictures.mask)?;
            if keep {
                self.shots.push(Shot { tilt: recording.tilt, mode: outcome.mode.name(), pictures });
            }
        }
        Ok(())
    }

    /// Costs on the mesh that a recording ends with.
    fn measure_costs(
        &mut self,
        scene: &Scene,
        renderer: &mut Renderer,
        recording: &Recording,
        modes: &[UpdateMode],
    ) -> Result<()> {
        let mut mesh = HostMesh::default();
        recording.updates.iter().try_for_each(|update| mesh.apply(update))?;
        renderer.set_view(&recording.view, Vec2::ZERO);
        renderer.visibility()?;
        for &patches in self.args.what.patches.iter().filter(|_| self.args.what.runs > 0) {
            self.say(format!("cost of {patches} patches"));
            let often = (patches as usize, self.args.what.runs as usize);
            let costs = cost::measure(renderer, (scene, &mesh), modes, often, &interrupt::requested)?;
            self.report.costs.extend(costs);
        }
        Ok(())
    }

    /// Writes the report and says what was found.
    fn finish(mut self, start: Instant) -> Result<Outcome> {
        let (args, report) = (self.args, &mut self.report);
        report.seconds = start.elapsed().as_secs_f64();
        report.interrupted = interrupt::requested();
        report.exceeded = exceeded(&args.limits, &report.modes);
        let texts = [page::html(report, &self.shots), report.json()?, report.artefacts_csv()?, report.costs_csv()?];
        for (name, text) in REPORTS.iter().zip(texts) {
            write(&args.out.join(name), text.as_bytes())?;
        }
        report.exceeded.iter().for_each(|line| output::report(line));
        if !args.verbosity.quiet {
            output::report(&report.line());
        }
        Ok(match (report.interrupted, report.exceeded.is_empty()) {
            (true, _) => Outcome::Interrupted,
            (false, true) => Outcome::Done,
            (false, false) => Outcome::LimitExceeded,
        })
    }
}

fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    atomic::write(path, |file| file.write_all(bytes))
}

/// A line for each limit that a row exceeds.
fn exceeded(limits: &CompareLimits, rows: &[ModeRow]) -> Vec<String> {
    let of_row = |row: &ModeRow| {
        let checks = [
            ("--max-missed", limits.max_missed, row.missed_fraction),
            ("--max-foreign", limits.max_foreign, row.foreign_fraction),
            ("--max-error", limits.max_error, row.relative_error),
            ("--max-flip", limits.max_flip, row.flip),
        ];
        let place = format!("{}, {}, {}", row.mode, row.depth(), row.tilt);
        let over = checks.into_iter().filter_map(move |(name, limit, value)| {
            limit.filter(|limit| value > *limit).map(|limit| format!("{place}: {name} {limit} exceeded: {value:.3e}"))
        });
        over.collect::<Vec<_>>()
    };
    rows.iter().flat_map(of_row).collect()
}
