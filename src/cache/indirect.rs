//! The static mesh of indirect light: sums of gathered light at its vertices, and what other vertices take over from them
//! (method 3, 6).

use super::dynamic::{Between, COVERED_WEIGHT, Cache, Luminance, SlotId};
use super::previous_lighting::{Gathers, PreviousLighting};
use super::vertex::VertexId;
use crate::estimate::light_vector::LightVector;
use crate::light::lights::Lighting;
use crate::math::luminance;
use glam::Vec3;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::f32::consts::PI;

/// Luminance vectors, sparse over vertices and slots.
#[derive(Clone, Debug, Default)]
pub struct IndirectLayer {
    /// Rays gathered so far, by vertex, and sums over them, by slot: one set of rays serves all normals of a vertex.
    gathers: Gathers,
    /// What was gathered before the lights changed.
    earlier: PreviousLighting,
    /// Whether what is shown leans on neighbours while rays are few.
    pub filter: bool,
    /// Base slots whose predictions wait to be brought up to date: one coarse vertex predicts hundreds.
    waiting: Vec<SlotId>,
}

/// New rays of one vertex.
#[derive(Clone, Copy, Debug)]
pub struct Round {
    /// The vertex.
    pub vertex: VertexId,
    /// How many rays.
    pub rays: u32,
    /// How many entries of the results' sums belong to it.
    pub sums: u32,
}

/// Standard error of a guess from before the lights changed, against the value.
const STALE_ERROR: f32 = 0.25;

impl IndirectLayer {
    /// Rays gathered at a vertex.
    #[must_use]
    pub fn rays(&self, vertex: VertexId) -> u32 {
        self.gathers.rays.get(vertex.0)
    }

    /// Whether a slot has gathered anything itself. (A look that was added after its vertex's last round has not.)
    #[must_use]
    pub fn is_sampled(&self, slot: SlotId) -> bool {
        self.gathers.sums.get(slot.0).samples() > 0
    }

    /// What a slot has gathered.
    #[must_use]
    pub fn sum(&self, slot: SlotId) -> LightVector {
        self.gathers.sums.get(slot.0)
    }

    /// Adds a round.
    pub fn add(&mut self, round: Round, sums: &[(SlotId, LightVector)]) {
        *self.gathers.rays.entry(round.vertex.0) += round.rays;
        for (slot, sum) in sums {
            self.gathers.sums.entry(slot.0).add(sum);
        }
    }

    /// Forgets what was gathered at a vertex of one slot.
    pub fn forget(&mut self, vertex: VertexId, slot: SlotId) {
        self.gathers.forget(vertex, slot);
        self.earlier.forget(vertex, slot);
    }

    /// Notes how far a midpoint is expected to deviate from what the ends of its edge predict, or a vertex inside a leaf from what
    /// its corners do, luminance².
    pub fn note_expected(&mut self, vertex: VertexId, square: f32) {
        *self.gathers.expected.entry(vertex.0) = square;
    }

    /// How far a midpoint is expected to deviate, luminance².
    #[must_use]
    pub fn expected(&self, vertex: VertexId) -> f32 {
        self.gathers.expected.get(vertex.0)
    }

    /// Bytes held.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.gathers.bytes() + self.earlier.bytes()
    }

    /// Rays of a vertex's next round that would be its first under the present lights, `least` or more.
    #[must_use]
    pub fn first_rays(&self, vertex: VertexId, least: u32) -> u32 {
        self.earlier.first_rays(vertex, least)
    }
}

impl Cache {
    /// Takes in that the lights have changed: what was gathered is scaled, brought back or set aside. The slots' values are
    /// to be refreshed.
    pub fn relight_indirect(&mut self, before: Lighting, now: &Lighting) {
        self.radiance.relight(before.common_ratio(now));
        self.indirect.earlier.relight(&mut self.indirect.gathers, before, now);
    }

    /// Brings the indirect light of slots and of all that depends on them up to date; returns every slot that was written,
    /// in ascending order.
    pub fn refresh_indirect(&mut self, slots: &[SlotId], eye: Vec3) -> Vec<SlotId> {
        let mut due = slots.to_vec();
        if self.indirect.filter {
            let base = slots.iter().filter(|s| self.slots[s.0].is_base() && self.indirect.is_sampled(**s));
            due.extend(base.flat_map(|&s| self.neighbours(s)));
        }
        self.refresh(&due, eye, false)
    }

    /// Predictions of base slots that wait to be brought up to date.
    #[must_use]
    pub fn waiting_predictions(&self) -> usize {
        self.indirect.waiting.len()
    }

