//! Geometry of OBJ files: polygons welded and cut into triangles.

use super::geometry::{Geometry, repeats};
use super::material::MaterialId;
use super::obj_text::{ABSENT, Corner, ObjMesh, V, VN, VT};
use super::{TriangleId, polygon};
use glam::{Vec2, Vec3};
use rustc_hash::FxHashMap;

/// The triangles of all OBJ files of a scene, in file order, before materials are known.
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
    /// Material slot of each triangle: what the caller's list says for its `usemtl`.
    pub slots: Vec<MaterialId>,
    /// What [`repeats`] finds, once all triangles are there.
    pub repeats: Vec<[TriangleId; 2]>,
    /// Triangles that were left out because they have no area.
    pub zero_area: usize,
    /// Triangles that were left out because their slot is [`SKIP`].
    pub skipped: usize,
    welded: FxHashMap<[u32; 3], u32>,
}

/// The slot of materials whose triangles are left out.
pub(super) const SKIP: u32 = u32::MAX;

impl Soup {
    /// Adds the polygons of a file; `slots[k]` is the slot of its k-th material, `no_material` that of faces before any, and
    /// `painted` says of which slots vertex colours are the reflectance.
    pub(super) fn add(&mut self, mesh: &ObjMesh, slots: &[u32], no_material: u32, painted: &[bool]) {
        let count = mesh.faces.len();
        self.triangles.reserve(count);
        self.normals.reserve(count);
        self.uvs.reserve(count);
        self.slots.reserve(count);
        self.positions.reserve(mesh.positions.len());
        self.welded.reserve(mesh.positions.len());
        // Which of the positions so far each of the file's is.
        let mut welded = vec![u32::MAX; mesh.positions.len()];
        let mut polygon = Polygon::default();
        let mut rest = mesh.corners.as_slice();
        for face in &mesh.faces {
            let (corners, after) = rest.split_at(face.corners as usize);
            rest = after;
            let slot = face.material.map_or(no_material, |k| slots[k as usize]);
            polygon.fill(mesh, corners, |v| self.weld(&mut welded[v as usize], mesh.positions[v as usize]));
            if painted.get(slot as usize).is_some_and(|&p| p) {
                polygon.paint(mesh, corners);
            }
            self.add_polygon(&mut polygon, slot);
        }
    }

    /// Index of a position, looked up once for each of a file's; equal bits are one position, −0 counts as 0.
    fn weld(&mut self, known: &mut u32, position: Vec3) -> u32 {
        if *known == u32::MAX {
            let position = position + Vec3::ZERO;
            let next = self.positions.len() as u32;
            *known = *self.welded.entry(position.to_array().map(f32::to_bits)).or_insert(next);
            if *known == next {
                self.positions.push(position);
            }
        }
        *known
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

    fn add_polygon(&mut self, polygon: &mut Polygon, slot: u32) {
        let count = polygon.vertices.len() - 2;
        if slot == SKIP {
            self.skipped += count;
            return;
        }
        let before = self.triangles.len();
        polygon.points.clear();
        polygon.points.extend(polygon.vertices.iter().map(|&i| self.positions[i as usize]));
        polygon::triangulate(&polygon.points, &mut polygon.cut);
        for &corners in &polygon.cut {
            if polygon::has_area(corners.map(|c| polygon.points[c as usize])) {
                let pick = corners.map(|c| c as usize);
                if !polygon.colours.is_empty() {
                    self.colours.resize(self.triangles.len(), [Vec3::ONE; 3]);
                    self.colours.push(pick.map(|c| polygon.colours[c]));
                }
                self.triangles.push(pick.map(|c| polygon.vertices[c]));
                self.normals.push(pick.map(|c| polygon.normals[c]));
                self.uvs.push(pick.map(|c| polygon.uvs[c]));
                self.slots.push(MaterialId(slot));
            }
        }
        // n corners stand for n − 2 triangles, however many of them have an area.
        self.zero_area += count.saturating_sub(self.triangles.len() - before);
    }
}

/// One polygon's corners, and room to cut it.
#[derive(Default)]
struct Polygon {
    vertices: Vec<u32>,
    normals: Vec<Vec3>,
    uvs: Vec<Vec2>,
    /// Empty where vertex colours do not count.
    colours: Vec<Vec3>,
    points: Vec<Vec3>,
    cut: Vec<[u32; 3]>,
}

impl Polygon {
    /// Takes the corners of a face; `weld` tells the index of a position of the file.
    fn fill(&mut self, mesh: &ObjMesh, corners: &[Corner], mut weld: impl FnMut(u32) -> u32) {
        self.vertices.clear();
        self.normals.clear();
        self.uvs.clear();
        self.colours.clear();
        for corner in corners {
            self.vertices.push(weld(corner[V]));
            self.normals.push(if corner[VN] == ABSENT { Vec3::ZERO } else { mesh.normals[corner[VN] as usize] });
            self.uvs.push(if corner[VT] == ABSENT { Vec2::ZERO } else { mesh.uvs[corner[VT] as usize] });
        }
    }

    fn paint(&mut self, mesh: &ObjMesh, corners: &[Corner]) {
        self.colours.extend(corners.iter().filter_map(|corner| mesh.colours.get(corner[V] as usize)));
    }
}
