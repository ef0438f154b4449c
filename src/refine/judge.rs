//! Judging what has changed: surpluses, the image's error, and the keys of everything around. Nothing waits with a
//! key that what was just found has raised.

use super::engine::Engine;
use super::error_model::{CHILD, LeafKeys};
use super::pixel_checks::{self, Found, Reference};
use super::scheduler::Task;
use super::work::{Lit, SplitLeaf, Work};
use crate::cache::ascending::ascending;
use crate::cache::ids::{NodeId, SlotId, VertexId};
use crate::cache::visibility_probe;

/// Slots whose leaves, and vertices whose tasks, take some ten microseconds.
const FEW_SLOTS: usize = 128;
const FEW_VERTICES: usize = 128;

impl Engine {
    /// Brings surpluses, the image's error and keys up to date with direct light that has changed, and checks pixels.
    pub(super) fn judge(&mut self, lit: &Lit) {
        if lit.first_visits {
            return self.judge_first_visits(lit);
        }
        lit.splits.iter().for_each(|leaf| self.divide_leaf(leaf));
        let children: Vec<NodeId> = lit.splits.iter().flat_map(|leaf| leaf.split.children.all()).collect();
        self.look_inside(&children);
        let mut nodes = self.nodes_around(&lit.slots);
        nodes.extend_from_slice(&lit.pixel_samples);
        nodes.extend(children);
        nodes.retain(|&node| self.cache.topology.is_leaf(node));
        self.measure_around(&mut nodes);
        ascending(&mut nodes);
        self.look_for_highlights(&nodes);
        self.account(&nodes);
        self.enqueue(&nodes);
        self.gather_inside(&lit.pixel_samples);
        self.check_pixels(&lit.checks);
        if self.miss_rate.has_risen() {
            let leaves = self.view.visible_leaves(&self.cache);
            self.enqueue(&leaves);
        }
    }

    /// The same after first visits; when the last is done, everything that waited for it is queued.
    fn judge_first_visits(&mut self, lit: &Lit) {
        let mut nodes = self.nodes_around(&lit.slots);
        if lit.outdated {
            self.measure_around(&mut nodes);
            ascending(&mut nodes);
        }
        self.look_for_highlights(&nodes);
        self.account(&nodes);
        self.queue_waiting();
    }

    /// Hands a split leaf's pixels, and what checks found there, over to its children.
    fn divide_leaf(&mut self, leaf: &SplitLeaf) {
        let surplus = self.error_model().surplus(leaf.node, leaf.split.middles);
        leaf.by_miss_rate.into_iter().for_each(|square| self.miss_rate.note(surplus / square));
        self.view.hand_pixels_down(leaf.node, leaf.split.children);
        self.checks.hand_down(leaf.node, leaf.split.children, &self.cache, &mut self.view);
        self.image.replace(&mut self.view.leaves[leaf.node].accounted, None);
        self.forget_inside(leaf.node);
    }

    /// Measures what the parents of leaves were split for by what is known there now, since the first look was a
    /// noisy one, and adds the leaves beside that are judged by it, too.
    fn measure_around(&mut self, leaves: &mut Vec<NodeId>) {
        let parent = |&leaf: &NodeId| self.cache.topology.nodes[leaf].parent.get();
        let mut parents: Vec<NodeId> = leaves.iter().filter_map(parent).collect();
        ascending(&mut parents);
        self.measure_direct(&parents);
        let topology = &self.cache.topology;
        let children = parents.iter().flat_map(|&parent| topology.children(parent));
        leaves.extend(children.filter(|&child| topology.is_leaf(child)));
    }

    /// Tells split nodes' children their surplus of direct light.
    pub(super) fn measure_direct(&mut self, parents: &[NodeId]) {
        let (model, topology) = (self.error_model(), &self.cache.topology);
        let measure = |parent| Some(model.surplus(parent, topology.middles(parent)?) * CHILD);
        let surpluses = self.workers.map(parents, measure);
        for (&parent, surplus) in parents.iter().zip(surpluses) {
            let Some(surplus) = surplus else { continue };
            let children = self.cache.topology.children(parent);
            children.for_each(|child| self.cache.topology.nodes[child].direct_surplus = surplus);
        }
    }

    /// Checks the pixels of leaves.
    fn check_pixels(&mut self, nodes: &[NodeId]) {
        let (context, cache, view) = (self.context(), &self.cache, &self.view);
        let turn = |node: NodeId| if view.is_checked(node) { view.hidden.get(node).checks } else { 0 };
        let check = |node, rays: &mut u64| pixel_checks::check(&context, cache, (view, node), turn(node), rays);
        let found = self.workers.map_counting(nodes, |&node, rays| check(node, rays));
        self.stats.rays += found.rays;
        self.checks.note_rays(found.rays);
        for (&node, found) in nodes.iter().zip(found.results) {
            if self.cache.topology.is_leaf(node) {
                self.note_check(node, found);
            }
        }
    }

    fn note_check(&mut self, node: NodeId, found: Found) {
        let model = self.error_model();
        let luminance = model.reference_luminance(&model.leaf(node));
        let of = Reference { luminance, reflectance: model.diffuse_reflectance(node) };
        self.checks.note(node, found, of, &mut self.view);
        self.account(&[node]);
        self.enqueue(&[node]);
    }

