//! Direct light at base vertices: one shadow ray for a delta light, stratified points for an area light (method 6).

use crate::cache::dynamic::{Cache, SlotId};
use crate::cache::layer::{AreaSum, Layer, Visibility};
use crate::cache::vertex::{Vertex, VertexId};
use crate::geom::Ray;
use crate::geom::bvh::Bvh;
use crate::math::{combine, luminance, sequence::Sequence};
use crate::scene::Scene;
use crate::shade::lights::{AreaSource, Arrival, Lights, Source, delta_arrival};
use glam::Vec3;
use std::f32::consts::PI;

/// What estimators read: immutable while jobs are traced.
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
}

impl World<'_> {
    /// The random sequence of a vertex and a light: from their permanent names, never from a thread or a clock.
    #[must_use]
    pub fn sequence(&self, vertex: &Vertex, light: u32) -> Sequence {
        Sequence::new(combine(combine(self.seed, vertex.key), u64::from(light)))
    }

    /// Whether the light of `arrival`, seen from the vertex, is unoccluded. Rays start at the vertex's nudged origin and
    /// aim at the same point of the light.
    #[must_use]
    pub fn visible(&self, vertex: &Vertex, arrival: &Arrival) -> bool {
        let ray = if arrival.distance.is_finite() {
            let target = vertex.position + arrival.direction * arrival.distance;
            let offset = target - vertex.origin;
            let length = offset.length();
            // Short of the light, whose own surface must not hide it.
            Ray { origin: vertex.origin, direction: offset / length, t_max: length * (1.0 - 1e-4) }
        } else {
            Ray { origin: vertex.origin, direction: arrival.direction, t_max: f32::INFINITY }
        };
        !self.bvh.occluded(self.scene, &ray)
    }
}

/// New samples of one light at one vertex.
#[derive(Clone, Copy, Debug)]
pub struct LightResult {
    /// The vertex.
    pub vertex: VertexId,
    /// The light.
    pub light: u32,
    /// Visibility including the new points.
    pub visibility: Visibility,
    /// How many entries of [`Results::sums`] belong to it.
    pub sums: u32,
}

/// Results of a run of jobs, in their order.
#[derive(Debug, Default)]
pub struct Results {
    /// By job and light.
    pub lights: Vec<LightResult>,
    /// What to add to the slots' sums, consecutive results' entries one after the other.
    pub sums: Vec<(SlotId, AreaSum)>,
    /// Shadow rays traced.
    pub rays: u64,
}

/// A visit to a vertex: which lights are sampled depends on the stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Job {
    /// The vertex.
    pub vertex: VertexId,
    /// 0: the lights that matter most; 1: all others too; from 2 on: area lights whose noise still shows.
    pub stage: u32,
}

/// Share of the unoccluded light that the first visit must cover.
const FIRST_VISIT: f32 = 0.95;
/// Points of an area light on the first and on the second visit; from the third on their number doubles.
const FIRST_POINTS: u32 = 4;
const SECOND_POINTS: u32 = 16;
/// Relative standard error of a vertex's irradiance below which more points do not show.
pub const TOLERANCE: f32 = 0.002;
/// Last stage, 4,096 points.
pub const LAST_STAGE: u32 = 9;

/// Points that an area light has after `stage`.
#[must_use]
pub const fn points_after(stage: u32) -> u32 {
    match stage {
        0 => FIRST_POINTS,
        n => SECOND_POINTS << (n - 1),
    }
}

/// Does a job: samples the lights that its stage asks for.
pub fn visit(world: &World<'_>, cache: &Cache, job: Job, floor: f32, out: &mut Results) {
    let vertex = &cache.vertices[job.vertex.0];
    let wanted = match job.stage {
        0 => strongest(world, cache, job.vertex),
        1 => (0..world.lights.sources.len() as u32).collect(),
        _ => noisy(world, cache, job.vertex, floor),
    };
    for light in wanted {
        let known = cache.layers[light as usize].visibility.get(job.vertex.0);
        match &world.lights.sources[light as usize] {
            Source::Delta(kind) => {
                if known.points == 0 {
                    let arrival = delta_arrival(kind, vertex.position);
                    let visibility = delta(world, cache, job.vertex, arrival, out);
                    out.lights.push(LightResult { vertex: job.vertex, light, visibility, sums: 0 });
                }
            }
            Source::Area(source) => {
                let until = points_after(job.stage);
                if known.points < until {
                    area(world, cache, (job.vertex, light), source, (known, until), out);
                }
            }
        }
    }
}

/// Lights in descending order of their bound until they cover most of the possible light.
fn strongest(world: &World<'_>, cache: &Cache, vertex: VertexId) -> Vec<u32> {
    let position = cache.vertices[vertex.0].position;
    let mut bounds: Vec<(f32, u32)> = (0_u32..)
        .zip(&world.lights.sources)
        .map(|(light, source)| {
            let of_slot = |slot: SlotId| source.bound(position, cache.slots[slot.0].normal);
            (cache.slots_of(vertex).map(of_slot).fold(0.0, f32::max), light)
        })
        .filter(|&(bound, _)| bound > 0.0)
        .collect();
    bounds.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let total: f32 = bounds.iter().map(|b| b.0).sum();
    let mut covered = 0.0;
    bounds
        .into_iter()
        .take_while(|&(bound, _)| {
            let needed = covered < total * FIRST_VISIT;
            covered += bound;
            needed
        })
        .map(|(_, light)| light)
        .collect()
}