    /// Brings the predictions of base slots up to date, and all that depends on them; returns the slots written.
    pub fn refresh_predictions(&mut self, eye: Vec3) -> Vec<SlotId> {
        let waiting = std::mem::take(&mut self.indirect.waiting);
        waiting.iter().for_each(|slot| self.slots[slot.0].waits = false);
        self.refresh(&waiting, eye, true)
    }

    /// Evaluates slots and those that they predict, each after those that predict it; predictions of base slots are only noted
    /// unless they are wanted, too.
    fn refresh(&mut self, slots: &[SlotId], eye: Vec3, predictions: bool) -> Vec<SlotId> {
        let order = |cache: &Self, slot: SlotId| Reverse((cache.slots[slot.0].rank, slot));
        let mut due: BinaryHeap<_> = slots.iter().map(|&slot| order(self, slot)).collect();
        let mut written = Vec::with_capacity(slots.len());
        while let Some(Reverse((_, slot))) = due.pop() {
            if written.last() == Some(&slot) {
                continue;
            }
            written.push(slot);
            self.slots[slot.0].indirect = self.indirect_light(slot, eye);
            let mut link = self.first_between(slot);
            while let Some((next, following)) = link {
                link = following.and_then(|link| self.linked_between(link));
                if self.indirect.is_sampled(next) {
                    continue;
                }
                if self.slots[next.0].is_base() && !predictions {
                    if !std::mem::replace(&mut self.slots[next.0].waits, true) {
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
    fn indirect_light(&self, slot: SlotId, eye: Vec3) -> Luminance {
        let between = self.slots[slot.0].between.as_ref();
        let predicted = between.map(|between| match between.coarse {
            true => self.shown_from_coarse(slot, between),
            false => self.predicted(between),
        });
        let predicted = predicted.filter(|light| light.known);
        let own = self.indirect.is_sampled(slot).then(|| self.gathered(slot, eye));
        match (own, predicted) {
            (Some(own), _) if !self.indirect.filter => Luminance { variance: self.likely_variance(slot), ..own },
            (Some(own), Some(predicted)) if predicted.coarse => self.filtered(slot, own),
            (Some(own), Some(predicted)) if predicted.stale => own,
            (Some(own), Some(predicted)) => self.combined(slot, own, predicted),
            (Some(own), None) => self.filtered(slot, own),
            // A vertex inside a leaf may not gather again: what is around it has the newer guess.
            (None, Some(predicted)) if between.is_some_and(Between::is_inside_leaf) => predicted,
            (None, predicted) => self.guessed(slot, eye).or(predicted).unwrap_or_default(),
        }
    }

    /// What slots predict for one that lies between them.
    fn predicted(&self, between: &Between) -> Luminance {
        let mut mean = Luminance::default();
        let mut total = 0.0;
        for &(slot, weight) in &between.of {
            let light = self.slots[slot.0].indirect;
            let weight = weight * self.weight(slot);
            if light.known {
                mean.diffuse += light.diffuse * weight;
                mean.specular += light.specular * weight;
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
    pub fn gathered(&self, slot: SlotId, eye: Vec3) -> Luminance {
        self.light_of(&self.indirect.sum(slot), slot, eye)
    }

    /// What a slot gathered before the lights changed, as a guess of what it would now.
    fn guessed(&self, slot: SlotId, eye: Vec3) -> Option<Luminance> {
        let light = self.light_of(&self.indirect.earlier.guess(slot)?, slot, eye);
        let doubt = STALE_ERROR * luminance(light.diffuse);
        Some(Luminance { variance: light.variance + doubt * doubt, stale: true, ..light })
    }

    /// The light that sums at a slot stand for.
    fn light_of(&self, sum: &LightVector, slot: SlotId, eye: Vec3) -> Luminance {
        let record = &self.slots[slot.0];
        let to_eye = (eye - self.vertices[record.vertex.0].position).normalize_or(record.normal);
        let specular = record.shininess.filter(|_| !record.mirror);
        let specular = specular.map_or(Vec3::ZERO, |s| sum.specular(record.normal, to_eye, s));
        let variance = sum.variance_of_mean() / (PI * PI);
        Luminance { diffuse: sum.irradiance() / PI, specular, variance, known: true, ..Luminance::default() }
    }

    /// Weight of a slot's vertex in interpolation.
    pub(super) fn weight(&self, slot: SlotId) -> f32 {
        let covered = self.vertices[self.slots[slot.0].vertex.0].progress.covered;
        if covered { COVERED_WEIGHT } else { 1.0 }
    }
}
