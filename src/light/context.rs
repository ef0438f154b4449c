//! What estimators read: the scene, its bounding volume hierarchy, its lights; immutable while jobs are traced.

use super::arrival::Arrival;
use super::group_points::Points;
use super::lights::Lights;
use crate::geom::bvh::Bvh;
use crate::geom::{Ray, offset};
use crate::math::{combine, hemisphere::Density, sequence::Sequence};
use crate::scene::Scene;
use glam::Vec3;

/// A place where light is sampled.
#[derive(Clone, Copy, Debug)]
pub struct ShadingPoint {
    /// Permanent name, which seeds the random numbers.
    pub key: u64,
    /// Position on the surface, scene units, where light is evaluated.
    pub position: Vec3,
    /// Where rays start, scene units: a little off the surface ([`offset`]).
    pub origin: Vec3,
    /// Unit normal of the surface.
    pub normal: Vec3,
}

impl ShadingPoint {
    /// The ray that must be free for the light of `arrival` to be seen: it starts at the nudged origin and aims at the same
    /// point of the light as from the position itself.
    #[must_use]
    pub fn ray_to(&self, arrival: &Arrival) -> Ray {
        let origin = self.origin;
        if arrival.distance.is_infinite() {
            return Ray { origin, direction: arrival.direction, t_max: f32::INFINITY };
        }
        let to_light = self.position + arrival.direction * arrival.distance - origin;
        let length = to_light.length();
        Ray { origin, direction: to_light / length, t_max: length * offset::SHORT_OF_LIGHT }
    }
}

/// What estimators read of a scene.
#[derive(Clone, Copy)]
pub struct SceneContext<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Its bounding volume hierarchy.
    pub bvh: &'a Bvh,
    /// Its lights.
    pub lights: &'a Lights,
    /// The run's seed.
    pub seed: u64,
    /// Length of the contact test's ray, scene units.
    pub contact: f32,
}

/// Probes of a dark vertex, all of which must hit back faces.
const PROBES: u32 = 8;

impl<'a> SceneContext<'a> {
    /// The context of a scene; `scale` is the scene's, [`Scene::scale`].
    #[must_use]
    pub const fn new(scene: &'a Scene, bvh: &'a Bvh, lights: &'a Lights, seed: u64, scale: f32) -> Self {
        Self { scene, bvh, lights, seed, contact: scale * offset::CONTACT }
    }

    /// The points of a light group as seen from a vertex.
    #[must_use]
    pub fn points(&self, shading_point: &ShadingPoint, group: usize) -> Points<'a> {
        let name = self.lights.sources_of_group(group)[0];
        let ShadingPoint { position, normal, .. } = *shading_point;
        self.lights.group(group).points((position, normal), self.sequence(shading_point, name))
    }

    /// The random sequence of a vertex and a light: from their permanent names, never from a thread or a clock.
    #[must_use]
    pub fn sequence(&self, shading_point: &ShadingPoint, light: u32) -> Sequence {
        Sequence::new(combine(combine(self.seed, shading_point.key), u64::from(light)))
    }

    /// Whether the light of `arrival`, seen from the vertex, is unoccluded.
    #[must_use]
    pub fn visible(&self, shading_point: &ShadingPoint, arrival: &Arrival) -> bool {
        !self.bvh.occluded(self.scene, &shading_point.ray_to(arrival))
    }

    /// Whether the vertex is covered by other geometry, so that its light is not its surface's: something lies on it
    /// (a short ray along the normal), or, if `probe`, everything that it sees is the inside of something.
    ///
    /// The probes do without the component being closed, which blocks without a bottom are not: curtains and leaves never
    /// show their backs in all directions. Where a whole room is wound the wrong way round all its vertices count as
    /// covered, and interpolation among them is as it would be without.
    #[must_use]
    pub fn is_covered(&self, shading_point: &ShadingPoint, probe: bool, rays: &mut u64) -> bool {
        *rays += 1;
        let contact = Ray { origin: shading_point.origin, direction: shading_point.normal, t_max: self.contact };
        if self.bvh.occluded(self.scene, &contact) {
            return true;
        }
        probe
            && (0..PROBES).all(|i| {
                *rays += 1;
                let ray = Ray { direction: self.probe_direction(shading_point, i), t_max: f32::INFINITY, ..contact };
                self.bvh.closest(self.scene, &ray).is_some_and(|hit| hit.back)
            })
    }

    /// Directions spread over the hemisphere by cosine.
    fn probe_direction(&self, shading_point: &ShadingPoint, index: u32) -> Vec3 {
        let [u, v, ..] = self.sequence(shading_point, u32::MAX).point(index);
        Density::Cosine.direction(shading_point.normal, [u, v])
    }
}
