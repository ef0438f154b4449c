//! The engine: owns the cache; batches in two phases, trace (shared, read only) and apply (alone, in job order).

use super::error_model::{ErrorModel, Reflectances};
use super::image_error::ImageError;
use super::miss_rate::MissRate;
use super::options::Options;
use super::pixel_checks::PixelChecks;
use super::publish::Published;
use super::queue::{Queue, Task};
use super::update::{DrawnPixels, EngineStats, Update};
use super::workers::{Workers, thread_nanoseconds};
use crate::cache::dynamic::{Cache, Luminance, SlotId};
use crate::cache::luminance;
use crate::cache::topology::NodeId;
use crate::cache::vertex::VertexId;
use crate::cache::weld::Weld;
use crate::geom::bvh::Bvh;
use crate::light::context::SceneContext;
use crate::light::lights::Lights;
use crate::scene::camera::View;
use crate::scene::{FaceId, Scene};
use glam::Vec3;
use rustc_hash::FxHashSet;
use std::collections::VecDeque;
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
    /// Eye position, for the specular luminance.
    pub eye: Vec3,
    /// The image, whose pixels are looked at one by one in the end; `None` leaves what vertices do not show to chance.
    pub view: Option<View>,
    /// Visible faces in ascending order, with their pixels.
    pub faces: Vec<(FaceId, u32)>,
}

/// Pixels of drawn triangles, as the GPU counted them.
#[derive(Clone, Debug)]
pub struct Counted {
    /// Camera generation that was drawn.
    pub generation: u32,
    /// Last update that was drawn completely.
    pub sequence: u64,
    /// Triangles with their pixels. `None` if nothing was counted.
    pub pixels: Option<Vec<DrawnPixels>>,
    /// Whether drawn triangles that are missing have no pixels; otherwise they were not counted.
    pub complete: bool,
}

/// The light engine of one scene.
pub struct Engine {
    pub(super) scene: Arc<Scene>,
    pub(super) bvh: Arc<Bvh>,
    pub(super) lights: Lights,
    weld: Weld,
    pub(super) scale: f32,
    pub(super) reflectances: Reflectances,
    pub(super) options: Options,
    /// Present rung of the ladder of tolerances.
    pub(super) tolerance: f32,
    pub(super) cache: Cache,
    pub(super) workers: Workers,
    /// Base vertices still to be visited before anything is refined, largest on screen first.
    pub(super) first_visits: VecDeque<VertexId>,
    pub(super) queue: Queue<Task>,
    pub(super) eye: Vec3,
    pub(super) generation: u32,
    /// What the view before showed: a camera that stays keeps what is known of its pixels.
    seen: (Vec3, Option<View>, Vec<(FaceId, u32)>),
    /// Roots of the visible faces.
    pub(super) roots: Vec<NodeId>,
    pub(super) published: Published,
    pub(super) image: ImageError,
    pub(super) stats: EngineStats,
    /// Vertices taken for enclosed by other geometry because no light was found there: only as long as the lights stay.
    pub(super) enclosed: Vec<VertexId>,
    /// Visible base vertices, those that may predict others after them.
    pub(super) base: Vec<VertexId>,
    /// Base vertices that predict others in this view.
    pub(super) predicting: Vec<VertexId>,
    /// Rays traced when the predictions were last brought up to date.
    pub(super) predicted_at: u64,
    /// How often since indirect light was surveyed.
    pub(super) predicted: u64,
    /// What leaves have turned out to hide.
    pub(super) hidden: MissRate,
    /// What pixels of leaves have turned out to show.
    pub(super) checks: PixelChecks,
    /// Clock of the engine's own thread when it was made, nanoseconds.
    pub(super) born: u64,
}

/// Error of a pixel against the image's mean at which refinement first stops; it then goes on with half of it, until the
/// options' own is reached.
const FIRST_TOLERANCE: f32 = 1e-3;

impl Engine {
    /// An engine with an empty cache.
    #[must_use]
    pub fn new(scene: Arc<Scene>, bvh: Arc<Bvh>, workers: Workers, options: Options) -> Self {
        let lights = Lights::in_groups(&scene, options.max_light_groups);
        let mut cache = Cache::new(&scene, lights.group_count());
        cache.indirect.filter = options.filter;
        Self {
            weld: Weld::new(&scene),
            scale: scene.scale(),
            reflectances: Reflectances::new(&scene),
            cache,
            first_visits: VecDeque::new(),
            queue: Queue::default(),
            eye: Vec3::ZERO,
            generation: 0,
            seen: (Vec3::ZERO, None, Vec::new()),
            checks: PixelChecks::default(),
            roots: Vec::new(),
            published: Published::default(),
            image: ImageError::default(),
            stats: EngineStats::default(),
            enclosed: Vec::new(),
            base: Vec::new(),
            predicting: Vec::new(),
            predicted_at: 0,
            predicted: 0,
            hidden: MissRate::default(),
            born: thread_nanoseconds(),
            tolerance: FIRST_TOLERANCE.max(options.tolerance),
            scene,
            bvh,
            lights,
            options,
            workers,
        }
    }

