//! The engine: owns the cache, and turns rays into light where the image needs it most. A step reads *choose → trace
//! → apply → judge → publish*: tasks are chosen by what they are worth, all workers trace, sharing the cache
//! read-only, the engine alone applies the results in job order, keys around what changed are judged anew, and what
//! changed is published to the GPU. Indirect light is traced beside all that, and applied one batch later (`gather.rs`).

use super::error_model::ErrorModel;
use super::image_error::ImageError;
use super::kept_blocks::Keeping;
use super::memory::{Memory, MemoryStats};
use super::miss_rate::MissRate;
use super::options::{Options, Piece};
use super::outdated_specular::OutdatedSpecular;
use super::pixel_checks::PixelChecks;
use super::pixel_lists::FaceImage;
use super::predictions::Predictions;
use super::publisher::{Publisher, Values};
use super::reflectances::Reflectances;
use super::roots::Roots;
use super::rounds::Rounds;
use super::scheduler::Scheduler;
use super::smoothing_clock::Smoothing;
use super::update::{DrawnPixels, EngineStats, Shown, Update};
use super::view::ViewState;
use super::workers::{Workers, job_nanoseconds, thread_nanoseconds};
use crate::cache::ids::{SlotId, VertexId};
use crate::cache::store::Cache;
use crate::cache::weld::Weld;
use crate::geom::bvh::Bvh;
use crate::light::context::SceneContext;
use crate::light::lights::Lights;
use crate::scene::{FaceId, Scene};
use crate::trace::{self, within};
use glam::Vec3;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How much a call of [`Engine::step`] may do.
#[derive(Clone, Copy, Debug)]
pub enum Budget {
    /// About this much time.
    Time(Duration),
    /// At least this many rays (if there is so much to do): the same work whatever the clock.
    Rays(u64),
}

/// What the camera sees: the engine lights nothing else.
#[derive(Clone, Debug)]
pub struct Visible {
    /// Camera generation, rising.
    pub generation: u32,
    /// Eye position, scene units, for the specular luminance.
    pub eye: Vec3,
    /// The image, whose pixels steer refinement and are checked one by one in the end; `None` goes by the faces' numbers of pixels alone,
    /// and leaves what vertices do not show to chance.
    pub image: Option<FaceImage>,
    /// Visible faces in ascending order, with their pixels.
    pub faces: Vec<(FaceId, u32)>,
}

/// What the GPU has drawn.
#[derive(Clone, Debug)]
pub struct Counted {
    /// Camera generation that was drawn.
    pub generation: u32,
    /// Last update that was drawn completely.
    pub sequence: u64,
    /// Triangles whose pixels were counted, for an engine that does not go by the image's ([`Options::listed`]).
    pub pixels: Vec<DrawnPixels>,
}

/// The light engine of one scene.
pub struct Engine {
    pub(super) scene: Arc<Scene>,
    pub(super) bvh: Arc<Bvh>,
    pub(super) lights: Arc<Lights>,
    pub(super) weld: Weld,
    pub(super) scale: f32,
    pub(super) reflectances: Reflectances,
    pub(super) options: Options,
    pub(super) workers: Workers,
    pub(super) cache: Cache,
    pub(super) view: ViewState,
    pub(super) scheduler: Scheduler,
    pub(super) image: ImageError,
    /// How likely large leaves are to hide a shadow.
    pub(super) miss_rate: MissRate,
    pub(super) checks: PixelChecks,
    pub(super) predictions: Predictions,
    pub(super) publisher: Publisher,
    /// What slots show.
    pub(super) shown: Shown,
    /// Present rung of the ladder of tolerances.
    pub(super) tolerance: f32,
    /// Vertices taken for enclosed by other geometry because no light was found there: only as long as the lights stay.
    pub(super) enclosed: Vec<VertexId>,
    /// Roots of faces that came into view while vertices waited to be visited: nothing is queued of them yet.
    pub(super) waiting: Roots,
    /// Roots of faces that left the view and are still to be taken out of it.
    pub(super) leaving: Roots,
    pub(super) outdated_specular: OutdatedSpecular,
    /// Faces in view that are not drawn yet, those last that come next.
    pub(super) unrevealed: Vec<FaceId>,
    /// How long a new view waits for what needs no ray; `None` until it is done.
    pub(super) view_time: Option<Duration>,
    /// Indirect light that is being gathered.
    pub(super) rounds: Option<Rounds>,
    pub(super) stats: EngineStats,
    pub(super) smoothing: Smoothing,
    pub(super) memory: Memory,
    pub(super) keeping: Option<Keeping>,
    /// Clocks of the engine's own thread when it was made.
    born: OwnClock,
}

