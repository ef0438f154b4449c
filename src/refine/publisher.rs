//! What the GPU is told: slots written, patches to redraw, and when the triangles that they replace may be recycled.

use super::update::{Patch, Slot, Update};
use super::view::ViewState;
use crate::cache::ascending::ascending;
use crate::cache::bytes::Places;
use crate::cache::drawn_mesh::OfNode;
use crate::cache::ids::{DrawnId, NodeId, SlotId};
use crate::cache::pool::Table;
use crate::cache::slot::{COVERED_WEIGHT, Luminance};
use crate::cache::store::Cache;
use crate::scene::FaceId;
use glam::Vec4;
use rustc_hash::FxHashMap;
use std::collections::VecDeque;

/// What has been published and what is due.
#[derive(Default)]
pub struct Publisher {
    /// Slots evaluated since the last update.
    changed: Vec<SlotId>,
    /// Nodes whose triangles are no longer right.
    redraw: Vec<NodeId>,
    /// Leaves drawn for the first time since the last update.
    revealed: Vec<NodeId>,
    /// Number of the last update.
    sequence: u64,
    /// Triangles out of use, with the update that replaced them.
    retired: VecDeque<(u64, DrawnId)>,
    /// Triangles of faces that are gone, with the faces; triangles of the children of nodes that are leaves again.
    dropped: Vec<(FaceId, Vec<DrawnId>)>,
    merged: FxHashMap<NodeId, Vec<DrawnId>>,
    /// Slots out of use, with the update that replaced the last triangles drawn with them.
    retired_slots: VecDeque<(u64, SlotId)>,
    /// Update that last listed each triangle, drawn or for its values: the low bits of its number.
    listed: Table<DrawnId, u32>,
}

