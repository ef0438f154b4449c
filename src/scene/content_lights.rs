//! Hashes of lights: of where they are, and of what they emit.

use super::environment::Environment;
use super::light::{Light, LightKind};
use super::{EmissionSide, Scene, TriangleId};
use crate::math::content_hash::{ContentHash, of_hashes};
use serde::{Deserialize, Serialize};

/// A named part of a scene with the hash of its content.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Part {
    /// The name in the scene's files.
    pub name: String,
    /// Of all of it.
    pub hash: u64,
    /// Of what its visibility depends on: for a light of a single direction, where it is, without what it emits. The same as `hash` for
    /// everything else.
    pub place: u64,
}

/// What surfaces of a scene emit.
pub(super) struct Emissions<'a> {
    pub(super) scene: &'a Scene,
    /// A hash for each material.
    pub(super) materials: Vec<u64>,
}

/// A light as a part of a scene. What one of a single direction emits is kept apart from where it is; of others samples are kept, in which
/// both are mixed.
pub(super) fn of_light(light: &Light, emissions: &Emissions<'_>) -> Part {
    let mut power = ContentHash::new("power");
    let place = match &light.kind {
        LightKind::Point { position, intensity } => {
            power.points(&[*intensity]);
            let mut place = ContentHash::new("point");
            place.points(&[*position]);
            place
        }
        LightKind::Spot { position, direction, intensity, cos_inner, cos_outer } => {
            power.points(&[*intensity]);
            let mut place = ContentHash::new("spot");
            place.points(&[*position, *direction]);
            place.floats(&[*cos_inner, *cos_outer]);
            place
        }
        LightKind::Lamp { position, lamp } => {
            let mut place = ContentHash::new("lamp");
            place.points(&[*position]);
            lamp.add_to(&mut place, &mut power);
            place
        }
        LightKind::Directional { direction, irradiance } => {
            power.points(&[*irradiance]);
            let mut place = ContentHash::new("directional");
            place.points(&[*direction]);
            place
        }
        LightKind::Environment(environment) => of_environment(environment),
        LightKind::Sun { direction, half_angle, radiance } => {
            let mut place = ContentHash::new("sun");
            place.points(&[*direction, *radiance]);
            place.floats(&[*half_angle]);
            place
        }
        LightKind::Area { triangles } => of_area(triangles, emissions),
    };
    let place = place.finish();
    Part { name: light.name.clone(), hash: of_hashes("light", &[place, power.finish()]), place }
}

fn of_environment(Environment { picture, axes }: &Environment) -> ContentHash {
    let mut hash = ContentHash::new("environment");
    hash.frame(axes);
    hash.indices(&picture.size());
    hash.points(picture.texels());
    hash
}

fn of_area(triangles: &[TriangleId], emissions: &Emissions<'_>) -> ContentHash {
    let scene = emissions.scene;
    let mut hash = ContentHash::new("area");
    hash.number(match scene.emission_side {
        EmissionSide::Front => 0,
        EmissionSide::Both => 1,
    });
    for &TriangleId(triangle) in triangles {
        let material = scene.triangle_materials[triangle as usize].0 as usize;
        hash.numbers(&[triangle.into(), emissions.materials[material]]);
        if scene.materials[material].map_ke.is_some() {
            hash.flat_points(&scene.uvs[triangle as usize]);
        }
    }
    hash
}