/// Clocks of a thread, nanoseconds of CPU time.
#[derive(Clone, Copy)]
struct OwnClock {
    all: u64,
    /// In jobs, which it shares with other threads.
    jobs: u64,
}

impl OwnClock {
    fn now() -> Self {
        Self { all: thread_nanoseconds(), jobs: job_nanoseconds() }
    }

    const fn outside_jobs(self) -> u64 {
        self.all - self.jobs
    }
}

/// Slots whose values take some ten microseconds to list.
const FEW_SLOTS: usize = 64;

/// Share of a memory budget that the radiance grid may take.
const FOR_RADIANCE: usize = 8;

/// Error of a pixel against the image's mean at which refinement first stops; it then goes on with half of it, until
/// the options' own is reached.
const FIRST_TOLERANCE: f32 = 1e-3;

impl Engine {
    /// An engine with an empty cache.
    #[must_use]
    pub fn new(scene: Arc<Scene>, bvh: Arc<Bvh>, workers: Workers, options: Options) -> Self {
        let mut engine = Self::without_hierarchy(scene, workers, options);
        engine.bvh = bvh;
        engine
    }

    /// An engine whose hierarchy is still in the making: it can create faces, and do nothing else before it has one.
    #[must_use]
    pub fn without_hierarchy(scene: Arc<Scene>, workers: Workers, options: Options) -> Self {
        let lights = Lights::in_groups(&scene, options.max_light_groups);
        let mut cache = Cache::new(&scene, lights.group_count());
        cache.indirect.filter = options.filter && !options.without.has(Piece::Filter);
        cache.without = options.without;
        Self {
            weld: Weld::new(&scene),
            scale: scene.scale(),
            reflectances: Reflectances::new(&scene),
            cache,
            view: ViewState { listed: options.listed, ..ViewState::default() },
            scheduler: Scheduler::default(),
            image: ImageError::default(),
            miss_rate: MissRate::default(),
            checks: PixelChecks::new(!options.without.has(Piece::CheckRate)),
            predictions: Predictions::default(),
            publisher: Publisher::default(),
            shown: Shown::default(),
            tolerance: FIRST_TOLERANCE.max(options.tolerance),
            enclosed: Vec::new(),
            waiting: Roots::default(),
            leaving: Roots::default(),
            stats: EngineStats::default(),
            smoothing: Smoothing::default(),
            memory: Memory::default(),
            keeping: None,
            outdated_specular: OutdatedSpecular::default(),
            unrevealed: Vec::new(),
            view_time: None,
            rounds: None,
            born: OwnClock::now(),
            bvh: Arc::new(Bvh::build(&Scene::default())),
            scene,
            lights: Arc::new(lights),
            options,
            workers,
        }
    }

    /// Takes the hierarchy that it waited for, which is made of its scene.
    pub fn take_hierarchy(&mut self, of_scene: impl FnOnce(&Scene) -> Arc<Bvh>) {
        self.bvh = of_scene(&self.scene);
    }

    /// The hierarchy of its scene.
    pub const fn hierarchy(&self) -> &Arc<Bvh> {
        &self.bvh
    }

