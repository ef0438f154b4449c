//! A batch of refinement: base vertices first, then the tasks that pay most.

use super::engine::Engine;
use super::error_model::CHILD;
use super::indirect::{GATHER_RAYS_A_RUN, IndirectWork};
use super::queue::Task;
use crate::cache::direct::{self, Job, Wanted};
use crate::cache::dynamic::{Cache, SlotId};
use crate::cache::topology::NodeId;
use crate::cache::vertex::VertexId;
use crate::estimate::visibility::Visibility;
use crate::light::context::SceneContext;
use rustc_hash::FxHashSet;

/// Base vertices a run: enough to be worth handing out, few enough to keep the frame loop served.
const VISITS_A_RUN: usize = 512;
/// Tasks a run: few, so that each is chosen knowing what the ones before found.
const TASKS_A_RUN: usize = 64;
/// Rays of direct light a run, about: a view that changes waits for no more, and no worker for another.
const DIRECT_RAYS_A_RUN: f32 = 65536.0;
/// A task whose key has fallen below this share of what it was queued with goes back into the queue.
const STALE: f32 = 0.8;
/// Rounds in which contradicted inferences are traced.
const CONFIRM_ROUNDS: usize = 64;

/// A leaf split in this batch.
struct Fresh {
    node: NodeId,
    first: NodeId,
    middles: [SlotId; 3],
    /// What it is judged by if only what it might hide had it split.
    blind: Option<f32>,
}

/// What a batch does to the drawn mesh.
#[derive(Default)]
struct Batch {
    /// Leaves to split.
    splits: Vec<NodeId>,
    /// Leaves to sample where their one pixel sees them.
    inner: Vec<NodeId>,
    /// Leaves whose pixels are asked.
    checks: Vec<NodeId>,
    /// Vertices to visit.
    jobs: Vec<Job>,
}

impl Batch {
    fn tasks(&self) -> usize {
        self.splits.len() + self.inner.len() + self.checks.len() + self.jobs.len()
    }
}

impl Engine {
    /// Visits the next base vertices; when the last is done, everything visible is queued for refinement.
    pub(super) fn visit_base_vertices(&mut self) -> bool {
        let count = self.first_visits.len().min(VISITS_A_RUN);
        let vertices: Vec<VertexId> = self.first_visits.drain(..count).collect();
        let jobs: Vec<Job> = vertices.iter().map(|&vertex| Job { vertex, wanted: Wanted::Strongest }).collect();
        self.run(&jobs);
        let slots = self.slots_of_all(&vertices);
        self.evaluate(&slots);
        let nodes = self.nodes_around(&slots);
        self.look_between_corners(&nodes);
        nodes.iter().for_each(|&node| self.account(node));
        if self.first_visits.is_empty() {
            let leaves = self.all_visible_leaves();
            self.enqueue_leaves(&leaves);
            self.survey_indirect();
        }
        true
    }

    /// Does the tasks that pay most; `false` if nothing is left.
    pub(super) fn refine(&mut self) -> bool {
        let (mut direct, mut indirect) = (Batch::default(), IndirectWork::default());
        let mut rays = 0.0;
        while direct.tasks() + indirect.tasks() < TASKS_A_RUN
            && indirect.rays < GATHER_RAYS_A_RUN
            && rays < DIRECT_RAYS_A_RUN
        {
            if let Some(leaf) = self.next_check() {
                direct.checks.push(leaf);
                continue;
            }
            let Some(entry) = self.queue.pop() else { break };
            let Some(key) = self.current_key(entry.task, entry.version) else { continue };
            let stale = key < entry.key * STALE;
            self.note_queued(entry.task, if stale { key } else { 0.0 });
            if stale {
                self.queue.push(key, entry.task, entry.version);
                continue;
            }
            rays += self.rays_of(entry.task);
            match entry.task {
                Task::Split(node) => direct.splits.push(node),
                Task::SamplePixel(node) => direct.inner.push(node),
                Task::Settle(vertex) => direct.jobs.push(self.take(vertex, Wanted::Settle)),
                Task::Double(vertex) => direct.jobs.push(self.take(vertex, Wanted::Double)),
                Task::Gather(vertex) => {
                    let rays = self.cache.indirect.rays(vertex);
                    indirect.gather(vertex, if rays == 0 { self.error_model().first_rays_at(vertex) } else { rays });
                }
                Task::Refine(node) => indirect.refine(node, self.error_model().first_rays(node)),
            }
        }
        // Direct light is done before indirect light ever is: its ladder does not wait.
        let direct_is_done = direct.tasks() == 0;
        if direct_is_done && indirect.tasks() == 0 {
            return self.lower_tolerance();
        }
        // The drawn mesh is at least as fine as that of indirect light.
        direct.splits.extend_from_slice(&indirect.refined);
        self.work_on_direct(direct);
        self.work_on_indirect(&indirect);
        if direct_is_done && self.tolerance > self.options.tolerance {
            self.step_down();
        }
        true
    }

