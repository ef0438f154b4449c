//! Coarsening, the opposite of a split: what the hierarchy no longer needs is given back, with its vertices and their samples.
//!
//! Two kinds: the four children of a node become one leaf again, and a face that is out of view goes altogether. Slots are
//! given back later than all else ([`super::pool::Pool::retire`]): the GPU may still draw with them.

use super::ids::{BetweenId, EdgeId, Link, NodeId, SlotId, VertexId};
use super::store::Cache;
use super::topology::Topology;
use super::vertex::VertexName;
use super::weld::Weld;
use crate::scene::{FaceId, Scene};

/// What was given back. Indices of slots stay retired until they are recycled.
#[derive(Debug, Default)]
pub struct Removed {
    /// Nodes.
    pub nodes: Vec<NodeId>,
    /// Vertices.
    pub vertices: Vec<VertexId>,
    /// Slots of those vertices.
    pub slots: Vec<SlotId>,
    /// Base vertices of faces that are gone which still predict others.
    pub predicting: Vec<VertexName>,
}

/// Whether a midpoint that no split node needs stays as long as leaves are drawn through it.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Hanging {
    Stays,
    Goes,
}

impl Topology {
    /// Gives back what is below a node, which stays on its own, beside no edge; nodes and vertices are noted.
    fn take_children(&mut self, id: NodeId, removed: &mut Removed) {
        let Some(children) = self.nodes[id].children() else { return };
        for child in children.all() {
            removed.nodes.push(child);
            removed.note_inside(self, child);
            if self.is_leaf(child) {
                self.leave_edges(child);
            }
            self.take_children(child, removed);
        }
        // What cuts the corners off lies beside these children only.
        for edge in self.nodes[children.middle()].edges {
            self.release(edge, Hanging::Goes, removed);
            self.edges.remove(edge);
        }
        self.nodes[id].first_child = Link::NONE;
        self.nodes.remove_four(children.first);
    }

    /// Gives back the halves of an edge, and its midpoint, as far as no node needs them any more.
    fn release(&mut self, edge: EdgeId, hanging: Hanging, removed: &mut Removed) {
        if let Some(halves) = self.edges[edge].halves() {
            halves.into_iter().for_each(|half| self.release(half, hanging, removed));
            if halves.into_iter().any(|half| self.is_used(half)) {
                return;
            }
            self.edges.remove_two(halves[0]);
            self.edges[edge].first_half = Link::NONE;
        }
        let Some(midpoint) = self.midpoint(edge) else { return };
        if hanging == Hanging::Goes || self.edges[edge].first.get().is_none() {
            removed.vertices.push(midpoint);
            self.edges[edge].midpoint = Link::NONE;
        }
    }

    fn is_used(&self, edge: EdgeId) -> bool {
        let edge = &self.edges[edge];
        edge.first.get().is_some() || edge.midpoint.get().is_some() || edge.first_half.get().is_some()
    }

    /// Gives back the tree of a face whose corners are at these vertices.
    fn remove_tree(&mut self, root: NodeId, corners: [VertexId; 3], removed: &mut Removed) {
        removed.nodes.push(root);
        removed.note_inside(self, root);
        if self.is_leaf(root) {
            self.leave_edges(root);
        }
        self.take_children(root, removed);
        for (at, edge) in self.nodes[root].edges.into_iter().enumerate() {
            self.release(edge, Hanging::Stays, removed);
            if !self.is_used(edge) {
                let mut ends = [corners[at], corners[(at + 1) % 3]];
                ends.sort_unstable();
                // Two edges of a face may be one.
                if self.base_edges.remove(&ends).is_some() {
                    self.edges.remove(edge);
                }
            }
        }
        self.nodes.remove(root);
    }

    /// Whether a split node can become a leaf: its children are leaves, and no neighbour is two levels finer than it.
    #[must_use]
    pub fn can_coarsen(&self, id: NodeId) -> bool {
        let node = &self.nodes[id];
        let Some(children) = node.children() else { return false };
        let halves = node.edges.iter().filter_map(|&edge| self.edges[edge].halves()).flatten();
        let is_fine = |half: EdgeId| self.midpoint(half).is_some();
        children.all().into_iter().all(|child| self.is_leaf(child)) && !halves.into_iter().any(is_fine)
    }