    /// Has the engine hold no more than a budget.
    pub fn limit_memory(&mut self, memory: Memory) {
        if let Some(budget) = memory.budget {
            self.cache.limit_radiance(budget / FOR_RADIANCE);
        }
        self.memory = memory;
    }

    /// Refines for D alone, before any view: no eye sees highlights.
    #[must_use]
    pub fn without_highlights(mut self) -> Self {
        self.reflectances = self.reflectances.without_highlights();
        self
    }

    /// Has a new view wait so long at most for new faces, and so long for S: what needs no ray, but time.
    pub fn answer_views_within(&mut self, time: Duration) {
        self.view_time = Some(time);
    }

    /// Does one batch and returns what changed.
    pub fn step(&mut self, budget: Budget) -> Update {
        let _batch = trace::span("batch");
        let (start, rays) = (Instant::now(), self.stats.rays);
        loop {
            self.make_room();
            self.save_some();
            within("reveal", || self.reveal_some());
            within("specular", || self.evaluate_some_specular());
            if self.is_complete() {
                within("bring up to date", || self.bring_some_up_to_date());
            }
            let work = within("choose", || self.choose());
            if work.is_empty() {
                if self.finish_gathering()
                    || self.evaluate_all_specular()
                    || self.bring_all_up_to_date()
                    || self.lower_tolerance()
                {
                    continue;
                }
                break;
            }
            let grown = within("grow", || self.grow(&work));
            let gathered = within("gather", || self.gather(&work));
            let lit = within("light", || self.light(&work, grown));
            within("judge", || self.judge(&lit));
            within("show gathered", || self.show_gathered(&gathered));
            self.end_rung(&work);
            let is_spent = match budget {
                Budget::Time(time) => start.elapsed() >= time,
                Budget::Rays(most) => self.stats.rays - rays >= most,
            };
            if is_spent {
                break;
            }
        }
        if self.is_idle() {
            self.look_again();
        }
        let smoothed = self.smooth_in_time();
        self.publish_with(&smoothed)
    }

    /// Brings up to date what waits to be shown: predictions. Returns what changed since the last update.
    pub fn settle(&mut self) -> Update {
        let _settle = trace::span("settle");
        self.finish_gathering();
        self.reveal_all();
        self.evaluate_all_specular();
        if self.is_complete() && self.options.indirect {
            self.refresh_waiting_predictions();
        }
        let smoothed = within("smooth", || self.smooth());
        let mut update = self.publish_with(&smoothed);
        update.settled = true;
        update
    }

    /// The update with everything that changed since the last, and slots that show something else.
    fn publish_with(&mut self, slots: &[SlotId]) -> Update {
        let mut update = self.publish();
        self.publish_values(&mut update, slots);
        update
    }

    /// All that the updates so far add up to, for a renderer that holds nothing of it; under the number of the last.
    pub fn whole(&mut self) -> Update {
        let mut update = self.publisher.whole(&self.cache, &self.view);
        update.stats = self.current_stats();
        update
    }

    /// Whether nothing is left to do for this view until more is heard of it: an empty queue says so on the last rung
    /// of the ladder of tolerances only.
    #[must_use]
    pub fn is_idle(&self) -> bool {
        self.scheduler.is_empty()
            && self.unrevealed.is_empty()
            && self.rounds.is_none()
            && self.tolerance <= self.options.tolerance
            && self.outdated_specular.is_empty()
            && self.is_up_to_date()
    }

    /// Whether every visible vertex has been visited.
    pub(super) fn is_complete(&self) -> bool {
        self.scheduler.first_visits() == 0 && self.unrevealed.is_empty()
    }

    /// The cache, to look at.
    #[must_use]
    pub const fn cache(&self) -> &Cache {
        &self.cache
    }

    /// The view, to look at.
    #[must_use]
    pub const fn view(&self) -> &ViewState {
        &self.view
    }