    /// Splits, traces, and draws the consequences.
    fn work_on_direct(&mut self, Batch { splits, inner, checks, mut jobs }: Batch) {
        let mut fresh = Vec::new();
        for node in splits {
            self.split(node, &mut fresh, &mut jobs);
        }
        let kept = self.place_pixel_vertex(&inner, &mut jobs);
        self.run(&jobs);
        let mut changed: Vec<VertexId> = jobs.iter().map(|job| job.vertex).collect();
        changed.sort_unstable();
        changed.dedup();
        let mut slots = self.slots_of_all(&changed);
        slots.extend(kept);
        slots.extend(fresh.iter().flat_map(|f| f.middles).filter(|s| !self.cache.slots[s.0].direct.known));
        self.confirm(&fresh, &mut slots);
        slots.sort_unstable();
        slots.dedup();
        self.evaluate(&slots);
        self.settle_accounts(&fresh, &slots, &inner);
        self.check_pixels(&checks);
        if self.hidden.has_risen() {
            let leaves = self.all_visible_leaves();
            leaves.into_iter().for_each(|leaf| self.enqueue_split(leaf));
        }
    }

    /// Puts a vertex inside each leaf where its one pixel sees it; returns the slots of those that were there before.
    fn place_pixel_vertex(&mut self, nodes: &[NodeId], jobs: &mut Vec<Job>) -> Vec<SlotId> {
        let mut kept = Vec::new();
        for &id in nodes {
            let node = &self.cache.topology.nodes[id.0];
            let Some(ray) = node.work.ray.filter(|_| node.child.is_none()) else { continue };
            let Some(placed) = self.cache.place_pixel_vertex(id, (self.eye, ray), self.generation) else { continue };
            if placed.kept {
                kept.extend(self.cache.slots_of(placed.vertex));
            } else {
                jobs.push(Job { vertex: placed.vertex, wanted: Wanted::Pixel });
            }
            self.note_redraw(id);
        }
        kept
    }

    /// The job of a task. What else is queued for its vertex is void now: a vertex may be queued twice with the samples it
    /// has, and the same points traced twice in a batch would count twice.
    fn take(&mut self, vertex: VertexId, wanted: Wanted) -> Job {
        self.cache.vertices[vertex.0].progress.version += 1;
        Job { vertex, wanted }
    }

    /// Steps down the ladder of tolerances and queues what the visible leaves leave to do there; `false` at its end.
    fn lower_tolerance(&mut self) -> bool {
        while self.queue.is_empty() && self.tolerance > self.options.tolerance {
            self.step_down();
        }
        !self.queue.is_empty()
    }

    /// Queues what there is to do after all: what was not worth it when it was last looked at may be, by what is known of the image now.
    pub(super) fn look_again(&mut self) {
        self.reopen_checks();
        self.refresh_waiting_predictions();
        let leaves = self.all_visible_leaves();
        self.enqueue_leaves(&leaves);
    }

    /// Halves the tolerance and queues what that leaves to do.
    fn step_down(&mut self) {
        self.tolerance = (self.tolerance * 0.5).max(self.options.tolerance);
        self.look_again();
        self.survey_indirect();
    }

    /// What a queued task is worth now; `None` if it is void.
    fn current_key(&self, task: Task, version: u32) -> Option<f32> {
        match task {
            Task::Split(id) => {
                let node = &self.cache.topology.nodes[id.0];
                (node.child.is_none() && node.work.version == version).then(|| self.error_model().split_key(id))
            }
            Task::SamplePixel(id) => {
                let node = &self.cache.topology.nodes[id.0];
                (node.child.is_none() && node.work.version == version).then(|| self.error_model().pixel_sample_key(id))
            }
            Task::Settle(id) | Task::Double(id) => {
                let current = self.cache.vertices[id.0].progress.version == version;
                current.then(|| self.error_model().vertex_key(id, self.rays_of(task)))
            }
            Task::Gather(id) => {
                (self.cache.vertices[id.0].gathers == version).then(|| self.error_model().gather_key(id))
            }
            Task::Refine(id) => {
                let node = &self.cache.topology.nodes[id.0].indirect;
                (!node.split && node.version == version).then(|| self.error_model().refine_key(id))
            }
        }
    }

