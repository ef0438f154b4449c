//! Luminance shown at a slot, from the samples of its vertex: no ray is traced here.

use super::direct::World;
use crate::cache::dynamic::{Cache, SlotId, SlotRecord};
use crate::cache::vertex::Vertex;
use crate::scene::light::LightKind;
use crate::shade::lights::{AreaSource, Source, delta_arrival};
use crate::shade::phong::lobe;
use glam::Vec3;
use std::f32::consts::PI;

/// Diffuse luminance D = Σ E/π of a slot over all lights sampled so far (method 2).
#[must_use]
pub fn diffuse(world: &World<'_>, cache: &Cache, slot: SlotId) -> Vec3 {
    let record = &cache.slots[slot.0];
    let vertex = &cache.vertices[record.vertex.0];
    let of_light = |(source, layer): (&Source, &crate::cache::layer::Layer)| {
        let visibility = layer.visibility.get(record.vertex.0);
        match source {
            Source::Delta(kind) if visibility.mask & 1 == 1 => delta_irradiance(kind, vertex.position, record.normal),
            Source::Delta(_) => Vec3::ZERO,
            Source::Area(_) => layer.sums.get(slot.0).mean(visibility.points),
        }
    };
    let irradiance: Vec3 = world.lights.sources.iter().zip(&cache.layers).map(of_light).sum();
    irradiance / PI
}

fn delta_irradiance(kind: &LightKind, x: Vec3, normal: Vec3) -> Vec3 {
    delta_arrival(kind, x).map_or(Vec3::ZERO, |a| a.facing * normal.dot(a.direction).max(0.0))
}

/// Specular luminance S of a slot seen from `eye`: exact for delta lights, and for area lights over the remembered points
/// with their own visibility, whose directions are drawn again from the vertex's sequence (method 2).
#[must_use]
pub fn specular(world: &World<'_>, cache: &Cache, slot: SlotId, eye: Vec3) -> Vec3 {
    let record = &cache.slots[slot.0];
    let Some(shininess) = record.shininess else { return Vec3::ZERO };
    let vertex = &cache.vertices[record.vertex.0];
    let to_eye = (eye - vertex.position).normalize_or(record.normal);
    let mut sum = Vec3::ZERO;
    for (light, source) in world.lights.sources.iter().enumerate() {
        match source {
            Source::Delta(kind) => {
                if cache.layers[light].visibility.get(record.vertex.0).mask & 1 == 1
                    && let Some(a) = delta_arrival(kind, vertex.position)
                {
                    let cosine = record.normal.dot(a.direction).max(0.0);
                    sum += a.facing * (cosine * lobe(shininess, record.normal, a.direction, to_eye));
                }
            }
            Source::Area(area) => sum += area_specular(world, cache, (record, vertex), (light, area), to_eye),
        }
    }
    sum
}

fn area_specular(
    world: &World<'_>,
    cache: &Cache,
    (record, vertex): (&SlotRecord, &Vertex),
    (light, source): (usize, &AreaSource),
    to_eye: Vec3,
) -> Vec3 {
    let visibility = cache.layers[light].visibility.get(record.vertex.0);
    let sequence = world.sequence(vertex, light as u32);
    let mut sum = Vec3::ZERO;
    for (index, visible) in visibility.remembered() {
        if !visible {
            continue;
        }
        let [u, v, ..] = sequence.point(index);
        if let Some(a) = source.sample(world.scene, vertex.position, [u, v]) {
            let cosine = record.normal.dot(a.direction).max(0.0);
            let shininess = record.shininess.unwrap_or(0.0);
            sum += a.facing * (cosine * lobe(shininess, record.normal, a.direction, to_eye));
        }
    }
    let count = visibility.remembered().count().max(1);
    sum / count as f32
}
