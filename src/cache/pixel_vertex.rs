//! Vertices inside leaves: one at the very point of a leaf that its one pixel shows.
//!
//! Between the corners of a leaf as small as a pixel a shadow's edge can be anywhere, and splitting would go on below
//! the size of the pixel. A vertex where the pixel's centre sees the leaf settles it instead: the pixel shows exactly
//! what is sampled there.

use super::between::Between;
use super::ids::{NodeId, SlotId, VertexId};
use super::pixels::weights_on_ray;
use super::store::Cache;
use super::vertex::Vertex;
use glam::Vec3;

/// A vertex that was added to a leaf or moved there.
#[derive(Clone, Copy, Debug)]
pub struct Placed {
    /// Its slot.
    pub slot: SlotId,
    /// Whether it is where it was before: what was sampled there stays.
    pub kept: bool,
}

/// Barycentric distance up to which a vertex need not be moved.
const SAME_PLACE: f32 = 1e-3;

impl Cache {
    /// Puts a leaf's pixel vertex where the ray from `eye` in the given direction, of any length, passes through it.
    /// The leaf has to be drawn anew. `None` if the leaf is seen so much edge-on that the ray has no place on it.
    pub fn place_pixel_vertex(&mut self, id: NodeId, eye: Vec3, direction: Vec3) -> Option<Placed> {
        let weights = weights_on_ray(self.corner_positions(id), eye, direction)?;
        let corners = self.topology.nodes[id].corners;
        let slot = match self.topology.nodes[id].pixel_vertex.get() {
            None => self.add_pixel_vertex(id, weights, [0, 1, 2].map(|i| (corners[i], weights[i]))),
            Some(slot) => {
                let old = self.between(slot).map_or(&[][..], |between| between.of).iter();
                if old.zip(weights).all(|((_, old), new)| (old - new).abs() < SAME_PLACE) {
                    return Some(Placed { slot, kept: true });
                }
                self.move_pixel_vertex(id, slot, weights);
                slot
            }
        };
        self.topology.nodes[id].pixel_vertex = slot.into();
        Some(Placed { slot, kept: false })
    }

    fn add_pixel_vertex(&mut self, id: NodeId, weights: [f32; 3], of: [(SlotId, f32); 3]) -> SlotId {
        let vertex = self.vertices.insert(self.vertex_inside(id, weights));
        let look = self.look_inside(id, weights);
        let slot = self.slot(vertex, look);
        self.note_between(slot, Between { of: &of, coarse: false });
        slot
    }

    /// Forgets all that is known at a pixel vertex and puts it elsewhere on its leaf.
    fn move_pixel_vertex(&mut self, id: NodeId, slot: SlotId, weights: [f32; 3]) {
        let vertex = self.slots[slot].vertex;
        let moved = self.vertex_inside(id, weights);
        self.vertices[vertex].move_to(moved);
        for layer in &mut self.layers {
            layer.forget(vertex, slot);
        }
        self.indirect.forget(vertex, slot);
        let normal = self.look_inside(id, weights).normal;
        self.between.weigh(self.slots[slot].between, weights);
        self.slots[slot].turn_to(normal);
    }

    /// The slot in the middle of a leaf's edge `at` that it is drawn through, if finer neighbours have put one there.
    #[must_use]
    pub fn hanging_slot(&self, id: NodeId, at: usize) -> Option<SlotId> {
        let node = &self.topology.nodes[id];
        let middle = self.topology.midpoint(node.edges[at])?;
        let mut slots = self.drawn.of_node(id).into_iter().flat_map(|drawn| self.drawn.triangles[drawn].slots);
        slots.find(|slot| self.slots[*slot].vertex == middle)
    }

    /// The slot of a vertex, if that lies inside a leaf.
    #[must_use]
    pub fn pixel_slot(&self, vertex: VertexId) -> Option<SlotId> {
        let is_inside = |slot: &SlotId| self.between(*slot).as_ref().is_some_and(Between::is_inside_leaf);
        self.vertices[vertex].first_slot.get().filter(is_inside)
    }

    /// The vertex that there would be inside a leaf.
    pub(super) fn vertex_inside(&self, id: NodeId, weights: [f32; 3]) -> Vertex {
        let corners = self.corner_vertices(id).map(|v| &self.vertices[v]);
        Vertex::inside(corners, weights, self.scale)
    }
}