    /// Splits a leaf, coarser neighbours before it, and lists the first visits of its new vertices.
    fn split(&mut self, id: NodeId, fresh: &mut Vec<Fresh>, jobs: &mut Vec<Job>) {
        if self.cache.topology.nodes[id.0].child.is_some() {
            return;
        }
        for neighbour in self.cache.topology.coarser_neighbours(id) {
            self.split(neighbour, fresh, jobs);
        }
        let (small, blind) = (self.error_model().trusts_corners(id), self.error_model().blind(id));
        let split = self.cache.split(id);
        for slot in split.middles {
            let vertex = self.cache.slots[slot.0].vertex;
            let progress = &mut self.cache.vertices[vertex.0].progress;
            if !std::mem::replace(&mut progress.visited, true) {
                jobs.push(Job { vertex, wanted: Wanted::Midpoint { node: id, small } });
            }
        }
        self.note_redraw(id);
        for edge in self.cache.topology.nodes[id.0].edges {
            let beside: Vec<NodeId> = self.cache.topology.beside(edge).collect();
            for node in beside {
                self.note_redraw(node);
            }
        }
        fresh.push(Fresh { node: id, first: split.first, middles: split.middles, blind });
    }

    /// Traces jobs on all workers, then writes their results in order.
    fn run(&mut self, jobs: &[Job]) {
        let context = SceneContext::new(&self.scene, &self.bvh, &self.lights, self.options.seed, self.scale);
        let cache = &self.cache;
        let results = self.workers.map_chunks(jobs, |chunk| {
            let mut results = direct::Results::default();
            chunk.iter().for_each(|&job| direct::visit(&context, cache, job, &mut results));
            results
        });
        let traced = |cache: &Cache| jobs.iter().filter(|j| cache.vertices[j.vertex.0].progress.traced).count();
        let before = traced(&self.cache);
        for result in &results {
            direct::apply(&mut self.cache, result);
            self.stats.rays += result.rays;
        }
        self.stats.vertices += (traced(&self.cache) - before) as u64;
        for job in jobs {
            let progress = &mut self.cache.vertices[job.vertex.0].progress;
            progress.visited = true;
            progress.version += 1;
        }
    }

    /// Traces what was inferred where a neighbour in a new leaf says otherwise: a light's mesh may only stay coarse where
    /// it shows no discontinuity. Adds the slots of what was traced.
    fn confirm(&mut self, fresh: &[Fresh], slots: &mut Vec<SlotId>) {
        // Not found by their triangles: new leaves are not drawn yet, nor their neighbours with the new midpoints.
        let beside = |f: &Fresh| self.cache.topology.nodes[f.node.0].edges.map(|edge| self.cache.topology.beside(edge));
        let neighbours = fresh.iter().flat_map(beside).flatten();
        let children = fresh.iter().flat_map(|f| (0..4).map(|i| NodeId(f.first.0 + i)));
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
            vertices.sort_unstable();
            vertices.dedup();
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
        let found = self.workers.map_chunks(nodes, of_chunk).into_iter().flatten();
        let first = found.filter(|&open| taken.insert(open));
        first.map(|(vertex, light)| Job { vertex, wanted: Wanted::Confirm { light } }).collect()
    }

