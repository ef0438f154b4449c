//! A run: one loop between the light engine and the renderer, for the command line, a window, scripts and tests.
//!
//! [`Session::open`] sets up device, hierarchy and engine; [`Session::look`] or [`Session::show`] points it at a view;
//! [`Session::step`] is one turn of the loop, [`Session::run`] turns until a budget is spent; [`Session::still`] is the finished image.
//! Nothing here reads the command line, prints, or keeps state outside the session.

mod budget;
mod clock;
mod counting;
mod debug_view;
mod drawing;
mod error_meter;
mod forecast;
mod frame;
mod interactive;
mod light_engine;
mod observer;
mod options;
pub mod pictures;
mod probe;
mod recording;
mod recovery;
mod reload;
mod run_log;
mod setup;
mod show_view;
mod specular_age;
mod still;
mod summarise;
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
pub use options::{Frames, Moves, Options, PixelCounts, Quality, Refinement, Thresholds, memory_budget, thread_count};
pub use probe::Probe;
pub use run_log::RunLog;
pub use setup::{Gpu, Hierarchy, Opening, owned_engine};
pub use still::Still;
pub use thread_times::thread_times;
pub use totals::Totals;

use crate::error::{Error, Result};
use crate::log::summary::AheadPictures;
use crate::pass::Renderer;
use crate::refine::engine::Visible;
use crate::refine::pixel_lists::FaceImage;
use crate::refine::replay::Levels;
use crate::refine::update::{EngineStats, Update};
use crate::scene::camera::{Camera, View};
use crate::scene::extent::Clearance;
use crate::scene::light::LightState;
use crate::scene::{Display, FaceId, Scene};
use crate::trace::{self, within};
use clock::Clock;
use counting::Counting;
use pictures::Picture;
use specular_age::SpecularAge;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How often an interrupt is looked for, and the observer told, while the first frame waits.
const TICK: Duration = Duration::from_millis(50);

/// How long a picture waits for S that is not too old: a walk goes on even if the engine hardly gets a core.
const PATIENCE: Duration = Duration::from_millis(300);

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
    /// Of the cameras.
    clearance: Clearance,
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
    /// Generation of the view that was drawn last; 0 for none.
    drawn: u32,
    /// Generation of the view that the engine's last update was for.
    generation: Option<u32>,
    specular_age: SpecularAge,
    /// The view that had been answered when a picture last waited in vain for S of a later one: none waits again before another is.
    waited_for: Option<u32>,
    /// Faces that show light of others near by since all was drawn last.
    filled_faces: u64,
    /// See [`Self::forecast`].
    forecast: u64,
    ahead: AheadPictures,
    /// What may be spent until the present picture is done.
    share: Budget,
    clock: Clock,
    frames: u64,
    stats: EngineStats,
    counting: Counting,
    debug: debug_view::Debug,
    /// When frames are drawn while the camera is still.
    frames_come: Frames,
    /// What was taken in for a frame that a lost device did not draw.
    undrawn: Option<Turn>,
    /// When a device was last lost.
    lost: Option<Instant>,
    /// Whether the engine only answers.
    rests: bool,
}

/// What a turn of the loop took in.
struct Turn {
    updates: Vec<Update>,
    /// Whether the engine has taken in a new view.
    answered: bool,
}

