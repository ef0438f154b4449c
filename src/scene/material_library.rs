//! The MTL files of a scene, each read once, and the materials that its faces use.

use super::find_file::Finder;
use super::material::Material;
use super::mtl::{self, MtlMaterial};
use super::obj_text::Named;
use super::report::Report;
use super::soup::SKIP;
use super::{input, materials, text, transparency};
use glam::Vec3;
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

/// A material of the scene, by its source.
#[derive(Debug)]
enum Slot {
    /// Index into [`MaterialLibrary::read`].
    Mtl(usize),
    /// The stand-in of a material that is nowhere defined, with its name.
    Grey(String),
}

/// All materials that were read, and those in use.
#[derive(Debug, Default)]
pub(super) struct MaterialLibrary {
    /// Materials of all MTL files.
    read: Vec<MtlMaterial>,
    /// Range in `read` of each file.
    files: HashMap<PathBuf, std::ops::Range<usize>>,
    /// The scene's materials, in order of first use.
    slots: Vec<Slot>,
    /// Whether vertex colours are the reflectance of each slot.
    pub painted: Vec<bool>,
    slot_of_mtl: HashMap<(usize, bool), u32>,
    slot_of_grey: HashMap<(String, bool), u32>,
}

/// The materials that the libraries of one OBJ offer.
#[derive(Debug, Default)]
pub(super) struct Library {
    /// Indices into [`MaterialLibrary::read`] by name, with the comment after it and without.
    by_name: HashMap<String, usize>,
}

impl Library {
    /// The material that `usemtl` names: with what follows it, else without a comment.
    pub(super) fn find(&self, name: &str) -> Option<usize> {
        let plain = || text::uncommented(name).and_then(|plain| self.by_name.get(plain));
        self.by_name.get(name).or_else(plain).copied()
    }
}

impl MaterialLibrary {
    /// Reads what the `mtllib` statements of `obj` name. Of two materials of one name the one counts that is in the library named
    /// first; in one library, the later one.
    pub(super) fn open_libraries(&mut self, obj: &Path, statements: &[Named], report: &mut Report) -> Library {
        let directory = obj.parent().unwrap_or(Path::new(""));
        let mut finder = Finder::default();
        let (mut seen, mut indices) = (HashSet::new(), Vec::new());
        for statement in statements.iter().filter(|statement| seen.insert(statement.name.as_str())) {
            for (name, path) in library_files(&mut finder, directory, &statement.name) {
                match path {
                    Some(path) => indices.extend(self.open(&path, report).rev()),
                    None => {
                        let message = format!("there is no MTL file {name:?}: its materials are grey");
                        report.warn(obj, Some(statement.line), message);
                    }
                }
            }
        }
        let mut library = Library::default();
        for &index in &indices {
            let first = *library.by_name.entry(self.read[index].whole_name.clone()).or_insert(index);
            self.warn_of_another(first, index, report);
        }
        for &index in &indices {
            library.by_name.entry(self.read[index].name.clone()).or_insert(index);
        }
        library
    }

    /// Says that a material is not used since another library, which is named before, has one of its name.
    fn warn_of_another(&self, first: usize, index: usize, report: &mut Report) {
        let (used, other) = (&self.read[first], &self.read[index]);
        if used.file != other.file && !used.is_alike(other) {
            let message =
                format!("material {}: that of {} counts, which is named first", other.name, used.file.display());
            report.warn(&other.file, Some(other.line), message);
        }
    }

    fn open(&mut self, path: &Path, report: &mut Report) -> std::ops::Range<usize> {
        if let Some(range) = self.files.get(path) {
            return range.clone();
        }
        let first = self.read.len();
        match input::read_text(path) {
            Ok(bytes) => {
                let (mut materials, faults) = mtl::read(path, &bytes);
                report.faults.extend(faults.faults);
                self.read.append(&mut materials);
            }
            Err(why) => report.warn(path, None, format!("the MTL file {why}: its materials are grey")),
        }
        let range = first..self.read.len();
        self.files.insert(path.to_owned(), range.clone());
        range
    }

