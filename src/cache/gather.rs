//! Gathering indirect light at vertices (docs/method/indirect-light.md): rays over the hemisphere, direct light at
//! their hits by a shadow ray, indirect light there by going on with the path, or both from the grid where paths have
//! told enough.
//!
//! Rounds continue one low-discrepancy sequence a vertex, so they add up and each is unbiased but for what the grid
//! gets wrong at hits. (The adaptive methods, there to be compared, are biased round by round.)

use super::ids::{SlotId, VertexId};
use super::indirect_layer::Round;
use super::pieces::Piece;
use super::radiance_grid::{CellKey, Deposit, RadianceGrid};
use super::store::Cache;
use crate::estimate::hemisphere::{self, Method, Radiance};
use crate::estimate::light_vector::LightVector;
use crate::estimate::surface::DiffusePoint;
use crate::geom::{Hit, Ray};
use crate::light::context::{SceneContext, ShadingPoint};
use crate::math::combine;
use crate::math::hemisphere::Density;
use crate::math::sequence::Sequence;
use glam::Vec3;
use smallvec::SmallVec;
use std::f32::consts::PI;
use std::sync::Arc;

/// A vertex that gathers, as it was when it was asked to: the cache may change while its rays are traced.
#[derive(Clone, Debug)]
pub struct Site {
    /// The vertex.
    pub vertex: VertexId,
    /// Where it lies.
    pub shading_point: ShadingPoint,
    /// Its slots with their unit normals.
    pub normals: SmallVec<[(SlotId, Vec3); 4]>,
}

/// What paths read of the radiance that others found.
#[derive(Clone, Debug)]
pub struct Learnt {
    /// The grid, which names the cells that paths teach.
    pub grid: Arc<RadianceGrid>,
    /// Whether it is read, too.
    pub is_read: bool,
}

/// A run of rays at a vertex.
#[derive(Clone, Debug)]
pub struct GatherJob {
    /// The vertex.
    pub site: Site,
    /// Index of the first ray.
    pub first: u32,
    /// Number of rays.
    pub rays: u32,
    /// How directions are chosen. Any part of a round of [`Method::Stratified`] is a job; those of the others, which
    /// choose directions by what they have seen, are jobs as a whole.
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
    /// What paths found at their hits.
    pub deposits: Vec<Deposit>,
}

/// Name of the sequence of indirect light beside those of the lights.
const INDIRECT: u32 = u32::MAX - 1;

impl Cache {
    /// A vertex as it is now.
    #[must_use]
    pub fn site(&self, vertex: VertexId) -> Site {
        let normals = self.slots_of(vertex).map(|slot| (slot, self.slots[slot].normal())).collect();
        Site { vertex, shading_point: self.vertices[vertex].shading_point(), normals }
    }

    /// Whether what a round has found is its vertex's light: that has not moved since, nor was it found covered before its
    /// first round, if it is a midpoint, which then takes over what is known around.
    fn is_of_use(&self, round: Round) -> bool {
        let vertex = &self.vertices[round.vertex];
        let is_base = vertex.first_slot.get().is_some_and(|slot| self.slots[slot].is_base());
        let takes_over = vertex.progress.covered && !vertex.progress.enclosed && !is_base;
        vertex.position == round.position && !(takes_over && self.indirect.rays(round.vertex) == 0)
    }

    /// What paths read.
    #[must_use]
    pub fn learnt(&self) -> Learnt {
        Learnt { grid: Arc::clone(&self.radiance), is_read: !self.without.has(Piece::RadianceGrid) }
    }
}

/// Does a job.
pub fn gather(context: &SceneContext<'_>, learnt: &Learnt, job: &GatherJob, out: &mut Gathered) {
    let Site { vertex, shading_point, normals: slots } = &job.site;
    let start = out.sums.len();
    out.sums.extend(slots.iter().map(|&(slot, _)| (slot, LightVector::default())));
    let normals: SmallVec<[Vec3; 8]> = slots.iter().map(|&(_, normal)| normal).collect();
    let sequence = context.sequence(shading_point, INDIRECT);
    let Gathered { sums, rays, deposits, .. } = out;
    let (origin, indices) = (shading_point.origin, job.first..job.first + job.rays);
    let paths = Paths { context, learnt, sequence: &sequence, origin, rays, deposits };
    hemisphere::gather(job.method, &normals, indices, &sequence, paths, |sample| {
        for ((_, sum), normal) in sums[start..].iter_mut().zip(&normals) {
            sum.push(*normal, &sample);
        }
    });
    let sums = (out.sums.len() - start) as u32;
    out.rounds.push(Round { vertex: *vertex, position: shading_point.position, rays: job.rays, sums });
}

