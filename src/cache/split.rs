//! What is added to the cache as the view asks for it: roots of faces with their base vertices, midpoints of splits,
//! and the triangles that leaves are drawn as.

use super::between::Between;
use super::ids::{BetweenId, DrawnId, NodeId, SlotId, VertexId};
use super::slot::{GlossId, INSIDE, Look, SlotRecord};
use super::store::Cache;
use super::topology::Children;
use super::vertex::{Vertex, VertexName};
use super::weld::{Group, Weld};
use crate::scene::{FaceId, Scene, TriangleId};
use glam::Vec3;

/// What a split created.
#[derive(Clone, Copy, Debug)]
pub struct Split {
    /// The four children.
    pub children: Children,
    /// Slots in the middle of the edges.
    pub middles: [SlotId; 3],
}

impl Cache {
    /// The root of `face`, created with its vertices on first demand.
    pub fn root(&mut self, scene: &Scene, weld: &mut Weld, face: FaceId) -> NodeId {
        if let Some(&root) = self.roots.get(&face) {
            return root;
        }
        let corners = [0, 1, 2].map(|corner| self.corner_slot(scene, weld, face, corner));
        let vertices = corners.map(|slot| self.slots[slot].vertex);
        let root = self.topology.add_root(face, corners, vertices);
        self.roots.insert(face, root);
        root
    }

    /// The slot of a face's corner: shared with every facet of the vertex's group of the same normal and gloss.
    fn corner_slot(&mut self, scene: &Scene, weld: &mut Weld, face: FaceId, corner: usize) -> SlotId {
        let (triangle, back) = (face.triangle(), face.is_back());
        let position = scene.triangles[triangle.0 as usize][corner];
        let name = |group: u32| VertexName { position, back, group };
        let known = weld.known_group(position, triangle).and_then(|group| self.names.get(&name(group)).copied());
        let vertex = known.unwrap_or_else(|| {
            let group = weld.group(scene, position, triangle);
            let there = self.names.get(&name(group.index)).copied();
            there.unwrap_or_else(|| self.add_base_vertex(scene, name(group.index), &group))
        });
        let look = self.corner_look(scene, position, triangle, back);
        self.slot(vertex, look)
    }

    /// Creates a vertex with the slots of all facets of its group, visible or not: its rays serve them all.
    fn add_base_vertex(&mut self, scene: &Scene, name: VertexName, group: &Group) -> VertexId {
        let vertex = self.vertices.insert(Vertex::base(scene, name, group, self.scale));
        self.names.insert(name, vertex);
        for &facet in &group.facets {
            let look = self.corner_look(scene, name.position, facet, name.back);
            self.slot(vertex, look);
        }
        vertex
    }

    /// The slot of a vertex with the given look, added if there is none.
    pub(super) fn slot(&mut self, vertex: VertexId, look: Look) -> SlotId {
        let same = self.slots_of(vertex).find(|&slot| self.slots[slot].looks(look));
        if let Some(slot) = same {
            return slot;
        }
        let slot = self.slots.insert(SlotRecord::new(vertex, self.vertices[vertex].first_slot, look));
        self.vertices[vertex].first_slot = slot.into();
        slot
    }

    /// Splits a leaf, whose neighbours must not be coarser than it.
    pub fn split(&mut self, id: NodeId) -> Split {
        let (edges, corners) = (self.topology.nodes[id].edges, self.corner_vertices(id));
        for (at, edge) in edges.into_iter().enumerate() {
            if self.topology.midpoint(edge).is_none() {
                let [a, b] = [corners[at], corners[(at + 1) % 3]].map(|end| &self.vertices[end]);
                let vertex = self.vertices.insert(Vertex::midpoint(a, b, self.scale));
                self.topology.set_midpoint(edge, vertex);
            }
        }
        let middles = [0, 1, 2].map(|at| self.middle_slot(id, at).unwrap_or(self.topology.nodes[id].corners[at]));
        let slots = &self.slots;
        let children = self.topology.split(id, middles, |slot| slots[slot].vertex);
        Split { children, middles }
    }

