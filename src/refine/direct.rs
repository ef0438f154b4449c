//! Direct light in a batch: the hierarchy grows, lights are traced, and what was inferred is traced where it is
//! contradicted.

use super::engine::Engine;
use super::options::Piece;
use super::scheduler::Task;
use super::view::VertexView;
use super::work::{Grown, Lit, SplitLeaf, Work};
use crate::cache::ascending::ascending;
use crate::cache::direct::{self, Job, Wanted};
use crate::cache::ids::{NodeId, SlotId, VertexId};
use crate::cache::luminance;
use crate::cache::store::Cache;
use crate::estimate::visibility::Visibility;
use crate::trace::{self, within};
use rustc_hash::FxHashSet;

/// Rounds in which contradicted inferences are traced.
const CONFIRM_ROUNDS: usize = 64;
/// Visits, leaves looked at for contradictions, and slots evaluated that take some ten microseconds.
const FEW_JOBS: usize = 4;
const FEW_NODES: usize = 128;
const FEW_SLOTS: usize = 16;

impl Engine {
    /// Splits leaves and puts pixel vertices into others; lists the vertices to visit.
    pub(super) fn grow(&mut self, work: &Work) -> Grown {
        let mut grown = Grown { jobs: work.visits.clone(), ..Grown::default() };
        let first = work.first_visits.iter().map(|&vertex| Job { vertex, wanted: Wanted::Strongest });
        grown.jobs.extend(first);
        // The drawn mesh is at least as fine as that of indirect light.
        for &node in work.splits.iter().chain(&work.refined) {
            self.split(node, &mut grown);
        }
        work.pixel_samples.iter().for_each(|&node| self.place_pixel_vertex(node, &mut grown));
        grown
    }

    /// Traces lights at vertices, and at others that these contradict, and evaluates their slots.
    pub(super) fn light(&mut self, work: &Work, grown: Grown) -> Lit {
        let outdated = work.first_visits.iter().any(|&vertex| self.cache.vertices[vertex].outdated);
        self.run(&grown.jobs);
        let mut changed: Vec<VertexId> = grown.jobs.iter().map(|job| job.vertex).collect();
        ascending(&mut changed);
        let mut slots = self.slots_of_all(&changed);
        slots.extend(grown.kept);
        let middles = grown.splits.iter().flat_map(|leaf| leaf.split.middles);
        slots.extend(middles.filter(|&slot| !self.cache.slots[slot].direct().known));
        let first_visits = !work.first_visits.is_empty();
        if !first_visits && !self.options.without.has(Piece::Confirm) {
            self.confirm(&grown.splits, &mut slots);
        }
        ascending(&mut slots);
        self.evaluate(&slots);
        let (pixel_samples, checks) = (work.pixel_samples.clone(), work.checks.clone());
        Lit { first_visits, outdated, splits: grown.splits, pixel_samples, checks, slots }
    }

    /// Puts a vertex inside a leaf where its one pixel sees it.
    fn place_pixel_vertex(&mut self, id: NodeId, grown: &mut Grown) {
        let Some(ray) = self.view.ray(id).filter(|_| self.cache.topology.is_leaf(id)) else { return };
        let Some(placed) = self.cache.place_pixel_vertex(id, self.view.eye, ray) else { return };
        self.view.leaves[id].sampled = true;
        let vertex = self.cache.slots[placed.slot].vertex;
        if placed.kept && !self.cache.vertices[vertex].outdated {
            grown.kept.extend(self.cache.slots_of(vertex));
        } else {
            if !placed.kept {
                self.forget_vertex(vertex);
            }
            grown.jobs.push(Job { vertex, wanted: Wanted::Pixel });
        }
        self.publisher.note_redraw(&self.cache, id);
    }

    /// Forgets what was made of a vertex that has moved.
    fn forget_vertex(&mut self, vertex: VertexId) {
        self.scheduler.void_direct(vertex);
        self.scheduler.void(Task::Gather(vertex));
        self.view.vertices[vertex] = VertexView::default();
        self.cache.slots_of(vertex).for_each(|slot| self.view.specular.reset(slot));
    }

    /// Splits a leaf, coarser neighbours before it, and lists the first visits of its new vertices.
    pub(super) fn split(&mut self, id: NodeId, grown: &mut Grown) {
        if !self.cache.topology.is_leaf(id) {
            return;
        }
        for neighbour in self.cache.topology.coarser_neighbours(id) {
            self.split(neighbour, grown);
        }
        let model = self.error_model();
        let (small, by_miss_rate) = (model.trusts_corners(id), model.split_by_miss_rate(id));
        let split = self.cache.split(id);
        for slot in split.middles {
            let vertex = self.cache.slots[slot].vertex;
            let record = &mut self.cache.vertices[vertex];
            if record.is_due() {
                record.progress.visited = true;
                grown.jobs.push(Job { vertex, wanted: Wanted::Midpoint { node: id, small } });
            }
        }
        self.publisher.note_redraw(&self.cache, id);
        let beside = self.cache.topology.nodes[id].edges.map(|edge| self.cache.topology.beside(edge));
        beside.into_iter().flatten().for_each(|node| self.publisher.note_redraw(&self.cache, node));
        grown.splits.push(SplitLeaf { node: id, split, by_miss_rate });
    }