    /// The same of one node, as vertices and lights.
    fn contradictions_of(&self, node: NodeId, found: &mut Vec<(VertexId, u32)>) {
        if self.cache.topology.nodes[node.0].child.is_some() {
            return;
        }
        let corners = self.cache.drawn_vertices(node);
        for (light, layer) in (0_u32..).zip(&self.cache.layers) {
            let known = |v: VertexId| layer.visibility.get(v.0);
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

    /// Whether a light can importance any normal of a vertex at all.
    fn can_light(&self, vertex: VertexId, light: u32) -> bool {
        let position = self.cache.vertices[vertex.0].position;
        let emitter = self.lights.group(light as usize);
        self.cache.slots_of(vertex).any(|slot| emitter.bound(position, self.cache.slots[slot.0].normal) > 0.0)
    }

    /// Surpluses of the split leaves, shares of their children, and new keys for everything around what changed.
    fn settle_accounts(&mut self, fresh: &[Fresh], slots: &[SlotId], inner: &[NodeId]) {
        for f in fresh {
            let surplus = self.error_model().surplus(f.node, f.middles);
            f.blind.into_iter().for_each(|square| self.hidden.note(surplus / square));
            let parent = self.cache.topology.nodes[f.node.0].work;
            for i in 0..4 {
                let work = &mut self.cache.topology.nodes[f.first.0 + i].work;
                work.pixels = parent.pixels * 0.25;
                work.share = parent.share * 0.25;
                work.generation = parent.generation;
            }
            self.hand_down_check(f.node, f.first);
            let node = &mut self.cache.topology.nodes[f.node.0];
            self.image.replace(&mut node.work, None);
        }
        let mut nodes = self.nodes_around(slots);
        nodes.extend_from_slice(inner);
        nodes.extend(fresh.iter().flat_map(|f| (0..4).map(|i| NodeId(f.first.0 + i))));
        nodes.retain(|node| self.cache.topology.nodes[node.0].child.is_none());
        self.measure_around(&mut nodes);
        nodes.sort_unstable();
        nodes.dedup();
        self.look_between_corners(&nodes);
        for node in nodes {
            self.account(node);
            self.enqueue_split(node);
        }
        self.gather_inside(inner);
    }

    /// Measures what the parents of leaves were split for by what is known there now, since the first look was a noisy one, and adds
    /// the leaves beside that are judged by it, too.
    fn measure_around(&mut self, leaves: &mut Vec<NodeId>) {
        let parent = |leaf: &NodeId| self.cache.topology.nodes[leaf.0].parent;
        let mut parents: Vec<NodeId> = leaves.iter().filter_map(parent).collect();
        parents.sort_unstable();
        parents.dedup();
        for parent in parents {
            self.measure_direct(parent);
            let is_leaf = |child: &NodeId| self.cache.topology.nodes[child.0].child.is_none();
            leaves.extend(self.children(parent).into_iter().filter(is_leaf));
        }
    }

    /// Tells a split node's children its surplus of direct light.
    pub(super) fn measure_direct(&mut self, parent: NodeId) {
        let Some(middles) = self.middles(parent) else { return };
        let surplus = self.error_model().surplus(parent, middles) * CHILD;
        self.children(parent).iter().for_each(|child| self.cache.topology.nodes[child.0].work.surplus = surplus);
    }

    /// Queues what is left to trace at the vertices of slots, whose triangles are drawn.
    pub(super) fn enqueue_vertices(&mut self, slots: &[SlotId]) {
        let mut vertices: Vec<VertexId> = slots.iter().map(|s| self.cache.slots[s.0].vertex).collect();
        vertices.sort_unstable();
        vertices.dedup();
        vertices.into_iter().for_each(|v| self.enqueue_vertex(v));
    }

    /// Brings a leaf's share of the image's error up to date.
    pub(super) fn account(&mut self, id: NodeId) {
        let visible = self.cache.topology.nodes[id.0].work.generation == self.generation;
        let error = visible.then(|| self.error_model().leaf_error(id));
        let work = &mut self.cache.topology.nodes[id.0].work;
        self.image.replace(work, error);
    }

    /// Queues everything that the visible leaves leave to do.
    pub(super) fn enqueue_leaves(&mut self, leaves: &[NodeId]) {
        for &leaf in leaves {
            self.account(leaf);
            self.enqueue_split(leaf);
        }
        let of_leaf = |leaf: &NodeId| {
            let node = &self.cache.topology.nodes[leaf.0];
            node.corners.into_iter().chain(node.inner.map(|inner| inner.slot))
        };
        let slots: Vec<SlotId> = leaves.iter().flat_map(of_leaf).collect();
        self.enqueue_vertices(&slots);
    }

    /// Queues a leaf by its present key.
    pub(super) fn enqueue_split(&mut self, id: NodeId) {
        let work = &mut self.cache.topology.nodes[id.0].work;
        work.version += 1;
        let (version, visible) = (work.version, work.generation == self.generation);
        if visible {
            let error_model = self.error_model();
            let (split, inner) = (error_model.split_key(id), error_model.pixel_sample_key(id));
            self.queue.push(split, Task::Split(id), version);
            self.queue.push(inner, Task::SamplePixel(id), version);
            self.enqueue_check(id);
        }
    }

    /// Queues what is left to trace at a vertex.
    fn enqueue_vertex(&mut self, id: VertexId) {
        let version = self.cache.vertices[id.0].progress.version;
        for task in [Task::Settle(id), Task::Double(id)] {
            let rays = self.rays_of(task);
            if rays > 0.0 {
                let key = self.error_model().vertex_key(id, rays);
                self.queue.push(key, task, version);
            }
        }
    }

    /// Rays that a vertex's task would take.
    fn rays_of(&self, task: Task) -> f32 {
        let left = |v: VertexId| self.cache.vertices[v.0].progress.left;
        match task {
            Task::Gather(_) | Task::Refine(_) => 0.0,
            Task::Split(id) | Task::SamplePixel(id) => {
                self.error_model().points_between(&self.cache.topology.nodes[id.0])
            }
            Task::Settle(v) => left(v).settle as f32,
            Task::Double(v) => left(v).double as f32,
        }
    }

    fn slots_of_all(&self, vertices: &[VertexId]) -> Vec<SlotId> {
        vertices.iter().flat_map(|&v| self.cache.slots_of(v)).collect()
    }

    /// Leaves that are drawn with any of the slots.
    pub(super) fn nodes_around(&self, slots: &[SlotId]) -> Vec<NodeId> {
        let leaves = slots.iter().flat_map(|&s| self.cache.drawn_with(s));
        let mut nodes: Vec<NodeId> = leaves.map(|l| self.cache.drawn[l.0].node).collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes.retain(|n| self.cache.topology.nodes[n.0].child.is_none());
        nodes
    }
}