impl Publisher {
    /// Bytes held.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let lists = self.changed.capacity() + self.redraw.capacity() + self.revealed.capacity();
        let retired = (self.retired.capacity() + self.retired_slots.capacity()) * size_of::<(u64, DrawnId)>();
        lists * size_of::<u32>() + retired + self.listed.bytes()
    }

    /// Bytes of what a renderer holds of slots and triangles.
    #[must_use]
    pub fn mirror_bytes(&self, cache: &Cache) -> usize {
        cache.slots.places() * MIRROR_OF_A_SLOT + cache.drawn.triangles.places() * MIRROR_OF_A_TRIANGLE
    }

    /// Bytes that so many more places take here and in a renderer.
    #[must_use]
    pub const fn bytes_of(added: &Places) -> usize {
        added.slots * MIRROR_OF_A_SLOT + added.drawn * (MIRROR_OF_A_TRIANGLE + size_of::<u32>())
    }

    /// Takes the triangles of a face out of use, which is out of view and about to go; nothing takes their place. Their numbers can be
    /// used again at once: the next update drops them before it does anything else.
    pub fn drop_face(&mut self, cache: &mut Cache, face: FaceId, root: NodeId) {
        let (mut nodes, mut old) = (vec![root], Vec::new());
        while let Some(node) = nodes.pop() {
            nodes.extend(cache.topology.children(node));
            let triangles = cache.drawn.retire(node);
            for &drawn in &triangles {
                self.listed[drawn] = 0;
                cache.drawn.triangles.remove(drawn);
            }
            // What was never sent is not to be taken back.
            if !triangles.is_empty() && !self.revealed.contains(&node) {
                old.extend(triangles);
            }
            old.extend(self.merged.remove(&node).into_iter().flatten());
        }
        if !old.is_empty() {
            self.dropped.push((face, old));
        }
    }

    /// Takes the triangles of a node's children out of use, which is about to become a leaf and will be drawn in their place.
    pub fn merge(&mut self, cache: &mut Cache, node: NodeId, children: &[NodeId]) {
        let mut old = Vec::new();
        for &child in children {
            old.extend(self.retire(cache, child));
            old.extend(self.merged.remove(&child).into_iter().flatten());
        }
        self.merged.entry(node).or_default().extend(old);
        self.redraw.push(node);
    }

    /// Whether anything waits that was drawn for the first time and never sent.
    pub const fn has_revealed(&self) -> bool {
        !self.revealed.is_empty()
    }

    /// Says nothing any more of slots and nodes that are gone.
    pub fn retain_alive(&mut self, cache: &Cache) {
        self.changed.retain(|&slot| cache.slots.is_alive(slot));
        self.redraw.retain(|&node| cache.topology.nodes.is_alive(node));
        self.revealed.retain(|&node| cache.topology.nodes.is_alive(node));
    }

    /// Notes slots that are gone, in view: they can be used again once the GPU draws none of their triangles.
    pub fn retire_slots(&mut self, slots: Vec<SlotId>) {
        let sequence = self.sequence + 1;
        self.retired_slots.extend(slots.into_iter().map(|slot| (sequence, slot)));
    }

    /// Notes that the values of slots have changed.
    pub fn note_changed(&mut self, slots: &[SlotId]) {
        self.changed.extend_from_slice(slots);
    }

    /// Notes that a node's triangles must be drawn anew; a node that never was drawn is part of one that was.
    pub fn note_redraw(&mut self, cache: &Cache, node: NodeId) {
        if cache.drawn.is_drawn(node) {
            self.redraw.push(node);
        }
    }

    /// Triangles out of use that the GPU has not replaced yet.
    #[must_use]
    pub fn retired(&self) -> usize {
        self.retired.len()
    }

    /// Slots out of use that the GPU may still draw with.
    #[must_use]
    pub fn retired_slots(&self) -> usize {
        self.retired_slots.len()
    }

    /// Takes the triangles of a node out of use: the update in the making replaces them.
    fn retire(&mut self, cache: &mut Cache, node: NodeId) -> OfNode {
        let old = cache.drawn.retire(node);
        self.retired.extend(old.iter().map(|&drawn| (self.sequence + 1, drawn)));
        old
    }

    /// Gives a leaf its triangles.
    fn draw(&mut self, cache: &mut Cache, view: &ViewState, node: NodeId) {
        let drawn = cache.draw(node, view.pixel_slot(cache, node));
        drawn.into_iter().for_each(|drawn| self.listed[drawn] = (self.sequence + 1) as u32);
    }

    /// Draws a leaf of a face that came into view, if neither it nor what it is a part of ever was.
    pub fn draw_revealed(&mut self, cache: &mut Cache, view: &ViewState, leaf: NodeId) {
        let mut above = std::iter::successors(Some(leaf), |&node| cache.topology.nodes[node].parent.get());
        if !above.any(|node| cache.drawn.is_drawn(node)) {
            self.draw(cache, view, leaf);
            self.revealed.push(leaf);
        }
    }

    /// Notes that a leaf that shows a pixel of another view must be drawn anew.
    pub fn note_outdated(&mut self, cache: &Cache, leaf: NodeId) {
        let is_flat = |&drawn: &DrawnId| cache.drawn.triangles[drawn].flat.get().is_some();
        if cache.drawn.of_node(leaf).iter().any(is_flat) {
            self.redraw.push(leaf);
        }
    }

    /// Starts the next update: draws what was revealed, and replaces the triangles of nodes that were split or whose
    /// edges changed, in view or not. Returns the slots that they are drawn with and that have no direct light yet: looks
    /// at a midpoint that only a neighbour had needed so far.
    pub fn redraw(&mut self, cache: &mut Cache, view: &ViewState) -> (Update, Vec<SlotId>) {
        let (mut update, mut fresh) = (Update::default(), Vec::new());
        for (face, old) in std::mem::take(&mut self.dropped) {
            let start = update.patch_triangles.len() as u32;
            update.patch_triangles.extend(old);
            let end = update.patch_triangles.len() as u32;
            update.patches.push(Patch { face, old: start..end, new: end..end });
        }
        for node in std::mem::take(&mut self.revealed) {
            let start = update.patch_triangles.len() as u32;
            list(cache, &mut update, node);
            let end = update.patch_triangles.len() as u32;
            let face = cache.topology.nodes[node].face;
            update.patches.push(Patch { face, old: start..start, new: start..end });
        }
        let mut nodes = std::mem::take(&mut self.redraw);
        ascending(&mut nodes);
        for node in nodes {
            let mut old = self.retire(cache, node).to_vec();
            old.extend(self.merged.remove(&node).into_iter().flatten());
            if old.is_empty() {
                // Part of what is drawn anew as a whole.
                continue;
            }
            let mut leaves = Vec::new();
            cache.topology.leaves(node, &mut leaves);
            let start = update.patch_triangles.len() as u32;
            update.patch_triangles.extend(old);
            let middle = update.patch_triangles.len() as u32;
            for leaf in leaves {
                self.draw(cache, view, leaf);
                list(cache, &mut update, leaf);
                let drawn = cache.drawn.of_node(leaf).into_iter();
                fresh.extend(drawn.flat_map(|drawn| cache.drawn.triangles[drawn].all_slots()));
            }
            let end = update.patch_triangles.len() as u32;
            let face = cache.topology.nodes[node].face;
            update.patches.push(Patch { face, old: start..middle, new: middle..end });
        }
        fresh.retain(|&slot| !cache.slots[slot].direct().known);
        ascending(&mut fresh);
        self.sequence += 1;
        (update.generation, update.sequence) = (view.generation, self.sequence);
        (update, fresh)
    }

    /// Takes the slots that were evaluated since the last update, in ascending order.
    pub fn take_changed(&mut self) -> Vec<SlotId> {
        let mut slots = std::mem::take(&mut self.changed);
        ascending(&mut slots);
        slots
    }

    /// Adds the values of slots, and patches of the triangles that these alone have changed, in view or not.
    pub fn add_values(&mut self, update: &mut Update, values: Vec<Values>) {
        let sequence = self.sequence as u32;
        update.slots.reserve(values.iter().map(|run| run.slots.len()).sum());
        for Values { slots, triangles } in values {
            update.slots.extend(slots);
            for (drawn, face) in triangles {
                if std::mem::replace(&mut self.listed[drawn], sequence) != sequence {
                    let i = update.patch_triangles.len() as u32;
                    update.patch_triangles.push(drawn);
                    update.patches.push(Patch { face, old: i..i + 1, new: i..i + 1 });
                }
            }
        }
    }

    /// Number of the last update.
    pub(super) const fn sequence(&self) -> u64 {
        self.sequence
    }

    /// How many updates have come since the last one that listed a triangle, drawn or for its values.
    pub(super) fn updates_since(&self, drawn: DrawnId) -> u32 {
        (self.sequence as u32).wrapping_sub(self.listed[drawn])
    }

    /// All that the updates so far add up to, under the number of the last.
    pub fn whole(&mut self, cache: &Cache, view: &ViewState) -> Update {
        // They are among all.
        self.revealed.clear();
        let (generation, sequence) = (view.generation, self.sequence);
        let mut update = Update { generation, sequence, whole: true, ..Update::default() };
        update.slots = cache.slots.ids().map(|slot| (slot, value(cache, view, slot))).collect();
        for node in cache.topology.nodes.ids().filter(|&node| cache.drawn.is_drawn(node)) {
            let start = update.patch_triangles.len() as u32;
            list(cache, &mut update, node);
            let end = update.patch_triangles.len() as u32;
            let face = cache.topology.nodes[node].face;
            update.patches.push(Patch { face, old: start..start, new: start..end });
        }
        update
    }

    /// Gives back the triangles that update `sequence` or an earlier one has replaced on the GPU.
    pub fn recycle(&mut self, cache: &mut Cache, sequence: u64) {
        let due = self.retired.partition_point(|&(replaced, _)| replaced <= sequence);
        for (_, drawn) in self.retired.drain(..due) {
            self.listed[drawn] = 0;
            cache.drawn.triangles.remove(drawn);
        }
        let due = self.retired_slots.partition_point(|&(replaced, _)| replaced <= sequence);
        self.retired_slots.drain(..due).for_each(|(_, slot)| cache.slots.recycle(slot));
    }
}

