//! Base vertices: where light is sampled.

use super::dynamic::SlotId;
use super::weld::Group;
use crate::math::{combine, mix};
use crate::scene::Scene;
use glam::Vec3;

/// Index of a vertex in the cache (recyclable; the permanent name is its key).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct VertexId(pub u32);

/// A base vertex: a position, a side and a normal group. One set of rays serves all normals of the group.
#[derive(Clone, Debug)]
pub struct Vertex {
    /// Permanent geometric key (method 3): object, base vertex, side, normal group. Seeds the random numbers.
    pub key: u64,
    /// Where rays start: off the surface and nudged towards the inside of its facets.
    pub origin: Vec3,
    /// Position on the surface, where light is evaluated.
    pub position: Vec3,
    /// First of its slots, linked through [`super::dynamic::SlotRecord::next`].
    pub first_slot: Option<SlotId>,
    /// Pixels of the visible faces around it, shared out over their corners.
    pub pixels: f32,
    /// Stage of its next visit.
    pub stage: u32,
}

/// What identifies a base vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct VertexName {
    /// Index of the position.
    pub position: u32,
    /// Side of the surface.
    pub back: bool,
    /// Normal group at the position.
    pub group: u32,
}

impl VertexName {
    /// The permanent 64-bit key, from the position's bits rather than its index.
    #[must_use]
    pub fn key(self, scene: &Scene) -> u64 {
        let p = scene.positions[self.position as usize];
        let bits = u64::from(p.x.to_bits()) << 32 | u64::from(p.y.to_bits());
        let rest = u64::from(p.z.to_bits()) << 32 | u64::from(self.group) << 1 | u64::from(self.back);
        combine(mix(bits), rest)
    }
}

/// Start of a vertex's rays: off the surface, and a little towards the inside of the facets, so that a vertex on the edge
/// of a wall sees what its surface sees and not the wall it touches (method 3, validity).
///
/// Steps follow the mesh's size, bounded by the scene's `diagonal`: large enough for f32 at that scale, small
/// enough to stay inside thin parts.
#[must_use]
pub fn ray_origin(position: Vec3, back: bool, group: &Group, diagonal: f32) -> Vec3 {
    let normal = if back { -group.normal } else { group.normal };
    let inward = group.centroid - position;
    let inward = inward - normal * inward.dot(normal);
    let along = (group.size * 0.02).clamp(diagonal * 1e-5, diagonal * 1e-3).min(inward.length() * 0.25);
    let off = (group.size * 0.01).clamp(diagonal * 4e-6, diagonal * 4e-5);
    position + inward.normalize_or_zero() * along + normal * off
}
