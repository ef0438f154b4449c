//! Indirect light in a batch: vertices gathered, its mesh refined, what depends on them brought up to date.

use super::engine::Engine;
use super::error_model::CHILD;
use super::indirect_error::PROOF_OF_DARKNESS;
use super::queue::Task;
use crate::cache::dynamic::SlotId;
use crate::cache::gather::{self, GatherJob, Gathered};
use crate::cache::topology::NodeId;
use crate::cache::vertex::VertexId;
use crate::estimate::hemisphere::Method;
use crate::geom::Ray;
use crate::light::context::SceneContext;
use glam::Vec3;
use smallvec::SmallVec;

/// Rays of a job: enough to be worth handing out, few enough to share a vertex's round among threads.
const RAYS_A_JOB: u32 = 128;

/// Direct light of a vertex against the light around it up to which it may be enclosed.
const FAINT: f32 = 0.02;

/// Rise of a key that is worth another entry in the queue.
const RISEN: f32 = 1.25;

/// Work on indirect light in a batch.
#[derive(Default)]
pub(super) struct IndirectWork {
    /// Leaves whose middles are to be sampled.
    pub refined: Vec<NodeId>,
    /// Vertices whose rays are to be doubled.
    vertices: Vec<VertexId>,
    /// Rays that this takes, roughly.
    pub rays: u32,
}

/// Gather rays of a run: the frame loop is served between runs.
pub(super) const GATHER_RAYS_A_RUN: u32 = 8192;

impl IndirectWork {
    /// Number of tasks.
    pub(super) const fn tasks(&self) -> usize {
        self.refined.len() + self.vertices.len()
    }

    /// Adds a vertex that is to get `rays` more rays.
    pub(super) fn gather(&mut self, vertex: VertexId, rays: u32) {
        self.vertices.push(vertex);
        self.rays += rays;
    }

    /// Adds a leaf whose middles get `first` rays each.
    pub(super) fn refine(&mut self, node: NodeId, first: u32) {
        self.refined.push(node);
        self.rays += 3 * first;
    }
}

impl Engine {
    /// Counts the pixels of the visible leaves of the mesh of indirect light and what the vertices' noise there costs, and
    /// queues what they leave to do.
    pub(super) fn survey_indirect(&mut self) {
        if !self.options.indirect {
            return;
        }
        self.place_in_coarse_levels();
        let mut leaves = Vec::new();
        self.roots.iter().for_each(|&root| self.cache.topology.indirect_leaves(root, &mut leaves));
        let corners = self.corners_of_all(&leaves);
        for vertex in &corners {
            let vertex = &mut self.cache.vertices[vertex.0];
            (vertex.importance, vertex.queued) = (0.0, 0.0);
        }
        for &leaf in &leaves {
            self.cache.topology.nodes[leaf.0].indirect.queued = 0.0;
            self.cache.topology.nodes[leaf.0].indirect.importance = 0.0;
            self.cache.topology.nodes[leaf.0].indirect.pixels = self.pixels_below(leaf);
            self.account_indirect(leaf);
            self.enqueue_refinement(leaf);
        }
        self.spread_importance();
        corners.into_iter().for_each(|v| self.enqueue_gather(v));
        self.gather_inside(&self.all_visible_leaves());
        self.refresh_predictions();
        self.predicted = 0;
    }

    /// Traces a batch's gathers and draws the consequences.
    pub(super) fn work_on_indirect(&mut self, work: &IndirectWork) {
        if work.tasks() == 0 {
            return;
        }
        let jobs = self.gather_jobs(work);
        let mut vertices: Vec<VertexId> = jobs.iter().map(|job| job.vertex).collect();
        vertices.dedup();
        self.gather(&jobs);
        work.refined.iter().for_each(|&node| self.mark_refined(node));
        let slots: Vec<SlotId> = vertices.iter().flat_map(|&v| self.cache.slots_of(v)).collect();
        let written = self.cache.refresh_indirect(&slots, self.eye);
        self.published.changed.extend(written);
        work.refined.iter().for_each(|&node| self.divide(node));
        self.judge_around(&slots, &work.refined, vertices);
        self.refresh_predictions_in_time();
    }

