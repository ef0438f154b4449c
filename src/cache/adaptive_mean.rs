//! Noise of samples at scattered places: the mean of each with its nearest neighbours, of as many as agree within their noise.
//!
//! Means over nested neighbourhoods, each of twice as many samples as the one before, are taken as long as their confidence
//! intervals have a point in common: the intersection of confidence intervals \[GN97\] \[Kat99\]. Where light is even a mean is of
//! many, at an edge of few; as rays grow in number the intervals shrink and with them the neighbourhoods, so that in the limit
//! nothing is smoothed away. The constants are chosen by the errors in docs/notebook/pieces.md.

use super::sample_tree::{Place, SampleTree};
use crate::estimate::light_vector::MOST_TURNING;
use crate::math::luminance;
use glam::Vec3;
use smallvec::SmallVec;

/// Half the width of a confidence interval, in standard deviations.
const CONFIDENCE: f32 = 1.4;
/// Samples of the largest neighbourhood.
const MOST: usize = 32;
/// Samples that a place without its own is interpolated between, and those near a group of places that these are chosen from.
const AROUND: usize = 12;
const NEAR_GROUP: usize = 24;
/// What a difference of normals counts for in neighbourhoods, and where places lie between samples: distances against the scene's
/// scale for a difference of length 1.
const NORMALS_OF_MEAN: f32 = 0.15;
const NORMALS_BETWEEN: f32 = 0.03;
/// Farther than this from all samples, against the scene's scale, nothing is interpolated.
const FAR: f32 = 0.1;
/// Largest distance from the mean plane of two samples of one surface, against their distance.
const FLAT: f32 = 1.0 / 3.0;

/// What was gathered for one normal at one place.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sample {
    /// Position, scene units.
    pub position: Vec3,
    /// Unit normal.
    pub normal: Vec3,
    /// Diffuse luminance D, W·sr⁻¹·m⁻².
    pub diffuse: Vec3,
    /// How D changes with the normal, against D: on a surface turned to n it is 1 + gradient·n times as much.
    pub gradient: Vec3,
    /// Independent rays.
    pub rays: f32,
    /// Variance of the luminance of D by one of them, (W·sr⁻¹·m⁻²)².
    pub variance: f32,
}

/// Samples of a scene by place and normal.
pub struct AdaptiveMeans<'a> {
    samples: &'a [Sample],
    near: SampleTree,
    between: SampleTree,
    far: f32,
}

impl<'a> AdaptiveMeans<'a> {
    /// Of samples in a scene of this scale; `None` without any.
    #[must_use]
    pub fn new(samples: &'a [Sample], scale: f32) -> Option<Self> {
        let places = || samples.iter().map(Sample::place);
        let tree = |normals: f32| SampleTree::new(places(), normals * scale);
        Some(Self { samples, near: tree(NORMALS_OF_MEAN)?, between: tree(NORMALS_BETWEEN)?, far: FAR * scale })
    }

    /// Mean D of a sample, by its number, with those around it, W·sr⁻¹·m⁻².
    #[must_use]
    pub fn of(&self, index: usize) -> Vec3 {
        let own = &self.samples[index];
        let near = self.near.nearest(own.place(), MOST);
        let near: Vec<&Sample> = near.map(|number| &self.samples[number]).collect();
        let is_related = |other: &&&Sample| own.is_of_one_surface(other);
        let related: Vec<&Sample> = near.iter().filter(is_related).copied().collect();
        largest_that_agrees(own, &related)
    }

    /// D at places near each other, between samples that show `means`, in their order, W·sr⁻¹·m⁻²; `None` far from all of them.
    #[must_use]
    pub fn between(&self, places: &[Place], means: &[Vec3]) -> Vec<Option<Vec3>> {
        let sum = |a: Place, b: &Place| (a.0 + b.0, a.1 + b.1);
        let (position, normal) = places.iter().fold((Vec3::ZERO, Vec3::ZERO), sum);
        let middle = (position / places.len().max(1) as f32, normal.normalize_or(Vec3::Y));
        let near: Vec<usize> = self.between.nearest(middle, NEAR_GROUP).collect();
        places.iter().map(|&place| self.interpolated(place, &near, means)).collect()
    }

    /// D at a place between the nearest of some samples, weighted by the inverse square of the distance.
    fn interpolated(&self, place: Place, near: &[usize], means: &[Vec3]) -> Option<Vec3> {
        let distance = |&number: &usize| (self.between.squared_distance(place, self.samples[number].place()), number);
        let mut near: SmallVec<[(f32, usize); NEAR_GROUP]> = near.iter().map(distance).collect();
        near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let (mut sum, mut total) = (Vec3::ZERO, 0.0);
        for &(squared, number) in near.iter().take(AROUND).take_while(|near| near.0 <= self.far * self.far) {
            let weight = 1.0 / squared.max(f32::MIN_POSITIVE.sqrt());
            sum += means[number] * (weight * self.samples[number].turning(place.1));
            total += weight;
        }
        (total > 0.0).then(|| sum / total)
    }
}

/// The mean over the largest neighbourhood of a sample that agrees with all smaller ones; `near` is it and others by distance.
fn largest_that_agrees(own: &Sample, near: &[&Sample]) -> Vec3 {
    // Of all: by itself it is small where the sample is low.
    let variance = near.iter().map(|sample| sample.variance).sum::<f32>() / near.len().max(1) as f32;
    let (mut found, mut interval) = (own.diffuse, [f32::NEG_INFINITY, f32::INFINITY]);
    let (mut sum, mut rays) = (Vec3::ZERO, 0.0);
    for (number, sample) in (1_usize..).zip(near) {
        sum += sample.diffuse * (sample.turning(own.normal) * sample.rays);
        rays += sample.rays;
        if number.is_power_of_two() {
            let (mean, width) = (sum / rays, CONFIDENCE * (variance / rays).sqrt());
            let y = luminance(mean);
            interval = [interval[0].max(y - width), interval[1].min(y + width)];
            if interval[0] > interval[1] {
                break;
            }
            found = mean;
        }
    }
    found
}

