//! The frame loop of a headless run: updates in, frames out, a log row each, until a budget is spent.

use super::args::{BudgetArgs, PixelCounts, RenderArgs};
use super::error_meter::ErrorMeter;
use super::interrupt;
use super::pictures::Picture;
use super::progress::Progress;
use crate::error::{Error, Result};
use crate::log::frame_log::{FrameLog, FrameRecord, PassRecord};
use crate::pass::{FrameOptions, FrameStats, Renderer};
use crate::refine::engine::{Counted, Visible};
use crate::refine::thread::EngineThread;
use crate::refine::update::{EngineStats, Update};
use crate::scene::Display;
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Work of a frame under `--deterministic`, rays.
const RAYS_A_FRAME: u64 = 20_000;

/// Frames between a count of pixels and the engine hearing of it under `--deterministic`.
const COUNTS_LAG: usize = 2;

/// How often a signal is looked for, and the progress line drawn, while nothing else happens.
const TICK: Duration = Duration::from_millis(50);

/// Occlusion queries of a frame: 13 to 30 µs each on a software rasteriser.
const QUERIES_A_FRAME: u32 = 128;

/// A run in progress.
pub struct Session<'a> {
    /// What was typed.
    pub args: &'a RenderArgs,
    /// The GPU side.
    pub renderer: &'a mut Renderer,
    /// The CPU side.
    pub engine: EngineThread,
    /// How images are displayed.
    pub display: Display,
    /// Reference of the same view, for the error columns.
    pub reference: Option<ErrorMeter>,
    /// Progress line.
    pub progress: Progress,
    /// When the process started.
    pub start: Instant,
    /// Level of each triangle by its id.
    pub levels: Vec<u8>,
}

/// What a run did.
#[derive(Clone, Debug)]
pub struct Ended {
    /// Why it ended: a budget's name, `converged`, `interrupted`, or `path` when all its pictures are there.
    pub by: &'static str,
    /// Frames drawn.
    pub frames: u64,
    /// The engine's last totals.
    pub engine: EngineStats,
    /// From the start of the process to the first frame combined, seconds.
    pub first_frame: Option<f64>,
    /// From the start of the process to the first frame in which every visible vertex has a value, seconds.
    pub complete_frame: Option<f64>,
    /// From the first frame to the end, seconds.
    pub elapsed: f64,
}

/// How far a run has come.
pub struct Run {
    log: Option<FrameLog>,
    /// What may be spent until the present picture is done.
    share: BudgetArgs,
    /// Generation of its view.
    wanted: u32,
    /// When the first frame began.
    first_frame: Option<Instant>,
    /// When the first light was there: what `--time` counts from.
    first_light: Option<Instant>,
    last_combine: Option<Instant>,
    frames: u64,
    stats: EngineStats,
    generation: Option<u32>,
    /// Whether anything was drawn since drawn triangles were last counted.
    uncounted: bool,
    /// Counts that the engine has not heard of yet.
    counted: VecDeque<Counted>,
    first_shown: Option<Instant>,
    complete_shown: Option<Instant>,
}

