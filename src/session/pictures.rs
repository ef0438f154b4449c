//! Which pictures a run makes: one of a camera that stands still, or those along a camera path.

use crate::error::{Error, Result};
use crate::scene::Scene;
use crate::scene::camera::Camera;
use crate::scene::camera_path::{CameraPath, load_camera_path};
use crate::scene::horizon::Horizon;
use crate::scene::light::LightState;
use std::path::Path;

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
    /// The scene's lights as they are made to be; empty if all are as loaded.
    pub lights: Vec<LightState>,
    /// Whether it is one of a camera path, even the only one: it then has a share of the budget.
    pub on_path: bool,
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
    /// One of a camera, or those along the path of a file that starts from it: `count` of them, or as many a second as films have.
    ///
    /// # Errors
    /// [`Error::Input`] or [`Error::Usage`]: what is wrong with the camera path, with its lines.
    pub fn new(scene: &Scene, camera: Camera, path: Option<&Path>, count: Option<u64>) -> Result<Self> {
        let Some(file) = path else { return Ok(Self { camera, path: None, count: 1 }) };
        let path = load_camera_path(file, scene.origin)?;
        path.check_lights(file, &scene.lights)?;
        let horizon = Horizon::of(&path, camera.up, file)?;
        let count = match count {
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
            return Picture { index, of, camera: self.camera, lights: Vec::new(), on_path: false };
        };
        let time = (f64::from(path.duration()) * index as f64 / (of - 1).max(1) as f64) as f32;
        let lights = path.lights_at(time, &scene.lights);
        let camera = horizon.hold(time, path.camera_at(time, &self.camera));
        Picture { index, of, camera, lights, on_path: true }
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
