//! Points on surfaces: those that a camera sees, and the light that one of them reflects.

use crate::geom::{Hit, Ray, offset};
use crate::light::arrival::Arrival;
use crate::light::context::{SceneContext, ShadingPoint};
use crate::math::{combine, sequence::Sequence};
use crate::scene::camera::View;
use glam::{Vec2, Vec3};
use std::f32::consts::PI;

/// Up to `count` places that the camera sees, spread evenly over its image, those that emit left out.
pub fn seen(context: &SceneContext<'_>, view: &View, count: u32) -> Vec<ShadingPoint> {
    let sequence = Sequence::new(combine(context.seed, u64::from(count)));
    let size = Vec2::new(view.size.width as f32, view.size.height as f32);
    let shading_point = |index| {
        let [x, y, ..] = sequence.point(index);
        let direction = view.direction(size * Vec2::new(x, y)).normalize();
        let ray = Ray { origin: view.eye, direction, t_max: f32::INFINITY };
        let hit = context.bvh.closest(context.scene, &ray)?;
        (!context.scene.face_emits(hit.face())).then(|| site_of(&hit, u64::from(index)))
    };
    (0..count).filter_map(shading_point).collect()
}

/// The point of a hit on the side that was hit.
pub fn site_of(hit: &Hit, key: u64) -> ShadingPoint {
    let [a, b, c] = hit.corners;
    let position = a * (1.0 - hit.u - hit.v) + b * hit.u + c * hit.v;
    let normal = hit.facet();
    let origin = offset::origin(position, normal, offset::scale_of_hit(position, hit.t), offset::HIT);
    ShadingPoint { key, position, origin, normal }
}

/// Radiance, W·sr⁻¹·m⁻², that the surface of a hit reflects diffusely of the light from one light, drawn in proportion
/// to its strength; one shadow ray. Its mean over `u` ∈ [0, 1)³ is that of all direct light.
pub fn reflected(context: &SceneContext<'_>, hit: &Hit, u: [f32; 3]) -> Vec3 {
    let shading_point = site_of(hit, 0);
    let Some((arrival, share)) = arrival(context, &shading_point, u) else { return Vec3::ZERO };
    let cosine = shading_point.normal.dot(arrival.direction);
    if cosine <= 0.0 || !context.visible(&shading_point, &arrival) {
        return Vec3::ZERO;
    }
    context.scene.kd_at(hit.triangle, hit.u, hit.v) * arrival.facing * (cosine / (PI * share))
}

/// Light from a point of one light, drawn in proportion to its strength, and the share of draws that take that light.
pub fn arrival(
    context: &SceneContext<'_>,
    shading_point: &ShadingPoint,
    [u, v, pick]: [f32; 3],
) -> Option<(Arrival, f32)> {
    let (mut pick, mut total, mut chosen) = (f64::from(pick), 0.0, None);
    // In one pass, since strengths cost as much as rays where lights are many: each light takes the place of the one before
    // by its share of those so far, and what decided becomes a new uniform number.
    for source in &context.lights.sources {
        let strength = f64::from(source.strength(shading_point.position, shading_point.normal));
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
    let arrival = source.sample_by_area(context.scene, shading_point.position, [u, v]);
    arrival.map(|arrival| (arrival, (strength / total) as f32))
}