impl Session<'_> {
    /// Starts the log.
    ///
    /// # Errors
    /// The log cannot be written.
    pub fn start(&self) -> Result<Run> {
        let log = match &self.args.log {
            Some(path) => Some(FrameLog::create(path, self.reference.is_some())?),
            None => None,
        };
        Ok(Run {
            log,
            share: self.args.budget,
            wanted: 0,
            first_frame: None,
            first_light: None,
            last_combine: None,
            frames: 0,
            stats: EngineStats::default(),
            generation: None,
            uncounted: false,
            counted: VecDeque::new(),
            first_shown: None,
            complete_shown: None,
        })
    }

    /// Draws frames of a picture whose view the renderer has and whose faces are visible, until its share of the budgets is
    /// spent, nothing is left to do, or a signal comes; returns why it ended.
    ///
    /// # Errors
    /// The device is lost, memory runs out, or the log cannot be written.
    pub fn draw(&mut self, run: &mut Run, picture: &Picture, visible: Visible) -> Result<&'static str> {
        run.wanted = visible.generation;
        self.progress.picture(picture.index, picture.of);
        self.engine.relight(picture.factors.clone(), visible);
        self.renderer.relight(&picture.factors)?;
        loop {
            let moved = self.take_updates(run)?;
            if moved && self.args.camera_path.is_some() {
                run.share = self.args.budget.share(picture.index, picture.of, since(run.first_light), run.stats.rays);
            }
            run.first_frame.get_or_insert_with(Instant::now);
            let by = self.ended_by(run);
            self.frame(run, moved, by.is_some())?;
            if let Some(by) = by {
                return Ok(by);
            }
        }
    }

    /// Hands the engine's updates to the renderer; whether there is a new view to draw.
    fn take_updates(&mut self, run: &mut Run) -> Result<bool> {
        let updates = if run.generation != Some(run.wanted) {
            self.view_arrives(run)?
        } else if self.args.engine.deterministic {
            self.one_step()?
        } else {
            self.arrived(run)?
        };
        // Broken off before there was an engine: bare geometry is drawn.
        let mut moved = run.generation.is_none() && updates.is_empty();
        for update in updates {
            if run.generation != Some(update.generation) {
                run.generation = Some(update.generation);
                self.renderer.reset_drawn();
                moved = true;
            }
            run.stats = update.stats;
            if run.stats.rays > 0 || run.stats.complete {
                run.first_light.get_or_insert_with(Instant::now);
            }
            self.note_levels(&update);
            self.renderer.apply(&update)?;
        }
        Ok(moved)
    }

    /// Keeps what the `level` layer of the written image says of each triangle.
    fn note_levels(&mut self, update: &Update) {
        for (id, drawn) in &update.drawn_triangles {
            let index = id.0 as usize;
            if index >= self.levels.len() {
                self.levels.resize(index + 1, 0);
            }
            self.levels[index] = drawn.level;
        }
    }

    /// The updates of a new view, the first of which shows all of it; what is left of the view before is void. The first view
    /// waits until there is an engine; none comes if a signal breaks that off.
    fn view_arrives(&self, run: &Run) -> Result<Vec<Update>> {
        let start = Instant::now();
        loop {
            let mut updates: Vec<Update> = self.engine.wait_for(TICK).into_iter().collect();
            updates.extend(self.engine.drain().ok_or_else(engine_died)?);
            updates.retain(|update| update.generation == run.wanted);
            let broken_off = interrupt::requested() && run.generation.is_none();
            if !updates.is_empty() || broken_off {
                return Ok(updates);
            }
            if run.generation.is_none() {
                self.progress.waits(start.elapsed());
            }
        }
    }

    /// Lockstep: a fixed amount of work.
    fn one_step(&self) -> Result<Vec<Update>> {
        self.engine.step(RAYS_A_FRAME);
        Ok(vec![self.engine.wait().ok_or_else(engine_died)?])
    }

    /// What has arrived; waits for something, at most until the next refresh is due.
    fn arrived(&self, run: &Run) -> Result<Vec<Update>> {
        let due = run.last_combine.map_or(Duration::ZERO, |last| {
            self.args.refresh.saturating_sub(last.elapsed()).max(Duration::from_millis(1))
        });
        let mut updates: Vec<Update> = Vec::new();
        if !run.stats.converged && !self.renderer.has_pending() {
            updates.extend(self.engine.wait_for(due));
        }
        updates.extend(self.engine.drain().ok_or_else(engine_died)?);
        Ok(updates)
    }

    /// The reason to stop after this frame, if there is one. A picture of a camera path is not left before every vertex that
    /// it shows has a value, or holes would flash by.
    fn ended_by(&self, run: &Run) -> Option<&'static str> {
        let budget = &run.share;
        if self.args.camera_path.is_some() && !run.stats.complete && !interrupt::requested() {
            return None;
        }
        let reached = [
            ("interrupted", interrupt::requested()),
            ("time", budget.time.is_some_and(|limit| since(run.first_light) >= limit)),
            ("frames", budget.frames.is_some_and(|limit| run.frames + 1 >= limit)),
            ("rays", budget.rays.is_some_and(|limit| run.stats.rays >= limit)),
            ("error", budget.least_error().is_some_and(|limit| run.stats.estimated_error.is_some_and(|e| e <= limit))),
            ("converged", run.stats.converged && !self.renderer.has_pending()),
        ];
        reached.iter().find(|(_, is)| *is).map(|(name, _)| *name)
    }

    fn frame(&mut self, run: &mut Run, moved: bool, last: bool) -> Result<()> {
        let due = run.last_combine.is_none_or(|at| at.elapsed() >= self.args.refresh);
        let combine = moved || last || due;
        let options = FrameOptions {
            colour: moved,
            // The last picture shows everything, whatever patches still wait.
            full_luminance: moved || last,
            combine: combine.then_some(self.display),
            update_mode: self.args.update,
            queries: if self.pixel_counts() == PixelCounts::Query { QUERIES_A_FRAME } else { 0 },
        };
        let passes = self.renderer.frame(&options)?;
        run.uncounted |= moved || passes.patches > 0;
        self.count(run, combine)?;
        let now = Instant::now();
        if combine {
            run.shown(now);
        }
        self.log_row(run, moved, now, &passes, (combine, last))?;
        self.progress.update(since(run.first_frame), &run.stats);
        run.frames += 1;
        Ok(())
    }

    /// As asked, or by histogram where the device's queries are not exact.
    fn pixel_counts(&self) -> PixelCounts {
        let inexact = !self.renderer.device().report().precise_queries;
        let asked = self.args.pixel_counts;
        if inexact && asked == PixelCounts::Query { PixelCounts::Histogram } else { asked }
    }

    /// Tells the engine what was drawn, with the pixels of the drawn triangles: all of them with each picture, or those that queries
    /// counted.
    fn count(&mut self, run: &mut Run, combined: bool) -> Result<()> {
        let Some(generation) = run.generation else { return Ok(()) };
        let deterministic = self.args.engine.deterministic;
        let pixels = match self.pixel_counts() {
            PixelCounts::Histogram if run.uncounted && (combined || deterministic) => {
                run.uncounted = false;
                Some(self.renderer.drawn_counts()?.drawn_triangles)
            }
            PixelCounts::Query => Some(self.renderer.query_counts().to_vec()),
            PixelCounts::Atomic => Some(self.renderer.atomic_counts().to_vec()),
            PixelCounts::Histogram | PixelCounts::Off => None,
        };
        let complete = self.pixel_counts() == PixelCounts::Histogram;
        let sequence = self.renderer.drawn_sequence();
        run.counted.push_back(Counted { generation, sequence, pixels, complete });
        let lag = if deterministic { COUNTS_LAG } else { 0 };
        let heard = run.counted.len().saturating_sub(lag);
        run.counted.drain(..heard).for_each(|counted| self.engine.counted(counted));
        Ok(())
    }

    fn log_row(
        &mut self,
        run: &mut Run,
        moved: bool,
        now: Instant,
        passes: &FrameStats,
        (combined, last): (bool, bool),
    ) -> Result<()> {
        let Some(log) = &mut run.log else { return Ok(()) };
        let error = match &mut self.reference {
            Some(reference) if combined => Some(reference.measure(&self.renderer.read_layers()?, last)?),
            _ => None,
        };
        log.record(&FrameRecord {
            frame: run.frames,
            at: run.first_frame.map_or(Duration::ZERO, |first| now.duration_since(first)),
            camera_moved: moved,
            passes: pass_record(passes),
            engine: run.stats,
            memory_mib: Some(
                (run.stats.cache_bytes + self.renderer.device().memory_bytes()) as f64 / f64::from(1 << 20),
            ),
            error,
        })
    }
}