    /// Brings leaves' shares of the image's error up to date.
    pub(super) fn account(&mut self, leaves: &[NodeId]) {
        let model = self.error_model();
        let errors = self.workers.map(leaves, |id| self.view.sees(id).then(|| model.leaf_error(id)));
        for (&id, error) in leaves.iter().zip(errors) {
            self.image.replace(&mut self.view.leaves[id].accounted, error);
        }
    }

    /// Queues everything that the visible leaves leave to do.
    pub(super) fn enqueue_leaves(&mut self, leaves: &[NodeId]) {
        self.account(leaves);
        self.enqueue(leaves);
        let of_leaf = |&leaf: &NodeId| {
            let node = &self.cache.topology.nodes[leaf];
            node.corners.into_iter().chain(node.pixel_vertex.get())
        };
        let slots: Vec<SlotId> = leaves.iter().flat_map(of_leaf).collect();
        self.enqueue_vertices(&slots);
    }

    /// Queues leaves by their present keys; those whose corners agree to be checked.
    pub(super) fn enqueue(&mut self, leaves: &[NodeId]) {
        let model = self.error_model();
        let keys = self.workers.map(leaves, |id| self.view.sees(id).then(|| model.leaf_keys(id)));
        for (&id, keys) in leaves.iter().zip(keys) {
            let tasks = [Task::Split(id), Task::SamplePixel(id)];
            let Some(LeafKeys { split, sample, check }) = keys else {
                tasks.into_iter().for_each(|task| self.scheduler.void(task));
                continue;
            };
            tasks.into_iter().zip([split, sample]).for_each(|(task, key)| self.scheduler.offer(task, key));
            self.offer_check(id, check);
        }
    }

    /// Queues a leaf to be checked, unless it waits for that.
    fn offer_check(&mut self, id: NodeId, key: Option<f32>) {
        let task = Task::CheckPixels(id);
        if let Some(key) = key.filter(|_| !self.scheduler.waits(task)) {
            self.scheduler.offer(task, key);
        }
    }

    /// Queues what is left to trace at the vertices of slots, whose triangles are drawn.
    pub(super) fn enqueue_vertices(&mut self, slots: &[SlotId]) {
        let mut vertices: Vec<VertexId> = slots.iter().map(|&slot| self.cache.slots[slot].vertex).collect();
        ascending(&mut vertices);
        let tasks = |id: VertexId| [Task::TraceDeferred(id), Task::DoublePoints(id)];
        let due = |task: &Task| self.rays_of(*task) > 0.0;
        let judged = self.workers.map_chunks(&vertices, FEW_VERTICES, |run| {
            let due = run.iter().flat_map(|&id| tasks(id)).filter(due);
            due.map(|task| (task, self.current_key(task))).collect::<Vec<_>>()
        });
        for (task, key) in judged.into_iter().flatten() {
            self.scheduler.offer(task, key.unwrap_or(0.0));
        }
    }

    /// Queues those of the visible leaves anew whose corners have come to agree about lights that a check left out.
    fn reopen_checks(&mut self) {
        let knows_more = |&id: &NodeId| {
            let open = self.view.hidden.get(id).check_open;
            self.view.is_checked(id) && open > 0 && visibility_probe::open_lights(&self.cache, id) < open
        };
        let leaves = self.view.visible_leaves(&self.cache).into_iter();
        for leaf in leaves.filter(knows_more).collect::<Vec<_>>() {
            self.view.leaves[leaf].checked = false;
            let key = self.error_model().leaf_keys(leaf).check;
            self.offer_check(leaf, key);
            if self.scheduler.waits(Task::CheckPixels(leaf)) {
                self.view.hidden.update(leaf, |hidden| hidden.check_open = 0);
            } else {
                self.view.leaves[leaf].checked = true;
            }
        }
    }

    /// Queues what there is to do after all: what was not worth it when it was last looked at may be, by what is
    /// known of the image now.
    pub(super) fn look_again(&mut self) {
        self.bring_all_up_to_date();
        self.reopen_checks();
        self.refresh_waiting_predictions();
        let leaves = self.view.visible_leaves(&self.cache);
        self.enqueue_leaves(&leaves);
    }

    /// Steps down the ladder of tolerances and queues what the visible leaves leave to do there; `false` at its end.
    pub(super) fn lower_tolerance(&mut self) -> bool {
        while self.scheduler.has_only_checks() && self.tolerance > self.options.tolerance {
            self.step_down();
        }
        !self.scheduler.has_only_checks()
    }

    /// Goes on to the next rung of the ladder where direct light is done: it does not wait for indirect light, which
    /// never is.
    pub(super) fn end_rung(&mut self, work: &Work) {
        if work.direct_tasks() == 0 && self.tolerance > self.options.tolerance {
            self.step_down();
        }
    }

    /// Halves the tolerance and queues what that leaves to do.
    fn step_down(&mut self) {
        self.tolerance = (self.tolerance * 0.5).max(self.options.tolerance);
        self.look_again();
        self.survey_indirect();
    }

    /// Leaves that are drawn with any of the slots.
    pub(super) fn nodes_around(&self, slots: &[SlotId]) -> Vec<NodeId> {
        let around = |run: &[SlotId]| {
            let drawn = run.iter().flat_map(|&slot| self.cache.drawn.with_slot(slot));
            let nodes = drawn.map(|drawn| self.cache.drawn.triangles[drawn].node);
            nodes.filter(|&node| self.cache.topology.is_leaf(node)).collect::<Vec<_>>()
        };
        let mut nodes = self.workers.map_chunks(slots, FEW_SLOTS, around).concat();
        ascending(&mut nodes);
        nodes
    }
}
