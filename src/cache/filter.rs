//! Noise of indirect light between vertices: what a vertex shows is its own sample combined with what its
//! neighbours predict, each by what it is worth. The sample's share tends to 1 as its rays grow in number, so that nothing is
//! smoothed away in the limit.

use super::ids::{NodeId, SlotId};
use super::pieces::Piece;
use super::slot::{Eye, SlotLight};
use super::store::Cache;
use crate::estimate::light_vector::LightVector;
use crate::estimate::light_vector::usual_gain;
use crate::math::luminance;
use glam::Vec3;
use smallvec::SmallVec;
use std::f32::consts::PI;

/// How many times its variance a squared deviation must exceed before it is believed.
const BELIEVED: f32 = 1.0;
/// Power of the cosine between normals by which neighbours count.
const NORMAL_POWER: i32 = 8;

/// Slots around one.
type Neighbours = SmallVec<[SlotId; 12]>;

/// A value, and how uncertain it is.
#[derive(Clone, Copy, Debug)]
struct Estimate {
    light: SlotLight,
    /// Variance by noise.
    noise: f32,
    /// Expected square error beyond noise.
    error: f32,
}

impl Cache {
    /// A midpoint's light from its own rays and from the ends of its edge.
    pub(super) fn combined(&self, slot: SlotId, own: SlotLight, predicted: SlotLight) -> SlotLight {
        let ends = self.slots[slot].between.iter().flat_map(|between| between.of.iter().map(|(end, _)| *end));
        let noise = self.pooled_variance(slot, ends);
        let deviation = luminance(own.diffuse - predicted.diffuse).powi(2);
        let measured = deviation - BELIEVED * (noise + predicted.variance);
        let error = self.indirect.expected(self.slots[slot].vertex).max(measured);
        let own = Estimate { light: own, noise, error: 0.0 };
        combine(own, Estimate { light: predicted, noise: predicted.variance, error })
    }

    /// A base vertex's light from its own rays and from what coarser ones around it predict, or those of its neighbours.
    pub(super) fn filtered(&self, slot: SlotId, own: SlotLight, eye: Eye<'_>) -> SlotLight {
        // The coarsest have only some of those around them to go by.
        let between = self.slots[slot].between.as_ref().filter(|_| self.slots[slot].rank > 0);
        if let Some((between, predicted)) = between.and_then(|b| Some((b, self.predicted_from_coarse(slot, b, eye)?))) {
            let noise = self.pooled_variance(slot, between.of.iter().map(|(parent, _)| *parent));
            let deviation = luminance(own.diffuse - predicted.light.diffuse).powi(2);
            let measured = deviation - BELIEVED * (noise + predicted.light.variance);
            let light = SlotLight { specular: own.specular, ..predicted.light };
            let predicted = Estimate { light, noise: light.variance, error: predicted.error.max(measured) };
            return combine(Estimate { light: own, noise, error: 0.0 }, predicted);
        }
        self.smoothed(slot, own)
    }

    /// A base vertex's light from its own rays and those of its neighbours.
    fn smoothed(&self, slot: SlotId, own: SlotLight) -> SlotLight {
        let around = self.neighbours(slot);
        let normal = self.slots[slot].normal;
        let per_ray = self.pooled_variance(slot, around.iter().copied()) * worth(&self.indirect.sum(slot));
        let (mut mean, mut total, mut noise, mut spread, mut doubt) = (Vec3::ZERO, 0.0, 0.0, 0.0, 0.0);
        let (y, own_noise) = (luminance(own.diffuse), per_ray / worth(&self.indirect.sum(slot)));
        for other in around {
            let sum = self.indirect.sum(other);
            let weight = normal.dot(self.slots[other].normal).max(0.0).powi(NORMAL_POWER) * self.weight(other);
            if sum.samples() < 2 || weight == 0.0 {
                continue;
            }
            let (diffuse, variance) = (sum.irradiance() / PI, per_ray / worth(&sum));
            mean += diffuse * weight;
            total += weight;
            noise += weight * weight * variance;
            spread += weight * (luminance(diffuse) - y).powi(2);
            doubt += weight * variance;
        }
        if total == 0.0 {
            return own;
        }
        let predicted = SlotLight { diffuse: mean / total, ..own };
        let error = (spread / total - BELIEVED * (own_noise + doubt / total)).max(0.0);
        let own = Estimate { light: own, noise: own_noise, error: 0.0 };
        combine(own, Estimate { light: predicted, noise: noise / (total * total), error })
    }

    /// Base slots that share a drawn face with a base slot.
    pub(super) fn neighbours(&self, slot: SlotId) -> Neighbours {
        let mut found = Neighbours::new();
        for drawn in self.drawn.with_slot(slot) {
            let up = |id: &NodeId| self.topology.nodes[*id].parent;
            let root = std::iter::successors(Some(self.drawn.triangles[drawn].node), up).last();
            let corners = root.into_iter().flat_map(|root| self.topology.nodes[root].corners);
            found.extend(corners.filter(|&corner| corner != slot));
        }
        found.sort_unstable();
        found.dedup();
        found
    }

    /// Variance of a slot's own D by what it and those around it have seen.
    pub fn likely_variance(&self, slot: SlotId) -> f32 {
        match &self.slots[slot].between {
            Some(between) => self.pooled_variance(slot, between.of.iter().map(|(other, _)| *other)),
            None => self.pooled_variance(slot, self.neighbours(slot).into_iter()),
        }
    }

    /// Variance of a slot's own D, pooled with others': by itself it is small where the sample is low, which would make low
    /// samples count for more than high ones.
    fn pooled_variance(&self, slot: SlotId, others: impl Iterator<Item = SlotId>) -> f32 {
        let own = self.indirect.sum(slot);
        let per_ray = |sum: &LightVector| sum.independent_variance() * sum.samples() as f32;
        let (mut sum, mut count) = (per_ray(&own), 1.0);
        let others = others.filter(|_| !self.without.has(Piece::PooledVariance));
        for other in others.map(|slot| self.indirect.sum(slot)).filter(|other| other.samples() > 1) {
            sum += per_ray(&other);
            count += 1.0;
        }
        sum / count / worth(&own) / (PI * PI)
    }
}

/// Independent rays that a sample's stratified ones are worth.
fn worth(sum: &LightVector) -> f32 {
    sum.samples() as f32 / usual_gain(sum.samples())
}

/// Two estimates by the inverse of their square errors.
fn combine(own: Estimate, predicted: Estimate) -> SlotLight {
    let against = predicted.noise + predicted.error;
    let share = if against + own.noise > 0.0 { against / (against + own.noise) } else { 1.0 };
    let mix = |a: Vec3, b: Vec3| a + (b - a) * share;
    SlotLight {
        diffuse: mix(predicted.light.diffuse, own.light.diffuse),
        specular: mix(predicted.light.specular, own.light.specular),
        variance: own.noise * share,
        known: true,
        ..SlotLight::default()
    }
}
