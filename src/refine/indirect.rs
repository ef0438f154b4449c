//! Indirect light in a batch: what depends on what vertices have gathered, and on the view, is brought up to date.

use super::engine::Engine;
use super::error_model::{CHILD, ErrorModel};
use super::scheduler::Task;
use super::view::IndirectLeafView;
use super::work::GatheredLight;
use super::workers::Workers;
use crate::cache::ascending::ascending;
use crate::cache::ids::{NodeId, SlotId, VertexId};
use crate::cache::indirect::{EvaluateRun, Evaluated};

/// Nodes whose corners, and slots whose light, take some ten microseconds.
const FEW: usize = 256;
const FEW_SLOTS: usize = 64;

/// Evaluates runs of slots on workers.
fn evaluate_on(workers: &Workers) -> impl Fn(&[SlotId], EvaluateRun<'_>) -> Vec<Evaluated> {
    |slots, evaluate| workers.map_chunks(slots, FEW_SLOTS, evaluate)
}

impl Engine {
    /// Measures surpluses again where they depend on indirect light that has changed, and queues what is left to do
    /// around it.
    pub(super) fn judge_indirect(&mut self, GatheredLight { vertices, refined }: &GatheredLight) {
        let slots = self.slots_of_all(vertices);
        let mut vertices = vertices.clone();
        let children = refined.iter().flat_map(|&node| self.cache.topology.children(node));
        let mut leaves = self.indirect_leaves_of(&self.nodes_around(&slots));
        let mut parents = refined.clone();
        parents.extend(self.cache.topology.above(&leaves));
        leaves.extend(children);
        ascending(&mut parents);
        leaves.extend(self.measure_indirect(&parents));
        ascending(&mut leaves);
        vertices.extend(self.corners_of_all(&leaves));
        self.find_enclosed(&vertices);
        self.account_indirect(&leaves);
        self.enqueue_refinements(&leaves);
        ascending(&mut vertices);
        self.enqueue_gathers(&vertices);
        self.refresh_predictions_in_time();
    }

    /// Brings the indirect light of slots that have gathered, and all that depends on it, up to date; it is then due to
    /// be sent.
    pub(super) fn refresh_indirect(&mut self, slots: &[SlotId]) {
        let (eye, specular) = (self.view.eye, &mut self.view.specular);
        let written = self.cache.refresh_indirect(slots, eye, specular, &evaluate_on(&self.workers));
        self.publisher.note_changed(&written);
    }

    /// Evaluates the indirect light of slots of which nothing new is known, for a new eye or since they are new; returns the
    /// slots written, which are not due to be sent.
    pub(super) fn refresh_unseen(&mut self, slots: &[SlotId]) -> Vec<SlotId> {
        let (eye, specular) = (self.view.eye, &mut self.view.specular);
        self.cache.evaluate_indirect(slots, (eye, specular), &evaluate_on(&self.workers))
    }

    /// Surveys all faces in view, of which base vertices alone are predicted from then on.
    pub(super) fn survey_indirect(&mut self) {
        if !self.options.indirect {
            return;
        }
        self.predictions.start_anew();
        let roots: Vec<NodeId> = self.view.faces.roots().collect();
        self.survey(&roots, &self.view.visible_leaves(&self.cache));
        if self.cache.predictions_are_stale() {
            self.refresh_predictions();
        }
        self.predictions.note_survey(self.stats.rays);
    }

