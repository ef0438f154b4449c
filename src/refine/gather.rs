//! Rounds of indirect light on their way: handed out as soon as they are chosen, they are traced beside all else that the engine
//! does, and their results are taken in when those of the next batch are handed out. They read nothing that changes meanwhile, and
//! when they are taken does not depend on when they are done: one thread and many give the same.

use super::engine::Engine;
use super::rounds::{Rounds, Traced};
use super::scheduler::Task;
use super::work::{GatheredLight, Work};
use crate::cache::gather::{self, GatherJob};
use crate::cache::ids::{NodeId, VertexId};
use crate::estimate::hemisphere::Method;
use crate::trace::{self, within};
use std::sync::Arc;

/// Rays of a job: enough to be worth handing out, few enough to share a vertex's round among threads.
const RAYS_A_JOB: u32 = 128;

impl Engine {
    /// Takes in what the rounds on their way have found, and hands those of a batch out; what was found is to be shown.
    pub(super) fn gather(&mut self, work: &Work) -> GatheredLight {
        let gathered = self.take_rounds();
        self.start_rounds(work);
        gathered
    }

    /// Takes in and shows what the rounds on their way find; whether there were any.
    pub(super) fn finish_gathering(&mut self) -> bool {
        let is_underway = self.rounds.is_some();
        let gathered = self.take_rounds();
        self.show_gathered(&gathered);
        is_underway
    }

    /// Whether a task is to go on with rounds that are on their way: it is judged anew when they are taken in.
    pub(super) fn awaits_rounds(&self, task: Task) -> bool {
        let Task::Gather(vertex) = task else { return false };
        self.rounds.as_ref().is_some_and(|rounds| rounds.light.vertices.binary_search(&vertex).is_ok())
    }

    /// Waits for the rounds on their way, and writes their results in order.
    fn take_rounds(&mut self) -> GatheredLight {
        let Some(Rounds { underway, light }) = self.rounds.take() else { return GatheredLight::default() };
        let found = within("gather rounds", || underway.finish());
        let _apply = trace::span("apply");
        for gathered in found {
            gather::apply(&mut self.cache, &gathered);
            self.stats.rays += gathered.rays;
        }
        light
    }

    /// Hands the rounds of a batch out.
    fn start_rounds(&mut self, work: &Work) {
        if work.gathers.is_empty() && work.refined.is_empty() {
            return;
        }
        let jobs = self.gather_jobs(work);
        let mut vertices: Vec<VertexId> = jobs.iter().map(|job| job.site.vertex).collect();
        vertices.dedup();
        work.refined.iter().for_each(|&node| self.mark_refined(node));
        let items = jobs.len();
        let traced = Traced {
            scene: Arc::clone(&self.scene),
            bvh: Arc::clone(&self.bvh),
            lights: Arc::clone(&self.lights),
            learnt: self.cache.learnt(),
            seed: self.options.seed,
            scale: self.scale,
            jobs,
        };
        let underway = self.workers.start(traced, items, Traced::gather);
        self.rounds = Some(Rounds { underway, light: GatheredLight { vertices, refined: work.refined.clone() } });
    }

    /// Brings up to date what hangs on what was gathered, and judges it.
    pub(super) fn show_gathered(&mut self, gathered: &GatheredLight) {
        if gathered.vertices.is_empty() && gathered.refined.is_empty() {
            return;
        }
        let slots = self.slots_of_all(&gathered.vertices);
        self.refresh_indirect(&slots);
        gathered.refined.iter().for_each(|&node| self.divide(node));
        self.judge_indirect(gathered);
    }

    /// The rounds of a batch, cut into jobs.
    fn gather_jobs(&self, work: &Work) -> Vec<GatherJob> {
        let mut rounds: Vec<(VertexId, u32)> = Vec::new();
        for &vertex in &work.gathers {
            let so_far = self.cache.indirect.rays(vertex);
            let first = || self.cache.indirect.first_rays(vertex, self.error_model().first_rays_at(vertex));
            rounds.push((vertex, if so_far == 0 { first() } else { so_far }));
        }
        for &node in &work.refined {
            let first = self.error_model().first_rays(node);
            for edge in self.cache.topology.nodes[node].edges {
                let Some(vertex) = self.cache.topology.midpoint(edge) else { continue };
                // What a covered one would find is not its surface's light: it takes over what is known around.
                let covered = self.cache.vertices[vertex].progress.covered;
                if !covered && self.cache.indirect.rays(vertex) == 0 {
                    rounds.push((vertex, first));
                }
            }
        }
        rounds.sort_by_key(|&(vertex, _)| vertex);
        rounds.dedup_by_key(|&mut (vertex, _)| vertex);
        let method = self.options.hemisphere;
        let most = if method == Method::Stratified { RAYS_A_JOB } else { u32::MAX };
        let mut jobs = Vec::with_capacity(rounds.len());
        for (vertex, rays) in rounds {
            let (site, start) = (self.cache.site(vertex), self.cache.indirect.rays(vertex));
            let cuts = (0..rays).step_by(most as usize);
            let job = |at| GatherJob { site: site.clone(), first: start + at, rays: most.min(rays - at), method };
            jobs.extend(cuts.map(job));
        }
        jobs
    }

    /// Makes a leaf a split node of the indirect layer.
    fn mark_refined(&mut self, id: NodeId) {
        let unmeasured = self.error_model().unmeasured(id);
        let node = &mut self.cache.topology.nodes[id];
        let expected = if node.indirect.doubt.is_finite() { node.indirect.doubt } else { unmeasured };
        node.indirect_split = true;
        for vertex in node.edges.map(|edge| self.cache.topology.midpoint(edge)).into_iter().flatten() {
            self.cache.indirect.note_expected(vertex, expected);
        }
    }

    /// Hands a refined leaf's pixels over to its children.
    fn divide(&mut self, id: NodeId) {
        self.set_importance(id, 0.0);
        self.image.replace_indirect(&mut self.view.indirect[id].accounted, 0.0);
        for child in self.cache.topology.children(id) {
            self.view.indirect[child].pixels = self.view.pixels_below(&self.cache, child);
            self.update_importance(child);
        }
    }
}
