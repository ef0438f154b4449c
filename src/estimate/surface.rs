//! A point that a gather ray has hit, as light leaves it: diffusely (method 2).

use crate::geom::{Hit, Ray};
use crate::light::context::SceneContext;
use crate::light::lights::{Arrival, Source, delta_arrival};
use crate::light::selection::{Drawn, LightChoice};
use crate::math::luminance;
use crate::scene::Scene;
use glam::Vec3;

/// A diffuse surface point.
#[derive(Clone, Copy, Debug)]
pub struct DiffusePoint {
    /// Where light is evaluated and rays start: a little off the facet, on the side that was hit. On the facet itself the
    /// back of a lamp may come to lie in front of it.
    pub origin: Vec3,
    /// Unit normal of the facet on that side.
    pub facet: Vec3,
    /// Unit shading normal on that side.
    pub normal: Vec3,
    /// Reflectance: what would go into the highlight is reflected diffusely, too, so that no energy is lost.
    pub kd: Vec3,
}

impl DiffusePoint {
    /// The point that `ray` has hit.
    #[must_use]
    pub fn new(scene: &Scene, ray: &Ray, hit: &Hit) -> Self {
        let position = hit.position(scene, ray);
        let facet = scene.geometric_normal(hit.triangle) * if hit.back { -1.0 } else { 1.0 };
        let scale = position.abs().max_element().max(hit.t * ray.direction.length());
        Self {
            origin: position + facet * (scale * LIFT),
            facet,
            normal: scene.shading_normal_at(hit.triangle, hit.u, hit.v, hit.back),
            kd: scene.kd_at(hit.triangle, hit.u, hit.v) + scene.material(hit.triangle).highlight_albedo(),
        }
    }

    /// Irradiance from one light, drawn in proportion to the bound of what it can send here, by one shadow ray: an unbiased
    /// estimate of that from all lights. `sample` is uniform in the unit cube: the choice, and the point of the light.
    pub fn direct(&self, context: &SceneContext<'_>, [pick, u, v]: [f32; 3], rays: &mut u64) -> Vec3 {
        let mut choice = LightChoice::default();
        choice.prepare(context.lights, self.origin, self.normal);
        let Some(Drawn { light, inverse_chance }) = choice.draw(context.lights, pick) else { return Vec3::ZERO };
        let arrival = match &context.lights.sources[light] {
            Source::Delta(kind) => delta_arrival(kind, self.origin),
            Source::Area(area) => area.sample_for(context.scene, (self.origin, self.normal), [u, v]),
        };
        let Some(arrival) = arrival else { return Vec3::ZERO };
        let value = arrival.facing * context.lights.factor(light) * self.normal.dot(arrival.direction).max(0.0);
        if luminance(value) <= 0.0 || arrival.direction.dot(self.facet) <= 0.0 {
            return Vec3::ZERO;
        }
        *rays += 1;
        if context.bvh.occluded(context.scene, &self.shadow_ray(&arrival)) {
            return Vec3::ZERO;
        }
        value * inverse_chance
    }

    fn shadow_ray(&self, arrival: &Arrival) -> Ray {
        Ray { origin: self.origin, direction: arrival.direction, t_max: arrival.distance * SHORT_OF_LIGHT }
    }
}

/// Step off the surface against the size of the numbers involved: well above the rounding of f32.
const LIFT: f32 = 4e-6;
/// Length of shadow rays against the distance of the light.
const SHORT_OF_LIGHT: f32 = 1.0 - 1e-4;
