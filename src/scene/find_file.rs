//! Files by the names that other files give them: names of another machine, another system or another folder.

use super::text;
use percent_encoding::percent_decode_str;
use std::collections::HashMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use unicode_normalization::UnicodeNormalization;

/// Folders in which textures lie, beside the file that names them or beside its folder.
const TEXTURE_FOLDERS: [&str; 5] = ["textures", "texture", "tex", "maps", "images"];
/// Formats in which a texture may lie that is named in another.
const TEXTURE_EXTENSIONS: [&str; 7] = ["png", "jpg", "jpeg", "tga", "bmp", "hdr", "exr"];

/// Where a texture was found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Found {
    /// The file that is meant.
    Named(PathBuf),
    /// The same name with another extension.
    OtherFormat(PathBuf),
}

/// Looks files up; reads each folder once at most, and none but those that a name or [`TEXTURE_FOLDERS`] says.
#[derive(Default)]
pub(super) struct Finder {
    /// Entries of the folders read so far, by [`folded`] name.
    folders: HashMap<PathBuf, HashMap<String, OsString>>,
}

impl Finder {
    /// A file of any kind: as written, else in any case, else by the last components of its path, in `directory`.
    pub(super) fn file(&mut self, directory: &Path, name: &str) -> Option<PathBuf> {
        spellings(name).iter().find_map(|name| self.by_components(directory, name))
    }

    /// A texture that may have one of several names: like [`Self::file`], else in a folder of textures, else in another format.
    pub(super) fn texture(&mut self, directory: &Path, names: &[String]) -> Option<Found> {
        let spellings: Vec<String> = names.iter().flat_map(|name| spellings(name)).collect();
        let named = spellings.iter().find_map(|name| self.in_folders(directory, name));
        named.map(Found::Named).or_else(|| {
            let others = spellings.iter().flat_map(|name| other_formats(name));
            others.into_iter().find_map(|name| self.in_folders(directory, &name)).map(Found::OtherFormat)
        })
    }

    fn in_folders(&mut self, directory: &Path, name: &str) -> Option<PathBuf> {
        if let Some(found) = self.by_components(directory, name) {
            return Some(found);
        }
        let last = name.rsplit('/').next().unwrap_or(name);
        let folders =
            TEXTURE_FOLDERS.iter().flat_map(|folder| [format!("{folder}/{last}"), format!("../{folder}/{last}")]);
        folders.into_iter().find_map(|name| self.in_any_case(directory, &name))
    }

    /// The path as written, then fewer and fewer of its last components.
    fn by_components(&mut self, directory: &Path, name: &str) -> Option<PathBuf> {
        let direct = directory.join(name);
        if direct.is_file() {
            return Some(direct);
        }
        let starts = std::iter::once(0).chain(name.match_indices('/').map(|(at, _)| at + 1));
        starts.into_iter().find_map(|start| self.in_any_case(directory, &name[start..]))
    }

    /// A relative path, component by component.
    fn in_any_case(&mut self, directory: &Path, path: &str) -> Option<PathBuf> {
        let mut found = directory.to_owned();
        for part in path.split('/').filter(|part| !part.is_empty() && *part != ".") {
            let exact = found.join(part);
            found = if exact.exists() { exact } else { found.join(self.entries(&found).get(&folded(part))?) };
        }
        found.is_file().then_some(found)
    }

    fn entries(&mut self, folder: &Path) -> &HashMap<String, OsString> {
        self.folders.entry(folder.to_owned()).or_insert_with(|| {
            let listed = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
            let entries = std::fs::read_dir(listed).into_iter().flatten().flatten().map(|entry| entry.file_name());
            entries.map(|name| (folded(&text::decode(name.as_encoded_bytes())), name)).collect()
        })
    }
}

/// Equal for names that differ in case or in how accents are composed: macOS writes them apart, others together.
fn folded(name: &str) -> String {
    name.nfc().collect::<String>().to_lowercase()
}

