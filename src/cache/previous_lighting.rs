//! Indirect light gathered before the lights changed: shown until new rounds take its place, and taken up again when
//! the lights go back to what they were (light is linear in what the sources emit).

use super::ids::{SlotId, VertexId};
use super::sparse::Sparse;
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
    /// Vertices that gathered just before, and have not in the present light.
    pub(super) outdated: u64,
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
        self.outdated = 0;
        if let Some((_, before)) = &mut self.before {
            let is_outdated = |vertex, rays| rays > 0 && gathered.rays.get(vertex) == 0;
            before.rays.for_each_mut(|vertex, rays| self.outdated += u64::from(is_outdated(vertex, *rays)));
        }
    }

    /// Notes that a vertex is gathering in the present light, or forgotten, which had not gathered in it.
    pub fn note_gathered(&mut self, vertex: VertexId) {
        if self.before.as_ref().is_some_and(|(_, before)| before.rays.get(vertex) > 0) {
            self.outdated = self.outdated.saturating_sub(1);
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

    /// Gives back what a vertex and its slots hold, which are gone.
    pub fn remove(&mut self, vertex: VertexId, slots: &[SlotId]) {
        self.before.iter_mut().for_each(|(_, gathers)| gathers.remove(vertex, slots));
        slots.iter().for_each(|&slot| self.guess.reset(slot));
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
    /// Gives back what a vertex and its slots hold, which are gone.
    pub fn remove(&mut self, vertex: VertexId, slots: &[SlotId]) {
        self.rays.reset(vertex);
        self.expected.reset(vertex);
        slots.iter().for_each(|&slot| self.sums.reset(slot));
    }

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

#[cfg(test)]
mod tests {
    use super::super::testing::gathered;
    use super::*;

    const VERTEX: VertexId = VertexId(3);
    const SLOT: SlotId = SlotId(5);

    /// Two lamps of 1 and 3 W that count times these factors.
    fn lighting(factors: [f32; 2]) -> Lighting {
        let power = Vec3::splat(factors[0] + 3.0 * factors[1]);
        Lighting { factors: factors.map(Vec3::splat).to_vec(), positions: vec![None, Some(Vec3::ZERO)], power }
    }

    /// What a vertex gathered of so many rays that find a diffuse luminance.
    fn gathers(rays: usize, found: f32) -> Gathers {
        let mut gathers = Gathers::default();
        *gathers.rays.entry(VERTEX) = rays as u32;
        *gathers.sums.entry(SLOT) = gathered(Vec3::Y, &vec![found; rays]);
        *gathers.expected.entry(VERTEX) = 0.04;
        gathers
    }

    fn close(a: f32, b: f32) -> bool {
        (a / b - 1.0).abs() < 1e-5
    }

    #[test]
    fn a_lamp_switched_off_and_on_again_has_lost_nothing() {
        let (mut previous, mut now) = (PreviousLighting::default(), gathers(40, 2.0));
        let (both, one) = (lighting([1.0, 1.0]), lighting([1.0, 0.0]));
        let before = now.sums.get(SLOT);
        previous.relight(&mut now, both.clone(), &one);
        assert_eq!((now.rays.get(VERTEX), now.sums.get(SLOT).samples()), (0, 0), "none of it is of this light");
        // A round under the one lamp must not get lost either.
        (*now.rays.entry(VERTEX), *now.sums.entry(SLOT)) = (8, gathered(Vec3::Y, &[0.5; 8]));
        previous.relight(&mut now, one.clone(), &both);
        assert_eq!((now.rays.get(VERTEX), now.sums.get(SLOT)), (40, before));
        previous.relight(&mut now, both, &one);
        assert_eq!((now.rays.get(VERTEX), now.sums.get(SLOT)), (8, gathered(Vec3::Y, &[0.5; 8])));
    }

    #[test]
    fn a_lamp_moved_there_and_back_has_lost_nothing_and_one_that_is_off_may_move() {
        let (mut previous, mut now) = (PreviousLighting::default(), gathers(40, 2.0));
        let moved = |factors: [f32; 2]| Lighting { positions: vec![None, Some(Vec3::X)], ..lighting(factors) };
        let before = now.sums.get(SLOT);
        previous.relight(&mut now, lighting([1.0, 0.0]), &moved([1.0, 0.0]));
        assert_eq!(now.sums.get(SLOT), before, "it is off");
        previous.relight(&mut now, moved([1.0, 1.0]), &lighting([1.0, 1.0]));
        assert_eq!(now.rays.get(VERTEX), 0);
        assert!(previous.guess(SLOT).is_some_and(|sum| close(sum.irradiance().x, before.irradiance().x)));
        previous.relight(&mut now, lighting([1.0, 1.0]), &moved([1.0, 1.0]));
        assert_eq!((now.rays.get(VERTEX), now.sums.get(SLOT)), (40, before));
    }

    #[test]
    fn lamps_that_change_alike_scale_what_was_gathered() {
        let (mut previous, mut now) = (PreviousLighting::default(), gathers(40, 2.0));
        previous.relight(&mut now, lighting([1.0, 1.0]), &lighting([0.5, 0.5]));
        assert_eq!(now.rays.get(VERTEX), 40);
        assert!(close(now.sums.get(SLOT).irradiance().x, std::f32::consts::PI));
        assert!(close(now.expected.get(VERTEX), 0.01), "a square goes with the square");
        assert!(previous.guess(SLOT).is_none(), "nothing of it is a guess");
    }

    #[test]
    fn other_light_is_guessed_by_its_power() {
        let (mut previous, mut now) = (PreviousLighting::default(), gathers(40, 2.0));
        let states = [[1.0, 1.0], [1.0, 0.0], [0.0, 2.0]].map(lighting);
        previous.relight(&mut now, states[0].clone(), &states[1]);
        let guess = |p: &PreviousLighting| p.guess(SLOT).map(|sum| sum.irradiance().x / std::f32::consts::PI);
        assert!(guess(&previous).is_some_and(|d| close(d, 2.0 / 4.0)), "1 W of 4 W");
        // Two changes ago: kept for 1 W.
        previous.relight(&mut now, states[1].clone(), &states[2]);
        assert!(guess(&previous).is_some_and(|d| close(d, 2.0 / 4.0 * 6.0)), "6 W");
        assert!(previous.guess(SlotId(6)).is_none(), "it never gathered");
    }

    #[test]
    fn first_rounds_go_by_what_was_gathered_before() {
        let rays = |gathered: usize| {
            let (mut previous, mut now) = (PreviousLighting::default(), gathers(gathered, 1.0));
            previous.relight(&mut now, lighting([1.0, 1.0]), &lighting([1.0, 0.0]));
            previous.first_rays(VERTEX, 16)
        };
        assert_eq!([8, 128, 1024].map(rays), [16, 32, MOST_FIRST_RAYS]);
        assert_eq!(PreviousLighting::default().first_rays(VERTEX, 100), 100);
    }

    #[test]
    fn a_vertex_that_moves_is_forgotten_in_all_lightings() {
        let (mut previous, mut now) = (PreviousLighting::default(), gathers(40, 2.0));
        let states = [[1.0, 1.0], [1.0, 0.0], [0.0, 2.0]].map(lighting);
        previous.relight(&mut now, states[0].clone(), &states[1]);
        previous.relight(&mut now, states[1].clone(), &states[2]);
        previous.forget(VERTEX, SLOT);
        assert!(previous.guess(SLOT).is_none());
        let mut kept = gathers(40, 2.0);
        kept.forget(VERTEX, SLOT);
        assert_eq!((kept.rays.get(VERTEX), kept.sums.get(SLOT).samples()), (0, 0));
    }
}
