//! Eviction: faces out of view leave memory, those first that were seen longest ago, once the engine would hold more than it may.
//! Their samples are spilled to disk ([`super::page_in`] brings them back). When all that is left is in view, splits are undone that
//! the view has no use for; after that, nothing is split any more.

use super::engine::{Engine, Visible};
use super::memory::{HeldParts, Room};
use super::publisher::Publisher;
use super::scheduler::{Scheduler, Task};
use super::view::{IndirectLeafView, LeafView, VertexView, ViewState};
use crate::cache::block::ClusterId;
use crate::cache::bytes::Places;
use crate::cache::coarsen::Removed;
use crate::cache::ids::{NodeId, SlotId};
use crate::scene::FaceId;
use crate::trace::within;

/// Share of the budget that a batch may take, and that is made free at a time: rarely, and much.
const A_BATCH: usize = 32;
const ROOM: usize = 12;
/// Share of the budget that is kept for samples where nothing can be split any more.
const FOR_SAMPLES: usize = 8;
/// Splits that a batch has room for, those included that neighbours force.
const SPLITS_A_BATCH: [usize; 2] = [16, 1024];
/// Splits that a task makes, about: neighbours may have to go first.
const SPLITS_A_TASK: usize = 2;

/// What is to fit in.
#[derive(Clone, Copy)]
struct Wanted {
    faces: usize,
    splits: usize,
}

impl Wanted {
    fn places(self) -> Places {
        let of = |face: usize, split: usize| face * self.faces + split * self.splits;
        let [face, split] = [Places::OF_A_FACE, Places::OF_A_SPLIT];
        Places {
            vertices: of(face.vertices, split.vertices),
            slots: of(face.slots, split.slots),
            nodes: of(face.nodes, split.nodes),
            edges: of(face.edges, split.edges),
            drawn: of(face.drawn, split.drawn),
        }
    }
}

/// Bytes that places take in arenas and tables.
const fn bytes_of_places(places: &Places) -> usize {
    let tables = ViewState::bytes_of(places) + Scheduler::bytes_of(places) + Publisher::bytes_of(places);
    places.bytes() + tables
}

impl Engine {
    /// Bytes that the engine holds, as far as the budget counts them.
    pub(super) fn held_bytes(&self) -> usize {
        self.held().iter().map(|(_, bytes)| bytes).sum()
    }

    /// Bytes that the engine holds, by what they are held for.
    #[must_use]
    pub fn held(&self) -> HeldParts {
        let tables = [
            ("tables of the view", self.view.bytes()),
            ("queue", self.scheduler.bytes()),
            ("publisher", self.publisher.bytes()),
            ("what is predicted", self.predictions.bytes()),
            ("eviction", self.memory.bytes() + self.kept_bytes() + self.outdated_specular.bytes()),
            ("mirror in the renderer", self.publisher.mirror_bytes(&self.cache)),
        ];
        let mut all = HeldParts::default();
        self.cache.bytes_by_part().into_iter().chain(tables).zip(&mut all).for_each(|(part, place)| *place = part);
        all
    }

    /// Makes room for a batch: evicts what is out of view if it has to, then undoes splits; if that does not help, nothing is split
    /// any more.
    pub(super) fn make_room(&mut self) {
        let Some(budget) = self.memory.budget else { return };
        let (for_vertices, a_split) = (budget - budget / FOR_SAMPLES, self.bytes_of(&Places::OF_A_SPLIT));
        let splits = (budget / A_BATCH / a_split).clamp(SPLITS_A_BATCH[0], SPLITS_A_BATCH[1]);
        let batch = Wanted { faces: 0, splits };
        self.memory.tasks = (splits / SPLITS_A_TASK) as u64;
        let was_full = self.memory.stats.full;
        let mut has_room = self.has_room_for(batch, for_vertices);
        if !has_room && (!was_full || self.memory.has_old()) {
            self.finish_gathering();
            within("evict", || self.evict(Wanted { splits: splits + budget / ROOM / a_split, ..batch }, for_vertices));
            has_room = self.has_room_for(batch, for_vertices);
            // What was drawn and never sent cannot be taken back.
            if !has_room && self.is_complete() && !self.publisher.has_revealed() {
                within("prune", || while self.prune() {});
                has_room = self.has_room_for(batch, for_vertices);
            }
        }
        self.memory.room = Room { for_vertices: has_room, for_samples: has_room || self.used_bytes() < budget };
        self.memory.stats.full = !has_room;
        self.memory.stats.short |= !has_room;
        if was_full && has_room && self.is_complete() {
            self.look_again();
        }
    }

