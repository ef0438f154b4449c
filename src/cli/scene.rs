//! Loading a scene for a command: warnings said once, the camera and display that the options ask for.

use super::args::{SceneArgs, VerbosityArgs};
use super::output;
use crate::error::{Error, Result};
use crate::scene::Scene;
use crate::scene::camera::{Camera, View};
use crate::scene::geometry::Geometry;
use crate::scene::load::{Loaded, load_beside};
use crate::scene::up_axis::UpAxis;
use std::path::Path;

/// Warnings printed at most without `-v`.
const MAX_WARNINGS: usize = 20;

/// Loads the scene and prints the loader's warnings: with `-v` each, else what is alike in one line, and not too many.
///
/// # Errors
/// As [`load_beside`]: every fault of the input is listed.
pub fn load_and_warn(args: &SceneArgs, verbosity: VerbosityArgs) -> Result<Loaded> {
    load_and_warn_beside(args, verbosity, |_| {})
}

/// As [`load_and_warn`]; `on_geometry` hears of the triangles as soon as they are known ([`load_beside`]).
///
/// # Errors
/// As [`load_and_warn`].
pub fn load_and_warn_beside(
    args: &SceneArgs,
    verbosity: VerbosityArgs,
    on_geometry: impl FnOnce(&Geometry) + Send,
) -> Result<Loaded> {
    load_path(&args.path, args.up, verbosity, on_geometry)
}

/// As [`load_and_warn`], for commands without a view.
///
/// # Errors
/// As [`load_and_warn`].
pub fn load_bare(path: &Path, up: Option<UpAxis>, verbosity: VerbosityArgs) -> Result<Loaded> {
    load_path(path, up, verbosity, |_| {})
}

fn load_path(
    path: &Path,
    up: Option<UpAxis>,
    verbosity: VerbosityArgs,
    on_geometry: impl FnOnce(&Geometry) + Send,
) -> Result<Loaded> {
    let loaded = load_beside(path, up, on_geometry)?;
    if verbosity.verbose {
        loaded.report.faults.iter().for_each(|fault| output::report(&fault.to_string()));
        return Ok(loaded);
    }
    let lines = loaded.report.collapsed();
    lines.iter().take(MAX_WARNINGS).for_each(|line| output::report(line));
    if lines.len() > MAX_WARNINGS {
        output::report(&format!("... and {} warnings more; -v lists all", lines.len() - MAX_WARNINGS));
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
    scene.view(camera, args.size)
}
