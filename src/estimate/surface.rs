//! A point that a gather ray has hit, as light leaves it: diffusely, since a highlight depends on where it is seen from
//! (docs/method/indirect-light.md).

use crate::bsdf::Reflectance;
use crate::geom::{Hit, Ray, offset};
use crate::light::arrival::Arrival;
use crate::light::context::SceneContext;
use crate::light::selection::{LightChoice, SampledLight};
use crate::math::luminance;
use crate::scene::Scene;
use crate::scene::footprint::Footprint;
use glam::Vec3;

/// A diffuse surface point.
#[derive(Clone, Copy, Debug)]
pub struct DiffusePoint {
    /// Where light is evaluated and rays start, scene units: a little off the facet, on the side that was hit. On the
    /// facet itself the back of a lamp may come to lie in front of it.
    pub origin: Vec3,
    /// Unit normal of the facet on that side.
    pub facet: Vec3,
    /// Unit shading normal on that side.
    pub normal: Vec3,
    /// Diffuse reflectance, without unit: what would go into the highlight is reflected diffusely, too, so that no
    /// energy is lost.
    pub kd: Vec3,
}

impl DiffusePoint {
    /// The point that `ray` has hit.
    #[must_use]
    pub fn new(scene: &Scene, ray: &Ray, hit: &Hit) -> Self {
        let (position, facet) = (hit.position(ray), hit.facet());
        let scale = offset::scale_of_hit(position, hit.t * ray.direction.length());
        Self {
            origin: offset::origin(position, facet, scale, offset::HIT),
            facet,
            normal: scene.shading_normal_at(hit.triangle, hit.u, hit.v, hit.back),
            kd: Reflectance::at(scene, hit.triangle, [hit.u, hit.v], &Footprint::POINT).albedo(),
        }
    }

    /// Irradiance, W·m⁻², from one light, drawn in proportion to the bound of what it can send here, by one shadow ray:
    /// an unbiased estimate of that from all lights. `sample` is uniform in the unit cube: the choice, and the point of
    /// the light.
    pub fn direct(&self, context: &SceneContext<'_>, [pick, u, v]: [f32; 3], rays: &mut u64) -> Vec3 {
        let mut choice = LightChoice::default();
        choice.prepare(context.lights, self.origin, self.normal);
        let Some(SampledLight { light, inverse_chance }) = choice.draw(context.lights, pick) else { return Vec3::ZERO };
        let source = &context.lights.sources[light];
        let arrival = source.sample_for(context.scene, (self.origin, self.normal), [u, v]);
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
        Ray { origin: self.origin, direction: arrival.direction, t_max: arrival.distance * offset::SHORT_OF_LIGHT }
    }
}
