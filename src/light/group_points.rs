//! Points of the sources of a light group as seen from one place, for shadow rays.
//!
//! The members of a group take turns, in an order that the place rotates: a whole number of turns leaves no noise but
//! that of penumbrae of single members, none where those are points.

use super::arrival::Arrival;
use super::group::{LightGroup, Members};
use super::source::SourceSampler;
use crate::math::sequence::Sequence;
use crate::scene::Scene;
use glam::Vec3;

/// Points of a light group, chosen by a sequence.
#[derive(Clone, Debug)]
pub struct Points<'a> {
    sequence: Sequence,
    sampler: GroupSampler<'a>,
}

#[derive(Clone, Debug)]
#[allow(clippy::large_enum_variant, reason = "one at a time on the stack, in the inner loop")]
enum GroupSampler<'a> {
    Single(SourceSampler<'a>),
    Shared(Turns<'a>),
}

impl<'a> LightGroup<'a> {
    /// Points as seen from `x` by surfaces whose normals are about `normal`, chosen by a sequence.
    #[must_use]
    pub fn points(self, (x, normal): (Vec3, Vec3), sequence: Sequence) -> Points<'a> {
        let sampler = match self {
            Self::Single(source) => GroupSampler::Single(source.sampler(x, normal)),
            Self::Shared(members) => GroupSampler::Shared(Turns::new(members, (x, normal), &sequence)),
        };
        Points { sequence, sampler }
    }
}

impl Points<'_> {
    /// The light that arrives from the point of an index, as if the whole group were there; `None` where none does. The
    /// mean of [`Arrival::irradiance`] over points is the unoccluded irradiance.
    #[must_use]
    pub fn sample(&self, scene: &Scene, index: u32) -> Option<Arrival> {
        match &self.sampler {
            GroupSampler::Single(sampler) => sampler.sample(scene, || {
                let [u, v, ..] = self.sequence.point(index);
                [u, v]
            }),
            GroupSampler::Shared(turns) => turns.sample(scene, &self.sequence, index),
        }
    }
}

/// The members of a group one after the other. Emission plays no part in the order, so that a point stays where it is
/// when lights change.
#[derive(Clone, Debug)]
struct Turns<'a> {
    members: Members<'a>,
    x: Vec3,
    normal: Vec3,
    first: u32,
    step: u32,
}

/// Members that follow each other are this share of all apart, so that a few are spread over all.
const SPREAD: f32 = 0.618;

impl<'a> Turns<'a> {
    fn new(members: Members<'a>, (x, normal): (Vec3, Vec3), sequence: &Sequence) -> Self {
        let count = members.count();
        let [first, ..] = sequence.point(0);
        let wanted = (SPREAD * count as f32) as u32;
        let step = (wanted..).find(|&step| gcd(step, count) == 1).unwrap_or(1);
        Self { members, x, normal, first: ((first * count as f32) as u32).min(count - 1), step }
    }

    fn sample(&self, scene: &Scene, sequence: &Sequence, index: u32) -> Option<Arrival> {
        let count = self.members.count() as usize;
        let at = (self.first as usize + index as usize * self.step as usize) % count;
        let sampler = self.members.member(at).sampler(self.x, self.normal);
        let arrival = sampler.sample(scene, || {
            let [u, v, ..] = sequence.point_of_set(index / count as u32, 1 + at as u32);
            [u, v]
        })?;
        let times = self.members.factor(at) * count as f32;
        Some(Arrival { facing: arrival.facing * times, measure: arrival.measure * count as f32, ..arrival })
    }
}

const fn gcd(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { gcd(b, a % b) }
}
