//! Light straight from the sources, found by sampling them.

use super::path::Tracer;
use super::random::Random;
use super::surface::Surface;
use super::{Settings, Strategy, Transport};
use crate::geom::Ray;
use crate::math::luminance;
use crate::scene::TriangleId;
use crate::shade::light_choice::{Drawn, LightChoice};
use crate::shade::lights::{Source, delta_arrival};
use crate::shade::world::World;
use glam::Vec3;

/// Lights of which each sample takes all; above, it draws one by its bound.
const SAMPLE_ALL: usize = 4;

/// A shadow ray to be traced.
pub struct Shadow {
    pub ray: Ray,
    /// Index of the sample.
    pub sample: usize,
    /// What arrives at the eye if nothing lies on the ray.
    pub light: Vec3,
}

impl Tracer<'_> {
    /// Samples the direct light reflected at a surface, the first light or the one picked at `point` of it, for a sample to which
    /// that comes times its throughput. Returns what [`Self::chance`] refers to.
    pub(super) fn direct(
        &mut self,
        surface: &Surface,
        (sample, throughput): (usize, Vec3),
        random: &Random,
        point: [f32; 2],
    ) -> f32 {
        let lights = self.world.lights;
        let mut add = |ray_and_light: Option<(Ray, Vec3)>, inverse_chance: f32| {
            let shadow = |(ray, light)| Shadow { ray, sample, light: throughput * light * inverse_chance };
            self.shadows.extend(ray_and_light.map(shadow));
        };
        let (world, settings) = (self.world, self.settings);
        if lights.sources.len() <= SAMPLE_ALL {
            for light in 0..lights.sources.len() {
                let point = if light == 0 { point } else { random.other_light(light as u32) };
                add(light_of(world, settings, surface, (light, 1.0), point), 1.0);
            }
            return 0.0;
        }
        self.choice.prepare(lights, surface.origin, surface.normal);
        if let Some(Drawn { light, inverse_chance }) = self.choice.draw(lights, random.pick()) {
            add(light_of(world, settings, surface, (light, inverse_chance.recip()), point), inverse_chance);
        }
        self.choice.total()
    }

    /// Probability with which [`Self::direct`] took the light at a surface, for which it returned `bounds`.
    fn chance(&self, surface: &Surface, bounds: f32, light: usize) -> f32 {
        let lights = self.world.lights;
        let at = (surface.origin, surface.normal);
        if lights.sources.len() <= SAMPLE_ALL { 1.0 } else { LightChoice::chance_of(lights, at, bounds, light) }
    }

    /// What counts of the light of `triangle` that a direction drawn with `density` hit `offset` from the surface: the rest
    /// is left to [`Self::direct`], which returned `bounds`.
    pub(super) fn share_of_hit(
        &self,
        surface: &Surface,
        bounds: f32,
        triangle: TriangleId,
        offset: Vec3,
        density: f32,
    ) -> f32 {
        let lights = self.world.lights;
        let Some(light) = lights.of_triangle(triangle) else { return 1.0 };
        match (self.settings.strategy, &lights.sources[light]) {
            (Strategy::Lights, _) => 0.0,
            (Strategy::Both, Source::Area(area)) => {
                let of_point = area.density_for((surface.origin, surface.normal), offset);
                share(density, self.chance(surface, bounds, light) * of_point)
            }
            _ => 1.0,
        }
    }
}

/// One sample of one light, taken with some chance: a shadow ray, and what is reflected if nothing lies on it.
fn light_of(
    world: &World<'_>,
    settings: Settings,
    surface: &Surface,
    (light, chance): (usize, f32),
    point: [f32; 2],
) -> Option<(Ray, Vec3)> {
    let both = settings.transport != Transport::Direct;
    let arrival = match &world.lights.sources[light] {
        Source::Delta(kind) => delta_arrival(kind, surface.origin)?,
        Source::Area(_) if both && settings.strategy == Strategy::Reflection => return None,
        Source::Area(area) => area.sample_for(world.scene, (surface.origin, surface.normal), point)?,
    };
    let response = surface.response(arrival.direction);
    let value = surface.reflect(response) * arrival.facing;
    let weighed = arrival.measure > 0.0 && both && settings.strategy == Strategy::Both;
    let share = if weighed { share(chance / arrival.measure, surface.density(response)) } else { 1.0 };
    (luminance(value) > 0.0).then(|| (surface.ray_to(&arrival), value * share))
}

/// Weight of a sample drawn with density `own` that could have been drawn with density `other` too: the power heuristic of
/// exponent 2 [VG95].
fn share(own: f32, other: f32) -> f32 {
    let ratio = other / own;
    1.0 / (1.0 + ratio * ratio)
}
