//! Vertices: where light is sampled.

use super::ids::{Link, SlotId};
use super::weld::Group;
use crate::geom::offset;
use crate::light::context::ShadingPoint;
use crate::math::{combine, mix};
use crate::scene::Scene;
use glam::Vec3;

/// A vertex: a base vertex (a position, a side, a normal group) or the midpoint of an edge. One set of rays serves all
/// its normals.
#[derive(Clone, Debug)]
pub struct Vertex {
    /// Permanent geometric key (docs/method/hierarchy-and-vertices.md): base vertex or edge and dyadic
    /// position, side, normal group. Seeds the random numbers.
    pub key: u64,
    /// Position on the surface, where light is evaluated.
    pub position: Vec3,
    /// Unit normal of the group, on the vertex's side.
    normal: Vec3,
    /// Step from the position towards the inside of the facets, tangential.
    inward: Vec3,
    /// Step off the surface.
    lift: f32,
    /// Whether all facets around it have its normal.
    flat: bool,
    /// Whether a light has moved since it was visited: what it knows of that one is a guess.
    pub outdated: bool,
    /// First of its slots, linked through [`super::slot::SlotRecord::next`].
    pub first_slot: Link<SlotId>,
    /// How far its sampling has come.
    pub progress: Progress,
}

/// How far the sampling of a vertex has come.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Progress {
    /// Whether light has been sampled or inferred at all.
    pub visited: bool,
    /// Whether any light has been traced.
    pub traced: bool,
    /// Whether the contact test found it covered by other geometry: its light is not its surface's.
    pub covered: bool,
    /// Whether it is taken for covered since it sees none of the light that its neighbours see.
    pub enclosed: bool,
    /// What is left to trace.
    pub left: Left,
}

/// Rays that tasks at a vertex would take, roughly.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Left {
    /// To trace the lights that are only guessed.
    pub settle: u32,
    /// To double the points of lights that are partly visible.
    pub double: u32,
    /// Points taken of lights that are partly visible.
    pub partial: u32,
}

/// Cosine of the angle up to which normals count as one.
const FLAT: f32 = 1.0 - 1e-6;
/// Largest step against the lift where facets are not all alike: they tilt by up to about 60° against the mean
/// normal, and the step must not take the rays' origin behind any of them.
const TILTED_STEP: f32 = 0.4;

/// What steps at a position are measured by.
fn size_at(position: Vec3, scale: f32) -> f32 {
    scale.max(position.abs().max_element())
}

/// A tangential step, shortened where it could lead behind a tilted facet.
fn above_facets(step: f32, lift: f32, flat: bool) -> f32 {
    if flat { step } else { step.min(lift * TILTED_STEP) }
}

impl Vertex {
    /// A base vertex. Its rays start off the surface and a little towards the inside of its facets, so that a vertex
    /// on the edge of a wall sees what its surface sees and not the wall it touches
    /// (docs/method/hierarchy-and-vertices.md).
    #[must_use]
    pub fn base(scene: &Scene, name: VertexName, group: &Group, scale: f32) -> Self {
        let position = scene.positions[name.position as usize];
        let normal = if name.back { -group.normal } else { group.normal };
        let to_middle = group.centroid - position;
        let to_middle = to_middle - normal * to_middle.dot(normal);
        let [inward, lift] =
            [offset::INWARD, offset::VERTEX].map(|range| range.map(|share| share * size_at(position, scale)));
        let step = (group.size * 0.02).clamp(inward[0], inward[1]).min(to_middle.length() * 0.25);
        let lift = (group.size * 0.01).clamp(lift[0], lift[1]);
        let flat = group.facets.iter().all(|&f| scene.geometric_normal(f).dot(group.normal) > FLAT);
        let inward = to_middle.normalize_or_zero() * above_facets(step, lift, flat);
        Self { position, normal, inward, lift, flat, ..Self::unsampled(name.key(scene)) }
    }

    /// The midpoint of the edge between two vertices, the same whichever comes first. Steps halve with the edge.
    #[must_use]
    pub fn midpoint(a: &Self, b: &Self, scale: f32) -> Self {
        let inward = (a.inward + b.inward) * 0.25;
        let normal = (a.normal + b.normal).normalize_or(a.normal);
        let inward = inward - normal * inward.dot(normal);
        let step = inward.length();
        let position = (a.position + b.position) * 0.5;
        let size = size_at(position, scale);
        let least = (size * offset::INWARD[0]).min(step * 4.0);
        let lift = ((a.lift + b.lift) * 0.25).max(size * offset::VERTEX[0]);
        // The facets between two flat vertices of one normal have that normal as well.
        let flat = a.flat && b.flat && a.normal.dot(b.normal) > FLAT;
        let inward = inward.normalize_or_zero() * above_facets(step.max(least), lift, flat);
        let key = combine(a.key.min(b.key), a.key.max(b.key));
        Self { position, normal, inward, lift, flat, ..Self::unsampled(key) }
    }

    /// A vertex inside a triangle whose corners are given, at the point of the given barycentric weights. Rays start
    /// straight above it.
    #[must_use]
    pub fn inside(corners: [&Self; 3], weights: [f32; 3], scale: f32) -> Self {
        let [a, b, c] = corners.map(|corner| corner.position);
        let mean = |of: fn(&Self) -> Vec3| (0..3).map(|i| of(corners[i]) * weights[i]).sum::<Vec3>();
        let (position, side) = (mean(|v| v.position), mean(|v| v.normal));
        let facet = (b - a).cross(c - a).normalize_or(side.normalize_or(corners[0].normal));
        let normal = if facet.dot(side) < 0.0 { -facet } else { facet };
        let lift = position.abs().max_element().max(scale * 0.1) * offset::INSIDE;
        let bits = position.to_array().map(|x| u64::from(x.to_bits()));
        let key = bits.into_iter().fold(corners[0].key, combine);
        Self { position, normal, lift, flat: true, ..Self::unsampled(key) }
    }

    /// Becomes another vertex, of which nothing is known, with the same slots.
    pub(super) fn move_to(&mut self, other: Self) {
        *self = Self { first_slot: self.first_slot, ..other };
    }

    /// A vertex of which nothing but the name is known.
    fn unsampled(key: u64) -> Self {
        Self {
            key,
            position: Vec3::ZERO,
            normal: Vec3::Y,
            inward: Vec3::ZERO,
            lift: 0.0,
            flat: false,
            outdated: false,
            first_slot: Link::NONE,
            progress: Progress::default(),
        }
    }

    /// Whether there is room for many positions between two vertices in single precision.
    #[must_use]
    pub fn is_apart_from(&self, other: &Self) -> bool {
        const ROOM: f32 = 1.0 / (1 << 20) as f32;
        let size = self.position.abs().max(other.position.abs()).max_element();
        self.position.distance_squared(other.position) > (size * ROOM) * (size * ROOM)
    }

    /// Unit normal of its group, on its side.
    #[must_use]
    pub const fn normal(&self) -> Vec3 {
        self.normal
    }

    /// Whether it is to be visited before anything else is done there.
    #[must_use]
    pub const fn is_due(&self) -> bool {
        !self.progress.visited || self.outdated
    }

    /// The place where light is sampled: rays start at its origin.
    #[must_use]
    pub fn shading_point(&self) -> ShadingPoint {
        let origin = offset::origin(self.position + self.inward, self.normal, self.lift, 1.0);
        ShadingPoint { key: self.key, position: self.position, origin, normal: self.normal }
    }
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