    /// The slot of a node's own look at the midpoint of its edge `at`, if that edge has one.
    fn middle_slot(&mut self, id: NodeId, at: usize) -> Option<SlotId> {
        let node = &self.topology.nodes[id];
        let vertex = self.topology.midpoint(node.edges[at])?;
        let ends = [node.corners[at], node.corners[(at + 1) % 3]];
        let [a, b] = ends.map(|slot| &self.slots[slot]);
        let normal = (a.normal() + b.normal()).normalize_or(a.normal());
        let look = Look { normal, gloss: self.gloss_inside(id, self.vertices[vertex].position) };
        let slot = self.slot(vertex, look);
        if self.between(slot).is_none() {
            self.note_between(slot, Between { of: &ends.map(|end| (end, 0.5)), coarse: false });
        }
        Some(slot)
    }

    /// Notes that a new slot lies between others.
    pub(super) fn note_between(&mut self, slot: SlotId, between: Between<'_>) {
        let list = self.between.add(between);
        // Base vertices are predicted all at once, those of a view (`Cache::refresh_predictions`).
        let linked = if between.coarse { &[] } else { between.of };
        for (place, (other, _)) in (0..).zip(linked) {
            let first = &mut self.slots[*other].first_between;
            let next = std::mem::replace(first, BetweenId(slot.0 * 8 + place).into());
            self.between.link(list, place as usize, next);
        }
        for (other, _) in between.of.iter().filter(|_| between.coarse) {
            self.coarse.note_predicts(self.slots[*other].vertex, true);
        }
        let highest = between.of.iter().map(|(other, _)| self.slots[*other].rank).max().unwrap_or(0);
        let record = &mut self.slots[slot];
        if !between.coarse {
            record.rank = (highest + 1).max(INSIDE);
        }
        record.between = list;
    }

    /// How a node's surface looks inside it.
    pub(super) fn look_inside(&self, id: NodeId, weights: [f32; 3]) -> Look {
        let corners = self.topology.nodes[id].corners.map(|slot| &self.slots[slot]);
        let [a, ..] = corners;
        let sum: Vec3 = corners.iter().zip(weights).map(|(corner, weight)| corner.normal() * weight).sum();
        let positions = self.corner_positions(id).into_iter().zip(weights);
        let place = positions.map(|(position, weight)| position * weight).sum();
        Look { normal: sum.normalize_or(a.normal()), gloss: self.gloss_inside(id, place) }
    }

    /// The highlight at a place of a node.
    fn gloss_inside(&self, id: NodeId, place: Vec3) -> Option<GlossId> {
        let node = &self.topology.nodes[id];
        self.glosses.at(node.face.triangle(), place, 0.5_f32.powi(i32::from(node.level) + 1))
    }

    /// Shading normal and gloss of a triangle's corner at `position`, on the given side.
    fn corner_look(&self, scene: &Scene, position: u32, triangle: TriangleId, back: bool) -> Look {
        let t = triangle.0 as usize;
        let corner = scene.triangles[t].iter().position(|&p| p == position).unwrap_or(0);
        let front = scene.normals[t][corner];
        let gloss = self.glosses.at(triangle, scene.positions[position as usize], 0.5);
        Look { normal: if back { -front } else { front }, gloss }
    }

    /// Draws a leaf through the midpoints on its edges, so that no crack or kink shows (conforming triangulation).
    /// Each triangle shows the value of `flat` all over if that is given.
    pub fn draw(&mut self, id: NodeId, flat: Option<SlotId>) -> Vec<DrawnId> {
        let triangles = self.triangulate(id);
        triangles.into_iter().map(|slots| self.drawn.add(id, slots, flat)).collect()
    }

