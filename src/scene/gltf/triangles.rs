//! From primitives to triangles in the world.

use super::document::Document;
use super::parts::{Part, Parts};
use super::transform::{of_normals, turns_over};
use crate::scene::soup::{Added, SKIP, Soup};
use ::gltf::json::mesh::Mode;
use glam::{DAffine3, DMat3, Vec2, Vec3};

/// No vertex yet.
const NONE: u32 = u32::MAX;

/// A primitive at one place in the world.
pub(super) struct Instance<'a> {
    document: &'a Document,
    parts: &'a Parts,
    part: &'a Part,
    frame: DAffine3,
    normals: DMat3,
    turned: bool,
    /// Index in the soup of each vertex; empty where few of many are used.
    welded: Vec<u32>,
}

impl<'a> Instance<'a> {
    /// A part under a transform to the world.
    pub(super) fn new(document: &'a Document, parts: &'a Parts, part: &'a Part, frame: DAffine3) -> Self {
        let vertices = parts.readers[part.positions].count;
        let welded = if vertices <= 16 + 4 * part.triangles { vec![NONE; vertices as usize] } else { Vec::new() };
        let (normals, turned) = (of_normals(frame.matrix3), turns_over(frame.matrix3));
        Self { document, parts, part, frame, normals, turned, welded }
    }

    /// Adds its triangles; `first` is the number of the file's first material. Answers how many had faults and were left out.
    pub(super) fn add_to(&mut self, soup: &mut Soup, first: u32) -> usize {
        let surface = &self.parts.surfaces[self.part.surface];
        let count = self.part.triangles as usize;
        if surface.slot == SKIP {
            soup.skipped += count;
            return 0;
        }
        soup.reserve(count, self.welded.len());
        let mut dropped = 0;
        for triangle in 0..self.part.triangles as u32 {
            let corners = corners(self.part.mode, triangle).map(|corner| self.vertex(corner));
            let [a, b, c] = corners;
            let corners = if self.turned { [a, c, b] } else { corners };
            let [Some(a), Some(b), Some(c)] = corners.map(|vertex| self.weld(soup, vertex)) else {
                dropped += 1;
                continue;
            };
            let mut added = self.added(corners, [a, b, c], first + surface.slot);
            if !soup.add(added.clone()) {
                soup.zero_area += 1;
            } else if surface.twice {
                added.turn_over();
                soup.add(added);
            }
        }
        soup.dropped_faces += dropped;
        dropped
    }

    /// The vertex at a corner.
    fn vertex(&self, corner: u32) -> u32 {
        self.part.indices.map_or(corner, |indices| self.parts.readers[indices].index(self.document, corner))
    }

    /// Index in the soup of a vertex; `None` for one that there is not, or whose place is not made of numbers.
    fn weld(&mut self, soup: &mut Soup, vertex: u32) -> Option<u32> {
        if let Some(&known) = self.welded.get(vertex as usize).filter(|&&known| known != NONE) {
            return Some(known);
        }
        let reader = &self.parts.readers[self.part.positions];
        let position = (u64::from(vertex) < reader.count).then(|| reader.vec3(self.document, vertex))?;
        let position = self.frame.transform_point3(position.as_dvec3()).as_vec3();
        let index = position.is_finite().then(|| soup.weld(position))?;
        if let Some(known) = self.welded.get_mut(vertex as usize) {
            *known = index;
        }
        Some(index)
    }

    fn added(&self, vertices: [u32; 3], corners: [u32; 3], slot: u32) -> Added {
        let reader = |number: Option<usize>| number.map(|number| &self.parts.readers[number]);
        let (normals, uvs, colours) = (reader(self.part.normals), reader(self.part.uvs), reader(self.part.colours));
        let normal = |vertex: u32| {
            let normal = normals.map_or(Vec3::ZERO, |reader| reader.vec3(self.document, vertex)).as_dvec3();
            let normal = (self.normals * normal).normalize_or_zero().as_vec3();
            if normal.is_finite() { normal } else { Vec3::ZERO }
        };
        let uv = |vertex: u32| {
            let uv = uvs.map_or(Vec2::Y, |reader| reader.vec2(self.document, vertex));
            // v points down in the file.
            let uv = Vec2::new(uv.x, 1.0 - uv.y);
            if uv.is_finite() { uv } else { Vec2::ZERO }
        };
        let colours = colours.map(|reader| {
            vertices.map(|vertex| {
                let colour = reader.colour(self.document, vertex);
                if colour.is_finite() { colour.clamp(Vec3::ZERO, Vec3::ONE) } else { Vec3::ONE }
            })
        });
        Added { corners, normals: vertices.map(normal), uvs: vertices.map(uv), colours, slot }
    }
}

/// The corners of a triangle, counter-clockwise from its front.
const fn corners(mode: Mode, triangle: u32) -> [u32; 3] {
    match mode {
        Mode::TriangleStrip => [triangle, triangle + 1 + triangle % 2, triangle + 2 - triangle % 2],
        Mode::TriangleFan => [triangle + 1, triangle + 2, 0],
        _ => [3 * triangle, 3 * triangle + 1, 3 * triangle + 2],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_and_fans_are_wound_alike() {
        let all = |mode| [0, 1, 2].map(|t| corners(mode, t));
        assert_eq!(all(Mode::TriangleStrip), [[0, 1, 2], [1, 3, 2], [2, 3, 4]]);
        assert_eq!(all(Mode::TriangleFan), [[1, 2, 0], [2, 3, 0], [3, 4, 0]]);
        assert_eq!(all(Mode::Triangles), [[0, 1, 2], [3, 4, 5], [6, 7, 8]]);
    }
}