    /// The cache, to look at.
    #[must_use]
    pub const fn cache(&self) -> &Cache {
        &self.cache
    }

    /// What estimators read.
    #[must_use]
    pub fn context(&self) -> SceneContext<'_> {
        SceneContext::new(&self.scene, &self.bvh, &self.lights, self.options.seed, self.scale)
    }

    /// The image that is made, if it is known.
    pub(super) const fn view(&self) -> Option<View> {
        self.seen.1
    }

    /// What keys are computed from.
    pub(super) fn error_model(&self) -> ErrorModel<'_> {
        ErrorModel {
            scene: &self.scene,
            cache: &self.cache,
            reflectances: &self.reflectances,
            options: &self.options,
            tolerance: self.tolerance,
            mean: self.image.mean(),
            generation: self.generation,
            hidden: self.hidden.expected(),
            checks: self.seen.1.is_some(),
        }
    }

    /// Takes a new view: creates what became visible, re-evaluates the specular luminance without a ray, and returns all
    /// visible leaves with the values known so far.
    pub fn set_visible(&mut self, visible: &Visible) -> Update {
        let stays = self.seen.0 == visible.eye && self.seen.1 == visible.view && self.seen.2 == visible.faces;
        self.seen = (visible.eye, visible.view, visible.faces.clone());
        self.forget_view(stays);
        let before = std::mem::replace(&mut self.generation, visible.generation);
        self.eye = visible.eye;
        self.roots = visible.faces.iter().map(|&(face, _)| self.cache.root(&self.scene, &self.weld, face)).collect();
        let leaves = self.visible_leaves(&visible.faces, stays.then_some(before));
        self.queue.clear();
        self.tolerance = FIRST_TOLERANCE.max(self.options.tolerance);
        self.image = ImageError::default();
        let slots = self.drawn_slots(&leaves);
        self.enqueue_first_visits(&leaves, &slots);
        // D stays where the eye moves.
        let record = |slot: &SlotId| &self.cache.slots[slot.0];
        let due = |slot: &SlotId| !record(slot).direct.known || record(slot).shininess.is_some();
        let due: Vec<SlotId> = slots.iter().copied().filter(due).collect();
        self.evaluate(&due);
        self.cache.refresh_indirect(&slots, self.eye);
        self.look_between_corners(&leaves);
        leaves.iter().for_each(|&leaf| self.account(leaf));
        if self.first_visits.is_empty() {
            self.enqueue_leaves(&leaves);
            self.survey_indirect();
        }
        self.full_update(&leaves, &slots)
    }

    /// The leaves of the visible faces, drawn and with their share of the faces' pixels until they are counted, or with the
    /// pixels that they have if the camera is that of generation `stays`.
    fn visible_leaves(&mut self, faces: &[(FaceId, u32)], stays: Option<u32>) -> Vec<NodeId> {
        let mut all = Vec::new();
        for (i, &(_, pixels)) in faces.iter().enumerate() {
            let start = all.len();
            self.cache.topology.leaves(self.roots[i], &mut all);
            for &leaf in &all[start..] {
                let node = &mut self.cache.topology.nodes[leaf.0];
                let work = &mut node.work;
                if let Some(before) = stays {
                    let current = node.inner.iter_mut().filter(|inner| inner.generation == before);
                    current.for_each(|inner| inner.generation = self.generation);
                    if work.checked == before {
                        work.checked = self.generation;
                    }
                } else {
                    work.share = pixels as f32 * 0.25_f32.powi(i32::from(node.level));
                    (work.pixels, work.ray) = (work.share, None);
                }
                work.generation = self.generation;
                work.version += 1;
                (work.accounted, work.light, work.error, work.unseen) = (0.0, 0.0, 0.0, 0.0);
            }
        }
        for &leaf in &all {
            let drawn = &self.cache.topology.nodes[leaf.0].drawn;
            let stale = stays.is_none() && drawn.iter().any(|l| self.cache.drawn[l.0].triangle.flat.is_some());
            if drawn.is_empty() || stale {
                self.retire_drawn(leaf);
                self.draw_node(leaf);
            }
        }
        all
    }

    /// Slots that the visible leaves are drawn with.
    fn drawn_slots(&self, leaves: &[NodeId]) -> Vec<SlotId> {
        let drawn = leaves.iter().flat_map(|l| &self.cache.topology.nodes[l.0].drawn);
        let mut slots: Vec<SlotId> = drawn.flat_map(|l| self.cache.drawn[l.0].triangle.all_slots()).collect();
        slots.sort_unstable();
        slots.dedup();
        slots
    }

    /// Queues the visible vertices that were never visited, largest on screen first.
    fn enqueue_first_visits(&mut self, leaves: &[NodeId], slots: &[SlotId]) {
        for slot in slots {
            let vertex = self.cache.slots[slot.0].vertex;
            self.cache.vertices[vertex.0].pixels = 0.0;
        }
        for leaf in leaves {
            let share = self.cache.topology.nodes[leaf.0].work.pixels / 3.0;
            for vertex in self.cache.corner_vertices(*leaf) {
                self.cache.vertices[vertex.0].pixels += share;
            }
        }
        let vertices: FxHashSet<VertexId> = slots.iter().map(|s| self.cache.slots[s.0].vertex).collect();
        self.stats.visible = vertices.len() as u64;
        let mut order: Vec<VertexId> =
            vertices.into_iter().filter(|v| !self.cache.vertices[v.0].progress.visited).collect();
        let pixels = |v: &VertexId| self.cache.vertices[v.0].pixels;
        // Among equals in no order of place: what the first find of the lights is to speak for the rest.
        let key = |v: &VertexId| self.cache.vertices[v.0].key;
        order.sort_by(|a, b| pixels(b).total_cmp(&pixels(a)).then(key(a).cmp(&key(b))));
        self.first_visits = order.into();
    }

    /// Does one batch and returns what changed.
    pub fn step(&mut self, budget: Budget) -> Update {
        let start = Instant::now();
        let rays_before = self.stats.rays;
        let mut worked = true;
        while worked {
            worked = if self.first_visits.is_empty() { self.refine() } else { self.visit_base_vertices() };
            let spent = match budget {
                Budget::Time(time) => start.elapsed() >= time,
                Budget::Rays(rays) => self.stats.rays - rays_before >= rays,
            };
            if spent {
                break;
            }
        }
        if self.is_idle() {
            self.look_again();
        }
        self.publish()
    }

    /// Whether nothing is left to do for this view until more is heard of it: an empty queue says so on the last rung of the ladder of tolerances only.
    #[must_use]
    pub fn is_idle(&self) -> bool {
        self.first_visits.is_empty()
            && self.queue.is_empty()
            && self.checks.are_done()
            && self.tolerance <= self.options.tolerance
    }

    /// The leaves that the camera sees.
    pub(super) fn all_visible_leaves(&self) -> Vec<NodeId> {
        let mut leaves = Vec::new();
        self.roots.iter().for_each(|&root| self.cache.topology.leaves(root, &mut leaves));
        leaves
    }

    /// Computes D and S of slots on all workers; the slots are then due to be sent.
    pub(super) fn evaluate(&mut self, slots: &[SlotId]) {
        let context = SceneContext::new(&self.scene, &self.bvh, &self.lights, self.options.seed, self.scale);
        let (cache, eye) = (&self.cache, self.eye);
        let values = self.workers.map_chunks(slots, |chunk| {
            chunk.iter().map(|&slot| luminance::shown(&context, cache, slot, eye)).collect::<Vec<_>>()
        });
        for (&slot, shown) in slots.iter().zip(values.into_iter().flatten()) {
            let record = &mut self.cache.slots[slot.0];
            record.direct = Luminance {
                diffuse: shown.diffuse.value,
                specular: shown.specular,
                variance: shown.diffuse.variance,
                known: self.cache.vertices[record.vertex.0].progress.visited,
                ..Luminance::default()
            };
            self.cache.vertices[record.vertex.0].progress.left = shown.left;
        }
        let fresh = |s: &&SlotId| !self.cache.slots[s.0].indirect.known;
        let fresh: Vec<SlotId> = slots.iter().filter(fresh).copied().collect();
        self.cache.refresh_indirect(&fresh, self.eye);
        self.published.changed.extend_from_slice(slots);
    }
}