/// The gather rays of a vertex.
struct Paths<'a> {
    context: &'a SceneContext<'a>,
    learnt: &'a Learnt,
    sequence: &'a Sequence,
    /// Where they start.
    origin: Vec3,
    rays: &'a mut u64,
    deposits: &'a mut Vec<Deposit>,
}

impl<'a> Paths<'a> {
    fn path(&self, index: u32) -> Path<'a> {
        let Self { context, learnt, sequence, .. } = *self;
        let unread = if learnt.is_read { unread_hits(index) } else { u32::MAX };
        Path { context, grid: &learnt.grid, sequence, index, unread }
    }

    fn ray(&self, direction: Vec3) -> Ray {
        Ray { origin: self.origin, direction, t_max: f32::INFINITY }
    }
}

impl Radiance for Paths<'_> {
    type Met = Option<Met>;

    fn meet(&mut self, index: u32, direction: Vec3) -> Option<Met> {
        self.path(index).meet(&self.ray(direction), self.rays)
    }

    fn look_up(&self, index: u32, met: &mut Option<Met>) {
        if let Some(met) = met {
            self.path(index).look_up(met, 0);
        }
    }

    fn radiance(&mut self, index: u32, direction: Vec3, met: Option<Met>) -> Vec3 {
        self.path(index).radiance(self.ray(direction), met, self.rays, self.deposits)
    }
}

/// Where a ray of a path ends.
struct Met {
    hit: Hit,
    /// The cells there.
    key: CellKey,
    /// What they know, where they may be asked and do.
    known: Option<Vec3>,
}

/// One gather ray and what follows it.
struct Path<'a> {
    context: &'a SceneContext<'a>,
    grid: &'a RadianceGrid,
    sequence: &'a Sequence,
    index: u32,
    /// Hits at which the grid is not read.
    unread: u32,
}

/// A hit from which a path goes on.
struct Bounce {
    /// The cells to be told what leaves it.
    teaches: Option<CellKey>,
    /// What those know already.
    known: Option<Vec3>,
    kd: Vec3,
    /// D of the lights, W·sr⁻¹·m⁻².
    direct: Vec3,
    /// Odds that the path goes on.
    odds: f32,
}

/// Rays of a vertex of which the first hit reads the grid, and those of which the second does.
const FIRST_HIT_READS: u32 = 4096;
const SECOND_HIT_READS: u32 = 32768;

/// Hits of a ray that go on without the grid. What it gets wrong does not fall with the number of rays: later rounds
/// read it one or two bounces further on, where each albedo between makes it count for less.
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
/// Share of the paths that teach the grid what it could be asked for.
const TEACHES: f32 = 0.0625;
/// Sets of coordinates that a sequence has for bounces, two a bounce.
const BOUNCES_A_SEQUENCE: u32 = 30;
/// First of the independent numbers that say which paths teach.
const TEACHING: u32 = 1 << 31;

