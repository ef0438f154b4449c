//! The light vector of a point: sums over samples of the light above it, so that more can always be added.
//!
//! V = ∫ L ω dω over the hemisphere above a normal n \[ZSP98\] [FP03 §2.1]. Its component along n is the irradiance; against
//! the fluence Φ = ∫ L dω its length tells how wide the light is: |V|/Φ is 1 for a single direction, 1/2 for an even
//! hemisphere.

use super::hemisphere::Sample;
use crate::bsdf::{Gloss, Lobe, SpreadLight};
use crate::math::luminance;
use glam::Vec3;

/// Light gathered at one point for one normal.
///
/// All fields are sums over samples, so adding rounds is adding vectors: rounds count by their rays.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LightVector {
    /// Σ L cosθ w: irradiance, W·m⁻².
    irradiance: Vec3,
    /// Σ (Y cosθ w)²: of the luminance.
    squares: f32,
    /// Σ Y ω w: luminance by direction.
    vector: Vec3,
    /// Σ Y w: fluence of the luminance.
    fluence: f32,
    /// Number of samples.
    samples: u32,
}

/// Bound of [`LightVector::turning`]: few samples must not make much of a turn.
pub const MOST_TURNING: f32 = 2.0;

impl LightVector {
    /// Words of [`Self::to_words`].
    pub const WORDS: usize = 9;

    /// Adds a sample of a gather for the unit `normal`; one below its horizon counts as dark.
    #[inline]
    pub fn push(&mut self, normal: Vec3, sample: &Sample) {
        self.samples += 1;
        let cosine = normal.dot(sample.direction);
        if cosine > 0.0 {
            let weighted = sample.radiance * sample.weight;
            let y = luminance(weighted);
            self.irradiance += weighted * cosine;
            self.squares += (y * cosine) * (y * cosine);
            self.vector += sample.direction * y;
            self.fluence += y;
        }
    }

    /// Adds the samples of another vector of the same point and normal.
    pub fn add(&mut self, other: &Self) {
        self.irradiance += other.irradiance;
        self.squares += other.squares;
        self.vector += other.vector;
        self.fluence += other.fluence;
        self.samples += other.samples;
    }

    /// Its sums as they are stored outside of memory.
    #[must_use]
    pub fn to_words(self) -> [u32; Self::WORDS] {
        let Self { irradiance, squares, vector, fluence, samples } = self;
        let [[r, g, b], [x, y, z]] = [irradiance, vector].map(|v| v.to_array().map(f32::to_bits));
        [r, g, b, squares.to_bits(), x, y, z, fluence.to_bits(), samples]
    }

    /// The sums that these words hold; `None` if they cannot be such.
    #[must_use]
    pub fn of_words(words: [u32; Self::WORDS]) -> Option<Self> {
        let [r, g, b, squares, x, y, z, fluence, samples] = words;
        let vector = |words: [u32; 3]| Vec3::from_array(words.map(f32::from_bits));
        let [squares, fluence] = [squares, fluence].map(f32::from_bits);
        let found = Self { irradiance: vector([r, g, b]), squares, vector: vector([x, y, z]), fluence, samples };
        let is_light = found.irradiance.min_element() >= 0.0 && squares >= 0.0 && fluence >= 0.0;
        let is_finite = found.irradiance.is_finite() && found.vector.is_finite() && (squares + fluence).is_finite();
        (is_light && is_finite).then_some(found)
    }

    /// The vector in light that is `factor` times this, by channel; what it holds by luminance changes as the irradiance's does.
    #[must_use]
    pub fn scaled(&self, factor: Vec3) -> Self {
        let irradiance = self.irradiance * factor;
        let before = luminance(self.irradiance);
        let y = if before > 0.0 { luminance(irradiance) / before } else { luminance(factor) };
        Self {
            irradiance,
            squares: self.squares * y * y,
            vector: self.vector * y,
            fluence: self.fluence * y,
            samples: self.samples,
        }
    }

    /// Number of samples so far.
    #[must_use]
    pub const fn samples(&self) -> u32 {
        self.samples
    }

    /// Irradiance on the surface, W·m⁻²; 0 without samples.
    #[must_use]
    pub fn irradiance(&self) -> Vec3 {
        self.irradiance / self.count()
    }

