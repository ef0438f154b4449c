//! What estimators read: the scene, its hierarchy, its lights; immutable while jobs are traced.

use crate::cache::vertex::Vertex;
use crate::geom::Ray;
use crate::geom::bvh::Bvh;
use crate::math::{combine, sequence::Sequence};
use crate::scene::Scene;
use crate::shade::lights::{Arrival, Lights};

/// The immutable part of the world.
#[derive(Clone, Copy)]
pub struct World<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Its hierarchy.
    pub bvh: &'a Bvh,
    /// Its lights.
    pub lights: &'a Lights,
    /// The run's seed.
    pub seed: u64,
    /// Length of the contact test's ray, scene units.
    pub contact: f32,
}

/// Length of the contact test against the scene's diagonal.
const CONTACT: f32 = 2e-4;

impl<'a> World<'a> {
    /// The world of a scene; `diagonal` is the scene's.
    #[must_use]
    pub const fn new(scene: &'a Scene, bvh: &'a Bvh, lights: &'a Lights, seed: u64, diagonal: f32) -> Self {
        Self { scene, bvh, lights, seed, contact: diagonal * CONTACT }
    }

    /// The random sequence of a vertex and a light: from their permanent names, never from a thread or a clock.
    #[must_use]
    pub fn sequence(&self, vertex: &Vertex, light: u32) -> Sequence {
        Sequence::new(combine(combine(self.seed, vertex.key), u64::from(light)))
    }

    /// Whether the light of `arrival`, seen from the vertex, is unoccluded. Rays start at the vertex's nudged origin and
    /// aim at the same point of the light.
    #[must_use]
    pub fn visible(&self, vertex: &Vertex, arrival: &Arrival) -> bool {
        let origin = vertex.origin();
        let ray = if arrival.distance.is_finite() {
            let target = vertex.position + arrival.direction * arrival.distance;
            let offset = target - origin;
            let length = offset.length();
            // Short of the light, whose own surface must not hide it.
            Ray { origin, direction: offset / length, t_max: length * (1.0 - 1e-4) }
        } else {
            Ray { origin, direction: arrival.direction, t_max: f32::INFINITY }
        };
        !self.bvh.occluded(self.scene, &ray)
    }

    /// Whether other geometry lies on the vertex.
    #[must_use]
    pub fn is_covered(&self, vertex: &Vertex) -> bool {
        let ray = Ray { origin: vertex.origin(), direction: vertex.normal(), t_max: self.contact };
        self.bvh.occluded(self.scene, &ray)
    }
}