    /// The triangles of a leaf through the midpoints on its edges.
    fn triangulate(&mut self, id: NodeId) -> Vec<[SlotId; 3]> {
        let c = self.topology.nodes[id].corners;
        let m = [0, 1, 2].map(|at| self.middle_slot(id, at));
        let at = |i: usize| c[i % 3];
        match (m, m.iter().flatten().count()) {
            ([Some(m0), Some(m1), Some(m2)], _) => {
                vec![[c[0], m0, m2], [m0, c[1], m1], [m2, m1, c[2]], [m0, m1, m2]]
            }
            (_, 2) => {
                // The two split edges meet at corner i + 1; the quadrilateral left over is cut from corner i.
                let i = (0..3).find(|&i| m[i].is_some() && m[(i + 1) % 3].is_some()).unwrap_or(0);
                let (Some(first), Some(second)) = (m[i], m[(i + 1) % 3]) else { return vec![c] };
                vec![[first, at(i + 1), second], [at(i), first, second], [at(i), second, at(i + 2)]]
            }
            (_, 1) => {
                let i = (0..3).find(|&i| m[i].is_some()).unwrap_or(0);
                let Some(middle) = m[i] else { return vec![c] };
                vec![[at(i), middle, at(i + 2)], [middle, at(i + 1), at(i + 2)]]
            }
            _ => vec![c],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::{Rooted, star};
    use super::*;

    /// The inner triangle of the star, drawn through the midpoints of those edges whose bit is set: neighbours have put them there.
    fn drawn_through(edges: u32) -> (Rooted, Vec<[SlotId; 3]>) {
        let mut star = star();
        for edge in (0..3).filter(|edge| edges >> edge & 1 == 1) {
            star.split(star.roots[edge + 1]);
        }
        let drawn = star.cache.draw(star.roots[0], None);
        let triangles = drawn.iter().map(|&drawn| star.cache.drawn.triangles[drawn].slots).collect();
        (star, triangles)
    }

    fn area_vector([a, b, c]: [Vec3; 3]) -> Vec3 {
        (b - a).cross(c - a)
    }

    #[test]
    fn all_eight_patterns_of_midpoints_tile_the_triangle() {
        for edges in 0..8 {
            let (star, triangles) = drawn_through(edges);
            assert_eq!(triangles.len() as u32, 1 + edges.count_ones());
            let whole = area_vector(star.cache.corner_positions(star.roots[0]));
            let parts = triangles.iter().map(|t| area_vector(t.map(|slot| star.position(slot))));
            assert!(parts.clone().all(|part| part.y > 0.0), "{edges:03b}: orientation is kept");
            assert!(parts.sum::<Vec3>().distance(whole) < 1e-6, "{edges:03b}: nothing is missing or covered twice");
        }
    }

    #[test]
    fn a_triangle_is_drawn_through_the_midpoints_of_its_edges_and_past_none() {
        for edges in 0..8 {
            let (star, triangles) = drawn_through(edges);
            let corners = star.cache.corner_positions(star.roots[0]);
            let sides = triangles.iter().flat_map(|t| (0..3).map(|i| [t[i], t[(i + 1) % 3]]));
            let sides: Vec<[Vec3; 2]> = sides.map(|side| side.map(|slot| star.position(slot))).collect();
            for edge in 0..3 {
                let (a, b) = (corners[edge], corners[(edge + 1) % 3]);
                let middle = (a + b) * 0.5;
                let is_split = edges >> edge & 1 == 1;
                assert_eq!(sides.contains(&[a, middle]) && sides.contains(&[middle, b]), is_split, "{edges:03b}");
                assert_eq!(sides.contains(&[a, b]), !is_split, "{edges:03b}: a T-junction, or an edge is missing");
            }
        }
    }

    #[test]
    fn neighbours_share_midpoints_and_slots() {
        let mut star = star();
        let outer = star.split(star.roots[1]).middles;
        let inner = star.split(star.roots[0]).middles;
        // Edge 0 of both joins the same corners.
        assert_eq!(inner[0], outer[0]);
        assert_eq!(star.position(inner[0]), Vec3::Z * 0.5);
        star.cache.validate();
    }
}
