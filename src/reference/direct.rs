//! Light straight from the sources, found by sampling them.

use super::random::Random;
use super::settings::{Settings, Strategy, Transport};
use super::surface::{Bounce, Surface};
use crate::geom::Ray;
use crate::light::context::SceneContext;
use crate::light::selection::{LightChoice, SampledLight};
use crate::math::luminance;
use glam::Vec3;

/// Lights of which each point of a path takes all; above, it draws some by their bounds.
const SAMPLE_ALL: usize = 4;
/// How many, where the eye sees it and beyond. Against one each the library's error at equal time is halved; the hall's and Sponza's
/// are as they were.
const DRAWN: [u32; 2] = [4, 2];

/// A shadow ray to be traced.
pub struct Shadow {
    pub ray: Ray,
    /// Index of the sample.
    pub sample: usize,
    /// What arrives at the eye if nothing lies on the ray, W·sr⁻¹·m⁻².
    pub light: Vec3,
}

/// A point of a path whose direct light is wanted.
#[derive(Clone, Copy)]
pub struct Lit<'a> {
    pub surface: &'a Surface,
    /// Index of the sample.
    pub sample: usize,
    /// What of the light there reaches the eye, a number.
    pub throughput: Vec3,
    /// Bounces before.
    pub bounces: u32,
}

/// Samples the lights at points of paths.
pub struct DirectLight<'a> {
    context: &'a SceneContext<'a>,
    settings: Settings,
    /// The choice of a light where it was last asked for.
    choice: LightChoice,
    /// Shadow rays that are still to be traced.
    pub shadows: Vec<Shadow>,
}

impl<'a> DirectLight<'a> {
    /// Nothing sampled yet.
    pub fn new(context: &'a SceneContext<'a>, settings: Settings) -> Self {
        Self { context, settings, choice: LightChoice::default(), shadows: Vec::new() }
    }

    /// Samples the direct light reflected at a point of a path: `point` chooses that of the first light. Returns what
    /// [`Self::expected`] refers to.
    pub fn sample(&mut self, lit: Lit<'_>, random: &Random, point: [f32; 2]) -> f32 {
        let (context, settings, Lit { surface, .. }) = (self.context, self.settings, lit);
        let mut add = |light: usize, expected: f32, k: u32| {
            let point = if k == 0 { point } else { random.other_light(k) };
            let found = light_of(context, settings, surface, (light, expected), point);
            let shadow = |(ray, light)| Shadow { ray, sample: lit.sample, light: lit.throughput * light / expected };
            self.shadows.extend(found.map(shadow));
        };
        let count = context.lights.sources.len();
        if count <= SAMPLE_ALL {
            (0..count).zip(0..).for_each(|(light, k)| add(light, 1.0, k));
            return 0.0;
        }
        self.choice.prepare(context.lights, surface.origin, surface.normal);
        let drawn = if lit.bounces == 0 { DRAWN[0] } else { DRAWN[1] };
        for k in 0..drawn {
            // Evenly spread, so that strong lights get their shares.
            let pick = (random.pick() + k as f32) / drawn as f32;
            if let Some(SampledLight { light, inverse_chance }) = self.choice.draw(context.lights, pick) {
                add(light, drawn as f32 / inverse_chance, k);
            }
        }
        self.choice.total() / drawn as f32
    }

    /// How many samples of a light [`Self::sample`] takes at a surface on average, where it returned `bounds`.
    fn expected(&self, surface: &Surface, bounds: f32, light: usize) -> f32 {
        let lights = self.context.lights;
        let at = (surface.origin, surface.normal);
        if lights.sources.len() <= SAMPLE_ALL { 1.0 } else { LightChoice::chance_of(lights, at, bounds, light) }
    }

    /// What a bounce that hits nothing meets, W·sr⁻¹·m⁻², as far as sampling the lights at the surface, which returned `bounds`, leaves it.
    pub fn beyond(&self, surface: &Surface, bounds: f32, bounce: &Bounce) -> Vec3 {
        let (lights, direction) = (self.context.lights, bounce.ray.direction);
        let of_light = |light: usize| {
            let radiance = lights.sources[light].radiance_at_infinity(direction) * lights.factor(light);
            if radiance == Vec3::ZERO {
                return Vec3::ZERO;
            }
            radiance * self.share_of_found(surface, bounds, Some(light), direction, bounce.density)
        };
        lights.at_infinity().map(of_light).sum()
    }

    /// What counts of light `light` that a direction drawn with `density` has found `offset` from the surface, or in that unit direction:
    /// the rest is left to [`Self::sample`], which returned `bounds`.
    pub fn share_of_found(
        &self,
        surface: &Surface,
        bounds: f32,
        light: Option<usize>,
        offset: Vec3,
        density: f32,
    ) -> f32 {
        let Some(light) = light else { return 1.0 };
        match self.settings.strategy {
            Strategy::Lights => 0.0,
            Strategy::Both => {
                let source = &self.context.lights.sources[light];
                let of_point = source.density_for((surface.origin, surface.normal), offset);
                share(density, self.expected(surface, bounds, light) * of_point)
            }
            Strategy::Reflection => 1.0,
        }
    }
}

/// One sample of one light, of as many as are expected: a shadow ray, and what is reflected if nothing lies on it,
/// W·sr⁻¹·m⁻².
fn light_of(
    context: &SceneContext<'_>,
    settings: Settings,
    surface: &Surface,
    (light, expected): (usize, f32),
    point: [f32; 2],
) -> Option<(Ray, Vec3)> {
    let both = settings.transport != Transport::Direct;
    let source = &context.lights.sources[light];
    if both && settings.strategy == Strategy::Reflection && !source.is_delta() {
        return None;
    }
    let arrival = source.sample_for(context.scene, (surface.origin, surface.normal), point)?;
    let response = surface.response(arrival.direction);
    let value = surface.reflect(response) * arrival.facing * context.lights.factor(light);
    let weighed = arrival.measure > 0.0 && both && settings.strategy == Strategy::Both;
    let share = if weighed { share(expected / arrival.measure, surface.density(response)) } else { 1.0 };
    (luminance(value) > 0.0).then(|| (surface.ray_to(&arrival), value * share))
}

/// Weight of a sample drawn with density `own` that could have been drawn with density `other` too: the power heuristic of
/// exponent 2 [VG95].
fn share(own: f32, other: f32) -> f32 {
    let ratio = other / own;
    1.0 / (1.0 + ratio * ratio)
}