    /// Makes a leaf of a node whose children are leaves; returns the leaves beside edges that lose their midpoint.
    fn coarsen(&mut self, id: NodeId, removed: &mut Removed) -> Vec<NodeId> {
        self.take_children(id, removed);
        let mut beside = Vec::new();
        for edge in self.nodes[id].edges {
            self.release(edge, Hanging::Goes, removed);
            if self.midpoint(edge).is_none() {
                beside.extend(self.beside(edge));
            }
        }
        self.join_edges(id);
        beside
    }
}

impl Removed {
    /// Notes the slot of the vertex inside a node.
    fn note_inside(&mut self, topology: &Topology, node: NodeId) {
        self.slots.extend(topology.nodes[node].pixel_vertex.get());
    }
}

impl Cache {
    /// Gives back a face with its tree, and the vertices that no other face has, but for those that still predict others
    /// ([`Self::remove_predicting`]). None of its
    /// triangles may be drawn any more. Asked for again, it begins anew.
    pub fn remove_face(&mut self, scene: &Scene, weld: &Weld, face: FaceId, removed: &mut Removed) {
        let Some(root) = self.roots.remove(&face) else { return };
        let first = [removed.vertices.len(), removed.slots.len()];
        let corners = self.corner_vertices(root);
        self.topology.remove_tree(root, corners, removed);
        let triangle = face.triangle();
        for (at, vertex) in corners.into_iter().enumerate() {
            let position = scene.triangles[triangle.0 as usize][at];
            let Some(group) = weld.known_group(position, triangle) else { continue };
            let name = VertexName { position, back: face.is_back(), group };
            if self.names.get(&name) == Some(&vertex) && self.is_left(scene, weld, name) {
                self.remove_base_vertex(name, vertex, removed);
            }
        }
        self.give_back(first, removed);
    }

    /// Gives back base vertices of faces that are gone, as far as what they predicted is gone by now.
    pub fn remove_predicting(&mut self, scene: &Scene, weld: &Weld, removed: &mut Removed) {
        loop {
            let first = [removed.vertices.len(), removed.slots.len()];
            for name in std::mem::take(&mut removed.predicting) {
                if let Some(vertex) = self.names.get(&name).copied().filter(|_| self.is_left(scene, weld, name)) {
                    self.remove_base_vertex(name, vertex, removed);
                }
            }
            if removed.vertices.len() == first[0] {
                return;
            }
            self.give_back(first, removed);
        }
    }

    /// Gives back a base vertex that no face has, or notes it while it predicts others.
    fn remove_base_vertex(&mut self, name: VertexName, vertex: VertexId, removed: &mut Removed) {
        if self.coarse.predicts(vertex) {
            removed.predicting.push(name);
            return;
        }
        if self.slots_of(vertex).any(|slot| self.slots[slot].is_coarse()) {
            self.coarse.remove(vertex, self.vertices[vertex].position, self.scale);
        }
        self.names.remove(&name);
        removed.vertices.push(vertex);
    }

    /// Whether no face has a base vertex any more.
    fn is_left(&self, scene: &Scene, weld: &Weld, name: VertexName) -> bool {
        let has = |vertex: VertexId| self.names.get(&name) == Some(&vertex);
        let is_of = |face: FaceId| {
            let corner = scene.triangles[face.triangle().0 as usize].iter().position(|&p| p == name.position);
            let root = self.root_of(face);
            root.zip(corner).is_some_and(|(root, corner)| has(self.corner_vertices(root)[corner]))
        };
        !weld.around(name.position).iter().map(|&t| FaceId::new(t, name.back)).any(is_of)
    }

    /// Makes a leaf of a split node ([`Topology::can_coarsen`]), whose children may not be drawn any more; returns the leaves that
    /// have to be drawn anew.
    pub fn coarsen(&mut self, id: NodeId, removed: &mut Removed) -> Vec<NodeId> {
        let first = [removed.vertices.len(), removed.slots.len()];
        let beside = self.topology.coarsen(id, removed);
        self.topology.nodes[id].indirect_split = false;
        self.give_back(first, removed);
        beside
    }