impl Sample {
    const fn place(&self) -> Place {
        (self.position, self.normal)
    }

    /// How much more light falls on a surface turned to `normal`, a ratio.
    fn turning(&self, normal: Vec3) -> f32 {
        (1.0 + self.gradient.dot(normal)).clamp(0.0, MOST_TURNING)
    }

    /// Whether another lies on the same surface as far as places and normals tell.
    fn is_of_one_surface(&self, other: &Self) -> bool {
        let offset = other.position - self.position;
        (self.normal + other.normal).dot(offset).abs() * 0.5 <= offset.length() * FLAT
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::mix;

    /// A grid of 32×32 samples of a plane, a unit wide, of 64 rays each, with noise of standard deviation `noise` about `light`.
    fn plane(noise: f32, light: impl Fn(f32) -> f32) -> Vec<Sample> {
        let uniform = |i: u64| mix(i) as f32 / u64::MAX as f32;
        let sample = |i: u64| {
            let position = Vec3::new((i % 32) as f32 / 32.0, 0.0, (i / 32) as f32 / 32.0);
            // Twelve uniform numbers: variance 1.
            let gauss: f32 = (0..12).map(|k| uniform(i * 12 + k)).sum::<f32>() - 6.0;
            let diffuse = Vec3::splat(light(position.x) + noise * gauss);
            Sample {
                position,
                normal: Vec3::Y,
                diffuse,
                rays: 64.0,
                variance: noise * noise * 64.0,
                ..Sample::default()
            }
        };
        (0..1024).map(sample).collect()
    }

    fn means(samples: &[Sample]) -> Vec<Vec3> {
        let means = AdaptiveMeans::new(samples, 1.0).expect("samples");
        (0..samples.len()).map(|i| means.of(i)).collect()
    }

    fn square_error(samples: &[Sample], values: &[Vec3], light: impl Fn(f32) -> f32) -> f32 {
        let error = |(s, v): (&Sample, &Vec3)| (v.x - light(s.position.x)).powi(2);
        samples.iter().zip(values).map(error).sum::<f32>() / samples.len() as f32
    }

    #[test]
    fn even_light_is_the_mean_of_many() {
        let samples = plane(0.3, |_| 1.0);
        let error = square_error(&samples, &means(&samples), |_| 1.0);
        // 0.09 before; 0.0028 if all were means of 32.
        assert!(error < 0.09 / 6.0, "{error}");
    }

    #[test]
    fn an_edge_that_noise_does_not_hide_stays() {
        let step = |x: f32| if x < 0.49 { 1.0 } else { 2.0 };
        let samples = plane(0.05, step);
        let means = means(&samples);
        let worst = samples.iter().zip(&means).map(|(s, m)| (m.x - step(s.position.x)).abs()).fold(0.0, f32::max);
        assert!(worst < 0.25, "{worst}");
        assert!(square_error(&samples, &means, step) < 0.05 * 0.05, "better than each by itself");
    }

    #[test]
    fn without_noise_samples_show_what_they_found() {
        let slope = |x: f32| 1.0 + x;
        let samples = plane(0.0, slope);
        assert!(square_error(&samples, &means(&samples), slope) < 1e-12);
    }

    /// A second plane, dark and as dense, a twentieth above the first: as near as the nearest dozen on it.
    #[test]
    fn other_surfaces_do_not_count() {
        let mut samples = plane(0.3, |_| 1.0);
        let above = plane(0.3, |_| 0.0);
        samples.extend(above.iter().map(|s| Sample { position: s.position + Vec3::Y * 0.05, ..*s }));
        let mean = means(&samples)[..1024].iter().map(|m| m.x).sum::<f32>() / 1024.0;
        assert!((mean - 1.0).abs() < 0.05, "{mean}");
    }

    #[test]
    fn places_between_samples_are_interpolated() {
        let slope = |x: f32| 1.0 + x;
        let samples = plane(0.0, slope);
        let shown: Vec<Vec3> = samples.iter().map(|s| s.diffuse).collect();
        let means = AdaptiveMeans::new(&samples, 1.0).expect("samples");
        let at = |position: Vec3| means.between(&[(position, Vec3::Y)], &shown)[0];
        let between = at(Vec3::new(0.515, 0.0, 0.485)).expect("near");
        assert!((between.x - 1.515).abs() < 0.02, "{between}");
        assert!((at(samples[40].position).expect("near") - shown[40]).length() < 1e-3, "at a sample");
        assert!(at(Vec3::Y * 0.2).is_none());
        let together: Vec<_> = (0..8).map(|i| (Vec3::new(0.5 + i as f32 * 2e-3, 0.0, 0.5), Vec3::Y)).collect();
        for (place, value) in together.iter().zip(means.between(&together, &shown)) {
            assert!((value.expect("near").x - 1.0 - place.0.x).abs() < 0.01, "{place:?}");
        }
    }

    #[test]
    fn many_samples_at_one_place_are_told_apart_from_none() {
        assert!(AdaptiveMeans::new(&[], 1.0).is_none());
        let one = Sample { normal: Vec3::Y, diffuse: Vec3::ONE, rays: 4.0, variance: 1.0, ..Sample::default() };
        assert!(means(&[one; 200]).iter().all(|mean| (*mean - Vec3::ONE).length() < 1e-5));
    }
}
