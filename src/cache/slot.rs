//! Vertex slots: one shading normal and gloss of a vertex, with the luminance known there.

use super::between::Place;
use super::ids::{BetweenId, Link, SlotId, VertexId};
use super::kept_luminance::KeptLuminance;
use super::sparse::Sparse;
use crate::math::unit_vector::UnitVector;
use glam::Vec3;

pub use super::kept_luminance::Luminance;

/// Weight of a covered vertex in interpolation. Not 0, so that a triangle whose vertices are all covered still shows
/// what they know; beside a valid vertex it does not count. The luminance pass relies on it (`LEAST_WEIGHT`): larger
/// than what extrapolation by a raster step can make of 0.
pub const COVERED_WEIGHT: f32 = 4e-3;

/// One shading normal (and highlight) of a vertex, with the luminance known there in any view.
#[derive(Clone, Debug)]
pub struct SlotRecord {
    /// The vertex whose samples it shares.
    pub vertex: VertexId,
    /// The vertex's next slot.
    pub next: Link<SlotId>,
    /// Shading normal, on the vertex's side.
    normal: UnitVector,
    /// Its highlight, or [`MATT`].
    gloss: u16,
    direct: KeptLuminance,
    indirect: KeptLuminance,
    /// Where the slots are listed that it lies between.
    pub(super) between: Place,
    /// Its place in the order in which slots are predicted: the spacing's number for base vertices, see
    /// [`super::coarse_levels`]; for all others, from [`INSIDE`] on, one more than the highest of those it lies between.
    pub rank: u8,
    /// First slot inside the faces that lies between this one and others.
    pub(super) first_between: Link<BetweenId>,
}

/// The highlight of a surface, by its place among those of the scene (`cache::glosses`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GlossId(pub(super) u16);

/// A surface without highlights.
const MATT: u16 = u16::MAX;

/// Lowest rank of slots inside the faces: predicted after all base vertices.
pub const INSIDE: u8 = 8;
/// Rank of base vertices that are not in the order yet.
const UNPLACED: u8 = INSIDE - 1;

/// Specular luminance S at a slot for one eye, W·sr⁻¹·m⁻².
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Specular {
    /// Of direct light.
    pub direct: Vec3,
    /// Of indirect light.
    pub indirect: Vec3,
}

/// Light at a slot as one eye sees it: what is kept of it in any view, with S.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SlotLight {
    /// Diffuse luminance D, W·sr⁻¹·m⁻².
    pub diffuse: Vec3,
    /// Specular luminance S, W·sr⁻¹·m⁻².
    pub specular: Vec3,
    /// Variance of the luminance of D, (W·sr⁻¹·m⁻²)².
    pub variance: f32,
    /// See [`Luminance`].
    pub known: bool,
    /// See [`Luminance`].
    pub stale: bool,
    /// See [`Luminance`].
    pub coarse: bool,
}

impl SlotLight {
    /// What was kept, with S.
    #[must_use]
    pub const fn new(kept: Luminance, specular: Vec3) -> Self {
        let Luminance { diffuse, variance, known, stale, coarse } = kept;
        Self { diffuse, specular, variance, known, stale, coarse }
    }

    /// What is kept of it in any view.
    #[must_use]
    pub const fn kept(self) -> Luminance {
        let Self { diffuse, variance, known, stale, coarse, .. } = self;
        Luminance { diffuse, variance, known, stale, coarse }
    }
}

/// From where slots are seen, and their S from there as far as it is known.
#[derive(Clone, Copy)]
pub struct Eye<'a> {
    /// Position of the eye, scene units.
    pub position: Vec3,
    /// S by slot.
    pub specular: &'a Sparse<SlotId, Specular>,
}

/// What facets must have in common to share a slot.
#[derive(Clone, Copy, Debug)]
pub(super) struct Look {
    pub(super) normal: Vec3,
    pub(super) gloss: Option<GlossId>,
}

impl SlotRecord {
    /// A slot of which no light is known.
    pub(super) fn new(vertex: VertexId, next: Link<SlotId>, Look { normal, gloss }: Look) -> Self {
        Self {
            vertex,
            next,
            normal: UnitVector::new(normal),
            gloss: gloss.map_or(MATT, |gloss| gloss.0),
            direct: KeptLuminance::default(),
            indirect: KeptLuminance::default(),
            between: Place::default(),
            rank: UNPLACED,
            first_between: Link::NONE,
        }
    }

    /// Whether it has this look. Coplanar facets may differ in the last bits of their normals; 1e-6 is 0.08°.
    pub(super) fn looks(&self, look: Look) -> bool {
        self.gloss() == look.gloss && self.normal().dot(look.normal) > 1.0 - 1e-6
    }

    /// Unit shading normal, on the vertex's side.
    #[must_use]
    #[inline]
    pub fn normal(&self) -> Vec3 {
        self.normal.get()
    }

    /// Bits of its shading normal.
    pub(super) const fn normal_bits(&self) -> u32 {
        self.normal.bits()
    }

    /// Takes another normal; what is known of its light is of no more use.
    pub(super) fn turn_to(&mut self, normal: Vec3) {
        self.normal = UnitVector::new(normal);
        (self.direct, self.indirect) = Default::default();
    }

    /// Direct light.
    #[must_use]
    #[inline]
    pub fn direct(&self) -> Luminance {
        self.direct.get()
    }

    /// Indirect light.
    #[must_use]
    #[inline]
    pub fn indirect(&self) -> Luminance {
        self.indirect.get()
    }

    /// Notes the direct light.
    pub fn set_direct(&mut self, light: Luminance) {
        self.direct = KeptLuminance::new(light);
    }

    /// Notes the indirect light.
    pub fn set_indirect(&mut self, light: Luminance) {
        self.indirect = KeptLuminance::new(light);
    }

    /// Its highlight, where the surface is glossy: [`super::store::Cache::gloss`] tells what that is.
    #[must_use]
    #[inline]
    pub fn gloss(&self) -> Option<GlossId> {
        (self.gloss != MATT).then_some(GlossId(self.gloss))
    }

    /// Whether it belongs to a base vertex.
    #[must_use]
    pub const fn is_base(&self) -> bool {
        self.rank < INSIDE
    }

    /// Whether it belongs to a base vertex that may predict others.
    #[must_use]
    pub const fn is_coarse(&self) -> bool {
        (self.rank as usize) < super::coarse_grids::LEVELS
    }

    /// Whether it belongs to a base vertex that is not in the order of coarse levels yet.
    #[must_use]
    pub const fn is_unplaced(&self) -> bool {
        self.rank == UNPLACED
    }

    /// Diffuse luminance D of all light, W·sr⁻¹·m⁻².
    #[must_use]
    pub fn diffuse(&self) -> Vec3 {
        self.direct().diffuse + self.indirect().diffuse
    }
}

impl Specular {
    /// Of all light.
    #[must_use]
    pub fn total(&self) -> Vec3 {
        self.direct + self.indirect
    }
}
