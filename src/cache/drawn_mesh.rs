//! The drawn mesh: the triangles that leaves are drawn as, found by leaf and by slot.

use super::ids::{DrawnId, NodeId, SlotId};
use super::pool::{Pool, Table};
use crate::scene::FaceId;

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

/// A drawn triangle with the links of those around its vertices.
#[derive(Clone, Copy, Debug)]
pub struct DrawnRecord {
    /// The triangle.
    pub triangle: DrawnTriangle,
    /// The node that it is part of.
    pub node: NodeId,
    next_use: [Option<u32>; 4],
}

/// The triangles that leaves are drawn as.
#[derive(Clone, Debug, Default)]
pub struct DrawnMesh {
    /// The triangles.
    pub triangles: Pool<DrawnId, DrawnRecord>,
    /// The triangles of each leaf: one, or several through the midpoints on its edges.
    of_node: Table<NodeId, Vec<DrawnId>>,
    /// First use of a slot by a triangle, `triangle * 4 + place`, linked through [`DrawnRecord::next_use`].
    first_use: Table<SlotId, Option<u32>>,
}

impl DrawnMesh {
    /// The triangles that a leaf is drawn as.
    #[must_use]
    pub fn of_node(&self, node: NodeId) -> &[DrawnId] {
        &self.of_node[node]
    }

    /// The triangles that are drawn with a slot.
    pub fn with_slot(&self, slot: SlotId) -> impl Iterator<Item = DrawnId> + '_ {
        let next = |&usage: &u32| self.triangles[DrawnId(usage / 4)].next_use[usage as usize % 4];
        std::iter::successors(self.first_use[slot], next).map(|usage| DrawnId(usage / 4))
    }

    /// Adds a triangle of a node.
    pub fn add(&mut self, node: NodeId, triangle: DrawnTriangle) -> DrawnId {
        let id = self.triangles.insert(DrawnRecord { triangle, node, next_use: [None; 4] });
        for (place, slot) in (0..).zip(triangle.all_slots()) {
            let previous = self.first_use[slot].replace(id.0 * 4 + place);
            self.triangles[id].next_use[place as usize] = previous;
        }
        self.of_node[node].push(id);
        id
    }

    /// Takes the triangles of a node out of use. Their indices must not be recycled before the GPU has drawn what
    /// replaces them: the caller gives them back with [`Pool::remove`] then.
    pub fn retire(&mut self, node: NodeId) -> Vec<DrawnId> {
        let old = std::mem::take(&mut self.of_node[node]);
        old.iter().for_each(|&id| self.unlink(id));
        old
    }

    /// Takes a triangle off the lists of its slots.
    fn unlink(&mut self, id: DrawnId) {
        for (place, slot) in (0..).zip(self.triangles[id].triangle.all_slots()) {
            let (wanted, next) = (id.0 * 4 + place, self.triangles[id].next_use[place as usize]);
            if self.first_use[slot] == Some(wanted) {
                self.first_use[slot] = next;
                continue;
            }
            let mut usage = self.first_use[slot];
            while let Some(u) = usage {
                let link = &mut self.triangles[DrawnId(u / 4)].next_use[u as usize % 4];
                if *link == Some(wanted) {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::mix;

    fn triangle(slots: [u32; 3], flat: Option<u32>) -> DrawnTriangle {
        DrawnTriangle { slots: slots.map(SlotId), face: FaceId(0), level: 0, flat: flat.map(SlotId) }
    }

    /// The triangles with a slot, by the lists and by looking at every triangle of `nodes`.
    fn assert_links(mesh: &DrawnMesh, nodes: u32, slots: u32) {
        let all = || (0..nodes).flat_map(|node| mesh.of_node(NodeId(node)).iter().copied());
        for slot in (0..slots).map(SlotId) {
            let mut listed: Vec<DrawnId> = mesh.with_slot(slot).collect();
            listed.sort_unstable();
            let mut used: Vec<DrawnId> =
                all().filter(|&drawn| mesh.triangles[drawn].triangle.all_slots().any(|s| s == slot)).collect();
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
                assert!(mesh.of_node(node).is_empty());
            } else {
                let first = random(2, SLOTS);
                let slots = [0, 1, 3].map(|k| (first + k) % SLOTS);
                let flat = (random(3, 4) == 0).then_some((first + 4) % SLOTS);
                let id = mesh.add(node, triangle(slots, flat));
                assert_eq!((mesh.of_node(node).last(), mesh.triangles[id].node), (Some(&id), node));
            }
            assert_links(&mesh, NODES, SLOTS);
        }
        assert!(mesh.triangles.live() > 0);
    }

    #[test]
    fn a_retired_triangle_keeps_its_index_until_it_is_given_back() {
        let mut mesh = DrawnMesh::default();
        let old = mesh.add(NodeId(0), triangle([0, 1, 2], None));
        assert_eq!(mesh.retire(NodeId(0)), [old]);
        assert_ne!(mesh.add(NodeId(0), triangle([0, 1, 2], None)), old);
        mesh.triangles.remove(old);
        assert_eq!(mesh.add(NodeId(1), triangle([0, 1, 2], None)), old);
    }
}
