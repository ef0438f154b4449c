//! Choosing the work of a batch: the tasks that pay most, by their present keys.

use super::engine::Engine;
use super::scheduler::Task;
use super::work::Work;
use crate::cache::direct::{Job, Wanted};
use crate::cache::ids::{NodeId, VertexId};

/// Base vertices a batch: enough to be worth handing out, few enough to keep the frame loop served.
const FIRST_VISITS: usize = 512;
/// The same where a view that changes is answered soon, times the light groups: some ten milliseconds.
const FIRST_VISITS_OF_LIGHTS: usize = 12_288;
/// Tasks a batch: few, so that each is chosen knowing what the ones before found.
const TASKS: u64 = 64;
/// Rays in the view so far for each task of a batch, if that allows more: later ones change less of what the others go by
/// (docs/notebook/clock.md).
const RAYS_A_TASK: u64 = 8192;
/// Tasks a batch at most: a tenth of a second on two cores, for which a view that changes waits.
const MOST_TASKS: u64 = 512;
/// Rays of direct light a batch, about.
const DIRECT_RAYS: f32 = 65536.0;
/// Gather rays of a batch for each task that it may hold.
const GATHER_RAYS_A_TASK: u64 = 128;
/// Tasks that are judged ahead, and those that take some ten microseconds.
const AHEAD: usize = 128;
const FEW: usize = 16;
/// A task whose key has fallen below this share of what it was queued with goes back into the queue.
const STALE: f32 = 0.8;

/// The leaf of a task that goes by its pixels.
pub(super) const fn leaf_of(task: Task) -> Option<NodeId> {
    match task {
        Task::Split(id) | Task::SamplePixel(id) | Task::RefineIndirect(id) | Task::CheckPixels(id) => Some(id),
        Task::TraceDeferred(_) | Task::DoublePoints(_) | Task::Gather(_) => None,
    }
}

impl Engine {
    fn first_visits_a_batch(&self) -> usize {
        let soon = FIRST_VISITS_OF_LIGHTS / self.lights.group_count().max(1);
        if self.view_time.is_some() { soon.clamp(1, FIRST_VISITS) } else { FIRST_VISITS }
    }

    /// Takes the tasks that pay most.
    pub(super) fn choose(&mut self) -> Work {
        let first_visits = self.scheduler.take_first_visits(self.first_visits_a_batch());
        let mut work = Work { first_visits, ..Work::default() };
        if !work.first_visits.is_empty() {
            return work;
        }
        let most = ((self.stats.rays - self.view.began) / RAYS_A_TASK).clamp(TASKS, MOST_TASKS);
        let most = self.memory.budget.map_or(most, |_| most.min(self.memory.tasks.max(1)));
        let has_room = |work: &Work| {
            (work.tasks() as u64) < most
                && u64::from(work.gather_rays) < most * GATHER_RAYS_A_TASK
                && work.direct_rays < DIRECT_RAYS
        };
        while has_room(&work) {
            self.workers.give_way();
            if let Some(leaf) = self.next_check() {
                work.checks.push(leaf);
                continue;
            }
            if !self.scheduler.has_judged() {
                self.judge_ahead();
            }
            let Some((task, queued, judged)) = self.scheduler.pop_judged() else { break };
            if self.awaits_rounds(task) || self.catch_up(task) {
                continue;
            }
            let key = judged.unwrap_or_else(|| self.key_or_none(task));
            if key < queued * STALE {
                self.scheduler.offer(task, key);
            } else {
                self.take(task, &mut work);
            }
        }
        self.scheduler.stop_judging();
        work
    }

    /// Judges the next tasks on all workers.
    fn judge_ahead(&mut self) {
        let tasks = self.scheduler.look_ahead(AHEAD);
        let judge = |run: &[Task]| run.iter().map(|&task| self.key_or_none(task)).collect::<Vec<_>>();
        let keys = self.workers.map_chunks(&tasks, FEW, judge);
        self.scheduler.note_judged(keys.into_iter().flatten());
    }

    /// What a task is worth now: nothing if it is void.
    fn key_or_none(&self, task: Task) -> f32 {
        self.current_key(task).unwrap_or(0.0)
    }

    /// Takes a leaf to be checked, if one is worth more than the next task or it is time for one.
    fn next_check(&mut self) -> Option<NodeId> {
        while let (next, other) = (self.scheduler.greatest_check(), self.scheduler.greatest())
            && self.checks.are_due(next, other, self.stats.rays)
        {
            let id = self.scheduler.pop_check()?;
            if !self.catch_up(Task::CheckPixels(id)) && self.error_model().wants_check(id) {
                self.checks.promise(self.view.leaves[id].pixels);
                return Some(id);
            }
        }
        None
    }

    /// What a queued task is worth now; `None` if it is void.
    pub(super) fn current_key(&self, task: Task) -> Option<f32> {
        let model = self.error_model();
        match task {
            Task::Split(id) => self.cache.topology.is_leaf(id).then(|| model.split_key(id)),
            Task::SamplePixel(id) => self.cache.topology.is_leaf(id).then(|| model.pixel_sample_key(id)),
            Task::TraceDeferred(id) | Task::DoublePoints(id) => Some(model.vertex_key(id, self.rays_of(task))),
            Task::Gather(id) => Some(model.gather_key(id)),
            Task::RefineIndirect(id) => (!self.cache.topology.nodes[id].indirect_split).then(|| model.refine_key(id)),
            Task::CheckPixels(_) => None,
        }
    }

    /// Adds a task to the work of the batch.
    fn take(&mut self, task: Task, work: &mut Work) {
        work.direct_rays += self.rays_of(task);
        match task {
            Task::Split(node) => work.splits.push(node),
            Task::SamplePixel(node) => work.pixel_samples.push(node),
            Task::TraceDeferred(vertex) => work.visits.push(self.visit(vertex, Wanted::Settle)),
            Task::DoublePoints(vertex) => work.visits.push(self.visit(vertex, Wanted::Double)),
            Task::Gather(vertex) => {
                let rays = self.cache.indirect.rays(vertex);
                work.gather_rays += if rays == 0 { self.error_model().first_rays_at(vertex) } else { rays };
                work.gathers.push(vertex);
            }
            Task::RefineIndirect(node) => {
                work.gather_rays += 3 * self.error_model().first_rays(node);
                work.refined.push(node);
            }
            Task::CheckPixels(_) => {}
        }
    }

    /// The job of a task. What else is queued for its vertex is void now: a vertex may be queued twice with the
    /// samples it has, and the same points traced twice in a batch would count twice.
    fn visit(&mut self, vertex: VertexId, wanted: Wanted) -> Job {
        self.scheduler.void_direct(vertex);
        Job { vertex, wanted }
    }

    /// Rays of direct light that a task would take.
    pub(super) fn rays_of(&self, task: Task) -> f32 {
        let left = |vertex: VertexId| self.cache.vertices[vertex].progress.left;
        match task {
            Task::Split(id) | Task::SamplePixel(id) => {
                self.error_model().points_between(&self.cache.topology.nodes[id])
            }
            Task::TraceDeferred(id) => left(id).settle as f32,
            Task::DoublePoints(id) => left(id).double as f32,
            Task::Gather(_) | Task::RefineIndirect(_) | Task::CheckPixels(_) => 0.0,
        }
    }
}