/// Bytes of a slot and of a triangle in a renderer: on the host and on the device.
const MIRROR_OF_A_SLOT: usize = 2 * 40;
const MIRROR_OF_A_TRIANGLE: usize = 2 * 20 + 12;

/// Lists a leaf's triangles with their definitions.
fn list(cache: &Cache, update: &mut Update, node: NodeId) {
    for drawn in cache.drawn.of_node(node) {
        update.drawn_triangles.push((drawn, cache.drawn_triangle(drawn)));
        update.patch_triangles.push(drawn);
    }
}

/// Weight of a slot whose direct light is a guess: it counts for nothing beside any that is known.
const GUESSED_WEIGHT: f32 = COVERED_WEIGHT;

/// What a run of slots shows, and which triangles show them.
#[derive(Debug, Default)]
pub struct Values {
    slots: Vec<(SlotId, Slot)>,
    /// With the faces that they lie on; once for each of their slots.
    triangles: Vec<(DrawnId, FaceId)>,
}

impl Values {
    /// The present values of slots, each by `value`.
    pub fn of(cache: &Cache, slots: &[SlotId], value: impl Fn(SlotId) -> Slot) -> Self {
        let mut triangles = Vec::with_capacity(slots.len() * 6);
        for &slot in slots {
            let of_node = |drawn| cache.topology.nodes[cache.drawn.triangles[drawn].node].face;
            triangles.extend(cache.drawn.with_slot(slot).map(|drawn| (drawn, of_node(drawn))));
        }
        Self { slots: slots.iter().map(|&slot| (slot, value(slot))).collect(), triangles }
    }
}

