//! A run: one loop between the light engine and the renderer, for the command line, a window, scripts and tests.
//!
//! [`Session::open`] sets up device, hierarchy and engine; [`Session::look`] or [`Session::show`] points it at a view;
//! [`Session::step`] is one turn of the loop, [`Session::run`] turns until a budget is spent; [`Session::still`] is the finished image.
//! Nothing here reads the command line, prints, or keeps state outside the session.

mod budget;
mod clock;
mod counting;
mod debug_view;
mod error_meter;
mod frame;
mod interactive;
mod light_engine;
mod observer;
mod options;
pub mod pictures;
mod recording;
mod run_log;
mod setup;
mod show_view;
mod still;
mod thread_times;
mod totals;
mod visible;

pub use budget::{Budget, EndedBy, Spent};
pub use clock::Moment;
pub use debug_view::DebugView;
pub use error_meter::ErrorMeter;
pub use frame::FrameReport;
pub use light_engine::{Batches, LightEngine, Pace};
pub use observer::{Observer, Unobserved};
pub use options::{Frames, Options, PixelCounts, Quality, Refinement, Thresholds, thread_count};
pub use run_log::RunLog;
pub use setup::{Gpu, Hierarchy, Opening, owned_engine};
pub use still::Still;
pub use thread_times::thread_times;
pub use totals::Totals;

use crate::error::{Error, Result};
use crate::pass::{FrameOptions, Renderer};
use crate::refine::engine::Visible;
use crate::refine::pixel_lists::FaceImage;
use crate::refine::replay::Levels;
use crate::refine::update::{EngineStats, Update};
use crate::scene::camera::{Camera, View};
use crate::scene::{Display, FaceId, Scene};
use clock::Clock;
use counting::Counting;
use glam::Vec3;
use pictures::Picture;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How often an interrupt is looked for, and the observer told, while the first frame waits.
const TICK: Duration = Duration::from_millis(50);

/// Occlusion queries of a frame: 13 to 30 µs each on a software rasteriser.
const QUERIES_A_FRAME: u32 = 128;

/// A run in progress: a renderer, a light engine, and what has passed between them.
///
/// One turn is a frame: the engine's updates go to the renderer, it draws, and the engine hears what was
/// drawn. Lengths are in scene units, images in pixels, radiance in W·sr⁻¹·m⁻², errors relative to the image's mean, times by the wall
/// clock. Not safe to share between threads; the engine may have its own.
pub struct Session {
    /// First, so that it stops before the device goes.
    engine: LightEngine,
    renderer: Renderer,
    scene: Arc<Scene>,
    options: Options,
    display: Display,
    /// Whether the display settings changed since the last picture.
    redisplay: bool,
    /// Level of each drawn triangle, for the layer of written images.
    levels: Levels,
    /// What is looked at; `None` before [`Self::look`].
    shot: Option<Shot>,
    /// Generation of the view that is looked at: 1 for the first.
    wanted: u32,
    /// Generation of the view that the engine's last update was for.
    generation: Option<u32>,
    /// What may be spent until the present picture is done.
    share: Budget,
    clock: Clock,
    frames: u64,
    stats: EngineStats,
    counting: Counting,
    debug: debug_view::Debug,
    /// When frames are drawn while the camera is still.
    frames_come: Frames,
}

/// What a turn of the loop took in.
struct Turn {
    updates: Vec<Update>,
    /// Whether there is a new view to draw.
    moved: bool,
}

/// What a session looks at.
struct Shot {
    view: View,
    /// The camera that it comes from.
    camera: Option<Camera>,
    /// Number of a picture of a camera path, and how many there are.
    of_path: Option<(u64, u64)>,
}

impl Session {
    /// A session of a renderer that holds the scene at the options' size, and an engine of the same scene and options.
    #[must_use]
    pub fn new(renderer: Renderer, engine: LightEngine, scene: &Arc<Scene>, options: &Options) -> Self {
        Self {
            counting: Counting::new(options, renderer.device()),
            frames_come: options.frames_on(renderer.device()),
            display: options.display_of(scene),
            redisplay: false,
            scene: Arc::clone(scene),
            share: options.budget,
            options: options.clone(),
            engine,
            renderer,
            levels: Levels::default(),
            shot: None,
            wanted: 0,
            generation: None,
            clock: Clock::default(),
            frames: 0,
            stats: EngineStats::default(),
            debug: debug_view::Debug::default(),
        }
    }

    /// Points the camera at a picture. One of a camera path gets a share of the budget, and is not left before every vertex that it
    /// shows has a value.
    ///
    /// # Errors
    /// [`Error::Exhausted`] when the device is lost or memory runs out.
    pub fn show(&mut self, picture: &Picture) -> Result<()> {
        let view = self.scene.view(&picture.camera, self.options.size);
        let of_path = picture.on_path.then_some((picture.index, picture.of));
        self.aim(Shot { view, camera: Some(picture.camera), of_path }, &picture.factors)
    }

