//! The primitives of meshes, checked: what they read lies in buffers, and all that they name is there.

use super::accessor::{Reader, Use};
use super::document::Document;
use super::faults::Faults;
use super::materials::Surface;
use crate::scene::soup::SKIP;
use ::gltf::json::mesh::{Mode, Primitive, Semantic};
use ::gltf::json::validation::Checked;
use std::collections::HashMap;

/// A primitive made of triangles.
#[derive(Clone, Debug)]
pub(super) struct Part {
    /// Numbers of readers.
    pub positions: usize,
    pub normals: Option<usize>,
    pub uvs: Option<usize>,
    pub colours: Option<usize>,
    pub indices: Option<usize>,
    /// How corners make triangles.
    pub mode: Mode,
    /// Number of its surface.
    pub surface: usize,
    /// How many triangles it has.
    pub triangles: u64,
    /// Mesh and primitive, for messages.
    pub place: [usize; 2],
}

/// What the meshes of a file have in common.
#[derive(Debug, Default)]
pub(super) struct Parts {
    /// All that is read.
    pub readers: Vec<Reader>,
    /// The materials in use.
    pub surfaces: Vec<Surface>,
    of_mesh: HashMap<usize, Vec<Part>>,
    readers_of: HashMap<(usize, Use), Option<usize>>,
    surfaces_of: HashMap<(Option<usize>, bool), usize>,
    /// Sparse values that were looked at.
    sparse: u64,
}

impl Parts {
    /// The primitives of a mesh that was [read](Self::read).
    pub(super) fn of(&self, mesh: usize) -> &[Part] {
        self.of_mesh.get(&mesh).map_or(&[], Vec::as_slice)
    }

    /// How many materials are drawn.
    pub(super) fn slots(&self) -> usize {
        self.drawn().count()
    }

    /// The materials that are drawn, in their order.
    pub(super) fn drawn(&self) -> impl Iterator<Item = &Surface> {
        self.surfaces.iter().filter(|surface| surface.slot != SKIP)
    }

    /// Checks a mesh and what it names, once.
    pub(super) fn read(&mut self, document: &Document, number: usize, faults: &mut Faults) {
        if self.of_mesh.contains_key(&number) {
            return;
        }
        let Some(mesh) = document.root.meshes.get(number) else {
            faults.error("meshes", format!("there is no mesh {number}, which a node names"));
            return;
        };
        let mut parts = Vec::new();
        for (k, primitive) in mesh.primitives.iter().enumerate() {
            if primitive.targets.as_ref().is_some_and(|targets| !targets.is_empty()) {
                faults.once("targets", "morph targets are not supported: meshes have the shape that they start from");
            }
            match primitive.mode {
                Checked::Valid(Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) => {}
                Checked::Valid(_) => {
                    faults.once("modes", "points and lines are not drawn");
                    continue;
                }
                Checked::Invalid => {
                    faults.warn(
                        "modes",
                        format!("mesh {number} primitive {k}: its mode is none of glTF: it is left out"),
                    );
                    continue;
                }
            }
            parts.extend(self.part(document, [number, k], primitive, faults));
        }
        self.of_mesh.insert(number, parts);
    }

    fn part(
        &mut self,
        document: &Document,
        place: [usize; 2],
        primitive: &Primitive,
        faults: &mut Faults,
    ) -> Option<Part> {
        let Checked::Valid(mode) = primitive.mode else { return None };
        let [mesh, number] = place;
        let attribute = |semantic| primitive.attributes.get(&Checked::Valid(semantic)).map(|index| index.value());
        let Some(positions) = attribute(Semantic::Positions) else {
            faults.warn("primitives", format!("mesh {mesh} primitive {number}: it has no POSITION and is left out"));
            return None;
        };
        let names = document.names.meshes.get(mesh).and_then(|mesh| mesh.primitives.get(number));
        let is_packed = names.is_some_and(|names| names.has("KHR_draco_mesh_compression"));
        if is_packed && document.root.accessors.get(positions).is_none_or(|accessor| accessor.buffer_view.is_none()) {
            let message =
                format!("mesh {mesh} primitive {number}: it is compressed by Draco: export it without compression");
            faults.error("Draco", message);
            return None;
        }
        let colours = attribute(Semantic::Colors(0));
        let surface = self.surface(document, primitive.material.map(|m| m.value()), colours.is_some(), faults);
        let uv_set = self.surfaces[surface].uv_set;
        if colours.is_some() && self.surfaces[surface].is_unlit() {
            faults.once(
                "unlit colours",
                "vertex colours of unlit materials are not supported: their base colour is shown",
            );
        }
        let mut read = |index: Option<usize>, purpose| index.map(|index| self.reader(document, index, purpose, faults));
        let positions = read(Some(positions), Use::Position).flatten();
        let normals = read(attribute(Semantic::Normals), Use::Normal);
        let uvs = read(attribute(Semantic::TexCoords(uv_set)), Use::TexCoord);
        let colours = read(colours, Use::Colour);
        let indices = read(primitive.indices.map(|index| index.value()), Use::Index);
        // All of them are looked at before one that is broken ends it.
        let positions = positions?;
        let whole = [normals, uvs, colours, indices].iter().all(|found| *found != Some(None));
        let [normals, uvs, colours, indices] = [normals, uvs, colours, indices].map(Option::flatten);
        let vertices = self.readers[positions].count;
        let short = [normals, uvs, colours].into_iter().flatten().any(|reader| self.readers[reader].count < vertices);
        if short {
            let message = format!(
                "mesh {mesh} primitive {number}: an attribute has fewer elements than its {vertices} of POSITION"
            );
            faults.error("attributes", message);
        }
        let corners = indices.map_or(vertices, |reader| self.readers[reader].count);
        let triangles = if mode == Mode::Triangles { corners / 3 } else { corners.saturating_sub(2) };
        let part = Part { positions, normals, uvs, colours, indices, mode, surface, triangles, place };
        (whole && !short).then_some(part)
    }

    /// The number of a reader; `None` where it cannot be read, which is said once.
    fn reader(&mut self, document: &Document, number: usize, purpose: Use, faults: &mut Faults) -> Option<usize> {
        if let Some(&known) = self.readers_of.get(&(number, purpose)) {
            return known;
        }
        let found = match Reader::new(document, number, purpose, &mut self.sparse) {
            Ok(reader) => {
                self.readers.push(reader);
                Some(self.readers.len() - 1)
            }
            Err(why) => {
                faults.error("accessors", format!("accessor {number} ({}): {why}", purpose.name()));
                None
            }
        };
        self.readers_of.insert((number, purpose), found);
        found
    }

    /// The number of the surface that a primitive names, `coloured` one of vertices with colours.
    fn surface(&mut self, document: &Document, number: Option<usize>, coloured: bool, faults: &mut Faults) -> usize {
        // Colours of vertices multiply what a material says, and are all that there is without one.
        let key = (number, coloured && number.is_none());
        if let Some(&known) = self.surfaces_of.get(&key) {
            return known;
        }
        let found = number.and_then(|number| {
            let surface = Surface::new(document, number, faults);
            if surface.is_none() {
                faults.warn("materials", format!("there is no material {number}: grey is used"));
            }
            surface
        });
        let mut surface = found.unwrap_or_else(|| Surface::plain(coloured));
        if surface.slot != SKIP {
            surface.slot = self.slots() as u32;
        }
        self.surfaces.push(surface);
        self.surfaces_of.insert(key, self.surfaces.len() - 1);
        self.surfaces.len() - 1
    }
}