    /// Counts the pixels of the indirect layer's leaves below roots, whose leaves are `drawn`, and what the vertices' noise there
    /// costs, and queues what they leave to do.
    pub(super) fn survey(&mut self, roots: &[NodeId], drawn: &[NodeId]) {
        if !self.options.indirect {
            return;
        }
        let base = self.corners_of_all(roots);
        let placed = self.predictions.place(&mut self.cache, &base, &self.workers);
        if self.cache.indirect.has_gathered() {
            let written = self.refresh_unseen(&placed);
            self.publisher.note_changed(&written);
        }
        let mut leaves = Vec::new();
        roots.iter().for_each(|&root| self.cache.topology.indirect_leaves(root, &mut leaves));
        for &leaf in &leaves {
            self.view.indirect[leaf].pixels = self.view.pixels_below(&self.cache, leaf);
        }
        self.account_indirect(&leaves);
        self.enqueue_refinements(&leaves);
        if self.predictions.have_grown() {
            self.predictions.spread_importance(&self.cache, &mut self.view);
        }
        self.enqueue_gathers(&self.corners_of_all(&leaves));
        self.gather_inside(drawn);
    }

    /// Takes a leaf of the indirect layer out of the view.
    pub(super) fn hide_indirect(&mut self, leaf: NodeId) {
        self.set_importance(leaf, 0.0);
        self.image.replace_indirect(&mut self.view.indirect[leaf].accounted, 0.0);
        self.view.indirect[leaf] = IndirectLeafView::default();
    }

    /// Has pixel vertices gather where corners of their leaf are covered.
    pub(super) fn gather_inside(&mut self, leaves: &[NodeId]) {
        if !self.options.indirect {
            return;
        }
        for &id in leaves {
            let model = self.error_model();
            let Some((slot, doubt)) = model.settled(id).zip(model.doubt_inside(id)) else { continue };
            let importance = self.view.leaves[id].pixels * model.gain_of(id, &[slot]);
            let vertex = self.cache.slots[slot].vertex;
            self.cache.indirect.note_expected(vertex, doubt);
            self.view.vertices[vertex].importance = importance;
            self.enqueue_gathers(&[vertex]);
        }
    }

    /// Brings predictions up to date where enough rays were traced for that to cost little beside them.
    fn refresh_predictions_in_time(&mut self) {
        if self.predictions.are_due(self.stats.rays) {
            self.refresh_waiting_predictions();
        }
    }

    /// Brings predictions up to date if any waits for that.
    pub(super) fn refresh_waiting_predictions(&mut self) {
        if self.cache.predictions_are_stale() {
            self.predictions.spread_importance(&self.cache, &mut self.view);
            self.refresh_predictions();
        }
    }

    /// Brings predictions up to date, with all that hangs on them.
    fn refresh_predictions(&mut self) {
        self.predictions.note_refresh(self.stats.rays);
        let (base, eye, specular) = (self.predictions.base(), self.view.eye, &mut self.view.specular);
        let written = self.cache.refresh_predictions(base, eye, specular, &evaluate_on(&self.workers));
        let leaves = self.indirect_leaves_of(&self.nodes_around(&written));
        self.account_indirect(&leaves);
        let base = written.iter().map(|&slot| &self.cache.slots[slot]).filter(|record| record.is_base());
        let mut vertices: Vec<VertexId> = base.map(|record| record.vertex).collect();
        vertices.extend_from_slice(self.predictions.predicting());
        ascending(&mut vertices);
        self.enqueue_gathers(&vertices);
        self.publisher.note_changed(&written);
    }

    /// Measures nodes' surpluses, and tells their children that are leaves; returns those.
    fn measure_indirect(&mut self, parents: &[NodeId]) -> Vec<NodeId> {
        let (model, topology) = (self.error_model(), &self.cache.topology);
        let measure = |parent| model.indirect_surplus(parent, topology.middles(parent)?);
        let errors = self.workers.map(parents, measure);
        let mut leaves = Vec::new();
        for (&parent, error) in parents.iter().zip(errors) {
            let Some([surplus, doubt]) = error.map(|error| error.map(|e| e * CHILD)) else { continue };
            for child in self.cache.topology.children(parent) {
                let node = &mut self.cache.topology.nodes[child];
                if !node.indirect_split {
                    (node.indirect.surplus, node.indirect.doubt) = (surplus, doubt);
                    leaves.push(child);
                }
            }
        }
        leaves
    }

