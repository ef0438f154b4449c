//! Indirect light gathered before the lights changed: shown until new rounds take its place, and taken up again when
//! the lights go back to what they were (light is linear in what the sources emit).

use super::ids::{SlotId, VertexId};
use super::pool::Sparse;
use crate::estimate::light_vector::LightVector;
use crate::light::lighting::Lighting;
use glam::Vec3;

/// Rays and sums gathered under one lighting.
#[derive(Clone, Debug, Default)]
pub struct Gathers {
    /// Rays by vertex.
    pub rays: Sparse<VertexId, u32>,
    /// Sums over those rays, by slot.
    pub sums: Sparse<SlotId, LightVector>,
    /// By midpoint: expected square deviation of D from what its edge's ends predict, (W·sr⁻¹·m⁻²)²; 0 where nothing is
    /// known.
    pub expected: Sparse<VertexId, f32>,
}

/// What is left of other lightings.
#[derive(Clone, Debug, Default)]
pub struct PreviousLighting {
    /// What was gathered just before, whole: a light that is switched back on has lost nothing.
    before: Option<(Lighting, Gathers)>,
    /// What is known from longer ago, newest first come, for lights of 1 W together.
    guess: Sparse<SlotId, LightVector>,
    /// What all lights emit now, W.
    power: Vec3,
}

/// The part of the rays of the lighting before that a first round takes, and the bounds of such a round: enough that
/// new values do not look worse than the old ones did.
const FIRST_SHARE: u32 = 4;
const MOST_FIRST_RAYS: u32 = 64;

impl PreviousLighting {
    /// Replaces what `gathered` holds for lights that were `before` by what is known for lights that are `now`: the
    /// same, scaled, if all lights change alike; what was gathered when they last were so; else nothing.
    pub fn relight(&mut self, gathered: &mut Gathers, before: Lighting, now: &Lighting) {
        self.power = now.power;
        let squared = before.brightening(now).powi(2);
        if let Some(ratio) = before.common_ratio(now) {
            gathered.sums.for_each_mut(|_, sum| *sum = sum.scaled(ratio));
            gathered.expected.for_each_mut(|_, square| *square *= squared);
            return;
        }
        let mut expected = gathered.expected.clone();
        expected.for_each_mut(|_, square| *square *= squared);
        let old = std::mem::replace(gathered, Gathers { expected, ..Gathers::default() });
        let older = self.before.replace((before, old));
        match older {
            Some((lighting, older)) if lighting == *now => *gathered = older,
            Some((lighting, mut older)) => self.remember(&lighting, &mut older),
            None => {}
        }
    }

    /// Keeps sums as a guess for other lights.
    fn remember(&mut self, lighting: &Lighting, gathers: &mut Gathers) {
        if lighting.power == Vec3::ZERO {
            return;
        }
        let per_watt = ratio(Vec3::ONE, lighting.power);
        let guess = &mut self.guess;
        gathers.sums.for_each_mut(|slot, sum| {
            if sum.samples() > 0 {
                *guess.entry(slot) = sum.scaled(per_watt);
            }
        });
    }

    /// What a slot gathered under other lights, times how much more the lights emit now; `None` if it never gathered
    /// any.
    #[must_use]
    pub fn guess(&self, slot: SlotId) -> Option<LightVector> {
        let sampled = |sum: &LightVector| sum.samples() > 0;
        let lit = self.before.as_ref().filter(|(lighting, _)| lighting.power != Vec3::ZERO);
        let newest = lit.map(|(lighting, gathers)| (gathers.sums.get(slot), ratio(self.power, lighting.power)));
        let (sum, factor) =
            newest.filter(|(sum, _)| sampled(sum)).unwrap_or_else(|| (self.guess.get(slot), self.power));
        sampled(&sum).then(|| sum.scaled(factor))
    }

    /// Rays of the first round at a vertex under the present lights, `least` or more.
    #[must_use]
    pub fn first_rays(&self, vertex: VertexId, least: u32) -> u32 {
        let before = self.before.as_ref().map_or(0, |(_, gathers)| gathers.rays.get(vertex));
        (before / FIRST_SHARE).clamp(least, MOST_FIRST_RAYS.max(least))
    }

    /// Forgets what was gathered at a vertex of one slot.
    pub fn forget(&mut self, vertex: VertexId, slot: SlotId) {
        self.before.iter_mut().for_each(|(_, gathers)| gathers.forget(vertex, slot));
        if self.guess.get(slot).samples() > 0 {
            *self.guess.entry(slot) = LightVector::default();
        }
    }

    /// Bytes held.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.guess.bytes() + self.before.as_ref().map_or(0, |(_, gathers)| gathers.bytes())
    }
}

impl Gathers {
    /// Forgets what a vertex of one slot holds.
    pub fn forget(&mut self, vertex: VertexId, slot: SlotId) {
        if self.rays.get(vertex) > 0 {
            *self.rays.entry(vertex) = 0;
            *self.sums.entry(slot) = LightVector::default();
        }
    }

    /// Bytes held.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.rays.bytes() + self.sums.bytes() + self.expected.bytes()
    }
}

/// a / b by channel, 0 where b is.
fn ratio(a: Vec3, b: Vec3) -> Vec3 {
    Vec3::select(b.cmpgt(Vec3::ZERO), a / b, Vec3::ZERO)
}