/// The path that a name stands for, in the order in which they are tried: as written, without percent signs, without `file://`.
fn spellings(name: &str) -> Vec<String> {
    let slashed = name.replace('\\', "/");
    let decoded = |name: &str| percent_decode_str(name).decode_utf8().map(std::borrow::Cow::into_owned).ok();
    let mut out = vec![slashed.clone()];
    out.extend(decoded(&slashed));
    if slashed.get(..5).is_some_and(|scheme| scheme.eq_ignore_ascii_case("file:")) {
        let rest = &slashed[5..];
        // `file:///home/x` and `file:///C:/x`: the name of the host is empty.
        let path = rest.strip_prefix("//").unwrap_or(rest);
        out.extend(decoded(path));
    }
    out.dedup();
    out
}

/// The name with other extensions.
fn other_formats(name: &str) -> Vec<String> {
    let last = name.rfind('/').map_or(0, |at| at + 1);
    if last == name.len() {
        return Vec::new();
    }
    let stem = match name[last..].rfind('.') {
        Some(dot) if dot > 0 => &name[..last + dot],
        _ => name,
    };
    TEXTURE_EXTENSIONS.iter().map(|extension| format!("{stem}.{extension}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A folder `scene` with files in it and beside it.
    fn folder(files: &[&str]) -> tempfile::TempDir {
        let root = tempfile::tempdir().unwrap();
        std::fs::create_dir(root.path().join("scene")).unwrap();
        for file in files {
            let path = root.path().join("scene").join(file);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, "").unwrap();
        }
        root
    }

    /// What is found, from the folder `scene`.
    fn found(root: &tempfile::TempDir, name: &str) -> Option<(String, bool)> {
        let directory = root.path().join("scene");
        let found = Finder::default().texture(&directory, &[name.to_owned()])?;
        let (path, named) = match found {
            Found::Named(path) => (path, true),
            Found::OtherFormat(path) => (path, false),
        };
        let path = path.strip_prefix(&directory).unwrap().to_string_lossy().into_owned();
        Some((path, named))
    }

    #[test]
    fn names_of_other_machines_find_the_file() {
        let root = folder(&[
            "WALL.png",
            "Textures/wood.png",
            "wood oak.png",
            "100%_wool.png",
            "Caf\u{e9}.png",
            "../maps/stone.jpg",
        ]);
        for (name, path) in [
            ("wall.PNG", "WALL.png"),
            ("C:\\Users\\x\\textures\\wood.png", "Textures/wood.png"),
            ("/home/x/project/textures/WOOD.png", "Textures/wood.png"),
            ("D:\\x\\wood.png", "Textures/wood.png"),
            ("wood%20oak.png", "wood oak.png"),
            ("file:///C:/x/textures/wood.png", "Textures/wood.png"),
            ("file:///home/x/wood%20oak.png", "wood oak.png"),
            ("100%_wool.png", "100%_wool.png"),
            ("Cafe\u{301}.png", "Caf\u{e9}.png"),
            ("../elsewhere/wall.png", "WALL.png"),
            ("textures//wood.png", "Textures/wood.png"),
            ("stone.jpg", "../maps/stone.jpg"),
            ("./Textures/../wall.png", "Textures/../WALL.png"),
        ] {
            let expected = Path::new(path).components().collect::<PathBuf>();
            let (path, named) = found(&root, name).unwrap_or_else(|| panic!("{name}: not found"));
            assert_eq!((Path::new(&path).components().collect::<PathBuf>(), named), (expected, true), "{name}");
        }
    }

    #[test]
    fn another_format_is_the_last_resort() {
        let root = folder(&["a.jpg", "textures/b.png", "textures/a.tga", ".tga"]);
        assert_eq!(found(&root, "b.tga"), Some(("textures/b.png".into(), false)));
        assert_eq!(found(&root, "a.tga"), Some(("textures/a.tga".into(), true)));
        for missing in ["c.png", "", "/", "..", "textures", "x/", ".png"] {
            assert_eq!(found(&root, missing), None, "{missing:?}");
        }
    }

    #[test]
    fn of_several_names_the_first_that_exists_is_meant() {
        let root = folder(&["a.png", "a.png # b"]);
        let names = ["a.png # b".to_owned(), "a.png".to_owned()];
        let directory = root.path().join("scene");
        let find = |names: &[String]| Finder::default().texture(&directory, names);
        assert_eq!(find(&names), Some(Found::Named(directory.join("a.png # b"))));
        std::fs::remove_file(directory.join("a.png # b")).unwrap();
        assert_eq!(find(&names), Some(Found::Named(directory.join("a.png"))));
    }
}
