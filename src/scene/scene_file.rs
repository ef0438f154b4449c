//! The scene file: TOML that names geometry and places cameras and lights.

use super::camera::{Camera, NamedCamera};
use super::lamp_file::{self, LampLight};
use super::light::{Light, LightKind};
use super::report::Report;
use super::sky_file::{self, Sky};
use super::toml_walk::{At, Document, Table};
use super::up_axis::UpAxis;
use super::{Display, EmissionSide, ToneMapping};
use glam::{DVec3, Vec3};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Vertical field of view of a camera that gives none, degrees.
const DEFAULT_FOV: f32 = 45.0;

/// A geometry file of a scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct GeometryName {
    /// Where it is.
    pub path: PathBuf,
    /// The line of the scene file that names it; `None` for a bare file.
    pub line: Option<u32>,
    /// Whether it is glTF, and no OBJ.
    pub is_gltf: bool,
}

impl GeometryName {
    /// Says why it cannot be read; `main` is the file that the scene is loaded by.
    pub(super) fn refuse(&self, main: &Path, why: String, report: &mut Report) {
        match self.line {
            None => report.error(main, None, why),
            line => report.error(main, line, format!("{}: {why}", self.path.display())),
        }
    }
}

/// In what the lights of glTF files are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum LightUnits {
    /// Candela and lux, as the extension has it.
    #[default]
    Photometric,
    /// W·sr⁻¹ and W·m⁻².
    Radiometric,
}

/// What a scene file says.
#[derive(Debug, Default)]
pub(super) struct Description {
    /// OBJ and glTF files.
    pub files: Vec<GeometryName>,
    /// Which side of emissive triangles emits.
    pub emission_side: EmissionSide,
    /// In what the lights of glTF files are.
    pub light_units: LightUnits,
    /// Smoothing of files without normals, degrees.
    pub smooth_angle: Option<f32>,
    /// Cameras in order.
    pub cameras: Vec<NamedCamera>,
    /// Whether a camera was asked for, valid or not.
    pub has_camera: bool,
    /// Lights in order.
    pub lights: Vec<Light>,
    /// Whether a light was asked for, valid or not.
    pub has_light: bool,
    /// Pictures of environments.
    pub pictures: Vec<PathBuf>,
    /// Display settings.
    pub display: Display,
    /// Which way is up for a camera and a light that are missing.
    pub up: UpAxis,
}

/// Reads the scene file `file`, whose point `origin` becomes the origin; what is wrong is in the report, the rest has defaults.
pub(super) fn read(file: &Path, text: &str, origin: DVec3) -> (Description, Report) {
    let (mut document, root) = Document::parse(file, text, origin);
    let mut table = Table::root(&mut document, &root);
    let mut out = Description::default();
    let directory = file.parent().unwrap_or(Path::new(""));
    let geometry = table.tables("geometry", "[geometry]", |t| read_geometry(t, directory, &mut out));
    if geometry.is_empty() {
        table.error(1, "the scene has no geometry: add [geometry] with obj = [\"file.obj\"] or gltf = [\"file.glb\"]");
    }
    let cameras = table.tables("camera", "[[camera]]", read_camera);
    let lights = table.tables("light", "[[light]]", |t| read_light(t, directory));
    table.tables("display", "[display]", |t| read_display(t, &mut out.display));
    if let Some(second) = geometry.get(1) {
        table.error(second.line, "[geometry] stands twice: merge them");
    }
    out.has_camera = !cameras.is_empty();
    out.has_light = !lights.is_empty();
    out.cameras = name_all(&mut table, cameras, "camera", |name, camera| NamedCamera { name, camera });
    if let Some(line) = second_environment(&lights) {
        table.error(line, "there are two environments or skies: a scene has one, leave the other out");
    }
    let (mut suns, mut pictures) = (Vec::new(), Vec::new());
    out.lights = name_all(&mut table, lights, "light", |name, lit| {
        suns.extend(lit.sun);
        pictures.extend(lit.picture);
        Light { name, kind: lit.kind }
    });
    out.pictures = pictures;
    add_suns(&mut out.lights, suns);
    table.reject_unknown();
    (out, document.finish())
}

