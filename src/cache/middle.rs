//! What a leaf's corners do not say: one ray a light from its middle, or from where a pixel sees it.
//!
//! Corners may all lie in or under other geometry while the leaf between them is lit, and a shadow or a shaft of light may
//! pass between them.

use super::dynamic::Cache;
use super::topology::NodeId;
use crate::estimate::visibility::Origin;
use crate::shade::light_mesh::Emitter;
use crate::shade::lights::Arrival;
use crate::shade::world::{Site, World};
use smallvec::SmallVec;
use std::f32::consts::PI;

/// Share of all the light that may arrive above which a light is worth a ray.
const WEAK: f32 = 0.03;
/// Cosine between a facet and a light below which the facet's own body hides it, whatever the shading normals say.
const GRAZING: f32 = 0.05;

/// Luminance of D, at a point of a leaf given by barycentric weights, of the lights of which a ray says otherwise than all
/// corners of the leaf do.
#[must_use]
pub fn surprise(world: &World<'_>, cache: &Cache, (id, weights): (NodeId, [f32; 3]), rays: &mut u64) -> f32 {
    let site = cache.inner_vertex(id, weights).site();
    let strength = |(light, emitter): (usize, Emitter<'_>)| {
        emitter.strength(site.position, site.normal) * world.lights.mesh_factor(light).max_element()
    };
    let strengths: SmallVec<[f32; 128]> = world.lights.meshes().enumerate().map(strength).collect();
    let weak = WEAK * strengths.iter().sum::<f32>();
    let mut surprise = 0.0;
    for (light, &strength) in strengths.iter().enumerate().filter(|(_, strength)| **strength > weak) {
        let Some(visible) = agreed(cache, light, id) else { continue };
        let arrival = arrival(world, light, &site).filter(|a| a.direction.dot(site.normal) > GRAZING);
        let Some(arrival) = arrival else { continue };
        *rays += 1;
        if world.visible(&site, &arrival) != visible {
            surprise += strength / PI;
        }
    }
    surprise
}

/// Whether a light is visible, if all corners of a node know and agree.
fn agreed(cache: &Cache, light: usize, id: NodeId) -> Option<bool> {
    let corners = cache.corner_vertices(id).map(|v| cache.layers[light].visibility.get(v.0));
    let first = corners[0].fraction();
    let settled = corners.iter().all(|c| matches!(c.origin, Origin::Sampled | Origin::Inferred));
    let agree = settled && corners.iter().all(|c| c.fraction() == first) && (first == 0.0 || first == 1.0);
    agree.then_some(first == 1.0)
}

/// The light that a ray is traced for: a random point of an area light or a group.
fn arrival(world: &World<'_>, light: usize, site: &Site) -> Option<Arrival> {
    world.points(site, light).sample(world.scene, 0)
}
