//! Lights that have a single direction at each place: point, spot and directional lights. One shadow ray tells all of
//! their visibility there, and no ray finds them by chance.

use super::arrival::Arrival;
use super::bounds::LightBounds;
use crate::math::luminance;
use crate::scene::Scene;
use crate::scene::light::{LightKind, spot_falloff};
use glam::Vec3;
use std::f32::consts::{PI, TAU};

/// Light of a point, spot or directional source at `x`; `None` where it sends none.
pub(super) fn arrival(kind: &LightKind, x: Vec3) -> Option<Arrival> {
    let from_point = |position: Vec3, intensity: Vec3| {
        let offset = position - x;
        let squared = offset.length_squared();
        (squared > 0.0).then(|| {
            let distance = squared.sqrt();
            Arrival::single(offset / distance, distance, intensity / squared)
        })
    };
    match *kind {
        LightKind::Point { position, intensity } => from_point(position, intensity),
        LightKind::Lamp { position, ref lamp } => {
            let arrival = from_point(position, Vec3::ONE)?;
            let intensity = lamp.intensity(-arrival.direction);
            let facing = arrival.facing * intensity;
            (facing != Vec3::ZERO).then(|| Arrival::single(arrival.direction, arrival.distance, facing))
        }
        LightKind::Spot { position, direction, intensity, cos_inner, cos_outer } => {
            let arrival = from_point(position, intensity)?;
            let falloff = spot_falloff(-arrival.direction.dot(direction), cos_inner, cos_outer);
            (falloff > 0.0).then(|| Arrival::single(arrival.direction, arrival.distance, arrival.facing * falloff))
        }
        LightKind::Directional { direction, irradiance } => {
            Some(Arrival::single(-direction, f32::INFINITY, irradiance))
        }
        LightKind::Environment(_) | LightKind::Sun { .. } | LightKind::Area { .. } => None,
    }
}

/// Luminance of the unoccluded irradiance at `x` on a surface of unit `normal`, W·m⁻².
pub(super) fn strength(kind: &LightKind, x: Vec3, normal: Vec3) -> f32 {
    // Half of many lights are behind the surface, which is found without a root.
    if kind.position().is_some_and(|position| (position - x).dot(normal) <= 0.0) {
        return 0.0;
    }
    arrival(kind, x).map_or(0.0, |a| luminance(a.facing) * a.direction.dot(normal).max(0.0))
}

/// Bounds of what it sends; `None` for light from infinity.
pub(super) fn bounds(kind: &LightKind) -> Option<LightBounds> {
    match *kind {
        LightKind::Point { position, intensity } => Some(LightBounds::of_point(position, luminance(intensity))),
        LightKind::Lamp { position, ref lamp } => Some(LightBounds::of_point(position, luminance(lamp.peak()))),
        LightKind::Spot { position, direction, intensity, cos_inner, cos_outer } => {
            Some(LightBounds::of_spot(position, direction, luminance(intensity), [cos_inner, cos_outer]))
        }
        LightKind::Directional { .. } | LightKind::Environment(_) | LightKind::Sun { .. } | LightKind::Area { .. } => {
            None
        }
    }
}

/// Radiant flux in all directions, W; roughly, for a spot, and of a directional light what falls on the scene's disc.
pub(super) fn power(kind: &LightKind, scene: &Scene) -> Vec3 {
    match kind {
        LightKind::Point { intensity, .. } => *intensity * (2.0 * TAU),
        LightKind::Lamp { lamp, .. } => lamp.power(),
        LightKind::Spot { intensity, cos_inner, cos_outer, .. } => {
            *intensity * (TAU * (1.0 - (cos_inner + cos_outer) * 0.5))
        }
        LightKind::Directional { irradiance, .. } => *irradiance * (PI / 4.0 * scene.diagonal().powi(2)),
        LightKind::Environment(_) | LightKind::Sun { .. } | LightKind::Area { .. } => Vec3::ZERO,
    }
}