    /// Has vertices inside leaves gather where corners of the leaf are covered.
    pub(super) fn gather_inside(&mut self, leaves: &[NodeId]) {
        if !self.options.indirect {
            return;
        }
        for &id in leaves {
            let error_model = self.error_model();
            let Some((slot, doubt)) = error_model.settled(id).zip(error_model.doubt_inside(id)) else { continue };
            let importance = self.cache.topology.nodes[id.0].work.pixels * error_model.gain_of(id, &[slot]);
            let vertex = self.cache.slots[slot.0].vertex;
            self.cache.indirect.note_expected(vertex, doubt);
            let record = &mut self.cache.vertices[vertex.0];
            (record.importance, record.queued) = (importance, 0.0);
            self.enqueue_gather(vertex);
        }
    }

    /// Finds vertices inside something: none of their rays found any light, no light reaches them, and neighbours do see
    /// light. Where a surface runs into a wall its light must not fade towards what is behind.
    fn find_enclosed(&mut self, vertices: &[VertexId]) {
        for &vertex in vertices {
            let slots: Vec<SlotId> = self.cache.slots_of(vertex).collect();
            let dark = |s: &SlotId| self.cache.slots[s.0].indirect.diffuse == Vec3::ZERO;
            let sampled = self.cache.indirect.rays(vertex) > 0 && !self.cache.vertices[vertex.0].progress.covered;
            if !sampled || !slots.iter().all(dark) {
                continue;
            }
            let nodes = self.nodes_around(&slots);
            if self.is_enclosed(vertex, &slots, &nodes) {
                self.enclosed.push(vertex);
                let progress = &mut self.cache.vertices[vertex.0].progress;
                (progress.covered, progress.enclosed) = (true, true);
                let written = self.cache.refresh_indirect(&slots, self.eye);
                self.published.changed.extend(written);
                for node in nodes {
                    self.account(node);
                    self.enqueue_split(node);
                }
            }
        }
    }

    /// Whether a vertex that has seen no light lies inside something: neighbours do see light, and either it has looked often
    /// enough or something stands between it and one of those.
    fn is_enclosed(&mut self, vertex: VertexId, slots: &[SlotId], nodes: &[NodeId]) -> bool {
        // What was put off is guessed: a little direct light proves nothing.
        let direct = slots.iter().map(|s| self.cache.slots[s.0].direct.diffuse.max_element()).fold(0.0, f32::max);
        let is_lit = |slot: &SlotId| {
            let light = self.cache.slots[slot.0].indirect;
            light.diffuse.max_element() * FAINT > direct && !light.stale
        };
        let corners = nodes.iter().flat_map(|n| self.cache.topology.nodes[n.0].corners).filter(is_lit);
        let mut lit: SmallVec<[VertexId; 8]> = corners.map(|slot| self.cache.slots[slot.0].vertex).collect();
        lit.sort_unstable();
        lit.dedup();
        if self.cache.indirect.rays(vertex) >= PROOF_OF_DARKNESS {
            return !lit.is_empty();
        }
        self.stats.rays += lit.len() as u64;
        let origin_of = |vertex: VertexId| self.cache.vertices[vertex.0].shading_point().origin;
        lit.into_iter().any(|other| self.is_cut_off(origin_of(other), origin_of(vertex)))
    }

    /// Whether something stands between two places.
    fn is_cut_off(&self, from: Vec3, to: Vec3) -> bool {
        let (length, direction) = ((to - from).length(), (to - from).normalize_or_zero());
        direction != Vec3::ZERO && self.bvh.occluded(&self.scene, &Ray { origin: from, direction, t_max: length })
    }

