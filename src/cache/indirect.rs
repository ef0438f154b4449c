//! Indirect light shown at slots: what they have gathered, what those around them predict, or both by what they are
//! worth.

use super::ascending::ascending;
use super::between::Between;
use super::ids::{SlotId, VertexId};
use super::prediction::Prediction;
use super::slot::{Eye, SlotLight, Specular};
use super::sparse::Sparse;
use super::store::Cache;
use crate::estimate::light_vector::LightVector;
use crate::light::lighting::Lighting;
use crate::math::luminance;
use glam::{Vec3, Vec4};
use std::f32::consts::PI;
use std::sync::Arc;

/// S of slots for one eye, as far as they show any.
pub type SpecularTable = Sparse<SlotId, Specular>;

/// Evaluates runs of slots, each by itself, in their order; on several threads if there are many.
pub type Evaluate<'a> = &'a dyn Fn(&[SlotId], EvaluateRun<'_>) -> Vec<Evaluated>;

/// Evaluates a run of slots.
pub type EvaluateRun<'a> = &'a (dyn Fn(&[SlotId]) -> Evaluated + Sync);

/// A run of slots evaluated.
#[derive(Debug)]
pub struct Evaluated {
    /// What they show, in their order.
    lights: Vec<SlotLight>,
    /// Slots inside the faces that they predict.
    predicted: Vec<SlotId>,
}

/// Standard error of a guess from before the lights changed, against the value.
const STALE_ERROR: f32 = 0.25;

impl Cache {
    /// Takes in that the lights have changed: what was gathered is scaled, brought back or set aside. The slots'
    /// values are to be refreshed.
    pub fn relight_indirect(&mut self, before: Lighting, now: &Lighting) {
        let common = before.common_ratio(now);
        Arc::make_mut(&mut self.radiance).relight(common);
        self.expected.relight(common);
        self.indirect.forget_smoothed();
        self.indirect.previous.relight(&mut self.indirect.gathers, before, now);
    }

    /// Brings the indirect light of slots that have gathered, and of all that depends on them, up to date; returns every
    /// slot that was written.
    pub fn refresh_indirect(
        &mut self,
        slots: &[SlotId],
        eye: Vec3,
        specular: &mut SpecularTable,
        evaluate: Evaluate<'_>,
    ) -> Vec<SlotId> {
        let mut due = slots.to_vec();
        if self.indirect.filter {
            let base = slots.iter().filter(|s| self.slots[**s].is_base() && self.indirect.is_sampled(**s));
            due.extend(base.flat_map(|&s| self.neighbours(s)));
        }
        self.indirect.stale |= due.iter().any(|slot| self.slots[*slot].is_base());
        self.evaluate_indirect(&due, (eye, specular), evaluate)
    }

    /// Whether predictions of base slots are to be brought up to date.
    #[must_use]
    pub const fn predictions_are_stale(&self) -> bool {
        self.indirect.stale
    }

    /// Brings up to date the predictions of base vertices, what is expected where there is none, and all that depends on them;
    /// returns the slots written.
    pub fn refresh_predictions(
        &mut self,
        base: impl Iterator<Item = VertexId>,
        eye: Vec3,
        specular: &mut SpecularTable,
        evaluate: Evaluate<'_>,
    ) -> Vec<SlotId> {
        self.indirect.stale = false;
        let is_predicted = |&slot: &SlotId| !self.indirect.is_sampled(slot);
        let slots = base.flat_map(|vertex| self.slots_of(vertex)).filter(is_predicted);
        let due: Vec<SlotId> = slots.collect();
        self.evaluate_indirect(&due, (eye, specular), evaluate)
    }

    /// Evaluates, from what is known, the indirect light of slots and of those inside the faces that they predict, rank by rank,
    /// so that each comes after those that predict it; returns every slot that was written. (The coarsest base vertices, which
    /// predict each other before they gather, see the values before.)
    pub fn evaluate_indirect(
        &mut self,
        slots: &[SlotId],
        (position, specular): (Vec3, &mut SpecularTable),
        evaluate: Evaluate<'_>,
    ) -> Vec<SlotId> {
        let mut waves: Vec<Vec<SlotId>> = Vec::new();
        self.add_by_rank(slots, &mut waves);
        let (mut written, mut rank) = (Vec::with_capacity(slots.len()), 0);
        while rank < waves.len() {
            let mut wave = std::mem::take(&mut waves[rank]);
            ascending(&mut wave);
            let (cache, eye) = (&*self, Eye { position, specular });
            let found = evaluate(&wave, &|run| cache.evaluate_run(run, eye));
            found.iter().for_each(|run| cache.add_by_rank(&run.predicted, &mut waves));
            for (&slot, light) in wave.iter().zip(found.iter().flat_map(|run| &run.lights)) {
                self.slots[slot].set_indirect(light.kept());
                specular.update(slot, |shown| shown.indirect = light.specular);
            }
            written.append(&mut wave);
            rank += 1;
        }
        written
    }

    /// Adds slots to the waves of their ranks.
    pub(super) fn add_by_rank(&self, slots: &[SlotId], waves: &mut Vec<Vec<SlotId>>) {
        for &slot in slots {
            let rank = usize::from(self.slots[slot].rank);
            if rank >= waves.len() {
                waves.resize_with(rank + 1, Vec::new);
            }
            waves[rank].push(slot);
        }
    }

    fn evaluate_run(&self, slots: &[SlotId], eye: Eye<'_>) -> Evaluated {
        let is_predicted = |next: &SlotId| !self.indirect.is_sampled(*next);
        let mut predicted = Vec::new();
        slots.iter().for_each(|&slot| predicted.extend(self.lying_between(slot).filter(is_predicted)));
        Evaluated { lights: slots.iter().map(|&slot| self.indirect_light(slot, eye)).collect(), predicted }
    }

    /// Indirect light of a slot: what it has gathered, what those around it predict, or both by what they are worth.
    fn indirect_light(&self, slot: SlotId, eye: Eye<'_>) -> SlotLight {
        let predicted = self.prediction(slot, eye);
        if self.indirect.is_sampled(slot) {
            let own = self.gathered(slot, eye.position);
            return match predicted {
                _ if !self.indirect.filter => SlotLight { variance: self.likely_variance(slot), ..own },
                Some(Prediction { light: SlotLight { stale: true, .. }, .. }) => own,
                _ => self.combined(slot, own, predicted),
            };
        }
        let predicted = predicted.map(|predicted| self.shown_by_prediction(slot, predicted));
        // A vertex inside a leaf may not gather again: what is around it has the newer guess.
        if predicted.is_some() && self.between(slot).as_ref().is_some_and(Between::is_inside_leaf) {
            return predicted.unwrap_or_default();
        }
        self.guessed(slot, eye.position).or(predicted).unwrap_or_default()
    }

    /// What a slot has gathered itself.
    #[must_use]
    pub fn gathered(&self, slot: SlotId, eye: Vec3) -> SlotLight {
        self.light_of(&self.indirect.sum(slot), slot, eye)
    }

    /// Light vector of the indirect light at a slot over π, and its fluence, by luminance, W·sr⁻¹·m⁻²: as of even light where nothing was
    /// gathered.
    #[must_use]
    pub fn indirect_vector(&self, slot: SlotId) -> Vec4 {
        let sum = self.indirect.sum(slot);
        let shown = luminance(self.slots[slot].indirect().diffuse);
        let gathered = luminance(sum.irradiance()) / PI;
        if gathered > 0.0 {
            return sum.vector().extend(sum.fluence()) * (shown / (gathered * PI));
        }
        self.slots[slot].normal().extend(2.0) * shown
    }

    /// What a slot gathered before the lights changed, as a guess of what it would now.
    fn guessed(&self, slot: SlotId, eye: Vec3) -> Option<SlotLight> {
        let light = self.light_of(&self.indirect.previous.guess(slot)?, slot, eye);
        let doubt = STALE_ERROR * luminance(light.diffuse);
        Some(SlotLight { variance: light.variance + doubt * doubt, stale: true, ..light })
    }

    /// The light that sums at a slot stand for.
    fn light_of(&self, sum: &LightVector, slot: SlotId, eye: Vec3) -> SlotLight {
        let record = &self.slots[slot];
        let to_eye = (eye - self.vertices[record.vertex].position).normalize_or(record.normal());
        let gloss = self.gloss(slot);
        let specular = gloss.filter(|gloss| !gloss.is_mirror());
        let specular = specular.map_or(Vec3::ZERO, |gloss| sum.specular(&gloss.seen(record.normal(), to_eye)));
        let share = gloss.map_or(1.0, |gloss| sum.diffuse_share(gloss, record.normal()));
        let variance = sum.variance_of_mean() / (PI * PI);
        SlotLight { diffuse: sum.irradiance() * (share / PI), specular, variance, known: true, ..SlotLight::default() }
    }
}

#[cfg(test)]
mod tests {
    use super::super::slot::{COVERED_WEIGHT, Luminance};
    use super::super::testing::{Rooted, known, square};
    use super::*;

    fn one_by_one(slots: &[SlotId], evaluate: EvaluateRun<'_>) -> Vec<Evaluated> {
        slots.chunks(1).map(evaluate).collect()
    }

    /// A square split once: the middle of the first triangle's diagonal, and the ends of it, which show 1 and 3.
    fn split() -> (Rooted, SlotId, [SlotId; 2]) {
        let mut square = square();
        let root = square.roots[0];
        let middle = square.split(root).middles[2];
        let corners = square.cache.topology.nodes[root].corners;
        let ends = [corners[0], corners[2]];
        let lights = [known(1.0, 0.25), known(3.0, 0.5)];
        ends.into_iter().zip(lights).for_each(|(end, light)| square.cache.slots[end].set_indirect(light));
        (square, middle, ends)
    }

    fn predicted(square: &Rooted, middle: SlotId) -> SlotLight {
        let predicted = square.cache.prediction(middle, Eye { position: Vec3::Y, specular: &SpecularTable::default() });
        predicted.map_or(SlotLight::default(), |predicted| predicted.light)
    }

    #[test]
    fn a_midpoint_is_predicted_by_the_mean_of_its_ends() {
        let (square, middle, _) = split();
        let light = predicted(&square, middle);
        assert!((light.diffuse.x - 2.0).abs() < 1e-6 && light.known && !light.stale, "{light:?}");
        assert!((light.variance - (0.25 + 0.5) / 4.0).abs() < 1e-6, "the variance of a mean of independent values");
    }

    #[test]
    fn a_covered_end_counts_for_nearly_nothing_and_an_unknown_one_for_nothing() {
        let (mut square, middle, [near, far]) = split();
        let vertex = square.cache.slots[far].vertex;
        square.cache.vertices[vertex].progress.covered = true;
        let expected = (1.0 + 3.0 * COVERED_WEIGHT) / (1.0 + COVERED_WEIGHT);
        assert!((predicted(&square, middle).diffuse.x - expected).abs() < 1e-6);
        square.cache.slots[far].set_indirect(Luminance::default());
        assert_eq!(predicted(&square, middle).diffuse.x, 1.0);
        square.cache.slots[near].set_indirect(Luminance { stale: true, ..known(1.0, 0.25) });
        assert!(predicted(&square, middle).stale, "no better than what it comes from");
        square.cache.slots[near].set_indirect(Luminance::default());
        assert!(!predicted(&square, middle).known);
    }

    /// Values at the ends that the rays of both have found reach the midpoint, and go on to what lies between that and others.
    #[test]
    fn what_changes_goes_on_to_all_that_depends_on_it() {
        let (mut square, middle, [near, far]) = split();
        let children = square.cache.topology.children(square.roots[0]).collect::<Vec<_>>();
        let finer = square.split(children[0]).middles;
        square.gather(near, &[4.0; 32]);
        square.gather(far, &[2.0; 32]);
        let mut specular = SpecularTable::default();
        let written = square.cache.refresh_indirect(&[near, far], Vec3::Y, &mut specular, &one_by_one);
        let shown = |slot: SlotId| square.cache.slots[slot].indirect().diffuse.x;
        assert!((shown(middle) - 3.0).abs() < 1e-5, "{}", shown(middle));
        let quarter = finer.into_iter().find(|&slot| {
            let between = square.cache.between(slot).expect("a midpoint");
            between.of.iter().all(|(end, _)| [near, middle].contains(end))
        });
        let quarter = quarter.expect("between the corner and the middle of the diagonal");
        assert!((shown(quarter) - 3.5).abs() < 1e-5, "{}", shown(quarter));
        assert!(written.contains(&middle) && written.contains(&quarter), "{written:?}");
    }

    #[test]
    fn a_midpoint_with_many_rays_shows_what_they_found() {
        let (mut square, middle, ends) = split();
        square.cache.indirect.filter = true;
        ends.into_iter().for_each(|end| square.gather(end, &[1.0, 3.0].repeat(64)));
        let mut show = |rays: usize| {
            square.gather(middle, &[0.0, 5.0].repeat(rays / 2));
            let (slots, mut specular) = ([ends[0], ends[1], middle], SpecularTable::default());
            square.cache.refresh_indirect(&slots, Vec3::Y, &mut specular, &one_by_one);
            square.cache.slots[middle].indirect().diffuse.x
        };
        let (few, many) = (show(16), show(16_384));
        assert!(2.0 < few && few < 2.4, "noisy: it leans on the ends, which say 2: {few}");
        assert!((2.45..2.51).contains(&many), "{many}");
    }
}
