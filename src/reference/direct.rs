//! Light straight from the sources, found by sampling them.

use super::path::{Random, Tracer};
use super::surface::Surface;
use super::{Strategy, Transport};
use crate::math::luminance;
use crate::scene::TriangleId;
use crate::shade::lights::{Source, delta_arrival};
use glam::Vec3;

/// Lights of which each sample takes all; above, it draws one by its bound.
const SAMPLE_ALL: usize = 4;

impl Tracer<'_> {
    /// One sample of the direct light reflected at a surface, of the first light or the one picked at `point` of it; what
    /// [`Self::chance`] refers to from then on.
    pub(super) fn direct(&mut self, surface: &Surface, random: &Random, point: [f32; 2]) -> Vec3 {
        let world = self.world;
        let sources = &world.lights.sources;
        if sources.len() <= SAMPLE_ALL {
            let point_of = |light: usize| if light == 0 { point } else { random.other_light(light as u32) };
            return (0..sources.len()).map(|light| self.light_of(surface, light, point_of(light))).sum();
        }
        self.choice.prepare(world.lights, surface.origin, surface.normal);
        let drawn = self.choice.draw(world.lights, random.pick());
        drawn.map_or(Vec3::ZERO, |drawn| self.light_of(surface, drawn.light, point) * drawn.inverse_chance)
    }

    /// Probability with which [`Self::direct`] took the light at the surface it was last asked for.
    fn chance(&self, light: usize) -> f32 {
        let lights = self.world.lights;
        if lights.sources.len() <= SAMPLE_ALL { 1.0 } else { self.choice.chance(lights, light) }
    }

    /// One sample of one light.
    fn light_of(&mut self, surface: &Surface, light: usize, point: [f32; 2]) -> Vec3 {
        let world = self.world;
        let both = self.settings.transport != Transport::Direct;
        let arrival = match &world.lights.sources[light] {
            Source::Delta(kind) => delta_arrival(kind, surface.origin),
            Source::Area(_) if both && self.settings.strategy == Strategy::Reflection => None,
            Source::Area(area) => area.sample_for(world.scene, (surface.origin, surface.normal), point),
        };
        let Some(arrival) = arrival else { return Vec3::ZERO };
        let response = surface.response(arrival.direction);
        let value = surface.reflect(response) * arrival.facing;
        if luminance(value) <= 0.0 || self.occluded(&surface.ray_to(&arrival)) {
            return Vec3::ZERO;
        }
        if arrival.measure > 0.0 && both && self.settings.strategy == Strategy::Both {
            return value * share(self.chance(light) / arrival.measure, surface.density(response));
        }
        value
    }

    /// What counts of the light of `triangle` that a direction drawn with `density` hit `offset` from the surface: the rest
    /// is left to [`Self::direct`].
    pub(super) fn share_of_hit(&self, surface: &Surface, triangle: TriangleId, offset: Vec3, density: f32) -> f32 {
        let lights = self.world.lights;
        let Some(light) = lights.of_triangle(triangle) else { return 1.0 };
        match (self.settings.strategy, &lights.sources[light]) {
            (Strategy::Lights, _) => 0.0,
            (Strategy::Both, Source::Area(area)) => {
                share(density, self.chance(light) * area.density_for((surface.origin, surface.normal), offset))
            }
            _ => 1.0,
        }
    }
}

/// Weight of a sample drawn with density `own` that could have been drawn with density `other` too: the power heuristic of
/// exponent 2 [VG95].
fn share(own: f32, other: f32) -> f32 {
    let ratio = other / own;
    1.0 / (1.0 + ratio * ratio)
}
