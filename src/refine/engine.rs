//! The engine: owns the cache; batches in two phases, trace (shared, read only) and apply (alone, in job order).

use super::queue::Queue;
use super::update::{EngineStats, Patch, Slot, Update};
use super::workers::Workers;
use crate::cache::dynamic::{Cache, LeafId, SlotId};
use crate::cache::vertex::VertexId;
use crate::cache::weld::Weld;
use crate::estimate::direct::{self, Job, World};
use crate::estimate::luminance;
use crate::geom::bvh::Bvh;
use crate::math;
use crate::scene::{FaceId, Scene};
use crate::shade::lights::Lights;
use glam::Vec3;
use std::collections::HashSet;
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
    /// Visible faces in ascending order, with their pixels.
    pub faces: Vec<(FaceId, u32)>,
}

/// The light engine of one scene.
pub struct Engine {
    scene: Arc<Scene>,
    bvh: Arc<Bvh>,
    lights: Lights,
    weld: Weld,
    diagonal: f32,
    seed: u64,
    cache: Cache,
    queue: Queue,
    workers: Workers,
    eye: Vec3,
    /// Slots of visible leaves.
    visible_slots: Vec<SlotId>,
    batch: u32,
    stats: EngineStats,
    generation: u32,
    image: ImageSums,
}

/// Sums over the visible slots, weighted by pixels, in which the error estimate is expressed.
#[derive(Clone, Copy, Debug, Default)]
struct ImageSums {
    pixels: f64,
    unknown_pixels: f64,
    luminance: f64,
    variance: f64,
}

impl Engine {
    /// An engine with an empty cache.
    #[must_use]
    pub fn new(scene: Arc<Scene>, bvh: Arc<Bvh>, workers: Workers, seed: u64) -> Self {
        let lights = Lights::new(&scene);
        Self {
            weld: Weld::new(&scene),
            diagonal: scene.diagonal(),
            cache: Cache::new(lights.sources.len()),
            queue: Queue::default(),
            eye: Vec3::ZERO,
            visible_slots: Vec::new(),
            batch: 0,
            stats: EngineStats::default(),
            generation: 0,
            image: ImageSums::default(),
            scene,
            bvh,
            lights,
            seed,
            workers,
        }
    }

    /// The cache, to look at.
    #[must_use]
    pub fn cache(&self) -> &Cache {
        &self.cache
    }

