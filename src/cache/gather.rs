//! Gathering indirect light at vertices (method 6): rays over the hemisphere, direct light at their hits by a shadow ray,
//! indirect light there from the mesh where it is known well enough, else by going on with the path.
//!
//! Rounds continue one low-discrepancy sequence a vertex, so they add up and each is unbiased but for what the mesh gets
//! wrong at hits, which falls as it is refined. (The adaptive methods, there to be compared, are biased round by round.)

use super::dynamic::{Cache, SlotId};
use super::indirect::Round;
use super::vertex::VertexId;
use crate::estimate::hemisphere::{self, Method};
use crate::estimate::light_vector::LightVector;
use crate::estimate::surface::DiffusePoint;
use crate::geom::Ray;
use crate::math::combine;
use crate::math::hemisphere::Density;
use crate::math::sequence::Sequence;
use crate::shade::world::World;
use glam::Vec3;
use smallvec::SmallVec;
use std::f32::consts::PI;

/// A run of rays at a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GatherJob {
    /// The vertex.
    pub vertex: VertexId,
    /// Index of the first ray.
    pub first: u32,
    /// Number of rays.
    pub rays: u32,
    /// How directions are chosen. Any part of a round of [`Method::Stratified`] is a job; those of the others, which choose
    /// directions by what they have seen, are jobs as a whole.
    pub method: Method,
}

/// Results of a run of jobs, in their order.
#[derive(Debug, Default)]
pub struct Gathered {
    /// One a job.
    pub rounds: Vec<Round>,
    /// Sums of the vertices' slots, consecutive rounds' entries one after the other.
    pub sums: Vec<(SlotId, LightVector)>,
    /// Rays traced, shadow rays included.
    pub rays: u64,
}

/// Name of the sequence of indirect light beside those of the lights.
const INDIRECT: u32 = u32::MAX - 1;

/// Does a job.
pub fn gather(world: &World<'_>, cache: &Cache, job: GatherJob, out: &mut Gathered) {
    let site = cache.vertices[job.vertex.0].site();
    let start = out.sums.len();
    out.sums.extend(cache.slots_of(job.vertex).map(|slot| (slot, LightVector::default())));
    let normals: SmallVec<[Vec3; 8]> = out.sums[start..].iter().map(|(slot, _)| cache.slots[slot.0].normal).collect();
    let sequence = world.sequence(&site, INDIRECT);
    let Gathered { sums, rays, .. } = out;
    let radiance = |index, direction| {
        let ray = Ray { origin: site.origin, direction, t_max: f32::INFINITY };
        Path { world, cache, sequence: &sequence, index, unread: unread_hits(index) }.radiance(ray, rays)
    };
    let indices = job.first..job.first + job.rays;
    hemisphere::gather(job.method, &normals, indices, &sequence, radiance, |sample| {
        for ((_, sum), normal) in sums[start..].iter_mut().zip(&normals) {
            sum.push(*normal, &sample);
        }
    });
    let sums = (out.sums.len() - start) as u32;
    out.rounds.push(Round { vertex: job.vertex, rays: job.rays, sums });
}

/// One gather ray and what follows it.
struct Path<'a> {
    world: &'a World<'a>,
    cache: &'a Cache,
    sequence: &'a Sequence,
    index: u32,
    /// Hits at which the mesh is not asked.
    unread: u32,
}

/// Rays of a vertex of which the first hit reads the mesh, and those of which the second does.
const FIRST_HIT_READS: u32 = 1024;
const SECOND_HIT_READS: u32 = 8192;

/// Hits of a ray that go on without the mesh. What the mesh gets wrong at hits does not fall with the number of rays: later
/// rounds read it one or two bounces further on, where each albedo between makes it count for less.
const fn unread_hits(index: u32) -> u32 {
    if index < FIRST_HIT_READS {
        0
    } else if index < SECOND_HIT_READS {
        1
    } else {
        2
    }
}

/// Odds of going on are at most this, so that paths end in white rooms, too.
const GO_ON: f32 = 0.95;
/// Sets of coordinates that a sequence has for bounces, two a bounce.
const BOUNCES_A_SEQUENCE: u32 = 30;

impl Path<'_> {
    /// Light that arrives along `ray` but for what lights send directly.
    fn radiance(&self, mut ray: Ray, rays: &mut u64) -> Vec3 {
        let mut sum = Vec3::ZERO;
        let mut throughput = Vec3::ONE;
        for bounce in 0.. {
            *rays += 1;
            let Some(hit) = self.world.bvh.closest(self.world.scene, &ray) else { break };
            let point = DiffusePoint::new(self.world.scene, &ray, &hit);
            throughput *= point.kd;
            let [pick, u, v, survive] = self.numbers(bounce, 1);
            if throughput.max_element() <= 0.0 {
                break;
            }
            sum += throughput * point.direct(self.world, [pick, u, v], rays) / PI;
            let known = if bounce < self.unread { None } else { self.cache.indirect_at(&hit, hit.t) };
            if let Some(luminance) = known {
                sum += throughput * luminance;
                break;
            }
            let odds = throughput.max_element().min(GO_ON);
            if survive >= odds {
                break;
            }
            throughput /= odds;
            let [u, v, ..] = self.numbers(bounce, 2);
            let direction = Density::Cosine.direction(point.normal, [u, v]);
            // Behind the facet there is nothing to see.
            if direction.dot(point.facet) <= 0.0 {
                break;
            }
            ray = Ray { origin: point.origin, direction, t_max: f32::INFINITY };
        }
        sum
    }

    /// Random numbers of a bounce.
    fn numbers(&self, bounce: u32, set: u32) -> [f32; 4] {
        let set = set + 2 * (bounce % BOUNCES_A_SEQUENCE);
        if bounce < BOUNCES_A_SEQUENCE {
            return self.sequence.point_of_set(self.index, set);
        }
        let seed = combine(u64::from(self.index), u64::from(bounce / BOUNCES_A_SEQUENCE));
        Sequence::new(seed).point_of_set(self.index, set)
    }
}

/// Writes results into the cache, in order (the engine alone, phase "apply").
pub fn apply(cache: &mut Cache, gathered: &Gathered) {
    let mut start = 0;
    for &round in &gathered.rounds {
        let end = start + round.sums as usize;
        cache.indirect.add(round, &gathered.sums[start..end]);
        start = end;
    }
}