fn read_geometry(t: &mut Table, directory: &Path, out: &mut Description) {
    let mut named = false;
    for (key, is_gltf) in [("obj", false), ("gltf", true)] {
        let Some(files) = t.strings(key) else { continue };
        if files.is_empty() {
            t.error(t.line, format!("{key} is empty: name at least one file, or leave it out"));
        }
        let file = |at: At<String>| GeometryName { path: directory.join(at.value), line: Some(at.line), is_gltf };
        out.files.extend(files.into_iter().map(file));
        named = true;
    }
    if !named {
        t.error(t.line, "[geometry] lacks obj and gltf: name at least one file by one of them");
    }
    let sides = [("front", EmissionSide::Front), ("both", EmissionSide::Both)];
    out.emission_side = t.choice("emit", &sides).map_or(EmissionSide::Front, |at| at.value);
    let units = [("photometric", LightUnits::Photometric), ("radiometric", LightUnits::Radiometric)];
    out.light_units = t.choice("light_units", &units).map_or(LightUnits::Photometric, |at| at.value);
    let angle = t.number_in("smooth_angle", "degrees from 0 to 180", |a| (0.0..=180.0).contains(&a));
    out.smooth_angle = angle.map(|at| at.value);
}

/// Something of the scene file that may have a name.
struct Entry<T> {
    name: Option<At<String>>,
    /// `None` when it has faults.
    content: Option<T>,
}

/// Gives each entry its name, or `what` and its number, and rejects names that stand twice.
fn name_all<T, O>(
    t: &mut Table,
    entries: Vec<At<Entry<T>>>,
    what: &str,
    mut make: impl FnMut(String, T) -> O,
) -> Vec<O> {
    let mut lines: HashMap<String, u32> = HashMap::new();
    let mut out = Vec::new();
    for (number, At { value: Entry { name, content }, line }) in entries.into_iter().enumerate() {
        let name = name.unwrap_or_else(|| At { value: format!("{what} {}", number + 1), line });
        if let Some(first) = lines.insert(name.value.clone(), name.line) {
            t.error(name.line, format!("{what} {:?} stands already at line {first}: choose another name", name.value));
        }
        out.extend(content.map(|content| make(name.value, content)));
    }
    out
}

fn read_camera(t: &mut Table) -> Entry<Camera> {
    let name = t.string("name");
    let position = t.position("position");
    let position = t.required("position", position);
    let look_at = t.position("look_at");
    let look_at = t.required("look_at", look_at);
    let up = t.vector("up");
    let fov = t.number_in("vertical_fov", "degrees between 0 and 180", |fov| fov > 0.0 && fov < 180.0);
    let content = position.zip(look_at).map(|(position, look_at)| {
        let camera = Camera {
            position: position.value,
            look_at: look_at.value,
            up: up.map_or(Vec3::Y, |at| at.value),
            vertical_fov: fov.map_or(DEFAULT_FOV, |at| at.value),
        };
        if let Some(fault) = view_fault(&camera) {
            let line = up.filter(|_| fault.about_up).map_or(look_at.line, |at| at.line);
            t.error(line, fault.message);
        }
        camera
    });
    Entry { name, content }
}

struct ViewFault {
    about_up: bool,
    message: &'static str,
}

fn view_fault(camera: &Camera) -> Option<ViewFault> {
    let view = (camera.look_at - camera.position).as_dvec3().normalize_or_zero();
    let up = camera.up.as_dvec3().normalize_or_zero();
    let fault = |about_up, message| Some(ViewFault { about_up, message });
    if view == glam::DVec3::ZERO {
        fault(false, "look_at is the camera's position: look at another point")
    } else if up == glam::DVec3::ZERO {
        fault(true, "up is zero: give a direction")
    } else if view.cross(up).length() < 1e-6 {
        fault(true, "up is parallel to the view: give another direction")
    } else {
        None
    }
}

/// The kinds of light of a scene file.
#[derive(Clone, Copy)]
enum Kind {
    Point,
    Spot,
    Directional,
    Environment,
    Sky,
}

const KINDS: [(&str, Kind); 5] = [
    ("point", Kind::Point),
    ("spot", Kind::Spot),
    ("directional", Kind::Directional),
    ("environment", Kind::Environment),
    ("sky", Kind::Sky),
];

/// A light, and what comes with it.
struct Lit {
    kind: LightKind,
    /// The sun of a sky.
    sun: Option<LightKind>,
    /// File of a picture or of a lamp.
    picture: Option<PathBuf>,
}

impl From<LightKind> for Lit {
    fn from(kind: LightKind) -> Self {
        Self { kind, sun: None, picture: None }
    }
}

impl From<LampLight> for Lit {
    fn from(lamp: LampLight) -> Self {
        Self { kind: lamp.kind, sun: None, picture: Some(lamp.file) }
    }
}

impl From<Sky> for Lit {
    fn from(sky: Sky) -> Self {
        Self { kind: sky.environment, sun: sky.sun, picture: sky.file }
    }
}

