//! Which pictures a run makes: one of a camera that stands still, or those along a camera path.

use super::args::RenderArgs;
use crate::error::{Error, Result};
use crate::scene::Scene;
use crate::scene::camera::Camera;
use crate::scene::camera_path::{CameraPath, load_camera_path};
use crate::scene::horizon::Horizon;
use clap_lex::OsStrExt as _;
use glam::Vec3;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

/// Pictures a second of a path's time where their number is not given.
const RATE: f32 = 24.0;
/// More pictures (an hour of them) are made only where their number is given.
const MOST_PICTURES: f32 = 86_400.0;

/// The pictures of a run.
pub struct Pictures {
    camera: Camera,
    path: Option<(CameraPath, Horizon)>,
    count: u64,
}

/// One picture.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Its number, from 0.
    pub index: u64,
    /// How many there are.
    pub of: u64,
    /// Where it is taken from.
    pub camera: Camera,
    /// What each of the scene's lights counts times; empty if all are as loaded.
    pub factors: Vec<Vec3>,
}

impl Picture {
    /// Which one it is, for the image's attributes: nothing if there is only one.
    #[must_use]
    pub fn label(&self) -> String {
        if self.of > 1 { format!(" (picture {} of {})", self.index + 1, self.of) } else { String::new() }
    }

    /// Which one it is, for what is said of it: nothing if there is only one.
    #[must_use]
    pub fn prefix(&self) -> String {
        if self.of > 1 { format!("picture {} of {}: ", self.index + 1, self.of) } else { String::new() }
    }
}

impl Pictures {
    /// Those that the options ask for, starting from the scene's camera.
    ///
    /// # Errors
    /// What is wrong with the camera path, with its lines.
    pub fn new(args: &RenderArgs, scene: &Scene, camera: Camera) -> Result<Self> {
        let Some(file) = &args.camera_path else { return Ok(Self { camera, path: None, count: 1 }) };
        let path = load_camera_path(file, scene.origin)?;
        path.check_lights(file, &scene.lights)?;
        let horizon = Horizon::of(&path, camera.up, file)?;
        let count = match args.budget.frames {
            Some(count) => count,
            None => default_count(file, path.duration())?,
        };
        Ok(Self { camera, path: Some((path, horizon)), count })
    }

    /// How many there are.
    #[must_use]
    pub const fn count(&self) -> u64 {
        self.count
    }

    /// A picture by its number from 0: those of a path are spread evenly from its start to its end.
    #[must_use]
    pub fn picture(&self, index: u64, scene: &Scene) -> Picture {
        let of = self.count;
        let Some((path, horizon)) = &self.path else {
            return Picture { index, of, camera: self.camera, factors: Vec::new() };
        };
        let time = (f64::from(path.duration()) * index as f64 / (of - 1).max(1) as f64) as f32;
        let factors = path.factors_at(time, &scene.lights);
        let camera = horizon.hold(time, path.camera_at(time, &self.camera));
        Picture { index, of, camera, factors }
    }

    /// Where a picture is written that was asked for as `path`.
    #[must_use]
    pub fn file(&self, path: &Path, picture: &Picture) -> PathBuf {
        if self.path.is_some() { numbered(path, picture.index + 1) } else { path.to_owned() }
    }
}

/// As many as are shown at [`RATE`].
fn default_count(file: &Path, duration: f32) -> Result<u64> {
    let count = (duration * RATE).round() + 1.0;
    if count <= MOST_PICTURES {
        return Ok(count as u64);
    }
    let file = file.display();
    Err(Error::Usage(format!("{file}: the path lasts {duration} s; say how many pictures to make with --frames")))
}

/// A path with a number: in place of the last run of `#` in its file name, with as many digits at least, or else of four
/// digits after an underscore before the extension.
#[must_use]
pub fn numbered(path: &Path, number: u64) -> PathBuf {
    const DIGITS: usize = 4;
    let name = path.file_name().unwrap_or_default();
    let mut parts: Vec<&OsStr> = name.split("#").collect();
    let after = parts.pop().unwrap_or_default();
    if parts.is_empty() {
        let mut named = path.file_stem().unwrap_or_default().to_owned();
        named.push(format!("_{number:0DIGITS$}."));
        named.push(path.extension().unwrap_or_default());
        return path.with_file_name(named);
    }
    // The last run leaves nothing between its signs.
    let run = parts.iter().rev().take_while(|part| part.is_empty()).count().min(parts.len() - 1);
    let digits = run + 1;
    let mut named = parts[..parts.len() - run].join(OsStr::new("#"));
    named.push(format!("{number:0digits$}"));
    named.push(after);
    path.with_file_name(named)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_go_where_the_name_asks_for_them() {
        let text = |path: &str, number| numbered(Path::new(path), number).to_string_lossy().into_owned();
        assert_eq!(text("a/walk.png", 7), "a/walk_0007.png");
        assert_eq!(text("walk_##.exr", 7), "walk_07.exr");
        assert_eq!(text("##_#b.png", 123), "##_123b.png");
        assert_eq!(text("dir##/w#.png", 12), "dir##/w12.png");
        assert_eq!(text("a.b.png", 12345), "a.b_12345.png");
        assert_eq!(text("###.png", 7), "007.png");
    }

    #[cfg(unix)]
    #[test]
    fn numbered_names_keep_their_bytes() {
        use std::os::unix::ffi::OsStrExt as _;
        let named = |name: &[u8]| numbered(Path::new(OsStr::from_bytes(name)), 7).as_os_str().as_bytes().to_vec();
        assert_eq!(named(b"\xe9.png"), b"\xe9_0007.png");
        assert_eq!(named(b"\xe9##\xff.png"), b"\xe907\xff.png");
    }
}
