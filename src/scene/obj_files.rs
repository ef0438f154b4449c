//! The OBJ files of a scene with their MTL files.

use super::material::{Material, TextureMap};
use super::material_library::MaterialLibrary;
use super::mtl::MAPS;
use super::obj_text::{Named, ObjText};
use super::report::Report;
use super::soup::{SKIP, Soup};
use super::source::Source;
use super::textures::Request;
use super::{materials, obj};
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// The OBJ files of a scene.
#[derive(Default)]
pub(super) struct ObjFiles {
    files: Vec<ObjFile>,
    library: MaterialLibrary,
    slots: Vec<Slots>,
}

impl ObjFiles {
    /// Reads the polygons of files, positions from `origin`.
    pub(super) fn parse(paths: &[PathBuf], bytes: &[Vec<u8>], origin: DVec3) -> Self {
        let files = paths.par_iter().zip(bytes).map(|(path, bytes)| ObjFile::parse(path, bytes, origin)).collect();
        Self { files, ..Self::default() }
    }

    /// Whether there is none.
    pub(super) const fn is_empty(&self) -> bool {
        self.files.is_empty()
    }

    /// Positions that faces use, file by file; one that is no number stands for those that cannot be drawn.
    pub(super) fn positions(&self) -> Vec<Vec<Vec3>> {
        self.files.iter().map(ObjFile::positions).collect()
    }

    /// Says what is wrong with the text.
    pub(super) fn report_text(&mut self, report: &mut Report) {
        self.files.iter_mut().for_each(|file| report.faults.append(&mut file.text.report.faults));
    }

    /// Reads the MTL files and finds the materials of faces.
    pub(super) fn read_materials(&mut self, report: &mut Report) {
        let Self { files, library, slots } = self;
        let named: Vec<_> = files.iter().map(|file| find_materials(file, library, report)).collect();
        library.settle_opacities(in_use(files, &named), report);
        *slots = files.iter().zip(&named).map(|(file, named)| resolve(file, named, library, report)).collect();
    }
}

impl Source for ObjFiles {
    fn slots(&self) -> usize {
        self.library.painted.len()
    }

    fn requests(&self) -> Vec<Request<'_>> {
        self.library.drawn().flat_map(materials::requests).map(|(_, request)| request).collect()
    }

    fn add_to(&self, soup: &mut Soup, first: u32, _: &mut Report) {
        let shifted = |slot: u32| if slot == SKIP { SKIP } else { first + slot };
        let painted: Vec<bool> = (0..first).map(|_| false).chain(self.library.painted.iter().copied()).collect();
        for (file, slots) in self.files.iter().zip(&self.slots) {
            soup.dropped_faces += file.text.dropped_faces;
            let of_material: Vec<u32> = slots.of_material.iter().copied().map(shifted).collect();
            obj::add(soup, &file.models, &of_material, shifted(slots.no_material), &painted);
        }
    }

    fn materials(&self, maps: &mut dyn Iterator<Item = Option<TextureMap>>, report: &mut Report) -> Vec<Material> {
        self.library.materials(|m, painted| {
            let mut of_material = [None; MAPS];
            for (map, _) in materials::requests(m) {
                of_material[map as usize] = maps.next().flatten();
            }
            materials::build(m, of_material, painted, report)
        })
    }

    fn files(&self) -> Vec<PathBuf> {
        let objs = self.files.iter().map(|file| file.path.clone());
        objs.chain(self.library.files().map(Path::to_owned)).collect()
    }
}

/// An OBJ file.
struct ObjFile {
    path: PathBuf,
    text: ObjText,
    models: Vec<tobj::Model>,
}

impl ObjFile {
    /// Reads a file, positions from `origin`.
    fn parse(path: &Path, bytes: &[u8], origin: DVec3) -> Self {
        let mut text = ObjText::read(path, bytes, origin);
        let models = obj::parse(&text).unwrap_or_else(|error| {
            text.report.error(path, None, format!("cannot be read: {error}"));
            Vec::new()
        });
        Self { path: path.to_owned(), text, models }
    }

    /// Positions that faces use; one that is no number stands for those that cannot be drawn.
    fn positions(&self) -> Vec<Vec3> {
        let positions = self.models.iter().flat_map(|model| model.mesh.positions.chunks_exact(3).map(Vec3::from_slice));
        positions.chain((!self.text.all_usable).then_some(Vec3::NAN)).collect()
    }
}

/// The slots of one OBJ's materials.
struct Slots {
    of_material: Vec<u32>,
    no_material: u32,
}

/// Where the material library has the materials of an OBJ, by their numbers.
fn find_materials(file: &ObjFile, library: &mut MaterialLibrary, report: &mut Report) -> Vec<Option<usize>> {
    let library = library.open_libraries(&file.path, &file.text.libraries, report);
    file.text.materials.iter().map(|named| library.find(&named.name)).collect()
}

/// The materials that faces use.
fn in_use(files: &[ObjFile], named: &[Vec<Option<usize>>]) -> impl Iterator<Item = usize> {
    let has_faces = files.iter().flat_map(|file| &file.text.has_faces);
    has_faces.zip(named.iter().flatten()).filter_map(|(has_faces, index)| index.filter(|_| *has_faces))
}

fn resolve(file: &ObjFile, named: &[Option<usize>], library: &mut MaterialLibrary, report: &mut Report) -> Slots {
    let coloured = file.text.has_colours;
    let stand_in = if coloured { "the vertex colours are" } else { "grey is" };
    let slot = |(named, index): (&Named, &Option<usize>)| match index {
        Some(index) => library.slot(*index, coloured, report),
        None => {
            let message = format!("material {}: in no MTL file: {stand_in} used", named.name);
            report.warn(&file.path, Some(named.line), message);
            library.grey(&named.name, coloured)
        }
    };
    let of_material: Vec<u32> = file.text.materials.iter().zip(named).map(slot).collect();
    // `tobj` names no material only before the first `usemtl`.
    let no_material =
        if starts_without_material(&file.text.faces) { library.grey("no material", coloured) } else { SKIP };
    let is_painted = |&slot: &u32| library.painted.get(slot as usize).is_some_and(|&painted| painted);
    if coloured && !of_material.iter().chain([&no_material]).any(is_painted) {
        let message = "the vertex colours are not used: every material has its own Kd or map_Kd";
        report.warn(&file.path, None, message);
    }
    Slots { of_material, no_material }
}

/// Whether a face stands before the first `usemtl` of the checked text.
fn starts_without_material(faces: &[u8]) -> bool {
    let after_library = memchr::memchr(b'\n', faces).map_or(0, |end| end + 1);
    faces.get(after_library) == Some(&b'f')
}
