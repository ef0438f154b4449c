//! Noise of indirect light between vertices: what a vertex shows is its own sample combined with what its neighbours
//! predict, each by what it is worth. The sample's share tends to 1 as its rays grow in number, so that nothing is
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
    /// Variance by noise, (W·sr⁻¹·m⁻²)².
    noise: f32,
    /// Expected square error beyond noise, (W·sr⁻¹·m⁻²)².
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

    /// A base vertex's light from its own rays and from what coarser ones around it predict, or those of its
    /// neighbours.
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

    /// Variance of a slot's own D by what it and those around it have seen, (W·sr⁻¹·m⁻²)².
    pub fn likely_variance(&self, slot: SlotId) -> f32 {
        match &self.slots[slot].between {
            Some(between) => self.pooled_variance(slot, between.of.iter().map(|(other, _)| *other)),
            None => self.pooled_variance(slot, self.neighbours(slot).into_iter()),
        }
    }

    /// Variance of a slot's own D, pooled with others': by itself it is small where the sample is low, which would
    /// make low samples count for more than high ones.
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

#[cfg(test)]
mod tests {
    use super::super::testing::{known, square};
    use super::*;

    fn light(diffuse: f32, variance: f32) -> SlotLight {
        SlotLight::new(known(diffuse, variance), Vec3::ZERO)
    }

    /// Mean and variance of the normalised product of two Gaussians, each given by mean and variance, by quadrature.
    fn product(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
        let density = |y: f64, [mean, variance]: [f64; 2]| (-(y - mean).powi(2) / (2.0 * variance)).exp();
        let moments = (0..40_000).map(|i| f64::from(i) * 1e-3 - 20.0).fold([0.0; 3], |[n, first, second], y| {
            let p = density(y, a) * density(y, b);
            [n + p, first + p * y, second + p * y * y]
        });
        let mean = moments[1] / moments[0];
        [mean, moments[2] / moments[0] - mean * mean]
    }

    #[test]
    fn estimates_combine_as_gaussians_multiply() {
        for (own, noise, predicted, error) in [(1.0, 0.5, 2.0, 0.25), (3.0, 0.1, 1.0, 2.0), (0.5, 4.0, 0.7, 0.0)] {
            let spread = 0.3;
            let a = Estimate { light: light(own, noise), noise, error: 0.0 };
            let b = Estimate { light: light(predicted, spread), noise: spread, error };
            let combined = combine(a, b);
            let [mean, variance] =
                product([own, noise].map(f64::from), [f64::from(predicted), f64::from(spread + error)]);
            assert!((f64::from(combined.diffuse.x) - mean).abs() < 1e-4, "{combined:?}, {mean}");
            assert!((f64::from(combined.variance) - variance).abs() < 1e-4, "{combined:?}, {variance}");
        }
    }

    /// A square split once, whose middle of the diagonal has gathered, and the ends of the diagonal, too.
    fn shown_in_the_middle(found: &[f32], at_ends: f32, expected: f32) -> SlotLight {
        let mut square = square();
        let root = square.roots[0];
        // Edge 2 of the first triangle is the diagonal.
        let middle = square.split(root).middles[2];
        square.gather(middle, found);
        for end in [0, 2].map(|corner| square.cache.topology.nodes[root].corners[corner]) {
            square.gather(end, &[at_ends; 64]);
        }
        let own = square.cache.gathered(middle, Vec3::Y);
        square.cache.indirect.note_expected(square.cache.slots[middle].vertex, expected);
        square.cache.combined(middle, own, light(at_ends, 0.0))
    }

    #[test]
    fn a_midpoint_leans_on_the_ends_of_its_edge_while_it_is_noisy() {
        // Rays that find 0 or 2: a mean of 1 give or take 1/√n.
        let found = |n: usize| [0.0, 2.0].repeat(n / 2);
        let few = shown_in_the_middle(&found(16), 1.1, 0.004).diffuse.x;
        let many = shown_in_the_middle(&found(4096), 1.1, 0.004).diffuse.x;
        assert!((1.05..1.1).contains(&few), "{few}");
        assert!((1.0..1.005).contains(&many), "{many}");
        assert!(shown_in_the_middle(&found(16), 1.1, 0.0).diffuse.x > few, "ends that predict well count for more");
    }

    #[test]
    fn a_deviation_beyond_all_noise_is_believed() {
        let found = [0.9, 1.1].repeat(32);
        assert!((shown_in_the_middle(&found, 5.0, 0.0).diffuse.x - 1.0).abs() < 0.01);
    }

    /// Rays find 0 or 3: half of them at one corner, a quarter at the others. The noise of all is pooled.
    #[test]
    fn base_vertices_lean_on_each_other_while_they_are_noisy() {
        let mut square = square();
        let corners = square.cache.topology.nodes[square.roots[0]].corners;
        square.cache.draw(square.roots[0], None);
        square.gather(corners[0], &[0.0, 0.0, 3.0, 3.0].repeat(2));
        square.gather(corners[1], &[0.0, 0.0, 0.0, 3.0].repeat(2));
        square.gather(corners[2], &[0.0, 0.0, 3.0, 0.0].repeat(2));
        let own = square.cache.gathered(corners[0], Vec3::Y);
        let shown = square.cache.smoothed(corners[0], own);
        assert!(shown.diffuse.x > 0.75 && shown.diffuse.x < 1.5, "between its own and theirs: {shown:?}");
        assert!(shown.variance < square.cache.likely_variance(corners[0]), "{shown:?}");
    }

    #[test]
    fn a_low_sample_does_not_take_itself_for_sure() {
        let mut square = square();
        let corners = square.cache.topology.nodes[square.roots[0]].corners;
        square.cache.draw(square.roots[0], None);
        square.gather(corners[0], &[0.0; 8]);
        assert_eq!(square.cache.likely_variance(corners[0]), 0.0, "by itself it knows no better");
        square.gather(corners[1], &[0.0, 4.0].repeat(4));
        // Independent rays of variance 4, or none: 2 in the mean, times 8/7 for the estimate, over 8 rays and their gain.
        let expected = 2.0 * 8.0 / 7.0 / 8.0 * usual_gain(8);
        let pooled = square.cache.likely_variance(corners[0]);
        assert!((pooled / expected - 1.0).abs() < 1e-3, "{pooled} {expected}");
    }
}
