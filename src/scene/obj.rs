//! Geometry of OBJ files: polygons from `tobj`, welded and cut into triangles.

use super::geometry::{Geometry, repeats};
use super::material::MaterialId;
use super::obj_text::ObjText;
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

/// The polygons of one OBJ file as `tobj` gives them.
pub(super) fn parse(text: &ObjText) -> Result<Vec<tobj::Model>, tobj::LoadError> {
    use std::io::Read;
    let options =
        tobj::LoadOptions { triangulate: false, ignore_points: true, ignore_lines: true, ..Default::default() };
    let numbers = || (0..text.materials.len()).map(|k| (k.to_string(), k)).collect();
    let mut reader = text.vertices.as_slice().chain(text.faces.as_slice());
    let (models, _) = tobj::load_obj_buf(&mut reader, &options, |_| Ok((Vec::new(), numbers())))?;
    Ok(models)
}

impl Soup {
    /// Adds the polygons of a file; `slots[k]` is the slot of its k-th material, `no_material` that of faces before any, and
    /// `painted` says of which slots vertex colours are the reflectance.
    pub(super) fn add(&mut self, models: &[tobj::Model], slots: &[u32], no_material: u32, painted: &[bool]) {
        for model in models {
            let slot = model.mesh.material_id.map_or(no_material, |k| slots[k]);
            let is_painted = painted.get(slot as usize).is_some_and(|&p| p);
            self.add_mesh(&model.mesh, slot, is_painted);
        }
    }

    fn add_mesh(&mut self, mesh: &tobj::Mesh, slot: u32, painted: bool) {
        let count = mesh.indices.len() / 3;
        self.triangles.reserve(count);
        self.normals.reserve(count);
        self.uvs.reserve(count);
        self.slots.reserve(count);
        self.positions.reserve(mesh.positions.len() / 3);
        self.welded.reserve(mesh.positions.len() / 3);
        let global: Vec<u32> = mesh.positions.chunks_exact(3).map(|p| self.weld(Vec3::from_slice(p))).collect();
        let mut polygon = Polygon::default();
        let mut first = 0;
        let faces = if mesh.face_arities.is_empty() { count } else { mesh.face_arities.len() };
        for face in 0..faces {
            let corners = mesh.face_arities.get(face).map_or(3, |&n| n as usize);
            polygon.fill(mesh, &global, first..first + corners);
            if painted {
                polygon.paint(mesh, first..first + corners);
            }
            first += corners;
            self.add_polygon(&mut polygon, slot);
        }
    }

    /// Index of a position; equal bits are one position, −0 counts as 0.
    fn weld(&mut self, position: Vec3) -> u32 {
        let position = position + Vec3::ZERO;
        let next = self.positions.len() as u32;
        let index = *self.welded.entry(position.to_array().map(f32::to_bits)).or_insert(next);
        if index == next {
            self.positions.push(position);
        }
        index
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
    fn fill(&mut self, mesh: &tobj::Mesh, global: &[u32], range: std::ops::Range<usize>) {
        self.vertices.clear();
        self.normals.clear();
        self.uvs.clear();
        for corner in range {
            self.vertices.push(global[mesh.indices[corner] as usize]);
            let normal = mesh.normal_indices.get(corner).map(|&i| Vec3::from_slice(&mesh.normals[3 * i as usize..]));
            self.normals.push(normal.unwrap_or(Vec3::ZERO));
            let uv = mesh.texcoord_indices.get(corner).map(|&i| Vec2::from_slice(&mesh.texcoords[2 * i as usize..]));
            self.uvs.push(uv.unwrap_or(Vec2::ZERO));
        }
    }

    fn paint(&mut self, mesh: &tobj::Mesh, range: std::ops::Range<usize>) {
        self.colours.clear();
        let colours = mesh.indices[range].iter().map(|&i| Vec3::from_slice(&mesh.vertex_color[3 * i as usize..]));
        self.colours.extend(colours);
    }
}