    /// What estimators read.
    #[must_use]
    pub fn context(&self) -> SceneContext<'_> {
        SceneContext::new(&self.scene, &self.bvh, &self.lights, self.options.seed, self.scale)
    }

    /// What keys are computed from.
    pub(super) fn error_model(&self) -> ErrorModel<'_> {
        ErrorModel {
            scene: &self.scene,
            cache: &self.cache,
            view: &self.view,
            reflectances: &self.reflectances,
            options: &self.options,
            tolerance: self.tolerance,
            // While nothing visible is lit, any luminance serves to order what may find light.
            mean: Some(self.image.mean()).filter(|mean| *mean > 0.0).unwrap_or(1.0),
            miss_rate: self.miss_rate.expected(),
            room: self.memory.room,
        }
    }

    /// Square error expected of a leaf that was not checked, against the square of what it shows. Without an image nothing is checked, and
    /// what splits have found tells.
    pub(super) fn unseen_rate(&self) -> f32 {
        if self.view.image.is_some() { self.checks.miss_rate() } else { self.miss_rate.expected() }
    }

    /// Starts from the top of the ladder of tolerances.
    pub(super) fn reset_tolerance(&mut self) {
        self.tolerance = FIRST_TOLERANCE.max(self.options.tolerance);
    }

    /// The update with everything that changed since the last.
    pub(super) fn publish(&mut self) -> Update {
        let _publish = trace::span("publish");
        let (mut update, fresh) = self.publisher.redraw(&mut self.cache, &self.view);
        self.evaluate(&fresh);
        let slots = self.publisher.take_changed();
        if self.is_complete() {
            self.enqueue_vertices(&slots);
        }
        self.publish_values(&mut update, &slots);
        // Checked after each of a few updates, then after ever more of them: all checks together take time linear in the cache.
        if cfg!(debug_assertions) && (is_sparse(update.sequence) || self.is_idle()) {
            self.cache.validate();
        }
        update.stats = self.current_stats();
        update.shown = self.shown;
        update
    }

    /// Adds what slots show to an update.
    pub(super) fn publish_values(&mut self, update: &mut Update, slots: &[SlotId]) {
        let groups = self.groups_shown();
        let values = |run: &[SlotId]| Values::of(&self.cache, run, |slot| self.value_to_show(&groups, slot));
        let values = self.workers.map_chunks(slots, FEW_SLOTS, values);
        self.publisher.add_values(update, values);
    }

    /// Totals up to now.
    pub(super) fn current_stats(&mut self) -> EngineStats {
        let now = OwnClock::now();
        self.stats.own_job_seconds = now.jobs.saturating_sub(self.born.jobs) as f64 * 1e-9;
        self.stats.cpu_seconds =
            self.workers.cpu_seconds() + now.outside_jobs().saturating_sub(self.born.outside_jobs()) as f64 * 1e-9;
        self.stats.triangles = (self.cache.drawn.triangles.live() - self.publisher.retired()) as u64;
        let parts = self.held();
        let held: usize = parts.iter().map(|(_, bytes)| bytes).sum();
        self.stats.cache_bytes = (held - self.publisher.mirror_bytes(&self.cache)) as u64;
        let (budget, held, free) = (self.memory.budget.unwrap_or(0) as u64, held as u64, self.free_bytes() as u64);
        self.stats.memory = MemoryStats { budget, held, parts, free, ..self.memory.stats };
        self.stats.unlit = self.scheduler.first_visits() as u64;
        self.stats.outdated = self.cache.indirect.outdated();
        self.stats.outdated_specular = self.outdated_specular.len() as u64;
        self.stats.complete = self.is_complete();
        let error = self.image.relative(self.unseen_rate());
        self.stats.estimated_error =
            error.filter(|_| self.stats.complete && self.leaving.is_empty() && self.view.faces.are_current());
        self.stats.converged = self.is_idle();
        self.stats
    }
}

/// Whether a number has at most three significant bits: true four times between a power of two and the next.
const fn is_sparse(number: u64) -> bool {
    number >> number.trailing_zeros() < 8
}