/// Area lights whose share of the noise at the vertex is above what is tolerated there.
fn noisy(world: &World<'_>, cache: &Cache, vertex: VertexId, floor: f32) -> Vec<u32> {
    let lights = world.lights.sources.len() as f32;
    let shows = |&light: &u32| {
        let sums = &cache.layers[light as usize].sums;
        let points = cache.layers[light as usize].visibility.get(vertex.0).points;
        cache
            .slots_of(vertex)
            .any(|slot| sums.get(slot.0).variance_of_mean(points) > allowed_variance(cache, slot, floor) / lights)
    };
    (0..world.lights.sources.len() as u32).filter(shows).collect()
}

/// Whether noise still shows at any slot of a vertex. `floor` is an irradiance (luminance) below which noise does not
/// matter: a share of the image's mean.
#[must_use]
pub fn is_noisy(cache: &Cache, vertex: VertexId, floor: f32) -> bool {
    cache.slots_of(vertex).any(|slot| cache.slots[slot.0].variance * PI * PI > allowed_variance(cache, slot, floor))
}

/// Variance of the irradiance that is tolerated at a slot.
fn allowed_variance(cache: &Cache, slot: SlotId, floor: f32) -> f32 {
    let irradiance = luminance(cache.slots[slot.0].diffuse) * PI;
    (TOLERANCE * irradiance.max(floor)).powi(2)
}

/// Variance of the luminance of the irradiance estimated at a slot, all lights together.
#[must_use]
pub fn variance(world: &World<'_>, cache: &Cache, slot: SlotId) -> f32 {
    let vertex = cache.slots[slot.0].vertex;
    let of_light = |(source, layer): (&Source, &Layer)| match source {
        Source::Delta(_) => 0.0,
        Source::Area(_) => layer.sums.get(slot.0).variance_of_mean(layer.visibility.get(vertex.0).points),
    };
    world.lights.sources.iter().zip(&cache.layers).map(of_light).sum()
}

/// Tests a delta light once; no ray where it cannot light any of the vertex's normals.
fn delta(world: &World<'_>, cache: &Cache, id: VertexId, arrival: Option<Arrival>, out: &mut Results) -> Visibility {
    let mut visibility = Visibility::default();
    let visible = arrival.is_some_and(|arrival| {
        lights_any_slot(cache, id, arrival.direction) && {
            out.rays += 1;
            world.visible(&cache.vertices[id.0], &arrival)
        }
    });
    visibility.push(visible);
    visibility
}

fn lights_any_slot(cache: &Cache, vertex: VertexId, direction: Vec3) -> bool {
    cache.slots_of(vertex).any(|slot| cache.slots[slot.0].normal.dot(direction) > 0.0)
}

/// Adds points of an area light until there are `until`.
fn area(
    world: &World<'_>,
    cache: &Cache,
    (id, light): (VertexId, u32),
    source: &AreaSource,
    (mut visibility, until): (Visibility, u32),
    out: &mut Results,
) {
    let vertex = &cache.vertices[id.0];
    let sequence = world.sequence(vertex, light);
    let first = out.sums.len();
    out.sums.extend(cache.slots_of(id).map(|slot| (slot, AreaSum::default())));
    while visibility.points < until {
        let [u, v, ..] = sequence.point(visibility.points);
        let arrival = source.sample(world.scene, vertex.position, [u, v]);
        let seen = arrival.filter(|a| {
            lights_any_slot(cache, id, a.direction) && {
                out.rays += 1;
                world.visible(vertex, a)
            }
        });
        visibility.push(seen.is_some());
        let Some(arrival) = seen else { continue };
        for (slot, sum) in &mut out.sums[first..] {
            let irradiance = arrival.facing * cache.slots[slot.0].normal.dot(arrival.direction).max(0.0);
            sum.irradiance += irradiance;
            sum.square += luminance(irradiance).powi(2);
        }
    }
    let sums = (out.sums.len() - first) as u32;
    out.lights.push(LightResult { vertex: id, light, visibility, sums });
}

/// Writes results into the cache, in order (the engine alone, method "apply").
pub fn apply(cache: &mut Cache, results: &Results) {
    let mut sums = results.sums.iter();
    for result in &results.lights {
        let layer = &mut cache.layers[result.light as usize];
        *layer.visibility.entry(result.vertex.0) = result.visibility;
        for &(slot, sum) in sums.by_ref().take(result.sums as usize) {
            let entry = layer.sums.entry(slot.0);
            entry.irradiance += sum.irradiance;
            entry.square += sum.square;
        }
    }
}
