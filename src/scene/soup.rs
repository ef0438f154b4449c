//! The triangles of a scene in the making, welded, from whatever files.

use super::geometry::{Geometry, repeats};
use super::material::MaterialId;
use super::{TriangleId, polygon};
use glam::{Vec2, Vec3};
use rustc_hash::FxHashMap;

/// The triangles of all files of a scene, in their order, before materials are known.
#[derive(Default)]
pub(super) struct Soup {
    /// Positions, welded by bits.
    pub positions: Vec<Vec3>,
    /// Triangles of non-zero area.
    pub triangles: Vec<[u32; 3]>,
    /// Normals of the file at the corners; zero where it has none.
    pub normals: Vec<[Vec3; 3]>,
    /// Texture coordinates at the corners; zero where the file has none.
    pub uvs: Vec<[Vec2; 3]>,
    /// Vertex colours at the corners, 1 where they do not count; see [`Self::complete`].
    pub colours: Vec<[Vec3; 3]>,
    /// Material slot of each triangle.
    pub slots: Vec<MaterialId>,
    /// What [`repeats`] finds, once all triangles are there.
    pub repeats: Vec<[TriangleId; 2]>,
    /// Triangles that were left out because they have no area.
    pub zero_area: usize,
    /// Triangles that were left out because their slot is [`SKIP`].
    pub skipped: usize,
    /// Faces with faults that were left out.
    pub dropped_faces: usize,
    welded: FxHashMap<[u32; 3], u32>,
}

/// The slot of materials whose triangles are left out.
pub(super) const SKIP: u32 = u32::MAX;

/// A triangle that goes into the soup.
#[derive(Clone)]
pub(super) struct Added {
    /// Indices of its positions.
    pub corners: [u32; 3],
    /// Normals of the file; zero where it has none.
    pub normals: [Vec3; 3],
    /// Texture coordinates, v up.
    pub uvs: [Vec2; 3],
    /// Vertex colours where they count.
    pub colours: Option<[Vec3; 3]>,
    /// Its material.
    pub slot: u32,
}

impl Added {
    /// Makes its back its front.
    pub(super) fn turn_over(&mut self) {
        self.corners.swap(1, 2);
        self.normals.swap(1, 2);
        self.normals = self.normals.map(|n| -n);
        self.uvs.swap(1, 2);
        if let Some(colours) = &mut self.colours {
            colours.swap(1, 2);
        }
    }
}

impl Soup {
    /// Makes room for more.
    pub(super) fn reserve(&mut self, triangles: usize, positions: usize) {
        self.triangles.reserve(triangles);
        self.normals.reserve(triangles);
        self.uvs.reserve(triangles);
        self.slots.reserve(triangles);
        self.positions.reserve(positions);
        self.welded.reserve(positions);
    }

    /// Index of a position; equal bits are one position, −0 counts as 0.
    pub(super) fn weld(&mut self, position: Vec3) -> u32 {
        let position = position + Vec3::ZERO;
        let next = self.positions.len() as u32;
        let index = *self.welded.entry(position.to_array().map(f32::to_bits)).or_insert(next);
        if index == next {
            self.positions.push(position);
        }
        index
    }

    /// Adds a triangle, if it has an area; says whether it has.
    pub(super) fn add(&mut self, triangle: Added) -> bool {
        let has_area = polygon::has_area(triangle.corners.map(|i| self.positions[i as usize]));
        if has_area {
            if let Some(colours) = triangle.colours {
                self.colours.resize(self.triangles.len(), [Vec3::ONE; 3]);
                self.colours.push(colours);
            }
            self.triangles.push(triangle.corners);
            self.normals.push(triangle.normals);
            self.uvs.push(triangle.uvs);
            self.slots.push(MaterialId(triangle.slot));
        }
        has_area
    }

    /// After all files: colours for all triangles where any has some, and which triangles repeat others.
    pub(super) fn complete(&mut self) {
        if !self.colours.is_empty() {
            self.colours.resize(self.triangles.len(), [Vec3::ONE; 3]);
        }
        self.repeats = repeats(&self.triangles);
    }

    /// Where the triangles are.
    pub(super) fn geometry(&self) -> Geometry<'_> {
        let Self { positions, triangles, slots, repeats, .. } = self;
        Geometry { positions, triangles, materials: slots, repeats }
    }
}