/// What a slot shows of all light.
pub fn value(cache: &Cache, view: &ViewState, slot: SlotId) -> Slot {
    let record = &cache.slots[slot];
    let weight = match record.direct() {
        Luminance { known: true, .. } => cache.weight(slot),
        Luminance { stale: true, .. } => GUESSED_WEIGHT,
        _ => 0.0,
    };
    let position = cache.vertices[record.vertex].position;
    let (diffuse, specular) = (cache.diffuse_to_show(slot), view.specular.get(slot).total());
    Slot { position, weight, diffuse, specular, light_vector: light_vector(cache, view, slot) }
}

/// Longest light vector that is sent: light that grazes would make bumps glow.
const MOST_TURNING: f32 = 4.0;

/// See [`Slot::light_vector`].
fn light_vector(cache: &Cache, view: &ViewState, slot: SlotId) -> Vec4 {
    if !cache.turns {
        return Vec4::ZERO;
    }
    let record = &cache.slots[slot];
    let all = view.light_vectors.get(slot) + cache.indirect_vector(slot);
    let (vector, fluence) = (all.truncate(), all.w);
    let along = vector.dot(record.normal());
    let over = if along > 0.0 { vector / along } else { record.normal() };
    let concentration = if fluence > 0.0 { vector.length() / fluence } else { 1.0 };
    over.clamp_length_max(MOST_TURNING).extend(concentration.min(1.0))
}

#[cfg(test)]
mod tests {
    use super::super::testing::{Judged, judged};
    use super::*;
    use crate::refine::replay::HostMesh;

