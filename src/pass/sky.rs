//! What shows where no geometry is: the picture of an environment, and the sun before it.

use super::shared::NONE;
use crate::scene::Scene;
use crate::scene::environment::Environment;
use crate::scene::light::{LightKind, LightState};
use glam::Vec3;
use std::sync::Arc;

/// The sky of a scene.
#[derive(Clone, Default)]
pub(super) struct Sky {
    /// The environment with its index among the lights, and the texture entry of its picture.
    environment: Option<(Arc<Environment>, usize, u32)>,
    /// The sun with its index.
    sun: Option<(Sun, usize)>,
    /// What both count times now, by channel.
    factors: [Vec3; 2],
    /// Most of a channel of the picture that images have to hold, W·sr⁻¹·m⁻².
    peak: f32,
}

#[derive(Clone, Copy)]
struct Sun {
    direction: Vec3,
    half_angle: f32,
    radiance: Vec3,
}

/// Largest value against the mean that counts for the range of images: what is brighter, the sun in a picture, may be cut off.
const BRIGHTEST: f32 = 1e6;

/// What shaders read of it.
pub(super) struct GpuSky {
    pub entry: u32,
    pub factor: [f32; 3],
    pub axes: [[f32; 3]; 3],
    pub sun_direction: [f32; 3],
    pub sun_reach: f32,
    pub sun_radiance: [f32; 3],
}

impl Sky {
    /// That of a scene; `entry` is the texture entry of its picture.
    pub(super) fn new(scene: &Scene, entry: Option<u32>) -> Self {
        let mut sky = Self { factors: [Vec3::ONE; 2], ..Self::default() };
        for (light, at) in scene.lights.iter().zip(0..) {
            match &light.kind {
                LightKind::Environment(environment) if sky.environment.is_none() => {
                    sky.environment = entry.map(|entry| (Arc::clone(environment), at, entry));
                    sky.peak = environment.picture.shown().peak().min(environment.mean_luminance() * BRIGHTEST);
                }
                &LightKind::Sun { direction, half_angle, radiance } if sky.sun.is_none() => {
                    sky.sun = Some((Sun { direction, half_angle, radiance }, at));
                }
                _ => {}
            }
        }
        sky
    }

    /// Takes over the states of lights, in the order of the scene's.
    pub(super) fn relight(&mut self, lights: &[LightState]) {
        let factor = |at: Option<usize>| at.and_then(|at| lights.get(at)).map_or(Vec3::ONE, |state| state.factor);
        let of_environment = self.environment.as_ref().map(|(_, at, _)| *at);
        self.factors = [factor(of_environment), factor(self.sun.map(|(_, at)| at))];
    }

    /// Most of a channel that images have to hold, W·sr⁻¹·m⁻².
    pub(super) fn peak(&self) -> f32 {
        self.peak * self.factors[0].max_element()
    }

    /// As shaders read it, radiance times `scale`.
    pub(super) fn on_device(&self, scale: f32) -> GpuSky {
        let axes = |environment: &Environment| environment.axes.to_cols_array_2d();
        let entry = self.environment.as_ref().map_or(NONE, |(.., entry)| *entry);
        let axes = self.environment.as_ref().map_or([[0.0; 3]; 3], |(environment, ..)| axes(environment));
        let none = Sun { direction: Vec3::Y, half_angle: 0.0, radiance: Vec3::ZERO };
        let sun = self.sun.map_or(none, |(sun, _)| sun);
        GpuSky {
            entry,
            factor: (self.factors[0] * scale).to_array(),
            axes,
            sun_direction: sun.direction.to_array(),
            sun_reach: 2.0 * (sun.half_angle * 0.5).sin(),
            sun_radiance: (sun.radiance * self.factors[1] * scale).min(Vec3::splat(f32::MAX)).to_array(),
        }
    }
}
