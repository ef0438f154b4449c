//! Scene files and camera paths as TOML text.

use glam::DVec3;
use std::fmt::Write;

/// A light of the scene file.
pub struct Light {
    /// What it is called.
    pub name: String,
    /// What it is.
    pub kind: Kind,
}

/// The kinds of light; intensities in W·sr⁻¹, half angles in degrees, irradiance in W·m⁻².
#[derive(Clone, Copy)]
pub enum Kind {
    /// To all sides.
    Point { position: DVec3, intensity: DVec3 },
    /// In a cone, inner and outer half angle.
    Spot { position: DVec3, direction: DVec3, intensity: DVec3, angles: [f64; 2] },
    /// Parallel.
    Directional { direction: DVec3, irradiance: DVec3 },
}

/// As scene files have it.
fn rounded(v: DVec3) -> DVec3 {
    DVec3::from(v.to_array().map(|c| (c * 1e4).round() / 1e4 + 0.0))
}

fn vector(v: DVec3) -> String {
    let [x, y, z] = rounded(v).to_array();
    format!("[{x}, {y}, {z}]")
}

impl Light {
    /// Intensity in W·sr⁻¹.
    #[must_use]
    pub fn point(name: &str, position: DVec3, intensity: DVec3) -> Self {
        let kind = Kind::Point { position: rounded(position), intensity: rounded(intensity) };
        Self { name: name.to_owned(), kind }
    }

    /// Intensity on the axis in W·sr⁻¹; inner and outer half angle in degrees.
    #[must_use]
    pub fn spot(name: &str, position: DVec3, direction: DVec3, intensity: DVec3, angles: [f64; 2]) -> Self {
        let [position, direction, intensity] = [position, direction, intensity].map(rounded);
        Self { name: name.to_owned(), kind: Kind::Spot { position, direction, intensity, angles } }
    }

    /// Irradiance on a perpendicular plane in W·m⁻².
    #[must_use]
    pub fn directional(name: &str, direction: DVec3, irradiance: DVec3) -> Self {
        let kind = Kind::Directional { direction: rounded(direction), irradiance: rounded(irradiance) };
        Self { name: name.to_owned(), kind }
    }

    /// Its keys but the name.
    fn body(&self) -> String {
        match self.kind {
            Kind::Point { position, intensity } => {
                format!("kind = \"point\"\nposition = {}\nintensity = {}", vector(position), vector(intensity))
            }
            Kind::Spot { position, direction, intensity, angles: [inner, outer] } => format!(
                "kind = \"spot\"\nposition = {}\ndirection = {}\nintensity = {}\ninner_angle = {inner}\nouter_angle = {outer}",
                vector(position),
                vector(direction),
                vector(intensity)
            ),
            Kind::Directional { direction, irradiance } => {
                format!(
                    "kind = \"directional\"\ndirection = {}\nirradiance = {}",
                    vector(direction),
                    vector(irradiance)
                )
            }
        }
    }
}

/// A camera: name, position, point looked at, vertical field of view in degrees.
pub struct Camera(pub &'static str, pub DVec3, pub DVec3, pub f64);

/// A scene file.
pub struct SceneFile<'a> {
    /// Comment at the top, without `#`.
    pub title: &'a str,
    /// OBJ files.
    pub obj: &'a [&'a str],
    /// Cameras, the default first.
    pub cameras: &'a [Camera],
    /// Lights without geometry.
    pub lights: &'a [Light],
    /// Exposure in stops.
    pub exposure: f64,
}

impl SceneFile<'_> {
    /// The text of the file.
    #[must_use]
    pub fn text(&self) -> String {
        let mut out = String::new();
        for line in self.title.lines() {
            let _ = writeln!(out, "# {line}");
        }
        let names: Vec<String> = self.obj.iter().map(|n| format!("\"{n}\"")).collect();
        let _ = writeln!(out, "\n[geometry]\nobj = [{}]\nemit = \"front\"", names.join(", "));
        for Camera(name, position, look_at, fov) in self.cameras {
            let (p, l) = (vector(*position), vector(*look_at));
            let _ = writeln!(
                out,
                "\n[[camera]]\nname = \"{name}\"\nposition = {p}\nlook_at = {l}\nup = [0, 1, 0]\nvertical_fov = {fov}"
            );
        }
        for light in self.lights {
            let _ = writeln!(out, "\n[[light]]\nname = \"{}\"\n{}", light.name, light.body());
        }
        let _ = writeln!(out, "\n[display]\nexposure = {:?}\ntone_mapping = \"aces\"", self.exposure);
        out
    }
}

/// A camera path from (time in seconds, position, point looked at).
#[must_use]
pub fn path(title: &str, keys: &[(f64, DVec3, DVec3)]) -> String {
    let mut out = format!("# {title}\n");
    for (time, position, look_at) in keys {
        let (p, l) = (vector(*position), vector(*look_at));
        let _ = writeln!(out, "\n[[key]]\ntime = {time:?}\nposition = {p}\nlook_at = {l}");
    }
    out
}
