//! The drawn mesh: the triangles that leaves are drawn as, found by leaf and by slot.

use super::ids::{DrawnId, Link, NodeId, SlotId, UseId};
use super::pool::{Pool, Table};
use crate::scene::FaceId;
use smallvec::SmallVec;

/// A drawn triangle: its three vertices in the order of the face's corners (front winding), and the face it lies on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DrawnTriangle {
    /// Vertices.
    pub slots: [SlotId; 3],
    /// The face.
    pub face: FaceId,
    /// Splits above its node.
    pub level: u8,
    /// The vertex whose value it shows all over instead of interpolating, if it shows in one pixel only and that has
    /// been sampled.
    pub flat: Option<SlotId>,
}

impl DrawnTriangle {
    /// Every slot that it is drawn with.
    pub fn all_slots(&self) -> impl Iterator<Item = SlotId> + use<> {
        self.slots.into_iter().chain(self.flat)
    }
}

/// A drawn triangle as it is kept: face and level are its node's.
#[derive(Clone, Copy, Debug)]
pub struct DrawnRecord {
    /// Vertices.
    pub slots: [SlotId; 3],
    /// The node that it is part of.
    pub node: NodeId,
    /// See [`DrawnTriangle::flat`].
    pub flat: Link<SlotId>,
    /// The next triangle of its node.
    next_of_node: Link<DrawnId>,
    /// By vertex, then `flat`: the next use of that slot.
    next_use: [Link<UseId>; 4],
}

impl DrawnRecord {
    /// Every slot that it is drawn with.
    pub fn all_slots(&self) -> impl Iterator<Item = SlotId> + use<> {
        self.slots.into_iter().chain(self.flat.get())
    }
}

/// The triangles of a node.
pub type OfNode = SmallVec<[DrawnId; 4]>;

/// The triangles that leaves are drawn as.
#[derive(Clone, Debug, Default)]
pub struct DrawnMesh {
    /// The triangles.
    pub triangles: Pool<DrawnId, DrawnRecord>,
    /// The first triangle of each leaf: there are one, or several through the midpoints on its edges.
    of_node: Table<NodeId, Link<DrawnId>>,
    /// First use of a slot by a triangle, linked through [`DrawnRecord::next_use`].
    first_use: Table<SlotId, Link<UseId>>,
}

impl DrawnMesh {
    /// The triangles that a leaf is drawn as.
    #[must_use]
    pub fn of_node(&self, node: NodeId) -> OfNode {
        let next = |id: &DrawnId| self.triangles[*id].next_of_node.get();
        std::iter::successors(self.of_node[node].get(), next).collect()
    }

    /// Whether a node is drawn.
    #[must_use]
    pub fn is_drawn(&self, node: NodeId) -> bool {
        self.of_node[node].get().is_some()
    }

    /// The triangles that are drawn with a slot.
    pub fn with_slot(&self, slot: SlotId) -> impl Iterator<Item = DrawnId> + '_ {
        let next = |usage: &UseId| self.triangles[triangle_of(*usage)].next_use[usage.0 as usize % 4].get();
        std::iter::successors(self.first_use[slot].get(), next).map(triangle_of)
    }

    /// Adds a triangle of a node.
    pub fn add(&mut self, node: NodeId, slots: [SlotId; 3], flat: Option<SlotId>) -> DrawnId {
        let (next_of_node, next_use) = (Link::NONE, [Link::NONE; 4]);
        let record = DrawnRecord { slots, node, flat: flat.into(), next_of_node, next_use };
        let id = self.triangles.insert(record);
        for (place, slot) in (0..).zip(record.all_slots()) {
            let previous = std::mem::replace(&mut self.first_use[slot], UseId(id.0 * 4 + place).into());
            self.triangles[id].next_use[place as usize] = previous;
        }
        match self.of_node(node).last() {
            Some(&last) => self.triangles[last].next_of_node = id.into(),
            None => self.of_node[node] = id.into(),
        }
        id
    }

    /// Takes the triangles of a node out of use. Their indices must not be recycled before the GPU has drawn what
    /// replaces them: the caller gives them back with [`Pool::remove`] then.
    pub fn retire(&mut self, node: NodeId) -> OfNode {
        let old = self.of_node(node);
        self.of_node[node] = Link::NONE;
        old.iter().for_each(|&id| self.unlink(id));
        old
    }

    /// Takes a triangle off the lists of its slots.
    fn unlink(&mut self, id: DrawnId) {
        for (place, slot) in (0..).zip(self.triangles[id].all_slots()) {
            let (wanted, next) = (UseId(id.0 * 4 + place).into(), self.triangles[id].next_use[place as usize]);
            if self.first_use[slot] == wanted {
                self.first_use[slot] = next;
                continue;
            }
            let mut usage = self.first_use[slot];
            while let Some(u) = usage.get() {
                let link = &mut self.triangles[triangle_of(u)].next_use[u.0 as usize % 4];
                if *link == wanted {
                    *link = next;
                    break;
                }
                usage = *link;
            }
        }
    }

    /// Bytes held.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.triangles.bytes() + self.of_node.bytes() + self.first_use.bytes()
    }
}

/// The triangle of a use.
const fn triangle_of(usage: UseId) -> DrawnId {
    DrawnId(usage.0 / 4)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::mix;

    /// The triangles with a slot, by the lists and by looking at every triangle of `nodes`.
    fn assert_links(mesh: &DrawnMesh, nodes: u32, slots: u32) {
        let all = || (0..nodes).flat_map(|node| mesh.of_node(NodeId(node)));
        for slot in (0..slots).map(SlotId) {
            let mut listed: Vec<DrawnId> = mesh.with_slot(slot).collect();
            listed.sort_unstable();
            let mut used: Vec<DrawnId> =
                all().filter(|&drawn| mesh.triangles[drawn].all_slots().any(|s| s == slot)).collect();
            used.sort_unstable();
            assert_eq!(listed, used, "{slot:?}");
        }
    }

    #[test]
    fn triangles_are_found_by_slot_after_adding_and_retiring_in_any_order() {
        const NODES: u32 = 12;
        const SLOTS: u32 = 9;
        let mut mesh = DrawnMesh::default();
        for step in 0..400_u64 {
            let random = |what: u64, below: u32| (mix(step * 8 + what) % u64::from(below)) as u32;
            let node = NodeId(random(0, NODES));
            if random(1, 3) == 0 {
                mesh.retire(node).into_iter().for_each(|drawn| mesh.triangles.remove(drawn));
                assert!(!mesh.is_drawn(node) && mesh.of_node(node).is_empty());
            } else {
                let first = random(2, SLOTS);
                let slots = [0, 1, 3].map(|k| SlotId((first + k) % SLOTS));
                let flat = (random(3, 4) == 0).then_some(SlotId((first + 4) % SLOTS));
                let id = mesh.add(node, slots, flat);
                assert_eq!((mesh.of_node(node).last(), mesh.triangles[id].node), (Some(&id), node));
            }
            assert_links(&mesh, NODES, SLOTS);
        }
        assert!(mesh.triangles.live() > 0);
    }

    #[test]
    fn a_retired_triangle_keeps_its_index_until_it_is_given_back() {
        let mut mesh = DrawnMesh::default();
        let slots = [0, 1, 2].map(SlotId);
        let old = mesh.add(NodeId(0), slots, None);
        assert_eq!(mesh.retire(NodeId(0)).as_slice(), [old]);
        assert_ne!(mesh.add(NodeId(0), slots, None), old);
        mesh.triangles.remove(old);
        assert_eq!(mesh.add(NodeId(1), slots, None), old);
    }
}