    /// The light vector by luminance, W·m⁻²: its component along the normal is the luminance of the irradiance, the rest
    /// is how the irradiance changes as the surface turns (the rotational gradient of \[Ward\]).
    #[must_use]
    pub fn vector(&self) -> Vec3 {
        self.vector / self.count()
    }

    /// How much more irradiance than on this vector's own surface, of unit `normal`, falls on one turned to `other` at
    /// the same place, a ratio: linear in the turn, by the rotational gradient. Never n·V for another normal: light
    /// below the horizon of either would be counted wrongly. At most [`MOST_TURNING`].
    #[must_use]
    pub fn turning(&self, normal: Vec3, other: Vec3) -> f32 {
        let own = luminance(self.irradiance);
        let gradient = self.vector - normal * normal.dot(self.vector);
        if own > 0.0 { (1.0 + gradient.dot(other) / own).clamp(0.0, MOST_TURNING) } else { 1.0 }
    }

    /// Fluence of the luminance over the hemisphere, W·m⁻².
    #[must_use]
    pub fn fluence(&self) -> f32 {
        self.fluence / self.count()
    }

    /// Independent samples that the stratified ones are worth, by the usual [`gain`](usual_gain).
    #[must_use]
    pub fn independent_rays(&self) -> f32 {
        self.samples as f32 / usual_gain(self.samples)
    }

    /// Variance of the luminance of [`Self::irradiance`] if the samples were independent, (W·m⁻²)²; infinite with fewer
    /// than two.
    #[must_use]
    pub fn independent_variance(&self) -> f32 {
        if self.samples < 2 {
            return f32::INFINITY;
        }
        let n = self.samples as f32;
        let mean = luminance(self.irradiance) / n;
        (self.squares / n - mean * mean).max(0.0) / (n - 1.0)
    }

    /// The same for stratified samples, by the usual [`gain`](usual_gain): right within a factor of 10, as scenes
    /// differ that much. [`Stratification`](super::stratification::Stratification) measures it instead.
    ///
    /// It is for rounds of [`Method::Stratified`](super::hemisphere::Method::Stratified); the error of the other methods
    /// is no variance.
    #[must_use]
    pub fn variance_of_mean(&self) -> f32 {
        self.independent_variance() * usual_gain(self.samples)
    }

    /// How wide the light is, |V|/Φ: 1 from one direction, 1/2 from an even hemisphere, 0 from a ring at the horizon.
    #[must_use]
    pub fn concentration(&self) -> f32 {
        if self.fluence > 0.0 { (self.vector.length() / self.fluence).min(1.0) } else { 0.0 }
    }

    /// What is known of where it comes from; `None` without light.
    #[must_use]
    pub fn spread(&self) -> Option<SpreadLight> {
        Some(SpreadLight { axis: self.vector.try_normalize()?, concentration: self.concentration() })
    }

    /// The specular luminance towards the eye, W·sr⁻¹·m⁻²: a lobe over light of this irradiance, spread as a von Mises–Fisher lobe of
    /// this vector's direction and width.
    #[must_use]
    pub fn specular(&self, lobe: &Lobe) -> Vec3 {
        self.spread().map_or(Vec3::ZERO, |light| self.irradiance() * lobe.over_spread_light(&light))
    }

    /// What the diffuse part of a surface of unit `normal` counts times in this light ([`Gloss::diffuse_in`]).
    #[must_use]
    pub fn diffuse_share(&self, gloss: Gloss, normal: Vec3) -> f32 {
        self.spread().map_or(1.0, |light| gloss.diffuse_in_spread(normal.dot(light.axis), light.concentration))
    }

    /// What sums are divided by; 1 without samples, when all of them are 0.
    fn count(&self) -> f32 {
        self.samples.max(1) as f32
    }
}