    /// A square that was drawn by a first update, and what the GPU holds of it.
    fn published() -> (Judged, Publisher, HostMesh) {
        let (mut square, mut publisher, mut mesh) = (judged(100.0), Publisher::default(), HostMesh::default());
        let leaves = square.leaves();
        leaves.iter().for_each(|&leaf| publisher.draw_revealed(&mut square.rooted.cache, &square.view, leaf));
        let slots: Vec<SlotId> = square.cache.slots.ids().collect();
        publisher.note_changed(&slots);
        let first = next(&mut square, &mut publisher, &mut mesh);
        assert_eq!((first.patches.len(), first.slots.len()), (2, slots.len()));
        (square, publisher, mesh)
    }

    /// The next update.
    fn next(square: &mut Judged, publisher: &mut Publisher, mesh: &mut HostMesh) -> Update {
        let (mut update, _) = publisher.redraw(&mut square.rooted.cache, &square.view);
        let slots = publisher.take_changed();
        let values =
            slots.chunks(2).map(|run| Values::of(&square.cache, run, |slot| value(&square.cache, &square.view, slot)));
        publisher.add_values(&mut update, values.collect());
        mesh.apply(&update).expect("an update that fits the mesh");
        update
    }

    /// Splits a root; both triangles are to be drawn anew.
    fn split(square: &mut Judged, publisher: &mut Publisher) {
        let root = square.roots[0];
        square.split(root);
        for child in square.cache.topology.children(root).collect::<Vec<_>>() {
            square.see(child, 25.0);
        }
        square.roots.iter().for_each(|&node| publisher.note_redraw(&square.cache, node));
    }

    #[test]
    fn a_slot_that_changed_is_sent_once_with_each_triangle_around_it() {
        let (mut square, mut publisher, mut mesh) = published();
        let shared = square.corners(square.roots[0])[0];
        publisher.note_changed(&[shared, shared]);
        publisher.note_changed(&[shared]);
        let update = next(&mut square, &mut publisher, &mut mesh);
        assert_eq!(update.slots.iter().map(|(slot, _)| *slot).collect::<Vec<_>>(), [shared]);
        assert_eq!((update.patches.len(), update.drawn_triangles.len()), (2, 0));
        let update = next(&mut square, &mut publisher, &mut mesh);
        assert_eq!((update.slots.len(), update.patches.len(), update.sequence), (0, 0, 3));
        let since = |slot| square.cache.drawn.with_slot(slot).map(|drawn| publisher.updates_since(drawn)).max();
        assert_eq!((since(shared), publisher.sequence()), (Some(1), 3));
    }

    #[test]
    fn a_triangle_around_several_changed_slots_is_listed_once_and_a_new_one_not_twice() {
        let (mut square, mut publisher, mut mesh) = published();
        let corners = square.corners(square.roots[0]);
        publisher.note_changed(&corners);
        let update = next(&mut square, &mut publisher, &mut mesh);
        assert_eq!((update.slots.len(), update.patch_triangles.len()), (3, 2));
        split(&mut square, &mut publisher);
        publisher.note_changed(&corners);
        let update = next(&mut square, &mut publisher, &mut mesh);
        // One of four replaced by four, one drawn through the middle of the diagonal: two for one.
        let parts = |patch: &Patch| (patch.old.len(), patch.new.len());
        assert_eq!(update.patches.iter().map(parts).collect::<Vec<_>>(), [(1, 4), (1, 2)]);
        assert_eq!(mesh.drawn().count(), 6);
    }

    #[test]
    fn triangles_are_recycled_once_the_gpu_has_drawn_what_replaces_them() {
        let (mut square, mut publisher, mut mesh) = published();
        let live = |square: &Judged| square.cache.drawn.triangles.live();
        split(&mut square, &mut publisher);
        let update = next(&mut square, &mut publisher, &mut mesh);
        assert_eq!((live(&square), publisher.retired()), (8, 2), "both wait to be replaced");
        publisher.recycle(&mut square.rooted.cache, update.sequence - 1);
        assert_eq!((live(&square), publisher.retired()), (8, 2));
        publisher.recycle(&mut square.rooted.cache, update.sequence);
        assert_eq!((live(&square), publisher.retired()), (6, 0));
    }
}