impl Path<'_> {
    /// Light that arrives along `ray` but for what lights send directly; what leaves the hits of a path that rests on
    /// nothing but itself goes to `deposits`.
    fn radiance(&self, ray: Ray, met: Option<Met>, rays: &mut u64, deposits: &mut Vec<Deposit>) -> Vec3 {
        let mut bounces = SmallVec::new();
        let end = self.walk((ray, met), rays, &mut bounces);
        // What the path itself finds, and what its vertex takes: the grid's word where there is one.
        let (mut found, mut taken) = (Vec3::ZERO, end);
        for bounce in bounces.iter().rev() {
            let leaving = |beyond: Vec3| bounce.kd * (bounce.direct + beyond / bounce.odds);
            found = leaving(found);
            taken = bounce.known.unwrap_or_else(|| leaving(taken));
            deposits.extend(bounce.teaches.map(|key| Deposit { key, radiance: found }));
        }
        taken
    }

    /// What a ray hits.
    fn meet(&self, ray: &Ray, rays: &mut u64) -> Option<Met> {
        *rays += 1;
        let hit = self.context.bvh.closest(self.context.scene, ray)?;
        let key = self.grid.key(ray.origin + ray.direction * hit.t, hit.area_vector(), hit.t);
        Some(Met { hit, key, known: None })
    }

    /// Asks the grid about a hit after some bounces, if it may be asked there.
    fn look_up(&self, met: &mut Met, bounces: u32) {
        if bounces >= self.unread {
            let own = if bounces == 0 { self.index } else { 0 };
            met.known = self.grid.read(met.key, met.hit.t, own);
        }
    }

    /// Follows a path from its first hit until it is absorbed, or the grid knows what leaves a hit; returns that.
    ///
    /// One that is to teach the grid goes on all the same, and so does one that came to a place which the grid does
    /// not know: it teaches from there on. Its vertex takes the first word that the grid has, its lessons rest on
    /// none: else the errors of cells would go round. (Hits before teach nothing: to take only paths that came to
    /// unknown places would be a choice of directions.)
    fn walk(
        &self,
        (mut ray, mut met): (Ray, Option<Met>),
        rays: &mut u64,
        bounces: &mut SmallVec<[Bounce; 8]>,
    ) -> Vec3 {
        let scene = self.context.scene;
        let [chance, _] = self.sequence.independent(TEACHING | self.index);
        let mut teaches = chance < TEACHES;
        let mut asks = true;
        for bounce in 0.. {
            let Some(Met { hit, key, known }) = met else { break };
            if asks && bounce >= self.unread {
                match known {
                    Some(known) if !teaches => return known,
                    Some(_) => asks = false,
                    None => teaches = true,
                }
            }
            let point = DiffusePoint::new(scene, &ray, &hit);
            let [pick, u, v, survive] = self.numbers(bounce, 1);
            let direct = point.direct(self.context, [pick, u, v], rays) / PI;
            let odds = point.kd.max_element().min(GO_ON);
            let teaches = teaches.then_some(key);
            bounces.push(Bounce { teaches, known, kd: point.kd, direct, odds: odds.max(f32::MIN_POSITIVE) });
            if survive >= odds {
                break;
            }
            let [u, v, ..] = self.numbers(bounce, 2);
            let direction = Density::Cosine.direction(point.normal, [u, v]);
            // Behind the facet there is nothing to see.
            if direction.dot(point.facet) <= 0.0 {
                break;
            }
            ray = Ray { origin: point.origin, direction, t_max: f32::INFINITY };
            met = self.meet(&ray, rays);
            if let Some(met) = met.as_mut().filter(|_| asks) {
                self.look_up(met, bounce + 1);
            }
        }
        Vec3::ZERO
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

impl Cache {
    /// Takes in what a vertex has gathered as what is to be expected around it, unless other geometry covers it.
    fn note_expected(&mut self, vertex: VertexId, sums: &[(SlotId, LightVector)]) {
        let vertex = &self.vertices[vertex];
        if vertex.progress.covered {
            return;
        }
        for (slot, sum) in sums {
            self.expected.note(vertex.position, self.slots[*slot].normal(), sum);
        }
    }
}

/// Writes results into the cache, in order (the engine alone, phase "apply").
pub fn apply(cache: &mut Cache, gathered: &Gathered) {
    Arc::make_mut(&mut cache.radiance).add(&gathered.deposits);
    let mut start = 0;
    for &round in &gathered.rounds {
        let end = start + round.sums as usize;
        if cache.is_of_use(round) {
            let sums = &gathered.sums[start..end];
            cache.indirect.add(round, sums);
            cache.note_expected(round.vertex, sums);
        }
        start = end;
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::square;
    use super::*;

    /// Vertices go on while their rays are on the way.
    #[test]
    fn what_is_not_a_vertex_s_light_any_more_is_dropped() {
        let mut square = square();
        let middle = square.split(square.roots[0]).middles[2];
        let vertex = square.cache.slots[middle].vertex;
        let round = |cache: &Cache| {
            let position = cache.vertices[vertex].position;
            let sums = vec![(middle, LightVector::default())];
            Gathered { rounds: vec![Round { vertex, position, rays: 16, sums: 1 }], sums, ..Gathered::default() }
        };
        let found = round(&square.cache);
        square.cache.vertices[vertex].progress.covered = true;
        apply(&mut square.cache, &found);
        assert_eq!(square.cache.indirect.rays(vertex), 0, "a covered midpoint takes over what is around");
        square.cache.vertices[vertex].progress.enclosed = true;
        apply(&mut square.cache, &found);
        assert_eq!(square.cache.indirect.rays(vertex), 16, "one that saw no light goes on looking");
        square.cache.vertices[vertex].position += Vec3::X;
        apply(&mut square.cache, &found);
        assert_eq!(square.cache.indirect.rays(vertex), 16, "it has moved");
    }

    #[test]
    fn a_covered_base_vertex_keeps_what_it_finds() {
        let mut square = square();
        let corner = square.cache.topology.nodes[square.roots[0]].corners[0];
        let vertex = square.cache.slots[corner].vertex;
        square.cache.vertices[vertex].progress.covered = true;
        let position = square.cache.vertices[vertex].position;
        let rounds = vec![Round { vertex, position, rays: 16, sums: 1 }];
        let sums = vec![(corner, LightVector::default())];
        apply(&mut square.cache, &Gathered { rounds, sums, ..Gathered::default() });
        assert_eq!(square.cache.indirect.rays(vertex), 16);
    }
}