    /// Traces jobs on all workers, then writes their results in order.
    fn run(&mut self, jobs: &[Job]) {
        let (context, cache) = (self.context(), &self.cache);
        let visit = |chunk: &[Job]| {
            let mut results = direct::Results::default();
            chunk.iter().for_each(|&job| direct::visit(&context, cache, job, &mut results));
            results
        };
        let results = within("direct trace", || self.workers.map_chunks(jobs, FEW_JOBS, visit));
        let _apply = trace::span("apply");
        let traced = |cache: &Cache| jobs.iter().filter(|j| cache.vertices[j.vertex].progress.traced).count();
        let before = traced(&self.cache);
        for result in &results {
            direct::apply(&mut self.cache, result);
            self.stats.rays += result.rays;
        }
        self.stats.vertices += (traced(&self.cache) - before) as u64;
        for job in jobs {
            let vertex = &mut self.cache.vertices[job.vertex];
            vertex.progress.visited = true;
            vertex.outdated &= !job.wanted.is_of_all_lights();
            self.scheduler.void_direct(job.vertex);
        }
    }

    /// Traces what was inferred where a neighbour in a new leaf says otherwise: a light's layer may only stay coarse
    /// where it shows no discontinuity. Adds the slots of what was traced.
    fn confirm(&mut self, splits: &[SplitLeaf], slots: &mut Vec<SlotId>) {
        // Not found by their triangles: new leaves are not drawn yet, nor their neighbours with the new midpoints.
        let topology = &self.cache.topology;
        let beside = |leaf: &SplitLeaf| topology.nodes[leaf.node].edges.map(|edge| topology.beside(edge));
        let neighbours = splits.iter().flat_map(beside).flatten();
        let children = splits.iter().flat_map(|leaf| leaf.split.children.all());
        let undrawn: Vec<NodeId> = children.chain(neighbours).collect();
        let mut around = self.nodes_around(slots);
        for _ in 0..CONFIRM_ROUNDS {
            let nodes = [undrawn.as_slice(), around.as_slice()].concat();
            let jobs = self.contradictions(&nodes);
            if jobs.is_empty() {
                return;
            }
            self.run(&jobs);
            let mut vertices: Vec<VertexId> = jobs.iter().map(|job| job.vertex).collect();
            ascending(&mut vertices);
            let changed = self.slots_of_all(&vertices);
            around = self.nodes_around(&changed);
            slots.extend(changed);
        }
    }

    /// Values inferred or hardly traced, at corners of nodes whose other corners disagree with them.
    fn contradictions(&self, nodes: &[NodeId]) -> Vec<Job> {
        let of_chunk = |chunk: &[NodeId]| {
            let mut found = Vec::new();
            chunk.iter().for_each(|&node| self.contradictions_of(node, &mut found));
            found
        };
        let mut taken = FxHashSet::default();
        let found = self.workers.map_chunks(nodes, FEW_NODES, of_chunk).into_iter().flatten();
        let first = found.filter(|&open| taken.insert(open));
        first.map(|(vertex, light)| Job { vertex, wanted: Wanted::Confirm { light } }).collect()
    }

    /// The same of one node, as vertices and lights.
    fn contradictions_of(&self, node: NodeId, found: &mut Vec<(VertexId, u32)>) {
        if !self.cache.topology.is_leaf(node) {
            return;
        }
        let corners = self.cache.drawn_vertices(node);
        for (light, layer) in (0_u32..).zip(&self.cache.layers) {
            let known = |v: VertexId| layer.visibility.get(v);
            let settled = || corners.iter().map(|&v| known(v)).filter(|known| known.is_settled());
            let first = settled().next().map(Visibility::fraction);
            // One that is off may wait.
            if settled().all(|known| Some(known.fraction()) == first) || !self.lights.group_is_on(light as usize) {
                continue;
            }
            let emitter = self.lights.group(light as usize);
            for &vertex in &corners {
                if direct::is_unconfirmed(emitter, known(vertex)) && self.can_light(vertex, light) {
                    found.push((vertex, light));
                }
            }
        }
    }

    /// Whether a light can reach any normal of a vertex at all.
    fn can_light(&self, vertex: VertexId, light: u32) -> bool {
        let position = self.cache.vertices[vertex].position;
        let emitter = self.lights.group(light as usize);
        self.cache.slots_of(vertex).any(|slot| emitter.bound(position, self.cache.slots[slot].normal()) > 0.0)
    }

    /// Computes D and S of slots on all workers; the slots are then due to be sent.
    pub(super) fn evaluate(&mut self, slots: &[SlotId]) {
        let _evaluate = trace::span("evaluate");
        let (context, cache, eye) = (self.context(), &self.cache, self.view.eye);
        let values = self.workers.map_chunks(slots, FEW_SLOTS, |chunk| {
            chunk.iter().map(|&slot| luminance::shown(&context, cache, slot, eye)).collect::<Vec<_>>()
        });
        for (&slot, shown) in slots.iter().zip(values.into_iter().flatten()) {
            self.cache.note_direct(slot, &shown);
            self.view.specular.update(slot, |at| at.direct = shown.specular);
            self.view.light_vectors.update(slot, |vector| *vector = shown.light_vector);
        }
        let is_fresh = |&&slot: &&SlotId| !self.cache.slots[slot].indirect().known;
        let fresh: Vec<SlotId> = slots.iter().filter(is_fresh).copied().collect();
        self.refresh_unseen(&fresh);
        self.publisher.note_changed(slots);
    }

    pub(super) fn slots_of_all(&self, vertices: &[VertexId]) -> Vec<SlotId> {
        vertices.iter().flat_map(|&v| self.cache.slots_of(v)).collect()
    }
}