/// What a session looks at.
struct Shot {
    view: View,
    /// The camera that it comes from.
    camera: Option<Camera>,
    /// The lights as they are made to be, in the scene's order; those that it lacks are as loaded.
    lights: Vec<LightState>,
    /// Number of a picture of a camera path, and how many there are.
    of_path: Option<(u64, u64)>,
    /// Whether any of it is glossy.
    glossy: bool,
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
            clearance: Clearance::new(scene),
            share: options.budget,
            options: options.clone(),
            engine,
            renderer,
            levels: Levels::default(),
            shot: None,
            wanted: 0,
            drawn: 0,
            generation: None,
            specular_age: SpecularAge::default(),
            waited_for: None,
            filled_faces: 0,
            forecast: 0,
            ahead: AheadPictures::default(),
            clock: Clock::default(),
            frames: 0,
            stats: EngineStats::default(),
            debug: debug_view::Debug::default(),
            undrawn: None,
            lost: None,
            rests: false,
        }
    }

    /// Points the camera at a picture. One of a camera path gets a share of the budget, and is not left before every vertex that it
    /// shows has a value.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::Exhausted`] when memory runs out.
    pub fn show(&mut self, picture: &Picture) -> Result<()> {
        let view = self.clearance.view(&self.scene, &picture.camera, self.options.size);
        let of_path = picture.on_path.then_some((picture.index, picture.of));
        let (camera, lights) = (Some(picture.camera), picture.lights.clone());
        self.aim(Shot { view, camera, lights, of_path, glossy: false })
    }

    /// Points the camera; light that was found stays. The lights are in these states, in the scene's order; those that are not given
    /// are as loaded. The frames of [`Self::step`] show the view from then on.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::Exhausted`] when memory runs out.
    pub fn look(&mut self, view: &View, lights: &[LightState]) -> Result<()> {
        self.aim(Shot { view: *view, camera: None, lights: lights.to_vec(), of_path: None, glossy: false })
    }

    fn aim(&mut self, shot: Shot) -> Result<()> {
        let _look = trace::span("look");
        let _first = self.go_first();
        let (faces, image) = visible::visible_faces(&mut self.renderer, &shot.view, self.options.redraws)?;
        trace::instant("camera", || Some(format!("view {}", self.wanted + 1)));
        self.forecast = forecast::of_view(&faces);
        let glossy = faces.iter().any(|(face, _)| self.scene.material(face.triangle()).is_glossy());
        self.send_view(faces, image, &shot.lights);
        self.renderer.relight(&shot.lights)?;
        self.shot = Some(Shot { glossy, ..shot });
        Ok(())
    }

    /// Sends the engine a view of a new generation.
    fn send_view(&mut self, faces: Vec<(FaceId, u32)>, image: FaceImage, lights: &[LightState]) {
        self.wanted += 1;
        let visible = Visible { generation: self.wanted, eye: image.view.eye, image: Some(image), faces };
        self.engine.relight(lights.to_vec(), visible);
    }

    /// One turn of the loop: takes the engine's updates, hands them to the renderer, draws a frame, tells the engine.
    /// The first turn of a view waits for the update that shows all of it, unless moves are drawn at once ([`Options::moves`]); others
    /// wait for fixed work, or until something arrives or a picture is due. Can go on after [`FrameReport::ended_by`], which only says that a
    /// limit is reached.
    ///
    /// # Errors
    /// [`Error::Usage`] before there was a view; [`Error::DeviceLost`], [`Error::Exhausted`] when memory runs out;
    /// [`Error::Internal`] if the engine has stopped.
    pub fn step(&mut self, observer: &mut dyn Observer) -> Result<FrameReport> {
        if self.shot.is_none() {
            return Err(Error::Usage("there is no view to draw".to_owned()));
        }
        let _frame = trace::span("frame");
        let undrawn = self.undrawn.take().filter(|_| self.generation == Some(self.wanted));
        let turn = undrawn.map_or_else(|| within("take updates", || self.take_updates(observer)), Ok);
        let Turn { mut updates, answered } = turn?;
        let moved = self.drawn != self.wanted;
        updates.extend(self.prepare_debug_view()?);
        self.clock.frame_begins();
        let ended_by = self.ended_by(observer.interrupted());
        // The last frame shows everything, whatever patches still wait; so do frames that are seldom, and the one with S of a new view.
        let wanted = ended_by.is_some() || observer.wants_picture(&self.stats);
        let whole = moved || answered || wanted || self.frames_come == Frames::Seldom;
        if wanted && !moved {
            let settled = self.engine.settle()?;
            self.apply(&settled)?;
            updates.extend(settled);
        }
        let combined = std::mem::take(&mut self.redisplay)
            || whole
            || matches!(self.frames_come, Frames::Every(time) if self.clock.picture_is_due(time));
        self.clock.drawing_begins();
        let passes = match self.draw(moved, whole, combined) {
            Err(fault @ Error::DeviceLost(_)) => {
                (self.undrawn, self.redisplay) = (Some(Turn { updates, answered: answered || moved }), combined);
                return Err(fault);
            }
            other => other?,
        };
        if self.frames_come == Frames::Seldom {
            self.renderer.draw_all_next();
        }
        self.drawn = self.wanted;
        if self.generation.is_some() {
            self.counting.tell(&self.renderer, &mut self.engine, self.drawn);
        }
        let at = self.clock.frame_ends(combined, self.stats.complete);
        let frame = self.frames;
        self.frames += 1;
        let (engine, filled_faces) = (self.stats, self.filled_faces);
        let stale_specular = combined && self.count_picture();
        self.count();
        Ok(FrameReport {
            frame,
            at,
            camera_moved: moved,
            passes,
            engine,
            combined,
            ended_by,
            stale_specular,
            filled_faces,
            updates,
        })
    }

    /// Whether the engine has taken the present view in.
    fn is_answered(&self) -> bool {
        self.generation == Some(self.wanted)
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
            _ if self.must_wait() => self.answer_arrives(observer)?,
            Some(batches) => self.fixed_work(&batches)?,
            None if self.drawn != self.wanted => self.engine.arrived()?,
            None => self.arrived()?,
        };
        let mut turn = Turn { answered: self.apply(&updates)?, updates };
        while self.batches().is_none()
            && !(turn.answered && self.shows_light() || self.frame_is_due(observer.interrupted()))
        {
            observer.works(self.clock.since_first_frame(), &self.stats);
            let updates = self.arrived()?;
            turn.answered |= self.apply(&updates)?;
            turn.updates.extend(updates);
        }
        Ok(turn)
    }

    fn draws_at_once(&self) -> bool {
        self.options.moves == Moves::AtOnce && self.batches().is_none()
    }

    /// Whether the next frame must not be drawn before the engine has answered: all of a view that is drawn only then, or S that is not
    /// too old.
    fn must_wait(&self) -> bool {
        if self.draws_at_once() {
            let waits_in_vain = self.waited_for.is_some_and(|answered| self.generation == Some(answered));
            !waits_in_vain && self.stale_specular().is_some_and(|of| self.specular_age.is_over(of))
        } else {
            !self.is_answered()
        }
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

    /// What is left of the view before, and the first update of a new one, which shows what came into it; where moves are drawn at once, of
    /// one with S that is not too old. The first view waits until there is an engine; none comes if the observer breaks that off.
    fn answer_arrives(&mut self, observer: &mut dyn Observer) -> Result<Vec<Update>> {
        let start = Instant::now();
        let mut updates: Vec<Update> = Vec::new();
        loop {
            updates.extend(self.engine.wait_for(TICK));
            updates.extend(self.engine.arrived()?);
            let broken_off = match self.generation {
                None => observer.interrupted(),
                Some(_) => self.draws_at_once() && start.elapsed() >= PATIENCE,
            };
            if updates.last().is_some_and(|update| self.is_recent(update.generation)) {
                return Ok(updates);
            }
            if broken_off {
                self.waited_for = self.generation;
                return Ok(updates);
            }
            if self.generation.is_none() {
                observer.waits(start.elapsed());
            }
        }
    }

    /// Whether the answer to a view is what [`Self::must_wait`] waits for.
    fn is_recent(&self, generation: u32) -> bool {
        generation == self.wanted || self.draws_at_once() && !self.specular_age.is_over(generation)
    }

    /// Lockstep: a fixed amount of work, none of an engine that rests.
    fn fixed_work(&mut self, batches: &Batches) -> Result<Vec<Update>> {
        let batch = |_| {
            self.engine.step(batches.rays);
            self.engine.wait()
        };
        let count = if self.rests { 0 } else { batches.until_next_frame(self.stats.rays) };
        (0..count).map(batch).collect()
    }

    /// What has arrived; waits for something, at most until the next picture is due.
    fn arrived(&mut self) -> Result<Vec<Update>> {
        let mut updates: Vec<Update> = Vec::new();
        let is_done = self.is_answered() && self.stats.converged;
        if !is_done && !self.renderer.has_pending() {
            let most = match self.frames_come {
                Frames::Every(time) => self.clock.until_picture(time),
                Frames::Seldom => TICK,
            };
            updates.extend(self.engine.wait_for(most));
        }
        updates.extend(self.engine.arrived()?);
        Ok(updates)
    }

    /// Hands updates to the renderer; whether the engine has taken in a new view.
    fn apply(&mut self, updates: &[Update]) -> Result<bool> {
        let mut answered = false;
        for update in updates {
            if self.generation != Some(update.generation) {
                self.generation = Some(update.generation);
                answered = true;
            }
            self.stats = update.stats;
            if self.stats.rays > 0 || self.stats.complete {
                self.clock.light_is_there();
            }
            self.levels.apply(update);
            self.renderer.apply(update)?;
            self.hear_for_debug_view(update)?;
        }
        if answered {
            self.share_budget();
        }
        Ok(answered)
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
        // Until then, what is spent tells of the view before.
        if !self.is_answered() {
            return None;
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
        self.engine.is_idle().unwrap_or(self.is_answered() && self.stats.converged) && !self.debug.waits()
    }
}