    /// Points the camera; light that was found stays. The lights emit `factors` times what the scene says, in its order, all as
    /// loaded if it is empty. The frames of [`Self::step`] show the view from then on.
    ///
    /// # Errors
    /// [`Error::Exhausted`] when the device is lost or memory runs out.
    pub fn look(&mut self, view: &View, factors: &[Vec3]) -> Result<()> {
        self.aim(Shot { view: *view, camera: None, of_path: None }, factors)
    }

    fn aim(&mut self, shot: Shot, factors: &[Vec3]) -> Result<()> {
        let (faces, image) = visible::visible_faces(&mut self.renderer, &shot.view, self.options.redraws)?;
        self.send_view(faces, image, factors);
        self.renderer.relight(factors)?;
        self.shot = Some(shot);
        Ok(())
    }

    /// Sends the engine a view of a new generation.
    fn send_view(&mut self, faces: Vec<(FaceId, u32)>, image: FaceImage, factors: &[Vec3]) {
        self.wanted += 1;
        let visible = Visible { generation: self.wanted, eye: image.view.eye, image: Some(image), faces };
        self.engine.relight(factors.to_vec(), visible);
    }

    /// One turn of the loop: takes the engine's updates, hands them to the renderer, draws a frame, tells the engine.
    /// The first turn of a view waits for the update that shows all of it; others wait for fixed work, or until something arrives or
    /// a picture is due. Can go on after [`FrameReport::ended_by`], which only says that a limit is reached.
    ///
    /// # Errors
    /// [`Error::Usage`] before there was a view; [`Error::Exhausted`] when the device is lost or memory runs out;
    /// [`Error::Internal`] if the engine has stopped.
    pub fn step(&mut self, observer: &mut dyn Observer) -> Result<FrameReport> {
        if self.shot.is_none() {
            return Err(Error::Usage("there is no view to draw".to_owned()));
        }
        let Turn { mut updates, moved } = self.take_updates(observer)?;
        updates.extend(self.prepare_debug_view()?);
        self.clock.frame_begins();
        let ended_by = self.ended_by(observer.interrupted());
        // The last frame shows everything, whatever patches still wait; so do frames that are seldom.
        let wanted = ended_by.is_some() || observer.wants_picture(&self.stats);
        let whole = moved || wanted || self.frames_come == Frames::Seldom;
        if wanted && !moved {
            let settled = self.engine.settle()?;
            self.apply(&settled)?;
            updates.extend(settled);
        }
        let combined = std::mem::take(&mut self.redisplay)
            || whole
            || matches!(self.frames_come, Frames::Every(time) if self.clock.picture_is_due(time));
        self.clock.drawing_begins();
        let passes = self.renderer.frame(&FrameOptions {
            colour: moved,
            full_luminance: whole,
            combine: combined.then_some(self.display),
            update_mode: self.options.update,
            queries: if self.counting.how == PixelCounts::Query { QUERIES_A_FRAME } else { 0 },
        })?;
        if self.frames_come == Frames::Seldom {
            self.renderer.draw_all_next();
        }
        if let Some(generation) = self.generation {
            self.counting.tell(&self.renderer, &mut self.engine, generation);
        }
        let at = self.clock.frame_ends(combined, self.stats.complete);
        let frame = self.frames;
        self.frames += 1;
        Ok(FrameReport { frame, at, camera_moved: moved, passes, engine: self.stats, combined, ended_by, updates })
    }

    /// Turns until the budget of the present view is spent, nothing is left to do, or the observer interrupts; tells it of each frame.
    ///
    /// # Errors
    /// As [`Self::step`], or what the observer could not do.
    pub fn run(&mut self, observer: &mut dyn Observer) -> Result<EndedBy> {
        loop {
            let report = self.step(observer)?;
            observer.frame(self, &report)?;
            if let Some(by) = report.ended_by {
                return Ok(by);
            }
        }
    }

    /// Takes in the engine's updates until a frame is due.
    fn take_updates(&mut self, observer: &mut dyn Observer) -> Result<Turn> {
        let updates = match self.batches() {
            _ if self.generation != Some(self.wanted) => self.view_arrives(observer)?,
            Some(batches) => self.fixed_work(&batches)?,
            None => self.arrived()?,
        };
        let mut turn = Turn { moved: self.apply(&updates)?, updates };
        while self.batches().is_none()
            && !(turn.moved && self.shows_light() || self.frame_is_due(observer.interrupted()))
        {
            observer.works(self.clock.since_first_frame(), &self.stats);
            let updates = self.arrived()?;
            turn.moved |= self.apply(&updates)?;
            turn.updates.extend(updates);
        }
        Ok(turn)
    }

    /// Whether a frame would show light; where frames are seldom, none is drawn before. Others show the bare geometry at once.
    fn shows_light(&self) -> bool {
        self.frames_come != Frames::Seldom || self.clock.has_light()
    }

