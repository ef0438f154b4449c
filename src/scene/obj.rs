//! Geometry of OBJ files: polygons from `tobj`, welded and cut into triangles.

use super::obj_text::ObjText;
use super::polygon;
use super::soup::{Added, SKIP, Soup};
use glam::{Vec2, Vec3};

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

/// Adds the polygons of a file to a soup; `slots[k]` is the slot of its k-th material, `no_material` that of faces before any, and
/// `painted` says of which slots vertex colours are the reflectance.
pub(super) fn add(soup: &mut Soup, models: &[tobj::Model], slots: &[u32], no_material: u32, painted: &[bool]) {
    for model in models {
        let slot = model.mesh.material_id.map_or(no_material, |k| slots[k]);
        let is_painted = painted.get(slot as usize).is_some_and(|&p| p);
        add_mesh(soup, &model.mesh, slot, is_painted);
    }
}

fn add_mesh(soup: &mut Soup, mesh: &tobj::Mesh, slot: u32, painted: bool) {
    let count = mesh.indices.len() / 3;
    soup.reserve(count, mesh.positions.len() / 3);
    let global: Vec<u32> = mesh.positions.chunks_exact(3).map(|p| soup.weld(Vec3::from_slice(p))).collect();
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
        add_polygon(soup, &mut polygon, slot);
    }
}

fn add_polygon(soup: &mut Soup, polygon: &mut Polygon, slot: u32) {
    let count = polygon.vertices.len() - 2;
    if slot == SKIP {
        soup.skipped += count;
        return;
    }
    let before = soup.triangles.len();
    polygon.points.clear();
    polygon.points.extend(polygon.vertices.iter().map(|&i| soup.positions[i as usize]));
    polygon::triangulate(&polygon.points, &mut polygon.cut);
    for &corners in &polygon.cut {
        let pick = corners.map(|c| c as usize);
        soup.add(Added {
            corners: pick.map(|c| polygon.vertices[c]),
            normals: pick.map(|c| polygon.normals[c]),
            uvs: pick.map(|c| polygon.uvs[c]),
            colours: (!polygon.colours.is_empty()).then(|| pick.map(|c| polygon.colours[c])),
            slot,
        });
    }
    // n corners stand for n − 2 triangles, however many of them have an area.
    soup.zero_area += count.saturating_sub(soup.triangles.len() - before);
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
