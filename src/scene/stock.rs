//! The MTL files of a scene, each read once, and the materials that its faces use.

use super::material::Material;
use super::mtl::{self, MtlMaterial};
use super::obj::SKIP;
use super::obj_text::Named;
use super::report::Report;
use super::{input, materials, textures};
use glam::Vec3;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// A material of the scene, by its source.
#[derive(Debug)]
enum Slot {
    /// Index into [`Stock::read`].
    Mtl(usize),
    /// The stand-in of a material that is nowhere defined, with its name.
    Grey(String),
}

/// All materials that were read, and those in use.
#[derive(Debug, Default)]
pub(super) struct Stock {
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

impl Stock {
    /// Reads what the `mtllib` statements of `obj` name; the materials by name, of several the last.
    pub(super) fn open_libraries(
        &mut self,
        obj: &Path,
        statements: &[Named],
        report: &mut Report,
    ) -> HashMap<String, usize> {
        let directory = obj.parent().unwrap_or(Path::new(""));
        let mut out = HashMap::new();
        for statement in statements {
            for (name, path) in library_files(directory, &statement.name) {
                let Some(path) = path else {
                    let message = format!("there is no MTL file {name:?}: its materials are grey");
                    report.warn(obj, Some(statement.line), message);
                    continue;
                };
                let range = self.open(&path, report);
                out.extend(range.map(|index| (self.read[index].name.clone(), index)));
            }
        }
        out
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

    /// The slot of a material that faces use, `coloured` ones of vertices with colours; [`SKIP`], with a warning, when it lets
    /// light pass.
    pub(super) fn slot(&mut self, index: usize, coloured: bool, report: &mut Report) -> u32 {
        let painted = coloured && materials::has_no_colour(&self.read[index]);
        if let Some(&slot) = self.slot_of_mtl.get(&(index, painted)) {
            return slot;
        }
        let slot = if materials::is_see_through(&self.read[index], report) {
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

/// The files that one `mtllib` names: the whole rest of the line where that is a file, else its words, in which
/// `\` before a space keeps a name together.
fn library_files(directory: &Path, statement: &str) -> Vec<(String, Option<PathBuf>)> {
    let whole = statement.trim_matches('"').to_owned();
    let found = textures::find_file(directory, &whole);
    if found.is_some() || !whole.contains(char::is_whitespace) {
        return vec![(whole, found)];
    }
    let glued = statement.replace("\\ ", "\u{0}");
    let names = glued.split_whitespace().map(|name| name.replace('\u{0}', " "));
    names.map(|name| (name.clone(), textures::find_file(directory, &name))).collect()
}
