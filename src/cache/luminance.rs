//! Luminance shown at a slot, from the samples of its vertex: no ray is traced here.

use super::dynamic::{Cache, SlotId, SlotRecord};
use super::layer::Layer;
use super::vertex::Vertex;
use crate::estimate::visibility::{Origin, REMEMBERED, Visibility};
use crate::math::luminance;
use crate::math::sequence::Sequence;
use crate::shade::lights::{AreaSource, Source, delta_arrival};
use crate::shade::phong::lobe;
use crate::shade::world::World;
use glam::Vec3;
use std::f32::consts::PI;

/// Diffuse luminance of a slot.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Diffuse {
    /// D = Σ E/π over all lights, as far as known (method 2).
    pub value: Vec3,
    /// Variance of its luminance, from penumbrae and from lights that are not traced yet.
    pub variance: f32,
}

/// Standard error of a guess of a visible fraction: a uniform distribution's.
const GUESS_ERROR: f32 = 0.29;
/// Variance of stratified points in a penumbra against independent ones.
const STRATIFIED: f32 = 0.3;

/// Relative variance of one point of a light that has no closed form.
const SAMPLED: f32 = 0.1;

/// Diffuse luminance of a slot over all lights.
#[must_use]
pub fn diffuse(world: &World<'_>, cache: &Cache, slot: SlotId) -> Diffuse {
    let record = &cache.slots[slot.0];
    let vertex = &cache.vertices[record.vertex.0];
    let (mut irradiance, mut variance) = (Vec3::ZERO, 0.0);
    for (source, layer) in world.lights.sources.iter().zip(&cache.layers) {
        let visibility = layer.visibility.get(record.vertex.0);
        let fraction = visibility.fraction();
        if visibility.points == 0 && fraction == 0.0 {
            continue;
        }
        let (visible, unoccluded) = match source {
            Source::Delta(kind) => {
                let full = delta_arrival(kind, vertex.position)
                    .map_or(Vec3::ZERO, |a| a.facing * record.normal.dot(a.direction).max(0.0));
                (full * fraction, full)
            }
            Source::Area(area) => area_irradiance(world, (area, layer), slot, (vertex, record), visibility),
        };
        irradiance += visible;
        let mut spread = fraction_variance(visibility, fraction);
        if visibility.points > 0 && matches!(source, Source::Area(area) if !area.has_closed_form()) {
            spread += SAMPLED / visibility.points as f32;
        }
        variance += luminance(unoccluded).powi(2) * spread;
    }
    Diffuse { value: irradiance / PI, variance: variance / (PI * PI) }
}

/// Variance of a visible fraction.
fn fraction_variance(visibility: Visibility, fraction: f32) -> f32 {
    match visibility.origin {
        Origin::Sampled if visibility.points >= REMEMBERED => {
            // Half a point of doubt each way: that all points agree does not say that all others would.
            let n = visibility.points as f32;
            let likely = (fraction * n + 0.5) / (n + 1.0);
            likely * (1.0 - likely) * STRATIFIED / n
        }
        Origin::Sampled | Origin::Inferred => 0.0,
        Origin::Deferred | Origin::Unknown => GUESS_ERROR * GUESS_ERROR,
    }
}

/// Irradiance from an area light, and what it would be without occlusion: the closed form times the visible fraction, or
/// the mean of the samples where there is no closed form.
fn area_irradiance(
    world: &World<'_>,
    (source, layer): (&AreaSource, &Layer),
    slot: SlotId,
    (vertex, record): (&Vertex, &SlotRecord),
    visibility: Visibility,
) -> (Vec3, Vec3) {
    let sum = layer.sums.get(slot.0);
    let sampled = visibility.points > 0 && sum.unoccluded > 0.0;
    match unoccluded(source, vertex.position, record.normal) {
        Some(unoccluded) if sampled => (sum.visible * (luminance(unoccluded) / sum.unoccluded), unoccluded),
        Some(unoccluded) => (unoccluded * visibility.fraction(), unoccluded),
        None if sampled => {
            let mean = sum.visible / visibility.points as f32;
            (mean, mean / visibility.fraction().max(0.05))
        }
        None => {
            let unoccluded = unoccluded_estimate(world, source, vertex.position, record.normal);
            (unoccluded * visibility.fraction(), unoccluded)
        }
    }
}

