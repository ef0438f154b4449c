//! Punctual lights (`KHR_lights_punctual`).

use super::document::Document;
use super::faults::Faults;
use super::nodes::Placed;
use crate::scene::light::{Light, LightKind};
use crate::scene::photometry::EFFICACY;
use crate::scene::scene_file::LightUnits;
use ::gltf::json::extensions::scene::khr_lights_punctual::{self as khr, Type};
use ::gltf::json::validation::Checked;
use glam::{DVec3, Vec3};

/// Least radiance of a white surface in the middle of the scene that is taken for what was meant, W·sr⁻¹·m⁻².
const DIM: f32 = 1.0 / 128.0;

/// A light in the coordinates of the file.
#[derive(Clone, Debug)]
pub(super) struct Punctual {
    /// Its name, or `None`.
    name: Option<String>,
    position: DVec3,
    kind: LightKind,
}

impl Punctual {
    /// The light of a node, if it has one that can be used.
    pub(super) fn of(document: &Document, placed: &Placed, units: LightUnits, faults: &mut Faults) -> Option<Self> {
        let node = document.root.nodes.get(placed.node)?;
        let number = node.extensions.as_ref()?.khr_lights_punctual.as_ref()?.light.value();
        let lights = document.root.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref());
        let Some(light) = lights.and_then(|lights| lights.lights.get(number)) else {
            faults.error("lights", format!("node {}: there is no light {number}", placed.node));
            return None;
        };
        let named = [&light.name, &node.name].into_iter().flatten().find(|name| !name.is_empty());
        match kind(light, placed, units) {
            Ok(kind) => {
                if light.range.is_some() {
                    faults.once("ranges", "lights have ranges, which are not used: they light everything");
                }
                Some(Self { name: named.cloned(), position: placed.frame.translation, kind })
            }
            Err(why) => {
                faults.error("lights", format!("light {number}: {why}"));
                None
            }
        }
    }

    /// The light with `origin` as the origin, called by its `number` where it has no name.
    pub(super) fn light(&self, origin: DVec3, number: usize) -> Light {
        let mut kind = self.kind.clone();
        kind.move_to((self.position - origin).as_vec3());
        Light { name: self.name.clone().unwrap_or_else(|| format!("light {number}")), kind }
    }
}

/// What is to be said of lights that leave a scene with that middle dark: many writers give watts in the place of lumens.
pub(in crate::scene) fn are_dim(lights: &[Light], middle: Vec3) -> Option<String> {
    let irradiance = |light: &Light| match &light.kind {
        LightKind::Directional { irradiance, .. } => irradiance.max_element(),
        LightKind::Lamp { position, lamp } => lamp.peak().max_element() / position.distance_squared(middle),
        LightKind::Point { position, intensity } | LightKind::Spot { position, intensity, .. } => {
            intensity.max_element() / position.distance_squared(middle)
        }
        LightKind::Area { .. } | LightKind::Environment(_) | LightKind::Sun { .. } => f32::INFINITY,
    };
    let radiance = lights.iter().map(irradiance).sum::<f32>() / std::f32::consts::PI;
    (!lights.is_empty() && radiance < DIM).then(|| {
        format!(
            "its lights, in candela and lux, leave the scene dark: white is lit to {radiance:.1e} in the middle. Where watts are \
             meant, as some programs write, say light_units = \"radiometric\" in [geometry] of a scene file; else --exposure helps"
        )
    })
}

fn kind(light: &khr::Light, placed: &Placed, units: LightUnits) -> Result<LightKind, String> {
    let per_watt = if units == LightUnits::Photometric { EFFICACY } else { 1.0 };
    let power = Vec3::from(light.color) * light.intensity / per_watt;
    if !power.is_finite() || power.min_element() < 0.0 {
        return Err("its colour or intensity is negative or no number".into());
    }
    let position = placed.frame.translation.as_vec3();
    if !position.is_finite() {
        return Err("its place is not made of finite numbers".into());
    }
    let direction = (placed.frame.matrix3 * DVec3::NEG_Z).normalize_or_zero().as_vec3();
    if direction == Vec3::ZERO && light.type_ != Checked::Valid(Type::Point) {
        return Err("its node is scaled to nothing: it has no direction".into());
    }
    match light.type_ {
        Checked::Valid(Type::Point) => Ok(LightKind::Point { position, intensity: power }),
        Checked::Valid(Type::Directional) => Ok(LightKind::Directional { direction, irradiance: power }),
        Checked::Valid(Type::Spot) => {
            let spot = light.spot.as_ref().ok_or("it is a spot light without the key spot")?;
            let (inner, outer) = (spot.inner_cone_angle, spot.outer_cone_angle);
            if !(0.0..=std::f32::consts::PI).contains(&outer) || !(0.0..outer).contains(&inner) {
                return Err(format!(
                    "its cone has angles of {inner} and {outer} rad: the inner one must be 0 or more, and less"
                ));
            }
            Ok(LightKind::Spot {
                position,
                direction,
                intensity: power,
                cos_inner: inner.cos(),
                cos_outer: outer.cos(),
            })
        }
        Checked::Invalid => Err("its type is none of directional, point and spot".into()),
    }
}