    /// Makes room for faces that come into view.
    pub(super) fn make_room_for_faces(&mut self, visible: &Visible) {
        let Some(budget) = self.memory.budget.map(|budget| budget - budget / FOR_SAMPLES) else { return };
        let new = visible.faces.iter().filter(|(face, _)| self.cache.root_of(*face).is_none()).map(|(face, _)| *face);
        let new: Vec<FaceId> = new.collect();
        let wanted = Wanted { faces: new.len(), splits: self.memory.splits_of_spilled(&new) };
        if !new.is_empty() && !self.has_room_for(wanted, budget) {
            self.finish_gathering();
            self.leave(visible);
            within("evict", || self.evict(wanted, budget));
        }
    }

    /// Takes the faces out of view that a new view does not show.
    fn leave(&mut self, visible: &Visible) {
        let (cache, scene, weld) = (&mut self.cache, &self.scene, &mut self.weld);
        let stays = |face: &&(FaceId, u32)| self.view.faces.index_of(face.0).is_some();
        let staying: Vec<(FaceId, u32)> = visible.faces.iter().filter(stays).copied().collect();
        let changes = self.view.faces.replace(&staying, |face| cache.root(scene, weld, face));
        self.leaving.add(changes.hidden);
    }

    /// Whether so many new faces and splits fit in: in places that are free, or in more.
    fn has_room_for(&self, wanted: Wanted, budget: usize) -> bool {
        let growth = self.bytes_of(&self.cache.places_added(wanted.faces, wanted.splits));
        let held = self.held_bytes();
        let used = self.used_bytes() + self.bytes_of(&wanted.places());
        used <= budget && (growth == 0 || held + growth <= budget)
    }

    /// Bytes that places take in arenas and tables, with what is sampled there.
    fn bytes_of(&self, places: &Places) -> usize {
        bytes_of_places(places) + self.cache.sample_bytes(places.vertices)
    }

    /// Whether more is in use than leaves room for samples.
    pub(super) fn is_over_budget(&self) -> bool {
        self.memory.budget.is_some_and(|budget| self.used_bytes() > budget - budget / FOR_SAMPLES)
    }

    /// Bytes in use: what the GPU is about to hear of is as good as free.
    fn used_bytes(&self) -> usize {
        let (slots, drawn) = (self.publisher.retired_slots(), self.publisher.retired());
        let pending = bytes_of_places(&Places { slots, drawn, ..Places::default() });
        self.held_bytes().saturating_sub(self.free_bytes() + pending)
    }

    /// Bytes of places that were given back and wait to be used again.
    pub(super) fn free_bytes(&self) -> usize {
        bytes_of_places(&self.cache.free_places())
    }

    /// Evicts clusters until there is room for what is wanted or none is left.
    fn evict(&mut self, wanted: Wanted, budget: usize) {
        self.hide_leaving(usize::MAX);
        let predicting = std::mem::take(&mut self.memory.predicting);
        let mut removed = Removed { predicting, ..Removed::default() };
        for cluster in self.memory.by_age() {
            if self.has_room_for(wanted, budget) {
                break;
            }
            if self.memory.is_spilled(cluster) {
                // The rest of it is read, and may be given numbers of what is gone.
                self.forget_all_removed(&mut removed);
            }
            self.evict_cluster(cluster, &mut removed);
        }
        self.cache.remove_predicting(&self.scene, &self.weld, &mut removed);
        self.memory.predicting = std::mem::take(&mut removed.predicting);
        self.forget_all_removed(&mut removed);
        self.cache.join_free();
    }

    /// Forgets what was removed out of view, so that all its numbers can be used again.
    fn forget_all_removed(&mut self, removed: &mut Removed) {
        let predicting = std::mem::take(&mut removed.predicting);
        let slots = self.forget_removed(std::mem::take(removed));
        slots.into_iter().for_each(|slot| self.cache.slots.recycle(slot));
        removed.predicting = predicting;
    }

    /// Spills a cluster and removes its faces, unless one of them is in view.
    fn evict_cluster(&mut self, cluster: ClusterId, removed: &mut Removed) {
        let triangles = self.scene.triangles.len() as u32;
        let faces: Vec<FaceId> = cluster.faces(triangles).filter(|&face| self.cache.root_of(face).is_some()).collect();
        if faces.iter().any(|&face| self.view.faces.index_of(face).is_some()) {
            return;
        }
        // What is on disk of others of its faces is written with these.
        self.page_rest_in(cluster);
        let faces: Vec<FaceId> = cluster.faces(triangles).filter(|&face| self.cache.root_of(face).is_some()).collect();
        self.memory.note_gone(cluster);
        self.spill_cluster(cluster);
        for face in faces {
            let first = removed.nodes.len();
            if let Some(root) = self.cache.root_of(face) {
                self.publisher.drop_face(&mut self.cache, face, root);
            }
            self.cache.remove_face(&self.scene, &self.weld, face, removed);
            self.memory.stats.evicted += 1;
            self.forget_nodes(&removed.nodes[first..]);
        }
    }

