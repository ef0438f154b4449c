//! Vertices inside leaves: one at the very point of a leaf that its one pixel shows.
//!
//! Between the corners of a leaf as small as a pixel a shadow's edge can be anywhere, and splitting would go on below the
//! size of the pixel. A vertex where the pixel's centre sees the leaf settles it instead: the pixel shows exactly what is
//! sampled there.

use super::dynamic::{Between, Cache, SlotId};
use super::topology::NodeId;
use super::vertex::{Vertex, VertexId};
use glam::{DVec3, Vec3};

/// A vertex inside a leaf.
#[derive(Clone, Copy, Debug)]
pub struct PixelVertex {
    /// Its slot.
    pub slot: SlotId,
    /// Generation of the camera whose pixel it was put under.
    pub generation: u32,
}

/// A vertex that was added to a leaf or moved there.
#[derive(Clone, Copy, Debug)]
pub struct Placed {
    /// The vertex.
    pub vertex: VertexId,
    /// Whether it is where it was before: what was sampled there stays.
    pub kept: bool,
}

/// Barycentric distance up to which a vertex need not be moved.
const SAME_PLACE: f32 = 1e-3;

impl Between {
    /// Whether it is between the corners of a leaf.
    pub(super) fn is_inside_leaf(&self) -> bool {
        !self.coarse && self.of.len() == 3
    }
}

impl Cache {
    /// Puts a leaf's inner vertex under the pixel of camera `generation` whose ray from `eye` has the given direction. The
    /// leaf has to be drawn anew unless it is kept. `None` if the leaf is seen so much edge-on that the ray has no place
    /// on it.
    pub fn place_pixel_vertex(
        &mut self,
        id: NodeId,
        (eye, direction): (Vec3, Vec3),
        generation: u32,
    ) -> Option<Placed> {
        let weights = weights_on_ray(self.corner_positions(id), eye, direction)?;
        let corners = self.topology.nodes[id.0].corners;
        let between = Between { of: corners.into_iter().zip(weights).collect(), coarse: false };
        let before = self.topology.nodes[id.0].inner;
        let slot = match before {
            None => self.add_pixel_vertex(id, weights, between),
            Some(inner) => {
                let old = self.slots[inner.slot.0].between.iter().flat_map(|b| &b.of);
                if old.zip(weights).all(|((_, old), new)| (old - new).abs() < SAME_PLACE) {
                    self.topology.nodes[id.0].inner = Some(PixelVertex { generation, ..inner });
                    return Some(Placed { vertex: self.slots[inner.slot.0].vertex, kept: true });
                }
                self.move_pixel_vertex(id, inner.slot, (weights, between));
                inner.slot
            }
        };
        self.topology.nodes[id.0].inner = Some(PixelVertex { slot, generation });
        Some(Placed { vertex: self.slots[slot.0].vertex, kept: false })
    }

    fn add_pixel_vertex(&mut self, id: NodeId, weights: [f32; 3], between: Between) -> SlotId {
        let vertex = VertexId(self.vertices.insert(self.vertex_inside(id, weights)));
        let look = self.look_inside(id, weights);
        let slot = self.slot(vertex, look);
        self.note_between(slot, between);
        slot
    }

    /// Forgets all that is known at an inner vertex and puts it elsewhere on its leaf.
    fn move_pixel_vertex(&mut self, id: NodeId, slot: SlotId, (weights, between): ([f32; 3], Between)) {
        let vertex = self.slots[slot.0].vertex;
        let moved = self.vertex_inside(id, weights);
        self.vertices[vertex.0].move_to(moved);
        for layer in &mut self.layers {
            layer.forget(vertex, slot);
        }
        self.indirect.forget(vertex, slot);
        let normal = self.look_inside(id, weights).normal;
        let record = &mut self.slots[slot.0];
        (record.normal, record.between) = (normal, Some(between));
        (record.direct, record.indirect) = Default::default();
    }

    /// The slot in the middle of a leaf's edge `at` that it is drawn through, if finer neighbours have put one there.
    #[must_use]
    pub fn hanging_slot(&self, id: NodeId, at: usize) -> Option<SlotId> {
        let node = &self.topology.nodes[id.0];
        let middle = self.topology.midpoint(node.edges[at])?;
        let mut slots = node.drawn.iter().flat_map(|leaf| self.drawn[leaf.0].triangle.slots);
        slots.find(|slot| self.slots[slot.0].vertex == middle)
    }

    /// The slot of a vertex, if that lies inside a leaf.
    #[must_use]
    pub fn pixel_slot(&self, vertex: VertexId) -> Option<SlotId> {
        let between = |slot: SlotId| self.slots[slot.0].between.as_ref();
        self.vertices[vertex.0].first_slot.filter(|&slot| between(slot).is_some_and(Between::is_inside_leaf))
    }

    /// The vertex that there would be inside a leaf.
    pub(super) fn vertex_inside(&self, id: NodeId, weights: [f32; 3]) -> Vertex {
        let corners = self.corner_vertices(id).map(|v| &self.vertices[v.0]);
        Vertex::inside(corners, weights, self.scale)
    }
}

/// Barycentric weights of the point of a triangle that a ray passes through, those of the nearest point of the triangle if
/// it just misses.
#[must_use]
pub fn weights_on_ray(corners: [Vec3; 3], eye: Vec3, direction: Vec3) -> Option<[f32; 3]> {
    let volumes = volumes(corners, eye, direction);
    let sum: f64 = volumes.iter().sum();
    let inside = volumes.map(|v| (v / sum).max(0.0));
    let total: f64 = inside.iter().sum();
    (total.is_finite() && total > 0.0).then(|| inside.map(|v| (v / total) as f32))
}

/// Volumes that a ray spans with the edges of a triangle, each opposite to a corner: in proportion to the barycentric weights of
/// the point where it passes through the plane, exact enough for slivers, and free of the plane's distance.
pub(super) fn volumes(corners: [Vec3; 3], eye: Vec3, direction: Vec3) -> [f64; 3] {
    let [a, b, c] = corners.map(|p| p.as_dvec3() - eye.as_dvec3());
    let volume = |p: DVec3, q: DVec3| direction.as_dvec3().dot(p.cross(q));
    [volume(b, c), volume(c, a), volume(a, b)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ray_passes_through_the_weighted_point() {
        let corners = [Vec3::new(1.0, 2.0, 9.0), Vec3::new(-3.0, 0.5, 7.0), Vec3::new(0.5, -1.0, 8.0)];
        let eye = Vec3::new(0.3, 0.2, -1.0);
        for weights in [[0.2, 0.3, 0.5], [0.9, 0.05, 0.05], [1.0, 0.0, 0.0]] {
            let point: Vec3 = (0..3).map(|i| corners[i] * weights[i]).sum();
            let found = weights_on_ray(corners, eye, (point - eye) * 0.3).unwrap();
            assert!(found.iter().zip(weights).all(|(a, b)| (a - b).abs() < 1e-5), "{found:?} {weights:?}");
        }
        // Beside it: clamped. Edge-on: no place.
        let beside = weights_on_ray(corners, eye, corners[0] + Vec3::Y - eye).unwrap();
        assert!(beside.iter().all(|w| (0.0..=1.0).contains(w)) && (beside.iter().sum::<f32>() - 1.0).abs() < 1e-6);
        assert!(weights_on_ray([Vec3::X, Vec3::X * 2.0, Vec3::X * 3.0], Vec3::ZERO, Vec3::X).is_none());
    }
}