/// A light; files are relative to `directory`.
fn read_light(t: &mut Table, directory: &Path) -> Entry<Lit> {
    let name = t.string("name");
    let kind = t.choice("kind", &KINDS);
    let content = match t.required("kind", kind).map(|at| at.value) {
        Some(Kind::Point) => read_point(t, directory),
        Some(Kind::Spot) => read_spot(t, directory),
        Some(Kind::Directional) => read_directional(t).map(Lit::from),
        Some(Kind::Environment) => sky_file::read_environment(t, directory).map(Lit::from),
        Some(Kind::Sky) => sky_file::read_sky(t).map(Lit::from),
        None => {
            t.accept_all();
            None
        }
    };
    Entry { name, content }
}

/// The line of an environment after the first, if there is one.
fn second_environment(lights: &[At<Entry<Lit>>]) -> Option<u32> {
    let is_environment = |at: &&At<Entry<Lit>>| {
        at.value.content.as_ref().is_some_and(|lit| matches!(lit.kind, LightKind::Environment(_)))
    };
    lights.iter().filter(is_environment).nth(1).map(|at| at.line)
}

/// Adds the suns of skies, under names that are free.
fn add_suns(lights: &mut Vec<Light>, suns: Vec<LightKind>) {
    for kind in suns {
        let mut name = "sun".to_owned();
        while lights.iter().any(|light| light.name == name) {
            name.push_str(" (sky)");
        }
        lights.push(Light { name, kind });
    }
}

fn read_point(t: &mut Table, directory: &Path) -> Option<Lit> {
    if let Some(photometry) = t.string("photometry") {
        let axis = if t.has("direction") { read_direction(t) } else { Some(lamp_file::DOWN) };
        return lamp_file::read(t, directory, &photometry, (axis, Some(None))).map(Lit::from);
    }
    let position = t.position("position");
    let position = t.required("position", position);
    let intensity = t.colour("intensity");
    let intensity = t.required("intensity", intensity);
    Some(LightKind::Point { position: position?.value, intensity: intensity?.value }.into())
}

fn read_spot(t: &mut Table, directory: &Path) -> Option<Lit> {
    if let Some(photometry) = t.string("photometry") {
        let direction = read_direction(t);
        let cone = if t.has("inner_angle") || t.has("outer_angle") { read_cone(t).map(Some) } else { Some(None) };
        return lamp_file::read(t, directory, &photometry, (direction, cone)).map(Lit::from);
    }
    let position = t.position("position");
    let position = t.required("position", position);
    let intensity = t.colour("intensity");
    let intensity = t.required("intensity", intensity);
    let direction = read_direction(t);
    let [cos_inner, cos_outer] = read_cone(t)?;
    let (direction, intensity) = (direction?, intensity?.value);
    Some(LightKind::Spot { position: position?.value, direction, intensity, cos_inner, cos_outer }.into())
}

/// Cosines of the half angles of a cone, inner and outer.
fn read_cone(t: &mut Table) -> Option<[f32; 2]> {
    let inner = t.number_in("inner_angle", "a half angle from 0 to 180 degrees", |a| (0.0..=180.0).contains(&a));
    let inner = t.required("inner_angle", inner);
    let outer = t.number_in("outer_angle", "a half angle from 0 to 180 degrees", |a| a > 0.0 && a <= 180.0);
    let outer = t.required("outer_angle", outer);
    let (inner, outer) = (inner?, outer?);
    if inner.value >= outer.value {
        let message = format!("inner_angle {} must be smaller than outer_angle {}", inner.value, outer.value);
        t.error(inner.line, message);
    }
    Some([inner, outer].map(|at| at.value.to_radians().cos()))
}

fn read_directional(t: &mut Table) -> Option<LightKind> {
    let direction = read_direction(t);
    let irradiance = t.colour("irradiance");
    let irradiance = t.required("irradiance", irradiance);
    Some(LightKind::Directional { direction: direction?, irradiance: irradiance?.value })
}

/// A unit direction.
fn read_direction(t: &mut Table) -> Option<Vec3> {
    let direction = t.vector("direction");
    let direction = t.required("direction", direction)?;
    let unit = direction.value.as_dvec3().normalize_or_zero().as_vec3();
    if unit == Vec3::ZERO {
        t.error(direction.line, "direction is zero: give a direction");
        return None;
    }
    Some(unit)
}

fn read_display(t: &mut Table, out: &mut Display) {
    if let Some(exposure) = t.number_in("exposure", "stops from -100 to 100", |e| e.abs() <= 100.0) {
        out.exposure = exposure.value;
    }
    if let Some(operator) = t.choice("tone_mapping", &ToneMapping::NAMES) {
        out.tone_mapping = operator.value;
    }
}
