//! What the lights of one group send: a single source, or a group of small ones whose visible fraction is sampled together.
//!
//! What a group sends without occlusion is the exact sum over its members; only the fraction of it that is visible is shared:
//! E = E_closed × (Σ v g / Σ g) over points of its members, g the unoccluded contribution of a point, as for one area light
//! (method 6). Members take turns, in an order that the vertex rotates: a whole number of turns leaves no noise but that of
//! penumbrae of single members, none where those are points.

use super::area_sampler::Sampler;
use super::bounds::LightBounds;
use super::lights::{Arrival, Source, delta_arrival};
use crate::math::sequence::Sequence;
use crate::scene::Scene;
use crate::scene::light::LightKind;
use glam::Vec3;

/// The sources that share a light group.
#[derive(Clone, Copy, Debug)]
pub enum LightGroup<'a> {
    /// One source.
    Single(&'a Source),
    /// Several small ones near each other.
    Shared(Members<'a>),
}

/// A group with its sources.
#[derive(Clone, Copy, Debug)]
pub struct Members<'a> {
    pub(super) group: &'a SharedGroup,
    /// All sources of the scene.
    pub(super) sources: &'a [Source],
}

/// Small sources near each other.
#[derive(Clone, Debug)]
pub struct SharedGroup {
    /// Indices of the sources, ascending.
    members: Vec<u32>,
    /// What each counts times beside the others.
    factors: Vec<Vec3>,
    /// What all count times: they change together without anything known of the group becoming wrong.
    common: Vec3,
    /// A sphere that holds all.
    centre: Vec3,
    radius: f32,
    /// What they send at most, from outside of it, with the members' factors.
    bounds: LightBounds,
}

/// Distance in radii from which a group's bound is that of all its power in its sphere.
const FAR: f32 = 4.0;
/// What a member that is off counts as in a group's strength: 0 is for lights that do not reach a place at all.
const OFF: f32 = 1e-6;

impl SharedGroup {
    pub(super) fn new(sources: &[Source], members: Vec<u32>) -> Self {
        let spheres = || members.iter().filter_map(|&m| sphere(&sources[m as usize]));
        let lo = spheres().map(|(c, r)| c - r).fold(Vec3::INFINITY, Vec3::min);
        let hi = spheres().map(|(c, r)| c + r).fold(Vec3::NEG_INFINITY, Vec3::max);
        let centre = (lo + hi) * 0.5;
        let radius = spheres().map(|(c, r)| c.distance(centre) + r).fold(0.0, f32::max);
        let factors = vec![Vec3::ONE; members.len()];
        let mut group = Self { members, factors, common: Vec3::ONE, centre, radius, bounds: LightBounds::default() };
        group.measure_reach(sources);
        group
    }

    fn measure_reach(&mut self, sources: &[Source]) {
        let members = self.members.iter().zip(&self.factors);
        let strengths = members.map(|(&m, factor)| strength(&sources[m as usize]) * factor.max_element());
        self.bounds = LightBounds::of_sphere(self.centre, self.radius, strengths.sum());
    }

    /// Indices of its sources.
    pub(super) fn members(&self) -> &[u32] {
        &self.members
    }

    /// What all members count times.
    pub(super) const fn common(&self) -> Vec3 {
        self.common
    }

    /// Takes over what its sources count times, in the order of the scene's lights; whether they changed against each other.
    pub(super) fn relight(&mut self, sources: &[Source], all: &[Vec3]) -> bool {
        let new: Vec<Vec3> = self.members.iter().map(|&m| all[m as usize]).collect();
        let ratio = common_ratio(&self.factors, &new);
        self.common = ratio.unwrap_or(Vec3::ONE);
        if ratio.is_none() {
            self.factors = new;
            self.measure_reach(sources);
        }
        ratio.is_none()
    }
}

/// What all of `from` are multiplied by to get `to`, by channel; `None` if they differ.
fn common_ratio(from: &[Vec3], to: &[Vec3]) -> Option<Vec3> {
    let channel = |c: usize| {
        let pairs = || from.iter().zip(to).map(|(f, t)| (f[c], t[c]));
        let (most, its) = pairs().fold((0.0, 0.0), |best, pair| if pair.0 > best.0 { pair } else { best });
        let ratio = if most > 0.0 { its / most } else { 1.0 };
        pairs().all(|(f, t)| (t - f * ratio).abs() <= t * 1e-6).then_some(ratio)
    };
    Some(Vec3::new(channel(0)?, channel(1)?, channel(2)?))
}