impl Run {
    fn shown(&mut self, now: Instant) {
        self.last_combine = Some(now);
        self.first_shown.get_or_insert(now);
        if self.stats.complete {
            self.complete_shown.get_or_insert(now);
        }
    }

    /// What is to be said of a picture that is left, because of `by`, before every vertex that it shows has a value.
    #[must_use]
    pub fn unfinished(&self, by: &str) -> Option<String> {
        let EngineStats { unlit, visible, complete, .. } = self.stats;
        if complete {
            return None;
        }
        Some(if self.generation.is_none() {
            "the run ended before the ray hierarchy was built: there is no light in the picture".to_owned()
        } else {
            let share = (unlit * 100).div_ceil(visible.max(1));
            format!(
                "the run ended ({by}) before every visible vertex had a value: {unlit} of {visible} ({share} %) have none, and \
                 are black or guessed from others; give it more time"
            )
        })
    }

    /// What was done up to now, which ends because of `by`; `start` is when the process started.
    #[must_use]
    pub fn ended(&self, by: &'static str, start: Instant) -> Ended {
        let since_start = |at: Instant| at.duration_since(start).as_secs_f64();
        Ended {
            by,
            frames: self.frames,
            engine: self.stats,
            first_frame: self.first_shown.map(since_start),
            complete_frame: self.complete_shown.map(since_start),
            elapsed: since(self.first_frame).as_secs_f64(),
        }
    }
}

/// Time since then; none if that is still to come.
fn since(then: Option<Instant>) -> Duration {
    then.map_or(Duration::ZERO, |then| then.elapsed())
}

fn engine_died() -> Error {
    Error::Internal("the light engine has stopped".to_owned())
}

fn pass_record(passes: &FrameStats) -> PassRecord {
    let time = |ms: Option<f64>| ms.map(|ms| Duration::from_secs_f64(ms.max(0.0) * 1e-3));
    PassRecord {
        visibility: time(passes.visibility_ms),
        colour: time(passes.colour_ms),
        luminance: time(passes.luminance_ms),
        combine: time(passes.combine_ms),
        readback: time(passes.readback_ms),
        dirty_parents: Some(passes.patches.into()),
        children_drawn: Some(passes.triangles_drawn.into()),
        queries: Some(passes.queries.into()),
        query_pixels: Some(passes.query_pixels),
    }
}