    /// What estimators read.
    #[must_use]
    pub fn world(&self) -> World<'_> {
        World { scene: &self.scene, bvh: &self.bvh, lights: &self.lights, seed: self.seed }
    }

    /// Takes a new view: creates what became visible, re-evaluates the specular luminance without a ray, and returns all
    /// visible leaves with the values known so far.
    pub fn set_visible(&mut self, visible: &Visible) -> Update {
        self.generation = visible.generation;
        self.eye = visible.eye;
        self.forget_pixels();
        let leaves: Vec<LeafId> = visible.faces.iter().map(|&(face, pixels)| self.show(face, pixels)).collect();
        self.visible_slots = self.slots_of_leaves(&leaves);
        self.enqueue_visible();
        let slots = std::mem::take(&mut self.visible_slots);
        self.evaluate(&slots);
        self.visible_slots = slots;
        self.image = self.visible_slots.iter().fold(ImageSums::default(), |sums, &s| sums.with(&self.cache, s, 1.0));
        self.full_update(&leaves)
    }

    fn forget_pixels(&mut self) {
        for &slot in &self.visible_slots {
            let record = &mut self.cache.slots[slot.0];
            record.pixels = 0.0;
            self.cache.vertices[record.vertex.0].pixels = 0.0;
        }
    }

    /// Makes a face part of the view.
    fn show(&mut self, face: FaceId, pixels: u32) -> LeafId {
        let id = self.cache.face(&self.scene, &self.weld, face, self.diagonal);
        let share = pixels as f32 / 3.0;
        self.cache.leaves[id.0].generation = self.generation;
        for slot in self.cache.leaves[id.0].leaf.slots {
            let record = &mut self.cache.slots[slot.0];
            record.pixels += share;
            self.cache.vertices[record.vertex.0].pixels += share;
        }
        id
    }

    fn slots_of_leaves(&self, leaves: &[LeafId]) -> Vec<SlotId> {
        let mut slots: Vec<SlotId> = leaves.iter().flat_map(|&l| self.cache.leaves[l.0].leaf.slots).collect();
        slots.sort_unstable();
        slots.dedup();
        slots
    }

    /// Queues the visible vertices, largest on screen first.
    fn enqueue_visible(&mut self) {
        self.queue.clear();
        let mut seen = HashSet::new();
        let mut order: Vec<VertexId> =
            self.visible_slots.iter().map(|s| self.cache.slots[s.0].vertex).filter(|&v| seen.insert(v)).collect();
        let pixels = |v: &VertexId| self.cache.vertices[v.0].pixels;
        order.sort_by(|a, b| pixels(b).total_cmp(&pixels(a)).then(a.cmp(b)));
        for vertex in order {
            self.queue.push(vertex, self.cache.vertices[vertex.0].stage);
        }
    }

    /// Does one batch and returns what changed.
    pub fn step(&mut self, budget: Budget) -> Update {
        let start = Instant::now();
        let rays_before = self.stats.rays;
        let mut visited: Vec<VertexId> = Vec::new();
        loop {
            let jobs = self.queue.take(self.lights.sources.len());
            if jobs.is_empty() {
                break;
            }
            self.run(&jobs);
            visited.extend(jobs.iter().map(|job| job.vertex));
            let spent = match budget {
                Budget::Time(time) => start.elapsed() >= time,
                Budget::Rays(rays) => self.stats.rays - rays_before >= rays,
            };
            if spent {
                break;
            }
        }
        self.publish(visited)
    }

    /// Traces jobs on all workers, then writes their results in order.
    fn run(&mut self, jobs: &[Job]) {
        let floor = self.noise_floor();
        let world = World { scene: &self.scene, bvh: &self.bvh, lights: &self.lights, seed: self.seed };
        let cache = &self.cache;
        let results = self.workers.map_chunks(jobs, |chunk| {
            let mut results = direct::Results::default();
            chunk.iter().for_each(|&job| direct::visit(&world, cache, job, floor, &mut results));
            results
        });
        for result in &results {
            direct::apply(&mut self.cache, result);
            self.stats.rays += result.rays;
        }
        for job in jobs {
            let vertex = &mut self.cache.vertices[job.vertex.0];
            self.stats.vertices += u64::from(vertex.stage == 0);
            vertex.stage = job.stage + 1;
        }
    }

    /// Irradiance below which noise does not show: 1 % of the image's mean.
    fn noise_floor(&self) -> f32 {
        let mean = self.image.luminance / self.image.pixels.max(1.0);
        (0.01 * mean) as f32 * std::f32::consts::PI
    }

    /// Evaluates the visited vertices, queues those with noise left, and lists what the GPU must redraw.
    fn publish(&mut self, mut visited: Vec<VertexId>) -> Update {
        visited.sort_unstable();
        visited.dedup();
        let slots: Vec<SlotId> = visited.iter().flat_map(|&v| self.cache.slots_of(v)).collect();
        for &slot in &slots {
            self.image = self.image.with(&self.cache, slot, -1.0);
        }
        self.evaluate(&slots);
        for &slot in &slots {
            self.image = self.image.with(&self.cache, slot, 1.0);
        }
        self.requeue(&visited);
        self.patch_update(&slots)
    }

    /// Computes D and S of slots on all workers.
    fn evaluate(&mut self, slots: &[SlotId]) {
        let world = World { scene: &self.scene, bvh: &self.bvh, lights: &self.lights, seed: self.seed };
        let (cache, eye) = (&self.cache, self.eye);
        let values = self.workers.map_chunks(slots, |chunk| {
            let value = |&slot: &SlotId| {
                let diffuse = luminance::diffuse(&world, cache, slot);
                (diffuse, luminance::specular(&world, cache, slot, eye), direct::variance(&world, cache, slot))
            };
            chunk.iter().map(value).collect::<Vec<_>>()
        });
        for (&slot, (diffuse, specular, variance)) in slots.iter().zip(values.into_iter().flatten()) {
            let record = &mut self.cache.slots[slot.0];
            (record.diffuse, record.specular) = (diffuse, specular);
            record.variance = variance / (std::f32::consts::PI * std::f32::consts::PI);
            record.known = self.cache.vertices[record.vertex.0].stage > 0;
        }
    }

    /// A vertex goes on to its next stage if it is its second, or while its noise shows.
    fn requeue(&mut self, visited: &[VertexId]) {
        let floor = self.noise_floor();
        for &vertex in visited {
            let stage = self.cache.vertices[vertex.0].stage;
            if stage <= 1 || direct::is_noisy(&self.cache, vertex, floor) {
                self.queue.push(vertex, stage);
            }
        }
    }

    fn full_update(&mut self, leaves: &[LeafId]) -> Update {
        let mut update = Update { generation: self.generation, ..Update::default() };
        update.slots = self.visible_slots.iter().map(|&s| (s, self.slot(s))).collect();
        for (i, &leaf) in (0_u32..).zip(leaves) {
            let record = &self.cache.leaves[leaf.0];
            update.leaves.push((leaf, record.leaf));
            update.patch_leaves.push(leaf);
            update.patches.push(Patch { face: record.leaf.face, old: i..i, new: i..i + 1 });
        }
        update.stats = self.current_stats();
        update
    }

    fn patch_update(&mut self, slots: &[SlotId]) -> Update {
        self.batch += 1;
        let mut update = Update { generation: self.generation, ..Update::default() };
        for &slot in slots {
            let mut drawn = false;
            let leaves: Vec<LeafId> = self.cache.leaves_of(slot).collect();
            for leaf in leaves {
                let record = &mut self.cache.leaves[leaf.0];
                if record.generation != self.generation {
                    continue;
                }
                drawn = true;
                if std::mem::replace(&mut record.batch, self.batch) == self.batch {
                    continue;
                }
                let i = update.patch_leaves.len() as u32;
                update.patch_leaves.push(leaf);
                update.patches.push(Patch { face: record.leaf.face, old: i..i + 1, new: i..i + 1 });
            }
            if drawn {
                update.slots.push((slot, self.slot(slot)));
            }
        }
        update.stats = self.current_stats();
        update
    }

    fn slot(&self, slot: SlotId) -> Slot {
        let record = &self.cache.slots[slot.0];
        Slot {
            position: self.cache.vertices[record.vertex.0].position,
            weight: if record.known { 1.0 } else { 0.0 },
            diffuse: record.diffuse,
            specular: record.specular,
        }
    }

    fn current_stats(&mut self) -> EngineStats {
        self.stats.cpu_seconds = self.workers.cpu_seconds();
        self.stats.triangles = self.cache.leaves.live() as u64;
        self.stats.cache_bytes = self.cache.bytes() as u64;
        self.stats.estimated_error = self.image.relative_error();
        self.stats.complete = self.queue.first_visits_done();
        self.stats.converged = self.queue.is_empty();
        self.stats
    }
}

impl ImageSums {
    /// Adds (`sign` 1) or takes away (−1) a slot.
    fn with(mut self, cache: &Cache, slot: SlotId, sign: f64) -> Self {
        let record = &cache.slots[slot.0];
        let pixels = sign * f64::from(record.pixels);
        self.pixels += pixels;
        if record.known {
            self.luminance += pixels * f64::from(math::luminance(record.diffuse));
            self.variance += pixels * f64::from(record.variance);
        } else {
            self.unknown_pixels += pixels;
        }
        self
    }

    /// Noise of D over the image as RMSE over mean; `None` until every visible vertex has a value.
    fn relative_error(&self) -> Option<f32> {
        let known = self.unknown_pixels.abs() < 0.5 && self.pixels > 0.0 && self.luminance > 0.0;
        known.then(|| ((self.variance.max(0.0) / self.pixels).sqrt() / (self.luminance / self.pixels)) as f32)
    }
}