/// A sphere that holds a source, if it has a place.
pub(super) fn sphere(source: &Source) -> Option<(Vec3, f32)> {
    match source {
        Source::Delta(LightKind::Point { position, .. } | LightKind::Spot { position, .. }) => Some((*position, 0.0)),
        Source::Delta(_) => None,
        Source::Area(area) => Some(area.sphere()),
    }
}

/// Upper bound of the luminance of a source's irradiance × squared distance.
fn strength(source: &Source) -> f32 {
    source.bounds().map_or(0.0, |bounds| bounds.strength())
}

impl<'a> LightGroup<'a> {
    /// The sources with what each counts times beside the others.
    pub fn sources(self) -> impl Iterator<Item = (&'a Source, Vec3)> {
        let (single, group) = match self {
            Self::Single(source) => (Some((source, Vec3::ONE)), None),
            Self::Shared(members) => (None, Some(members.sources())),
        };
        single.into_iter().chain(group.into_iter().flatten())
    }

    /// Upper bound of the luminance of the unoccluded irradiance at `x` on a surface of unit `normal`; 0 only where no light can
    /// arrive.
    #[must_use]
    pub fn bound(self, x: Vec3, normal: Vec3) -> f32 {
        match self {
            Self::Single(source) => source.bound(x, normal),
            Self::Shared(members) => members.bound(x, normal),
        }
    }

    /// What gives the same bound at places that are not [near](Self::is_near); `None` if nothing does anywhere.
    pub(super) fn bounds(self) -> Option<LightBounds> {
        match self {
            Self::Single(source) => source.bounds(),
            Self::Shared(members) => Some(members.group.bounds),
        }
    }

    /// Whether only [`Self::bound`] itself tells the bound at `x`: that of a group is the sum over its members there.
    pub(super) fn is_near(self, x: Vec3) -> bool {
        match self {
            Self::Single(source) => source.bounds().is_none(),
            Self::Shared(members) => members.is_near(x),
        }
    }

    /// The luminance of the unoccluded irradiance itself, roughly: what to order lights by; 0 only where no light can arrive,
    /// whatever sources are on.
    #[must_use]
    pub fn strength(self, x: Vec3, normal: Vec3) -> f32 {
        match self {
            Self::Single(source) => source.strength(x, normal),
            Self::Shared(members) => members.strength(x, normal),
        }
    }

    /// Whether one ray tells all about its visibility.
    #[must_use]
    pub const fn is_delta(self) -> bool {
        matches!(self, Self::Single(Source::Delta(_)))
    }

    /// Whether what arrives without occlusion is known exactly everywhere.
    #[must_use]
    pub fn has_closed_form(self) -> bool {
        match self {
            Self::Single(Source::Area(area)) => area.has_closed_form(),
            // Others are not grouped.
            Self::Single(Source::Delta(_)) | Self::Shared(_) => true,
        }
    }

    /// Number of sources.
    #[must_use]
    pub fn count(self) -> u32 {
        match self {
            Self::Single(_) => 1,
            Self::Shared(members) => members.group.members.len() as u32,
        }
    }

    /// Number of points that tell all about its visibility, if any does.
    #[must_use]
    pub fn all_points(self) -> Option<u32> {
        let is_delta = match self {
            Self::Single(source) => matches!(source, Source::Delta(_)),
            // Members are of one kind.
            Self::Shared(members) => matches!(members.sources[members.source(0)], Source::Delta(_)),
        };
        is_delta.then(|| self.count())
    }

    /// Points as seen from `x`, chosen by a sequence.
    #[must_use]
    pub fn points(self, x: Vec3, sequence: Sequence) -> Points<'a> {
        let source = match self {
            Self::Single(Source::Delta(kind)) => PointSource::Delta(delta_arrival(kind, x)),
            Self::Single(Source::Area(area)) => PointSource::Area(area.at(x)),
            Self::Shared(members) => PointSource::Shared(Turns::new(members, x, &sequence)),
        };
        Points { sequence, source }
    }
}