    /// Whether a frame is to be drawn of what has arrived.
    fn frame_is_due(&self, interrupted: bool) -> bool {
        self.frames_come != Frames::Seldom
            || self.clock.has_light() && self.clock.frame_is_cheap()
            || self.stats.complete && self.clock.complete_picture.is_none()
            || self.ended_by(interrupted).is_some()
    }

    /// Fixed work between frames; an owned engine has no other.
    fn batches(&self) -> Option<Batches> {
        match (self.options.pace, &self.engine) {
            (Pace::Fixed(batches), _) => Some(batches),
            (Pace::Free, LightEngine::Owned(_)) => Some(Batches::A_FRAME),
            (Pace::Free, LightEngine::Thread(_)) => None,
        }
    }

    /// What is left of the view before, and the first update of a new one, which shows what came into it. The first view waits
    /// until there is an engine; none comes if the observer breaks that off.
    fn view_arrives(&mut self, observer: &mut dyn Observer) -> Result<Vec<Update>> {
        let start = Instant::now();
        let mut updates: Vec<Update> = Vec::new();
        loop {
            updates.extend(self.engine.wait_for(TICK));
            updates.extend(self.engine.arrived()?);
            let broken_off = observer.interrupted() && self.generation.is_none();
            if updates.last().is_some_and(|update| update.generation == self.wanted) || broken_off {
                return Ok(updates);
            }
            if self.generation.is_none() {
                observer.waits(start.elapsed());
            }
        }
    }

    /// Lockstep: a fixed amount of work.
    fn fixed_work(&mut self, batches: &Batches) -> Result<Vec<Update>> {
        let batch = |_| {
            self.engine.step(batches.rays);
            self.engine.wait()
        };
        (0..batches.until_next_frame(self.stats.rays)).map(batch).collect()
    }

    /// What has arrived; waits for something, at most until the next picture is due.
    fn arrived(&mut self) -> Result<Vec<Update>> {
        let mut updates: Vec<Update> = Vec::new();
        if !self.stats.converged && !self.renderer.has_pending() {
            let most = match self.frames_come {
                Frames::Every(time) => self.clock.until_picture(time),
                Frames::Seldom => TICK,
            };
            updates.extend(self.engine.wait_for(most));
        }
        updates.extend(self.engine.arrived()?);
        Ok(updates)
    }

    /// Hands updates to the renderer; whether there is a new view to draw.
    fn apply(&mut self, updates: &[Update]) -> Result<bool> {
        // Broken off before there was an engine: bare geometry is drawn.
        let mut moved = self.generation.is_none() && updates.is_empty();
        for update in updates {
            if self.generation != Some(update.generation) {
                self.generation = Some(update.generation);
                moved = true;
            }
            self.stats = update.stats;
            if self.stats.rays > 0 || self.stats.complete {
                self.clock.light_is_there();
            }
            self.levels.apply(update);
            self.renderer.apply(update)?;
            self.hear_for_debug_view(update)?;
        }
        if moved {
            self.share_budget();
        }
        Ok(moved)
    }

    fn share_budget(&mut self) {
        let of_path = self.shot.as_ref().and_then(|shot| shot.of_path);
        self.share = of_path.map_or(self.options.budget, |picture| self.options.budget.share(picture, &self.spent()));
    }

    fn spent(&self) -> Spent {
        Spent {
            time: self.clock.since_light(),
            frames: self.frames + 1,
            rays: self.stats.rays,
            error: self.stats.estimated_error,
            converged: self.stats.converged && !self.renderer.has_pending(),
        }
    }

    /// The reason to end with the coming frame, if there is one. A picture of a camera path is not left before every vertex that
    /// it shows has a value, or holes would flash by.
    fn ended_by(&self, interrupted: bool) -> Option<EndedBy> {
        if interrupted {
            return Some(EndedBy::Interrupted);
        }
        let on_path = self.shot.as_ref().is_some_and(|shot| shot.of_path.is_some());
        if on_path && !self.stats.complete { None } else { self.share.ended_by(&self.spent()) }
    }

    /// The renderer, to look at.
    #[must_use]
    pub const fn renderer(&self) -> &Renderer {
        &self.renderer
    }

    /// The renderer, to read images. What it draws otherwise must be drawn again by the next step: change nothing else of it.
    pub const fn renderer_mut(&mut self) -> &mut Renderer {
        &mut self.renderer
    }

    /// Ends the run: the engine stops; the renderer keeps the scene and its images.
    #[must_use]
    pub fn into_renderer(self) -> Renderer {
        self.renderer
    }

    /// Memory of the cache and of the device, bytes.
    #[must_use]
    pub fn memory_bytes(&self) -> u64 {
        self.stats.cache_bytes + self.renderer.device().memory_bytes()
    }

    /// Whether the engine has nothing to do until it hears more: of an owned one as it stands, of one on a thread by its last update.
    #[must_use]
    pub fn is_idle(&self) -> bool {
        self.engine.is_idle().unwrap_or(self.stats.converged) && !self.debug.waits()
    }
}
