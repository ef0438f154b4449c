//! Noise of indirect light between vertices: what a vertex shows is its own sample combined with what its neighbours
//! predict, each by what it is worth. The sample's share tends to 1 as its rays grow in number, so that nothing is
//! smoothed away in the limit.

use super::ids::SlotId;
use super::pieces::Piece;
use super::prediction::Prediction;
use super::slot::SlotLight;
use super::store::Cache;
use crate::estimate::light_vector::LightVector;
use crate::math::luminance;
use glam::Vec3;
use std::f32::consts::PI;

impl Cache {
    /// A slot's light from its own rays, and what others predict as far as that is worth anything. S is its own where base
    /// vertices predict it: they may be less glossy.
    pub(super) fn combined(&self, slot: SlotId, own: SlotLight, predicted: Option<Prediction>) -> SlotLight {
        let noise = self.likely_variance(slot);
        let record = &self.slots[slot];
        // The coarsest have only some of those around them to go by.
        let by_neighbours = record.is_base() && record.rank == 0 || predicted.is_none();
        let around = || self.prediction_by_neighbours(slot, noise * self.indirect.sum(slot).independent_rays());
        let Some(predicted) = (if by_neighbours { around() } else { predicted }) else {
            return SlotLight { variance: noise, ..own };
        };
        let combined = combine(SlotLight { variance: noise, ..own }, predicted);
        if record.is_base() || by_neighbours { SlotLight { specular: own.specular, ..combined } } else { combined }
    }

    /// Variance of a slot's own D by what it and those around it have seen, (W·sr⁻¹·m⁻²)².
    pub fn likely_variance(&self, slot: SlotId) -> f32 {
        match self.between(slot) {
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
        sum / count / own.independent_rays() / (PI * PI)
    }
}

/// Two estimates by the inverse of their square errors: noise, and of the prediction how far it is known to be wrong.
fn combine(own: SlotLight, Prediction { light, error }: Prediction) -> SlotLight {
    let deviation = luminance(own.diffuse - light.diffuse).powi(2);
    let against = light.variance + error.max(deviation - own.variance - light.variance);
    let share = if against + own.variance > 0.0 { against / (against + own.variance) } else { 1.0 };
    let mix = |predicted: Vec3, own: Vec3| predicted + (own - predicted) * share;
    let (diffuse, specular) = (mix(light.diffuse, own.diffuse), mix(light.specular, own.specular));
    SlotLight { diffuse, specular, variance: own.variance * share, known: true, ..SlotLight::default() }
}

#[cfg(test)]
mod tests {
    use super::super::testing::{known, square};
    use super::*;
    use crate::estimate::light_vector::usual_gain;

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
        for (own, noise, predicted, error) in [(1.0, 0.5, 2.0, 0.25), (3.0, 0.1, 1.0, 4.0), (0.5, 4.0, 0.7, 0.0)] {
            let spread = 0.3;
            // Its deviation must be no more than what noise and error explain, or it is believed.
            let combined = combine(light(own, noise), Prediction { light: light(predicted, spread), error });
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
        square.cache.combined(middle, own, Some(Prediction { light: light(at_ends, 0.0), error: expected }))
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
        let shown = square.cache.combined(corners[0], own, None);
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