impl<'a> Members<'a> {
    fn sources(self) -> impl Iterator<Item = (&'a Source, Vec3)> {
        let members = self.group.members.iter().zip(&self.group.factors);
        members.map(move |(&m, &factor)| (&self.sources[m as usize], factor))
    }

    /// Height of the highest part over a surface's horizon.
    fn highest(self, x: Vec3, normal: Vec3) -> f32 {
        (self.group.centre - x).dot(normal) + self.group.radius
    }

    fn bound(self, x: Vec3, normal: Vec3) -> f32 {
        if self.highest(x, normal) < 0.0 {
            return 0.0;
        }
        if self.is_near(x) { self.bounds(x, normal).sum() } else { self.group.bounds.bound(x, normal) }
    }

    fn is_near(self, x: Vec3) -> bool {
        self.group.centre.distance_squared(x) < (FAR * self.group.radius).powi(2)
    }

    /// Bounds of its members one by one.
    pub(super) fn bounds(self, x: Vec3, normal: Vec3) -> impl Iterator<Item = f32> + 'a {
        self.sources().map(move |(source, factor)| source.bound(x, normal) * factor.max_element())
    }

    /// Index among the scene's sources of member `at`.
    pub(super) fn source(self, at: usize) -> usize {
        self.group.members[at] as usize
    }

    fn strength(self, x: Vec3, normal: Vec3) -> f32 {
        if self.highest(x, normal) < 0.0 {
            return 0.0;
        }
        self.sources().map(|(source, factor)| source.strength(x, normal) * factor.max_element().max(OFF)).sum()
    }
}

/// Points of the sources of a group as seen from one place.
#[derive(Clone, Debug)]
pub struct Points<'a> {
    sequence: Sequence,
    source: PointSource<'a>,
}

#[derive(Clone, Debug)]
#[allow(clippy::large_enum_variant, reason = "one at a time on the stack, in the inner loop")]
enum PointSource<'a> {
    /// A single direction, if light comes from there.
    Delta(Option<Arrival>),
    Area(Sampler<'a>),
    Shared(Turns<'a>),
}

impl Points<'_> {
    /// The light that arrives from the point of an index, as if the whole group were there; `None` where none does. The mean of
    /// `facing · max(0, n·direction)` over points is the unoccluded irradiance.
    #[must_use]
    pub fn sample(&self, scene: &Scene, index: u32) -> Option<Arrival> {
        match &self.source {
            PointSource::Delta(arrival) => *arrival,
            PointSource::Area(sampler) => {
                let [u, v, ..] = self.sequence.point(index);
                sampler.sample(scene, [u, v])
            }
            PointSource::Shared(turns) => turns.sample(scene, &self.sequence, index),
        }
    }
}

/// The members of a group one after the other. Emission plays no part in the order, so that a point stays where it is when lights
/// change.
#[derive(Clone, Debug)]
struct Turns<'a> {
    members: Members<'a>,
    x: Vec3,
    first: u32,
    step: u32,
}

/// Members that follow each other are this share of all apart, so that a few are spread over all.
const SPREAD: f32 = 0.618;

impl<'a> Turns<'a> {
    fn new(members: Members<'a>, x: Vec3, sequence: &Sequence) -> Self {
        let count = members.group.members.len() as u32;
        let [first, ..] = sequence.point(0);
        let wanted = (SPREAD * count as f32) as u32;
        let step = (wanted..).find(|&step| gcd(step, count) == 1).unwrap_or(1);
        Self { members, x, first: ((first * count as f32) as u32).min(count - 1), step }
    }

    fn sample(&self, scene: &Scene, sequence: &Sequence, index: u32) -> Option<Arrival> {
        let count = self.members.group.members.len();
        let at = (self.first as usize + index as usize * self.step as usize) % count;
        let arrival = match &self.members.sources[self.members.source(at)] {
            Source::Delta(kind) => delta_arrival(kind, self.x)?,
            Source::Area(area) => {
                let [u, v, ..] = sequence.point_of_set(index / count as u32, 1 + at as u32);
                area.at(self.x).sample(scene, [u, v])?
            }
        };
        let times = self.members.group.factors[at] * count as f32;
        Some(Arrival { facing: arrival.facing * times, measure: arrival.measure * count as f32, ..arrival })
    }
}

const fn gcd(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { gcd(b, a % b) }
}