    /// The MTL files that it has read, or tried to.
    pub fn files(&self) -> impl Iterator<Item = &Path> {
        self.files.keys().map(PathBuf::as_path)
    }

    /// Finds out what the opacities of the MTL files mean, from the materials that faces use.
    pub(super) fn settle_opacities(&mut self, used: impl Iterator<Item = usize>, report: &mut Report) {
        let mut has_faces = vec![false; self.read.len()];
        used.for_each(|index| has_faces[index] = true);
        let mut ranges: Vec<_> = self.files.values().cloned().collect();
        ranges.sort_unstable_by_key(|range| range.start);
        for range in ranges {
            transparency::settle(&mut self.read[range.clone()], &has_faces[range], report);
        }
    }

    /// The slot of a material that faces use, `coloured` ones of vertices with colours; [`SKIP`], with a warning, when it lets
    /// light pass.
    pub(super) fn slot(&mut self, index: usize, coloured: bool, report: &mut Report) -> u32 {
        let painted = coloured && materials::has_no_colour(&self.read[index]);
        if let Some(&slot) = self.slot_of_mtl.get(&(index, painted)) {
            return slot;
        }
        let slot = if transparency::is_see_through(&self.read[index], report) {
            SKIP
        } else {
            self.push(Slot::Mtl(index), painted)
        };
        self.slot_of_mtl.insert((index, painted), slot);
        slot
    }

    /// The slot of a stand-in: grey, or of the colours of its vertices.
    pub(super) fn grey(&mut self, name: &str, painted: bool) -> u32 {
        let next = self.slots.len() as u32;
        let slot = *self.slot_of_grey.entry((name.to_owned(), painted)).or_insert(next);
        if slot == next {
            self.push(Slot::Grey(name.to_owned()), painted);
        }
        slot
    }

    fn push(&mut self, slot: Slot, painted: bool) -> u32 {
        self.slots.push(slot);
        self.painted.push(painted);
        self.slots.len() as u32 - 1
    }

    /// The MTL materials in use, in the order of the scene's materials.
    pub(super) fn drawn(&self) -> impl Iterator<Item = &MtlMaterial> {
        self.slots.iter().filter_map(|slot| match slot {
            Slot::Mtl(index) => Some(&self.read[*index]),
            Slot::Grey(_) => None,
        })
    }

    /// The scene's materials; `build` makes those that come from an MTL file, told whether vertex colours are
    /// their reflectance.
    pub(super) fn materials(&self, mut build: impl FnMut(&MtlMaterial, bool) -> Material) -> Vec<Material> {
        let make = |(slot, &painted): (&Slot, &bool)| match slot {
            Slot::Mtl(index) => build(&self.read[*index], painted),
            Slot::Grey(name) if painted => Material { kd: Vec3::ONE, ..Material::grey(name) },
            Slot::Grey(name) => Material::grey(name),
        };
        self.slots.iter().zip(&self.painted).map(make).collect()
    }
}

/// The files that one `mtllib` names: the whole rest of the line, with a comment or without, where that is a file, else its words, in
/// which `\` before a space keeps a name together.
fn library_files(finder: &mut Finder, directory: &Path, statement: &str) -> Vec<(String, Option<PathBuf>)> {
    let whole = statement.trim_matches('"').to_owned();
    if let Some(found) = finder.file(directory, &whole) {
        return vec![(whole, Some(found))];
    }
    let plain = text::uncommented(statement).unwrap_or(statement);
    let whole = plain.trim_matches('"').to_owned();
    let found = finder.file(directory, &whole);
    if found.is_some() || !whole.contains(char::is_whitespace) {
        return vec![(whole, found)];
    }
    let glued = plain.replace("\\ ", "\u{0}");
    let names = glued.split_whitespace().map(|name| name.replace('\u{0}', " "));
    names.map(|name| (name.clone(), finder.file(directory, &name))).collect()
}
