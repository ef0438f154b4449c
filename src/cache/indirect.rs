//! Indirect light shown at slots: what they have gathered, what those around them predict, or both by what they are
//! worth.

use super::ids::SlotId;
use super::pool::Table;
use super::slot::{Between, Eye, SlotLight, Specular};
use super::store::Cache;
use crate::estimate::light_vector::LightVector;
use crate::light::lighting::Lighting;
use crate::math::luminance;
use glam::Vec3;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::f32::consts::PI;

/// S of slots for one eye.
pub type SpecularTable = Table<SlotId, Specular>;

/// Standard error of a guess from before the lights changed, against the value.
const STALE_ERROR: f32 = 0.25;

impl Cache {
    /// Takes in that the lights have changed: what was gathered is scaled, brought back or set aside. The slots'
    /// values are to be refreshed.
    pub fn relight_indirect(&mut self, before: Lighting, now: &Lighting) {
        self.radiance.relight(before.common_ratio(now));
        self.indirect.previous.relight(&mut self.indirect.gathers, before, now);
    }

    /// Brings the indirect light of slots and of all that depends on them up to date; returns every slot that was
    /// written, in ascending order.
    pub fn refresh_indirect(&mut self, slots: &[SlotId], eye: Vec3, specular: &mut SpecularTable) -> Vec<SlotId> {
        let mut due = slots.to_vec();
        if self.indirect.filter {
            let base = slots.iter().filter(|s| self.slots[**s].is_base() && self.indirect.is_sampled(**s));
            due.extend(base.flat_map(|&s| self.neighbours(s)));
        }
        self.refresh(&due, (eye, specular), false)
    }

    /// Predictions of base slots that wait to be brought up to date.
    #[must_use]
    pub fn waiting_predictions(&self) -> usize {
        self.indirect.waiting.len()
    }

    /// Brings the predictions of base slots up to date, and all that depends on them; returns the slots written.
    pub fn refresh_predictions(&mut self, eye: Vec3, specular: &mut SpecularTable) -> Vec<SlotId> {
        let waiting = std::mem::take(&mut self.indirect.waiting);
        waiting.iter().for_each(|slot| self.slots[*slot].waits = false);
        self.refresh(&waiting, (eye, specular), true)
    }

    /// Evaluates slots and those that they predict, each after those that predict it; predictions of base slots are
    /// only noted unless they are wanted, too.
    fn refresh(
        &mut self,
        slots: &[SlotId],
        (position, specular): (Vec3, &mut SpecularTable),
        predictions: bool,
    ) -> Vec<SlotId> {
        let order = |cache: &Self, slot: SlotId| Reverse((cache.slots[slot].rank, slot));
        let mut due: BinaryHeap<_> = slots.iter().map(|&slot| order(self, slot)).collect();
        let mut written = Vec::with_capacity(slots.len());
        while let Some(Reverse((_, slot))) = due.pop() {
            if written.last() == Some(&slot) {
                continue;
            }
            written.push(slot);
            let light = self.indirect_light(slot, Eye { position, specular });
            self.slots[slot].indirect = light.kept();
            specular[slot].indirect = light.specular;
            let mut link = self.first_between(slot);
            while let Some((next, following)) = link {
                link = following.and_then(|link| self.linked_between(link));
                if self.indirect.is_sampled(next) {
                    continue;
                }
                if self.slots[next].is_base() && !predictions {
                    if !std::mem::replace(&mut self.slots[next].waits, true) {
                        self.indirect.waiting.push(next);
                    }
                } else {
                    due.push(order(self, next));
                }
            }
        }
        written
    }

    /// Indirect light of a slot: what it has gathered, what those around it predict, or both by what they are worth.
    fn indirect_light(&self, slot: SlotId, eye: Eye<'_>) -> SlotLight {
        let between = self.slots[slot].between.as_ref();
        let predicted = between.map(|between| match between.coarse {
            true => self.shown_from_coarse(slot, between, eye),
            false => self.predicted(between, eye),
        });
        let predicted = predicted.filter(|light| light.known);
        let own = self.indirect.is_sampled(slot).then(|| self.gathered(slot, eye.position));
        match (own, predicted) {
            (Some(own), _) if !self.indirect.filter => SlotLight { variance: self.likely_variance(slot), ..own },
            (Some(own), Some(predicted)) if predicted.coarse => self.filtered(slot, own, eye),
            (Some(own), Some(predicted)) if predicted.stale => own,
            (Some(own), Some(predicted)) => self.combined(slot, own, predicted),
            (Some(own), None) => self.filtered(slot, own, eye),
            // A vertex inside a leaf may not gather again: what is around it has the newer guess.
            (None, Some(predicted)) if between.is_some_and(Between::is_inside_leaf) => predicted,
            (None, predicted) => self.guessed(slot, eye.position).or(predicted).unwrap_or_default(),
        }
    }

    /// What slots predict for one that lies between them.
    fn predicted(&self, between: &Between, eye: Eye<'_>) -> SlotLight {
        let mut mean = SlotLight::default();
        let mut total = 0.0;
        for &(slot, weight) in &between.of {
            let light = self.slots[slot].indirect;
            let weight = weight * self.weight(slot);
            if light.known {
                mean.diffuse += light.diffuse * weight;
                mean.specular += eye.specular[slot].indirect * weight;
                mean.variance += light.variance * weight * weight;
                total += weight;
                mean.known = true;
                mean.stale |= light.stale;
            }
        }
        if total > 0.0 {
            mean.diffuse /= total;
            mean.specular /= total;
            mean.variance /= total * total;
        }
        mean
    }

    /// What a slot has gathered itself.
    #[must_use]
    pub fn gathered(&self, slot: SlotId, eye: Vec3) -> SlotLight {
        self.light_of(&self.indirect.sum(slot), slot, eye)
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
        let to_eye = (eye - self.vertices[record.vertex].position).normalize_or(record.normal);
        let specular = record.shininess.filter(|_| !record.mirror);
        let specular = specular.map_or(Vec3::ZERO, |s| sum.specular(record.normal, to_eye, s));
        let variance = sum.variance_of_mean() / (PI * PI);
        SlotLight { diffuse: sum.irradiance() / PI, specular, variance, known: true, ..SlotLight::default() }
    }
}