    fn spill_cluster(&mut self, cluster: ClusterId) {
        let blocks = self.cache.blocks(cluster, self.scene.triangles.len() as u32);
        if !blocks.is_empty() {
            let layers =
                blocks.direct.iter().chain([&blocks.indirect]).map(|block| block.as_deref().unwrap_or_default());
            let all: Vec<&[u8]> = [blocks.shape.as_slice()].into_iter().chain(layers).collect();
            let is_spilled = self.memory.spill(cluster, &all, blocks.size);
            self.save_leaving(cluster, &blocks, is_spilled);
        }
    }

    /// Forgets what the view and the queue hold of nodes that are gone.
    fn forget_nodes(&mut self, nodes: &[NodeId]) {
        for &node in nodes {
            self.image.replace(&mut self.view.leaves[node].accounted, None);
            self.view.leaves[node] = LeafView::default();
            self.view.hidden.reset(node);
            self.image.replace_indirect(&mut self.view.indirect[node].accounted, 0.0);
            self.view.indirect[node] = IndirectLeafView::default();
            self.checks.forget_node(node);
            let tasks =
                [Task::Split(node), Task::SamplePixel(node), Task::RefineIndirect(node), Task::CheckPixels(node)];
            tasks.into_iter().for_each(|task| self.scheduler.void(task));
        }
    }

    /// Forgets what is known elsewhere of what was removed, before its numbers are used again; returns the slots, which are not free yet.
    fn forget_removed(&mut self, removed: Removed) -> Vec<SlotId> {
        for &vertex in &removed.vertices {
            self.view.vertices[vertex] = VertexView::default();
            self.scheduler.void_direct(vertex);
            self.scheduler.void(Task::Gather(vertex));
        }
        for &slot in &removed.slots {
            self.view.specular.reset(slot);
            self.view.light_vectors.reset(slot);
        }
        if removed.nodes.is_empty() {
            return removed.slots;
        }
        let cache = &self.cache;
        self.enclosed.retain(|&vertex| cache.vertices.is_alive(vertex));
        self.predictions.retain(|vertex| cache.vertices.is_alive(vertex));
        self.scheduler.retain_first_visits(|vertex| cache.vertices.is_alive(vertex));
        self.waiting.retain(|root| cache.topology.nodes.is_alive(root));
        self.outdated_specular.slots.retain(|&slot| cache.slots.is_alive(slot));
        self.publisher.retain_alive(cache);
        removed.slots
    }

    /// Undoes splits that are worth nothing to the view, the finest first; whether there were any.
    pub(super) fn prune(&mut self) -> bool {
        let mut removed = Removed::default();
        let fit = |node: &NodeId| self.cache.topology.can_coarsen(*node) && self.is_useless(*node);
        let nodes: Vec<NodeId> = self.cache.topology.nodes.ids().filter(fit).collect();
        let mut changed = Vec::new();
        for node in nodes {
            // Another may have gone that this one went by.
            if self.cache.topology.can_coarsen(node) {
                changed.extend(self.coarsen(node, &mut removed));
            }
        }
        let any = !removed.nodes.is_empty();
        // The GPU may still draw with them.
        let slots = self.forget_removed(removed);
        self.publisher.retire_slots(slots);
        // Their leaves share the pixels out anew.
        let nodes = changed.into_iter().filter(|&node| self.cache.topology.nodes.is_alive(node));
        let faces = nodes.filter_map(|node| self.view.faces.index_of(self.cache.topology.nodes[node].face));
        let mut indices: Vec<usize> = faces.collect();
        indices.sort_unstable();
        indices.dedup();
        self.bring_up_to_date(&indices);
        any
    }

    /// Whether the children of a node are in view, and would not be asked for if it were a leaf: they cover hardly a pixel, and
    /// interpolation between its corners is as good as what is known of its middles.
    fn is_useless(&self, node: NodeId) -> bool {
        let mut children = self.cache.topology.children(node);
        let shown: f32 = self.cache.topology.children(node).map(|child| self.view.leaves[child].pixels).sum();
        children.all(|child| self.view.leaves[child].visible) && self.error_model().is_smooth(node, shown)
    }

    /// Makes a leaf of a node; returns the leaves that show something else.
    fn coarsen(&mut self, node: NodeId, removed: &mut Removed) -> Vec<NodeId> {
        let first = removed.nodes.len();
        let children: Vec<NodeId> = self.cache.topology.children(node).collect();
        let pixels = children.iter().map(|&child| self.view.leaves[child].pixels).sum();
        children.iter().for_each(|&child| self.hide_indirect(child));
        self.publisher.merge(&mut self.cache, node, &children);
        let mut changed = self.cache.coarsen(node, removed);
        self.forget_nodes(&removed.nodes[first..]);
        self.view.show(node, None, pixels);
        self.memory.stats.coarsened += 1;
        for &leaf in &changed {
            self.publisher.note_redraw(&self.cache, leaf);
        }
        changed.push(node);
        changed
    }
}
