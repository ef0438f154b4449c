//! Loading a scene for a command: warnings said once, the camera and display that the options ask for.

use super::args::SceneArgs;
use super::output;
use crate::error::{Error, Result};
use crate::scene::Scene;
use crate::scene::camera::{Camera, View};
use crate::scene::load::{Loaded, load};

/// Loads the scene and prints the loader's warnings.
///
/// # Errors
/// As [`load`]: every fault of the input is listed.
pub fn load_and_warn(args: &SceneArgs) -> Result<Loaded> {
    let loaded = load(&args.path)?;
    for fault in &loaded.report.faults {
        output::report(&fault.to_string());
    }
    Ok(loaded)
}

/// The camera that `--camera` names, or the scene's first.
///
/// # Errors
/// [`Error::Usage`] listing the cameras there are.
pub fn camera(scene: &Scene, name: Option<&str>) -> Result<Camera> {
    let found = match name {
        Some(name) => scene.cameras.iter().find(|c| c.name == name),
        None => scene.cameras.first(),
    };
    found.map(|c| c.camera).ok_or_else(|| {
        let names: Vec<&str> = scene.cameras.iter().map(|c| c.name.as_str()).collect();
        Error::Usage(format!("--camera {}: the scene has {}", name.unwrap_or_default(), names.join(", ")))
    })
}

/// The view of a scene through one of its cameras.
#[must_use]
pub fn view(scene: &Scene, camera: &Camera, args: &SceneArgs) -> View {
    View::new(camera, args.size, scene.diagonal())
}
