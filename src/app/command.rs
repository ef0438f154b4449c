//! Everything that can be done, as values: what keys, mouse, panels and scripts ask for alike.

use super::views::View;
use super::words::quoted;
use crate::pass::UpdateMode;
use crate::scene::ToneMapping;
use glam::{DVec3, Vec2, Vec3};
use std::fmt;
use std::path::{Path, PathBuf};

/// Something to be done. Angles are in degrees, places of the image in shares of its width and height from the top left.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    /// Fly on at this velocity, in multiples of the speed: right, up, forward.
    Fly(Vec3),
    /// Multiply the speed.
    Speed(f32),
    /// Turn the view to the right and down.
    Look([f32; 2]),
    /// Choose the point seen at a place of the image to orbit, pan and dolly about.
    Pivot(Vec2),
    /// Turn the scene about the pivot, to the right and down.
    Orbit([f32; 2]),
    /// Shift the scene to the right and down, so that the pivot moves by these shares of the image's height.
    Pan([f32; 2]),
    /// Multiply the distance from the pivot.
    Dolly(f32),
    /// Look at the point seen at a place of the image.
    Centre(Vec2),
    /// Step back until all of the scene is in view.
    FrameAll,
    /// Take one of the scene's cameras, or the one that the user left.
    Go(String),
    /// Place the camera, in coordinates of the scene's files.
    Place {
        /// Eye position.
        position: DVec3,
        /// Point looked at.
        look_at: DVec3,
    },
    /// Record a camera path.
    RecordCamera(PathBuf),
    /// Record what is done, as a script.
    RecordSession(PathBuf),
    /// Write what was recorded.
    RecordStop,
    /// Switch a light.
    ToggleLight(String),
    /// Set a light's power, as a factor on that of the scene.
    DimLight(String, f32),
    /// Set a light's colour, as factors on that of the scene.
    ColourLight(String, [f32; 3]),
    /// Put a point or spot light somewhere, in coordinates of the scene's files.
    MoveLight(String, DVec3),
    /// Show a debug view, of a light if it names one.
    View(&'static View, Option<String>),
    /// Show the next debug view.
    NextView,
    /// Show the path-traced reference in place of the picture, or the picture again.
    Reference(bool),
    /// Set how changed lighting is redrawn.
    Update(UpdateMode),
    /// Set the exposure, stops.
    Exposure(f32),
    /// Change the exposure, stops.
    Expose(f32),
    /// Set the tone-mapping operator.
    ToneMapping(ToneMapping),
    /// Take the next tone-mapping operator.
    NextToneMapping,
    /// Load the scene again.
    Reload,
    /// Write what the window shows.
    Screenshot(Option<PathBuf>),
    /// Write the picture without what lies over it.
    Picture(Option<PathBuf>),
    /// Explain the pixel at a place of the image; the one that is explained no more.
    Explain(Vec2),
    /// Write what is said of the pixel that is explained.
    SaveExplanation(PathBuf),
    /// Show or hide the panel.
    ToggleHud,
    /// Open or close the list of lights.
    ToggleLights,
    /// Show or hide the help.
    ToggleHelp,
    /// Close what is open.
    Back,
    /// End.
    Quit,
}

impl Command {
    /// Its name, and its arguments as they are written.
    #[must_use]
    pub fn words(&self) -> (&'static str, Vec<String>) {
        let numbers = |values: &[f32]| -> Vec<String> { values.iter().map(ToString::to_string).collect() };
        let path = |path: &Path| path.to_string_lossy().into_owned();
        let optional = |place: &Option<PathBuf>| place.iter().map(|place| path(place)).collect();
        match self {
            Self::Fly(velocity) => ("camera.fly", numbers(&velocity.to_array())),
            Self::Speed(factor) => ("camera.speed", numbers(&[*factor])),
            Self::Look(angles) => ("camera.look", numbers(angles)),
            Self::Pivot(at) => ("camera.pivot", numbers(&at.to_array())),
            Self::Orbit(angles) => ("camera.orbit", numbers(angles)),
            Self::Pan(shift) => ("camera.pan", numbers(shift)),
            Self::Dolly(factor) => ("camera.dolly", numbers(&[*factor])),
            Self::Centre(at) => ("camera.centre", numbers(&at.to_array())),
            Self::FrameAll => ("camera.frame-all", vec![]),
            Self::Go(name) => ("camera.go", vec![name.clone()]),
            Self::Place { position, look_at } => {
                let all = position.to_array().into_iter().chain(look_at.to_array());
                ("camera.place", all.map(|value| value.to_string()).collect())
            }
            Self::RecordCamera(to) => ("camera.record", vec![path(to)]),
            Self::RecordSession(to) => ("session.record", vec![path(to)]),
            Self::RecordStop => ("record.stop", vec![]),
            Self::ToggleLight(name) => ("light.toggle", vec![name.clone()]),
            Self::DimLight(name, factor) => ("light.dim", vec![name.clone(), factor.to_string()]),
            Self::ColourLight(name, factors) => {
                ("light.colour", std::iter::once(name.clone()).chain(numbers(factors)).collect())
            }
            Self::MoveLight(name, to) => {
                let to = to.to_array().map(|value| value.to_string());
                ("light.move", std::iter::once(name.clone()).chain(to).collect())
            }
            Self::View(view, light) => {
                ("view.set", std::iter::once(view.name.to_owned()).chain(light.clone()).collect())
            }
            Self::NextView => ("view.next", vec![]),
            Self::Reference(shown) => ("reference.show", vec![if *shown { "on" } else { "off" }.to_owned()]),
            Self::Update(mode) => ("update.set", vec![mode.name().to_owned()]),
            Self::Exposure(stops) => ("exposure.set", numbers(&[*stops])),
            Self::Expose(stops) => ("exposure.add", numbers(&[*stops])),
            Self::ToneMapping(operator) => ("tone-mapping.set", vec![operator_name(*operator).to_owned()]),
            Self::NextToneMapping => ("tone-mapping.next", vec![]),
            Self::Reload => ("scene.reload", vec![]),
            Self::Screenshot(to) => ("window.screenshot", optional(to)),
            Self::Picture(to) => ("window.picture", optional(to)),
            Self::Explain(at) => ("pixel.explain", numbers(&at.to_array())),
            Self::SaveExplanation(to) => ("pixel.save", vec![path(to)]),
            Self::ToggleHud => ("hud.toggle", vec![]),
            Self::ToggleLights => ("hud.lights", vec![]),
            Self::ToggleHelp => ("help.toggle", vec![]),
            Self::Back => ("app.back", vec![]),
            Self::Quit => ("app.quit", vec![]),
        }
    }
}

impl fmt::Display for Command {
    /// As a script has it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (name, arguments) = self.words();
        f.write_str(name)?;
        arguments.iter().try_for_each(|word| write!(f, " {}", quoted(word)))
    }
}

/// The name of a tone-mapping operator.
#[must_use]
pub fn operator_name(operator: ToneMapping) -> &'static str {
    ToneMapping::NAMES.iter().find(|(_, known)| *known == operator).map_or("", |(name, _)| name)
}

/// What a mistyped name was meant to be.
#[must_use]
pub fn nearest<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    const ALIKE: f64 = 0.75;
    let likeness = |known: &'a str| (strsim::jaro_winkler(name, known), known);
    let best = known.map(likeness).max_by(|a, b| a.0.total_cmp(&b.0))?;
    (best.0 >= ALIKE).then_some(best.1)
}
