//! Lamps of a scene file: point and spot lights whose intensity was measured.

use super::light::LightKind;
use super::photometry::{self, Hanging, Lamp};
use super::toml_walk::{At, Table};
use glam::Vec3;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Where a light shines that hangs as in most rooms.
pub(super) const DOWN: Vec3 = Vec3::NEG_Y;

/// Cosines of the half angles of a cone, if there is to be one; `None` where they have faults.
pub(super) type Cone = Option<Option<[f32; 2]>>;

/// A lamp, and its file.
pub(super) struct LampLight {
    pub kind: LightKind,
    pub file: PathBuf,
}

/// Reads a point light, or a spot light with its cone, of a unit axis (`None` where that has faults), whose `photometry` names a file relative to `directory`.
pub(super) fn read(
    t: &mut Table,
    directory: &Path,
    name: &At<String>,
    (axis, cone): (Option<Vec3>, Cone),
) -> Option<LampLight> {
    let position = t.position("position");
    let position = t.required("position", position);
    if let Some(intensity) = t.colour("intensity") {
        t.error(intensity.line, "intensity comes from the photometry: scale, flux and colour change it");
    }
    let hanging = read_hanging(t, axis.unwrap_or(DOWN), cone.unwrap_or(None));
    let file = directory.join(&name.value);
    let distribution = match photometry::read(&file) {
        Ok(distribution) => distribution,
        Err(why) => {
            t.error(name.line, format!("photometry: {why}"));
            return None;
        }
    };
    let (hanging, up) = hanging?;
    axis.zip(cone)?;
    let tilt = distribution.at_tilt((-up).angle_between(hanging.frame.z_axis).to_degrees());
    let Some(lamp) = Lamp::new(distribution, &Hanging { tilt, ..hanging }) else {
        t.error(name.line, format!("photometry: {}: nothing shines in any direction", file.display()));
        return None;
    };
    Some(LampLight { kind: LightKind::Lamp { position: position?.value, lamp: Arc::new(lamp) }, file })
}

/// How it hangs, and what is up.
fn read_hanging(t: &mut Table, axis: Vec3, cone: Option<[f32; 2]>) -> Option<(Hanging, Vec3)> {
    let turn = t.number_in("turn", "degrees from -360 to 360", |a| a.abs() <= 360.0);
    let scale = t.number_in("scale", "a factor above 0", |s| s > 0.0);
    let flux = t.number_in("flux", "lumen above 0", |f| f > 0.0);
    let colour = t.colour("colour");
    let up = t.vector("up").map_or(Vec3::Y, |at| at.value);
    let colour = match colour {
        Some(At { value, line }) if value == Vec3::ZERO => {
            t.error(line, "colour is black: give a colour, or leave the light out");
            return None;
        }
        colour => colour.map_or(Vec3::ONE, |at| at.value),
    };
    let up = up.normalize_or(Vec3::Y);
    let across = if up.x.abs() < 0.9 { Vec3::X } else { Vec3::Z };
    let frame = photometry::frame(axis, across, turn.map_or(0.0, |at| at.value));
    let scale = scale.map_or(1.0, |at| at.value);
    Some((Hanging { frame, colour, flux: flux.map(|at| at.value), scale, cone, tilt: 1.0 }, up))
}
