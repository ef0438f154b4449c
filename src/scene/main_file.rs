//! The file that a scene is loaded by.

use super::input::{self, Kind};
use super::report::Report;
use super::scene_file::{self, Description, GeometryName};
use super::up_axis::UpAxis;
use crate::error::{Error, Result};
use glam::DVec3;
use std::path::Path;

/// The main file.
#[derive(Debug)]
pub(super) enum Main {
    /// A scene file's text.
    SceneFile(String),
    /// A bare OBJ, and which of its axes points up.
    Obj(UpAxis),
    /// A bare glTF.
    Gltf,
}

/// Finds out what `path` is.
///
/// # Errors
/// [`Error::Io`] when it cannot be read; [`Error::Input`] when it is no scene; [`Error::Usage`] where `up` is not for it.
pub(super) fn open(path: &Path, up: Option<UpAxis>) -> Result<Main> {
    let refuse = |why: String| {
        let mut report = Report::default();
        report.error(path, None, why);
        Error::Input(report)
    };
    let data = std::fs::metadata(path).map_err(|e| Error::io(path, "cannot read", e))?;
    if data.is_dir() {
        return Err(refuse("is a directory: name a scene file, an OBJ or a glTF in it".into()));
    }
    match input::kind(path).map_err(refuse)? {
        Kind::SceneFile if up.is_some() => {
            let file = path.display();
            Err(Error::Usage(format!("--up is for a bare OBJ: in {file}, up = [x, y, z] of a [[camera]] says it")))
        }
        Kind::SceneFile => {
            let bytes = input::read_scene_file(path).map_err(refuse)?;
            let text = String::from_utf8(bytes).map_err(|_| refuse("is not UTF-8, which TOML has to be".into()))?;
            Ok(Main::SceneFile(text))
        }
        Kind::Gltf if up.is_some() => {
            let file = path.display();
            Err(Error::Usage(format!("--up is for a bare OBJ: in glTF files as {file} y is up")))
        }
        kind @ (Kind::Obj | Kind::Gltf) => {
            // Opening a pipe would wait for its writer; reading refuses it.
            if data.is_file() {
                std::fs::File::open(path).map_err(|e| Error::io(path, "cannot read", e))?;
            }
            Ok(if kind == Kind::Gltf { Main::Gltf } else { Main::Obj(up.unwrap_or_default()) })
        }
    }
}

impl Main {
    /// What is to be loaded, with `origin` as the origin. A bare OBJ or glTF is a scene of one file.
    pub(super) fn describe(&self, path: &Path, origin: DVec3) -> (Description, Report) {
        match self {
            Self::SceneFile(text) => scene_file::read(path, text, origin),
            Self::Obj(up) => {
                (Description { files: vec![bare(path, false)], up: *up, ..Description::default() }, Report::default())
            }
            Self::Gltf => (Description { files: vec![bare(path, true)], ..Description::default() }, Report::default()),
        }
    }
}

fn bare(path: &Path, is_gltf: bool) -> GeometryName {
    GeometryName { path: path.to_owned(), line: None, is_gltf }
}
