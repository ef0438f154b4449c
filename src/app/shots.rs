//! Pictures that are to be written.

use super::screen::Screen;
use crate::error::Result;
use crate::image::{FileFormat, png};
use crate::session::Session;
use std::path::{Path, PathBuf};

/// A picture to be written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Shot {
    /// Where to.
    pub path: PathBuf,
    /// Whether with what lies over it, where the format has no layers.
    pub with_panels: bool,
}

/// Those that wait for the next frame.
pub struct Shots {
    waiting: Vec<Shot>,
    /// What those without a name are called, but for number and extension.
    name: PathBuf,
}

impl Shots {
    /// None yet.
    pub(super) const fn new(name: PathBuf) -> Self {
        Self { waiting: Vec::new(), name }
    }

    /// Asks for a picture; without a path, for one of each format, under the first number that is free.
    pub(super) fn ask(&mut self, path: Option<&Path>, with_panels: bool) {
        let paths = path.map_or_else(|| self.free(), |path| vec![path.to_owned()]);
        self.waiting.extend(paths.into_iter().map(|path| Shot { path, with_panels }));
    }

    fn free(&self) -> Vec<PathBuf> {
        let numbered = |number: u32| {
            ["png", "exr"].map(|extension| {
                let mut name = self.name.as_os_str().to_owned();
                name.push(format!("-{number:03}.{extension}"));
                PathBuf::from(name)
            })
        };
        let is_free = |paths: &[PathBuf; 2]| {
            paths.iter().all(|path| !path.exists() && self.waiting.iter().all(|shot| shot.path != *path))
        };
        (1..).map(numbered).find(is_free).map(Vec::from).unwrap_or_default()
    }

    pub(super) fn take(&mut self) -> Vec<Shot> {
        std::mem::take(&mut self.waiting)
    }
}

impl Shot {
    /// Writes it: what the screen shows last, or the session's picture; a warning where values could not be held.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`] naming the file; the device is lost.
    pub fn write(&self, screen: &mut Screen, session: &mut Session) -> Result<Option<String>> {
        if self.with_panels && FileFormat::of(&self.path) == Some(FileFormat::Png) {
            let pixels: Vec<u8> = screen.read()?.iter().flat_map(|[r, g, b, _]| [*r, *g, *b]).collect();
            return png::write_bytes(&self.path, session.size(), &pixels).map(|()| None);
        }
        session.still()?.write(&self.path, "penombre view")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_that_are_taken_are_passed_over() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("box-001.exr"), "").unwrap();
        let mut shots = Shots::new(folder.path().join("box"));
        shots.ask(None, true);
        shots.ask(Some(Path::new("a.exr")), false);
        shots.ask(None, false);
        let names: Vec<String> = shots
            .take()
            .iter()
            .map(|shot| format!("{} {}", shot.path.file_name().unwrap().to_string_lossy(), shot.with_panels))
            .collect();
        let expected =
            ["box-002.png true", "box-002.exr true", "a.exr false", "box-003.png false", "box-003.exr false"];
        assert_eq!(names, expected);
        assert_eq!(shots.take(), []);
    }
}