    /// Forgets what was removed since there were so many vertices and slots on the list.
    fn give_back(&mut self, [first_vertex, first_slot]: [usize; 2], removed: &mut Removed) {
        // Vertices inside leaves are listed by their slots.
        let inside: Vec<SlotId> = removed.slots.drain(first_slot..).collect();
        removed.vertices.extend(inside.iter().map(|&slot| self.slots[slot].vertex));
        for &vertex in &removed.vertices[first_vertex..] {
            let slots: Vec<SlotId> = self.slots_of(vertex).collect();
            self.forget_samples(vertex, &slots);
            slots.iter().for_each(|&slot| self.leave_between(slot));
            slots.iter().for_each(|&slot| self.slots.retire(slot));
            removed.slots.extend(slots);
            self.vertices.remove(vertex);
        }
    }

    /// Forgets what was sampled at a vertex and its slots.
    fn forget_samples(&mut self, vertex: VertexId, slots: &[SlotId]) {
        for layer in &mut self.layers {
            layer.visibility.reset(vertex);
            slots.iter().for_each(|&slot| layer.sums.reset(slot));
        }
        self.indirect.remove(vertex, slots);
    }

    /// Takes a slot off the lists of those it lies between.
    fn leave_between(&mut self, slot: SlotId) {
        let list = self.slots[slot].between;
        let inside = self.between(slot).filter(|between| !between.coarse);
        let of: Vec<SlotId> = inside.map_or_else(Vec::new, |between| between.of.iter().map(|(of, _)| *of).collect());
        for (place, other) in (0..).zip(of) {
            let wanted = BetweenId(slot.0 * 8 + place);
            let next = self.between.next(list, place as usize).into();
            let mut before = None;
            let mut entry = self.slots[other].first_between.get();
            while let Some(id) = entry.filter(|&id| id != wanted) {
                before = Some(id);
                entry = self.between.next(self.slots[SlotId(id.0 / 8)].between, id.0 as usize % 8);
            }
            match before {
                None => self.slots[other].first_between = next,
                Some(id) => self.between.link(self.slots[SlotId(id.0 / 8)].between, id.0 as usize % 8, next),
            }
        }
        let coarse = self.between(slot).filter(|between| between.coarse);
        let predicted_by: Vec<SlotId> = coarse.map_or_else(Vec::new, |of| of.of.iter().map(|(of, _)| *of).collect());
        for other in predicted_by {
            self.coarse.note_predicts(self.slots[other].vertex, false);
        }
        self.between.remove(list);
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::{Rooted, rooted, scene_of};
    use super::*;
    use crate::math::mix;
    use crate::scene::TriangleId;
    use glam::Vec3;

    const CELLS: u32 = 3;

    /// A floor of 18 triangles.
    fn floor() -> (Rooted, Weld) {
        let at = |i: u32, j: u32| i * (CELLS + 1) + j;
        let positions: Vec<Vec3> = (0..(CELLS + 1).pow(2))
            .map(|i| Vec3::new((i % (CELLS + 1)) as f32, 0.0, (i / (CELLS + 1)) as f32))
            .collect();
        let cells = (0..CELLS * CELLS).map(|i| (i / CELLS, i % CELLS));
        let triangles = cells.flat_map(|(i, j)| {
            [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]
        });
        let scene = scene_of(&positions, &triangles.collect::<Vec<_>>());
        let mut weld = Weld::new(&scene);
        for (t, triangle) in (0..).zip(&scene.triangles) {
            triangle.iter().for_each(|&position| _ = weld.group(&scene, position, TriangleId(t)));
        }
        (rooted(scene), weld)
    }

    fn face(number: u64) -> FaceId {
        FaceId::new(TriangleId((number % u64::from(2 * CELLS * CELLS)) as u32), false)
    }

    /// All leaves, and all other nodes.
    fn nodes(cache: &Cache) -> [Vec<NodeId>; 2] {
        let all: Vec<NodeId> = cache.topology.nodes.ids().collect();
        let (leaves, others) = all.into_iter().partition(|&node| cache.topology.is_leaf(node));
        [leaves, others]
    }

    /// Splits what lies beside nodes that are two levels finer.
    fn balance(floor: &mut Rooted) {
        while let Some(leaf) =
            nodes(&floor.cache)[0].iter().find(|&&leaf| floor.cache.topology.is_beside_much_finer(leaf))
        {
            floor.split(*leaf);
        }
    }

    /// Does something with the hierarchy at random.
    fn change(floor: &mut Rooted, weld: &mut Weld, step: u64) {
        let random = mix(step);
        let mut removed = Removed::default();
        match random % 8 {
            0..4 => {
                let [leaves, _] = nodes(&floor.cache);
                if !leaves.is_empty() {
                    let leaf = leaves[(random >> 8) as usize % leaves.len()];
                    if floor.cache.topology.nodes[leaf].level < 6 {
                        floor.split(leaf);
                    }
                }
            }
            4..6 => {
                let [_, others] = nodes(&floor.cache);
                let fit = others.into_iter().filter(|&node| floor.cache.topology.can_coarsen(node));
                let fit: Vec<NodeId> = fit.collect();
                if !fit.is_empty() {
                    floor.cache.coarsen(fit[(random >> 8) as usize % fit.len()], &mut removed);
                }
            }
            6 => floor.cache.remove_face(&floor.scene, weld, face(random >> 8), &mut removed),
            _ => {
                floor.cache.root(&floor.scene, weld, face(random >> 8));
                balance(floor);
            }
        }
        removed.slots.into_iter().for_each(|slot| floor.cache.slots.recycle(slot));
    }

    #[test]
    fn whatever_is_split_coarsened_removed_and_made_again_the_hierarchy_is_whole() {
        let (mut floor, mut weld) = floor();
        for step in 0..3000 {
            change(&mut floor, &mut weld, step);
            if step % 20 == 0 {
                floor.cache.validate();
            }
        }
        let grown = floor.cache.bytes();
        for step in 3000..9000 {
            change(&mut floor, &mut weld, step);
        }
        floor.cache.validate();
        assert!(floor.cache.bytes() < 2 * grown, "places are used again: {} {grown}", floor.cache.bytes());
        let mut removed = Removed::default();
        (0..2 * u64::from(CELLS * CELLS))
            .for_each(|f| floor.cache.remove_face(&floor.scene, &weld, face(f), &mut removed));
        let Cache { topology, vertices, slots, names, roots, .. } = &floor.cache;
        let live = [topology.nodes.live(), topology.edges.live(), vertices.live(), slots.live()];
        assert_eq!((live, topology.base_edges.len(), names.len(), roots.len()), ([0; 4], 0, 0, 0), "nothing leaks");
    }

    #[test]
    fn a_leaf_that_was_split_and_coarsened_is_as_before() {
        let (mut floor, _) = floor();
        let root = floor.roots[0];
        let live = |cache: &Cache| [cache.topology.nodes.live(), cache.vertices.live(), cache.slots.live()];
        let before = live(&floor.cache);
        let middle = floor.split(root).children.middle();
        floor.split(middle);
        assert!(!floor.cache.topology.can_coarsen(root), "a child is split");
        let mut removed = Removed::default();
        floor.cache.coarsen(middle, &mut removed);
        let beside = floor.cache.coarsen(root, &mut removed);
        assert_eq!((live(&floor.cache), floor.cache.topology.is_leaf(root)), (before, true));
        assert!(beside.iter().all(|&leaf| leaf != root), "{beside:?}");
        assert_eq!((removed.vertices.len(), removed.nodes.len()), (6, 8));
    }

    #[test]
    fn a_face_that_stays_is_drawn_through_the_midpoint_that_another_left() {
        let (mut floor, weld) = floor();
        let [gone, stays] = [0, 1].map(|t| floor.roots[t]);
        floor.split(gone);
        let shared = floor.cache.topology.nodes[stays]
            .edges
            .into_iter()
            .find(|&edge| floor.cache.topology.midpoint(edge).is_some());
        let edge = shared.expect("the diagonal");
        let midpoint = floor.cache.topology.midpoint(edge);
        let mut removed = Removed::default();
        floor.cache.remove_face(&floor.scene, &weld, face(0), &mut removed);
        assert_eq!((floor.cache.topology.midpoint(edge), removed.vertices.len()), (midpoint, 1), "the edge on the rim");
        floor.cache.validate();
        floor.cache.remove_face(&floor.scene, &weld, face(1), &mut removed);
        assert!(removed.vertices.contains(&midpoint.expect("a midpoint")));
    }
}
