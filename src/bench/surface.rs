//! Points on surfaces: those that a camera sees, and the light that one of them reflects.

use crate::geom::{Hit, Ray};
use crate::math::{combine, sequence::Sequence};
use crate::scene::Scene;
use crate::scene::camera::View;
use crate::shade::lights::{Arrival, Source, delta_arrival};
use crate::shade::world::{Site, World};
use glam::{Vec2, Vec3};
use std::f32::consts::PI;

/// Up to `count` places that the camera sees, spread evenly over its image, those that emit left out.
pub fn seen(world: &World<'_>, view: &View, count: u32) -> Vec<Site> {
    let sequence = Sequence::new(combine(world.seed, u64::from(count)));
    let size = Vec2::new(view.size.width as f32, view.size.height as f32);
    let site = |index| {
        let [x, y, ..] = sequence.point(index);
        let direction = view.direction(size * Vec2::new(x, y)).normalize();
        let ray = Ray { origin: view.eye, direction, t_max: f32::INFINITY };
        let hit = world.bvh.closest(world.scene, &ray)?;
        (!world.scene.face_emits(hit.face())).then(|| site_of(world.scene, &hit, u64::from(index)))
    };
    (0..count).filter_map(site).collect()
}

/// The point of a hit on the side that was hit.
pub fn site_of(scene: &Scene, hit: &Hit, key: u64) -> Site {
    let [a, b, c] = scene.corners(hit.triangle);
    let position = a * (1.0 - hit.u - hit.v) + b * hit.u + c * hit.v;
    let normal = scene.geometric_normal(hit.triangle) * if hit.back { -1.0 } else { 1.0 };
    let scale = position.abs().max_element().max(hit.t);
    Site { key, position, origin: position + normal * (scale * 4e-6), normal }
}

/// Radiance that the surface of a hit reflects diffusely of the light from one light, drawn in proportion to its strength;
/// one shadow ray. Its mean over `u` ∈ [0, 1)³ is that of all direct light.
pub fn reflected(world: &World<'_>, hit: &Hit, u: [f32; 3]) -> Vec3 {
    let site = site_of(world.scene, hit, 0);
    let Some((arrival, share)) = arrival(world, &site, u) else { return Vec3::ZERO };
    let cosine = site.normal.dot(arrival.direction);
    if cosine <= 0.0 || !world.visible(&site, &arrival) {
        return Vec3::ZERO;
    }
    world.scene.kd_at(hit.triangle, hit.u, hit.v) * arrival.facing * (cosine / (PI * share))
}

/// Light from a point of one light, drawn in proportion to its strength, and the share of draws that take that light.
pub fn arrival(world: &World<'_>, site: &Site, [u, v, pick]: [f32; 3]) -> Option<(Arrival, f32)> {
    let (mut pick, mut total, mut chosen) = (f64::from(pick), 0.0, None);
    // In one pass, since strengths cost as much as rays where lights are many: each light takes the place of the one before
    // by its share of those so far, and what decided becomes a new uniform number.
    for source in &world.lights.sources {
        let strength = f64::from(source.strength(site.position, site.normal));
        if strength > 0.0 {
            total += strength;
            let share = strength / total;
            if pick < share {
                chosen = Some((source, strength));
                pick /= share;
            } else {
                pick = (pick - share) / (1.0 - share);
            }
        }
    }
    let (source, strength) = chosen?;
    let arrival = match source {
        Source::Delta(kind) => delta_arrival(kind, site.position),
        Source::Area(area) => area.sample(world.scene, site.position, [u, v]),
    };
    arrival.map(|arrival| (arrival, (strength / total) as f32))
}