    /// The rounds of a batch, cut into jobs.
    fn gather_jobs(&self, work: &IndirectWork) -> Vec<GatherJob> {
        let mut rounds: Vec<(VertexId, u32)> = Vec::new();
        for &vertex in &work.vertices {
            let so_far = self.cache.indirect.rays(vertex);
            let first = || self.cache.indirect.first_rays(vertex, self.error_model().first_rays_at(vertex));
            rounds.push((vertex, if so_far == 0 { first() } else { so_far }));
        }
        for &node in &work.refined {
            let first = self.error_model().first_rays(node);
            for edge in self.cache.topology.nodes[node.0].edges {
                let Some(vertex) = self.cache.topology.midpoint(edge) else { continue };
                // What a covered one would find is not its surface's light: it takes over what is known around.
                let covered = self.cache.vertices[vertex.0].progress.covered;
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
            let start = self.cache.indirect.rays(vertex);
            let cuts = (0..rays).step_by(most as usize);
            jobs.extend(cuts.map(|at| GatherJob { vertex, first: start + at, rays: most.min(rays - at), method }));
        }
        jobs
    }

    /// Traces jobs on all workers, then writes their results in order.
    fn gather(&mut self, jobs: &[GatherJob]) {
        let context = SceneContext::new(&self.scene, &self.bvh, &self.lights, self.options.seed, self.scale);
        let cache = &self.cache;
        let results = self.workers.map_chunks(jobs, |chunk| {
            let mut gathered = Gathered::default();
            chunk.iter().for_each(|&job| gather::gather(&context, cache, job, &mut gathered));
            gathered
        });
        for gathered in &results {
            gather::apply(&mut self.cache, gathered);
            self.stats.rays += gathered.rays;
        }
    }

    /// Makes a leaf an inner node of the mesh of indirect light.
    fn mark_refined(&mut self, id: NodeId) {
        let unmeasured = self.error_model().unmeasured(id);
        let node = &mut self.cache.topology.nodes[id.0];
        let expected = if node.indirect.doubt.is_finite() { node.indirect.doubt } else { unmeasured };
        node.indirect.split = true;
        for vertex in node.edges.map(|edge| self.cache.topology.midpoint(edge)).into_iter().flatten() {
            self.cache.indirect.note_expected(vertex, expected);
        }
    }

    /// Hands a refined leaf's pixels over to its children.
    fn divide(&mut self, id: NodeId) {
        self.forget_indirect(id);
        for child in self.children(id) {
            self.cache.topology.nodes[child.0].indirect.pixels = self.pixels_below(child);
            self.set_importance(child);
        }
    }

    /// Measures surpluses again where they depend on slots, and queues what is left to do around them.
    fn judge_around(&mut self, slots: &[SlotId], refined: &[NodeId], mut vertices: Vec<VertexId>) {
        let mut leaves: Vec<NodeId> = refined.iter().flat_map(|&node| self.children(node)).collect();
        let mut parents = refined.to_vec();
        for node in self.nodes_around(slots) {
            let leaf = self.cache.topology.indirect_leaf(node);
            leaves.push(leaf);
            let up = |id: &NodeId| self.cache.topology.nodes[id.0].parent;
            parents.extend(std::iter::successors(up(&leaf), up));
        }
        parents.sort_unstable();
        parents.dedup();
        for parent in parents {
            leaves.extend(self.measure(parent));
        }
        leaves.sort_unstable();
        leaves.dedup();
        vertices.extend(self.corners_of_all(&leaves));
        self.find_enclosed(&vertices);
        for leaf in leaves {
            self.account_indirect(leaf);
            self.enqueue_refinement(leaf);
        }
        vertices.sort_unstable();
        vertices.dedup();
        vertices.into_iter().for_each(|v| self.enqueue_gather(v));
    }

    /// Measures a node's surplus, and tells its children that are leaves; returns those.
    fn measure(&mut self, parent: NodeId) -> Vec<NodeId> {
        let Some(middles) = self.middles(parent) else { return Vec::new() };
        let Some(error) = self.error_model().indirect_surplus(parent, middles) else { return Vec::new() };
        let [surplus, doubt] = error.map(|e| e * CHILD);
        let mut leaves = self.children(parent);
        leaves.retain(|child| !self.cache.topology.nodes[child.0].indirect.split);
        for child in &leaves {
            let node = &mut self.cache.topology.nodes[child.0].indirect;
            (node.surplus, node.doubt) = (surplus, doubt);
        }
        leaves
    }

    /// The slots in the middle of a split node's edges: the corners of its middle child.
    pub(super) fn middles(&self, id: NodeId) -> Option<[SlotId; 3]> {
        let first = self.cache.topology.nodes[id.0].child?;
        Some(self.cache.topology.nodes[first.0 + 3].corners)
    }

    pub(super) fn children(&self, id: NodeId) -> Vec<NodeId> {
        let first = self.cache.topology.nodes[id.0].child;
        first.map_or(Vec::new(), |first| (0..4).map(|i| NodeId(first.0 + i)).collect())
    }

    pub(super) fn corners_of_all(&self, nodes: &[NodeId]) -> Vec<VertexId> {
        let mut vertices: Vec<VertexId> = nodes.iter().flat_map(|&n| self.cache.corner_vertices(n)).collect();
        vertices.sort_unstable();
        vertices.dedup();
        vertices
    }

    /// Pixels of the drawn leaves of a node.
    fn pixels_below(&self, id: NodeId) -> f32 {
        let node = &self.cache.topology.nodes[id.0];
        match node.child {
            None => node.work.pixels,
            Some(first) => (0..4).map(|i| self.pixels_below(NodeId(first.0 + i))).sum(),
        }
    }

    /// Takes in that a drawn leaf covers more or fewer pixels than was thought.
    pub(super) fn recount_indirect(&mut self, leaf: NodeId, difference: f32) {
        if !self.options.indirect {
            return;
        }
        let id = self.cache.topology.indirect_leaf(leaf);
        let node = &mut self.cache.topology.nodes[id.0].indirect;
        node.pixels = (node.pixels + difference).max(0.0);
        self.account_indirect(id);
        self.enqueue_refinement(id);
    }

    /// Brings up to date what a leaf's noise adds to its corners' importance. Linear interpolation shows a sixth of the variance at
    /// each corner.
    fn set_importance(&mut self, id: NodeId) {
        let share = self.cache.topology.nodes[id.0].indirect.pixels * self.error_model().gain(id) / 6.0;
        self.replace_importance(id, share);
    }

    fn replace_importance(&mut self, id: NodeId, share: f32) {
        let before = std::mem::replace(&mut self.cache.topology.nodes[id.0].indirect.importance, share);
        for vertex in self.cache.corner_vertices(id) {
            let importance = &mut self.cache.vertices[vertex.0].importance;
            *importance = (*importance + share - before).max(0.0);
        }
    }

    /// Brings a leaf's share of the image's error up to date.
    pub(super) fn account_indirect(&mut self, id: NodeId) {
        self.set_importance(id);
        let face = self.cache.topology.nodes[id.0].face;
        let [interpolation, noise] = self.error_model().indirect_error(id);
        let shown = self.reflectances.noise_gain(&self.scene, face) * (interpolation + noise);
        let node = &mut self.cache.topology.nodes[id.0].indirect;
        let error = f64::from(node.pixels * shown);
        self.image.replace_indirect(&mut node.accounted, error);
    }

    fn forget_indirect(&mut self, id: NodeId) {
        self.replace_importance(id, 0.0);
        self.image.replace_indirect(&mut self.cache.topology.nodes[id.0].indirect.accounted, 0.0);
    }

    fn enqueue_refinement(&mut self, id: NodeId) {
        let key = self.error_model().refine_key(id);
        let node = &mut self.cache.topology.nodes[id.0].indirect;
        if is_due(key, node.queued) {
            node.version += 1;
            node.queued = key;
            let version = node.version;
            self.queue.push(key, Task::Refine(id), version);
        }
    }

    pub(super) fn enqueue_gather(&mut self, id: VertexId) {
        let key = self.error_model().gather_key(id);
        let vertex = &mut self.cache.vertices[id.0];
        if is_due(key, vertex.queued) {
            vertex.gathers += 1;
            vertex.queued = key;
            let version = vertex.gathers;
            self.queue.push(key, Task::Gather(id), version);
        }
    }

    /// Notes the key that a task on indirect light waits with, 0 if it has left the queue.
    pub(super) fn note_queued(&mut self, task: Task, key: f32) {
        match task {
            Task::Gather(id) => self.cache.vertices[id.0].queued = key,
            Task::Refine(id) => self.cache.topology.nodes[id.0].indirect.queued = key,
            Task::Split(_) | Task::SamplePixel(_) | Task::Settle(_) | Task::Double(_) => {}
        }
    }
}

/// Whether a task must be queued anew: one that waits with nearly as high a key, or a higher one, is looked at in time.
fn is_due(key: f32, queued: f32) -> bool {
    key > queued * RISEN
}