/// Variance of the mean of stratified samples against that of independent ones, where nothing is measured yet: n^-0.3.
///
/// Measured at 1024 rays (docs/notebook/bench.md): 0.07 where light is even, as in a Cornell box, and near 1 where few rays
/// find most of it, as in a room of small lamps; this is between.
#[must_use]
pub fn usual_gain(samples: u32) -> f32 {
    (samples.max(1) as f32).powf(-0.3)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::hemisphere::{Method, gather};
    use crate::math::sequence::Sequence;
    use std::f32::consts::PI;

    /// What is gathered about Z in the light of `radiance`.
    fn gathered(rays: u32, radiance: impl Fn(Vec3) -> Vec3) -> LightVector {
        let mut vector = LightVector::default();
        let sink = |sample| vector.push(Vec3::Z, &sample);
        gather(Method::Stratified, &[Vec3::Z], 0..rays, &Sequence::new(11), |_, direction| radiance(direction), sink);
        vector
    }

    fn phong(shininess: f32, to_eye: Vec3) -> Lobe {
        Gloss::Phong { shininess, mirror: false }.seen(Vec3::Z, to_eye)
    }

    #[test]
    fn nothing_gathered_is_dark_and_uncertain() {
        let empty = LightVector::default();
        assert_eq!((empty.irradiance(), empty.samples()), (Vec3::ZERO, 0));
        assert_eq!(empty.specular(&phong(50.0, Vec3::Z)), Vec3::ZERO);
        assert!(empty.variance_of_mean().is_infinite() && empty.spread().is_none());
        assert!(size_of::<LightVector>() <= 64);
    }

    /// In a furnace E = πL and r = 1/2; the lobe's integral is L, of which the Gaussians find 84 to 94 %.
    #[test]
    fn furnace() {
        let colour = Vec3::new(2.0, 1.0, 0.5);
        let light = gathered(1 << 14, |_| colour);
        // f32 sums of 16,384 terms.
        assert!((light.irradiance() / (PI * colour) - 1.0).abs().max_element() < 5e-4);
        assert!((light.concentration() - 0.5).abs() < 2e-3, "{}", light.concentration());
        assert!((light.vector().z / luminance(light.irradiance()) - 1.0).abs() < 5e-4);
        assert!((light.fluence() / (2.0 * PI * luminance(colour)) - 1.0).abs() < 4e-3, "{}", light.fluence());
        assert!(light.variance_of_mean() < 1e-6);
        for shininess in [5.0, 10.0, 20.0, 50.0, 200.0] {
            let share = light.specular(&phong(shininess, Vec3::Z)) / colour;
            assert!(share.min_element() > 0.83 && share.max_element() < 0.95, "{shininess}: {share}");
        }
    }

    /// Light from one direction reflects as the Phong lobe itself, near its axis.
    #[test]
    fn a_single_direction() {
        let direction = Vec3::new(0.6, 0.0, 0.8);
        let mut light = LightVector::default();
        light.push(Vec3::Z, &Sample { direction, radiance: Vec3::splat(3.0), weight: 0.5 });
        assert!((light.irradiance().x - 3.0 * 0.5 * 0.8).abs() < 1e-6);
        assert!(light.concentration() > 0.999 && light.spread().is_some_and(|light| light.sharpness() > 1e4));
        for shininess in [20.0, 100.0] {
            for off in [0.0_f32, 0.05, 0.1] {
                let turned = 0.6_f32.asin() + off;
                let to_eye = Vec3::new(-turned.sin(), 0.0, turned.cos());
                let exact = phong(shininess, to_eye).value(direction).x;
                let found = light.specular(&phong(shininess, to_eye)).x / light.irradiance().x;
                assert!((found / exact - 1.0).abs() < 0.06, "{shininess}, {off}: {found} {exact}");
            }
        }
    }

    /// Sharpness against the lobe it was fitted to: the mean of exp(κ cos) has length coth κ − 1/κ.
    #[test]
    fn sharpness_gives_the_concentration_back() {
        for r in [0.2_f32, 0.5, 0.8, 0.95] {
            let light = LightVector { vector: Vec3::Z * r, fluence: 1.0, samples: 1, ..LightVector::default() };
            let kappa = light.spread().expect("light").sharpness();
            assert!((kappa.tanh().recip() - kappa.recip() - r).abs() < 0.015, "{r}: {kappa}");
        }
    }

    /// Below the horizon of the normal there is no light, but the sample counts.
    #[test]
    fn light_from_below_is_dark() {
        let mut light = LightVector::default();
        let sample = |z: f32| Sample { direction: Vec3::Z * z, radiance: Vec3::ONE, weight: 2.0 };
        light.push(Vec3::Z, &sample(-1.0));
        light.push(Vec3::Z, &sample(1.0));
        assert_eq!((light.samples(), light.irradiance().x, light.fluence()), (2, 1.0, 1.0));
        // Samples 0 and 2: variance 2, of the mean 1 if they were independent.
        assert!((light.variance_of_mean() - usual_gain(2)).abs() < 1e-6);
    }
}