    /// The leaves of the indirect layer that leaves are parts of, each once where those of one follow each other.
    fn indirect_leaves_of(&self, leaves: &[NodeId]) -> Vec<NodeId> {
        let mut found = self.workers.map(leaves, |leaf| self.cache.topology.indirect_leaf(leaf));
        found.dedup();
        found
    }

    /// The vertices at the corners of nodes, in ascending order.
    fn corners_of_all(&self, nodes: &[NodeId]) -> Vec<VertexId> {
        let corners =
            |run: &[NodeId]| run.iter().flat_map(|&node| self.cache.corner_vertices(node)).collect::<Vec<_>>();
        let mut vertices = self.workers.map_chunks(nodes, FEW, corners).concat();
        ascending(&mut vertices);
        vertices
    }

    /// Takes in that a drawn leaf covers more or fewer pixels than was thought.
    pub(super) fn recount_indirect(&mut self, leaf: NodeId, difference: f32) {
        if !self.options.indirect {
            return;
        }
        let id = self.cache.topology.indirect_leaf(leaf);
        let pixels = &mut self.view.indirect[id].pixels;
        *pixels = (*pixels + difference).max(0.0);
        self.account_indirect(&[id]);
        self.enqueue_refinements(&[id]);
    }

    /// Brings up to date what a leaf's noise adds to its corners' importance. Linear interpolation shows a sixth of
    /// the variance at each corner.
    pub(super) fn update_importance(&mut self, id: NodeId) {
        let share = self.view.indirect[id].pixels * self.error_model().gain(id) / 6.0;
        self.set_importance(id, share);
    }

    pub(super) fn set_importance(&mut self, id: NodeId, share: f32) {
        let before = std::mem::replace(&mut self.view.indirect[id].importance, share);
        for vertex in self.cache.corner_vertices(id) {
            let importance = &mut self.view.vertices[vertex].importance;
            *importance = (*importance + share - before).max(0.0);
        }
    }

    /// Brings leaves' shares of the image's error, and what their noise adds to their corners' importance, up to date.
    fn account_indirect(&mut self, leaves: &[NodeId]) {
        let model = self.error_model();
        let judged = self.workers.map(leaves, |id| {
            let face = self.cache.topology.nodes[id].face;
            let error: f32 = if self.is_buried(&model, id) { 0.0 } else { model.indirect_error(id).iter().sum() };
            [model.gain(id), self.reflectances.noise_gain(&self.scene, face) * error]
        });
        for (&id, [gain, shown]) in leaves.iter().zip(judged) {
            let pixels = self.view.indirect[id].pixels;
            self.set_importance(id, pixels * gain / 6.0);
            self.image.replace_indirect(&mut self.view.indirect[id].accounted, pixels * shown);
        }
    }

    /// Whether a leaf lies inside other geometry, as far as it is looked at: then it has no light to be wrong about. A picture that sees it
    /// says otherwise.
    fn is_buried(&self, model: &ErrorModel, id: NodeId) -> bool {
        let corners = self.cache.topology.nodes[id].corners;
        self.view.image.is_none()
            && corners.iter().all(|&slot| self.cache.is_covered(slot))
            && model.refine_key(id) == 0.0
    }

    /// Queues leaves of the indirect layer by their present keys.
    fn enqueue_refinements(&mut self, leaves: &[NodeId]) {
        let model = self.error_model();
        let keys = self.workers.map(leaves, |id| model.refine_key(id));
        leaves.iter().zip(keys).for_each(|(&id, key)| self.scheduler.offer(Task::RefineIndirect(id), key));
    }

    /// Queues vertices to gather by their present keys.
    fn enqueue_gathers(&mut self, vertices: &[VertexId]) {
        let model = self.error_model();
        let keys = self.workers.map(vertices, |id| model.gather_key(id));
        vertices.iter().zip(keys).for_each(|(&id, key)| self.scheduler.offer(Task::Gather(id), key));
    }
}