/// Unoccluded irradiance of an area source, where it has a closed form.
fn unoccluded(source: &AreaSource, x: Vec3, normal: Vec3) -> Option<Vec3> {
    if source.is_distant(x) {
        return Some(source.distant_irradiance(x, normal));
    }
    source.closed_form(x).map(|form| form.irradiance(normal))
}

/// Points that stand in for a closed form where there is none.
const ESTIMATE_POINTS: u32 = 8;

/// Unoccluded irradiance of a source of too many triangles, from a few of its points.
fn unoccluded_estimate(world: &World<'_>, source: &AreaSource, x: Vec3, normal: Vec3) -> Vec3 {
    let (sampler, sequence) = (source.at(x), Sequence::new(0));
    let irradiance = |i| {
        let [u, v, ..] = sequence.point(i);
        let arrival = sampler.sample(world.scene, [u, v]);
        arrival.map_or(Vec3::ZERO, |a| a.mean_facing * normal.dot(a.direction).max(0.0))
    };
    (0..ESTIMATE_POINTS).map(irradiance).sum::<Vec3>() / ESTIMATE_POINTS as f32
}

/// Specular luminance S of a slot seen from `eye`: exact for delta lights; for area lights the unoccluded highlight times
/// the visibility of the remembered points, weighted by the lobe (method 2).
#[must_use]
pub fn specular(world: &World<'_>, cache: &Cache, slot: SlotId, eye: Vec3) -> Vec3 {
    let record = &cache.slots[slot.0];
    let Some(shininess) = record.shininess else { return Vec3::ZERO };
    let vertex = &cache.vertices[record.vertex.0];
    let to_eye = (eye - vertex.position).normalize_or(record.normal);
    let mut sum = Vec3::ZERO;
    for (light, (source, layer)) in (0_u32..).zip(world.lights.sources.iter().zip(&cache.layers)) {
        let visibility = layer.visibility.get(record.vertex.0);
        if visibility.fraction() == 0.0 {
            continue;
        }
        sum += match source {
            Source::Delta(kind) => delta_arrival(kind, vertex.position).map_or(Vec3::ZERO, |a| {
                let cosine = record.normal.dot(a.direction).max(0.0);
                a.facing * (visibility.fraction() * cosine * lobe(shininess, record.normal, a.direction, to_eye))
            }),
            Source::Area(area) => {
                let (x, normal) = (vertex.position, record.normal);
                let far = area.distant_specular(x, normal, to_eye, shininess);
                let full = far.unwrap_or_else(|| area.specular(world.scene, x, normal, to_eye, shininess));
                let share = if full == Vec3::ZERO {
                    0.0
                } else {
                    lobe_visibility(world, (vertex, record), (light, area), visibility, to_eye)
                };
                full * share
            }
        };
    }
    sum
}

/// Visible share of a highlight: the remembered points weighted by what each adds to it, the plain fraction where none does.
fn lobe_visibility(
    world: &World<'_>,
    (vertex, record): (&Vertex, &SlotRecord),
    (light, source): (u32, &AreaSource),
    visibility: Visibility,
    to_eye: Vec3,
) -> f32 {
    let fraction = visibility.fraction();
    if visibility.points == 0 || fraction == 1.0 {
        return fraction;
    }
    let shininess = record.shininess.unwrap_or(0.0);
    let sequence = world.sequence(&vertex.site(), light);
    let sampler = source.at(vertex.position);
    let (mut seen, mut all) = (0.0, 0.0);
    for (index, visible) in visibility.remembered() {
        let [u, v, ..] = sequence.point(index);
        if let Some(a) = sampler.sample(world.scene, [u, v]) {
            let cosine = record.normal.dot(a.direction).max(0.0);
            let weight = luminance(a.facing) * cosine * lobe(shininess, record.normal, a.direction, to_eye);
            all += weight;
            seen += if visible { weight } else { 0.0 };
        }
    }
    // Where hardly any point falls into the lobe, its share says nothing.
    if all > 1e-12 { seen / all } else { fraction }
}
