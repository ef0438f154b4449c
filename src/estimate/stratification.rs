//! How much less than independent samples stratified ones err: measured, since it depends on the scene.
//!
//! The variance of stratified samples does not show in their spread, but in how much rounds differ: two rounds of n
//! samples whose means are a and b tell the variance of their common mean by (a − b)²/4. From one point that is next to
//! nothing; pooled over many it is the gain, by which the independent variance of each point is multiplied. It errs
//! upwards, since together two rounds are stratified more finely than each: 2^p − 1 times where the variance falls as n^-p.
//!
//! `bench` measures it to show what stratification gains. The engine keeps to [`usual_gain`]: with the measured one its
//! estimated error was nearer to the truth in a hall of small lamps (0.99 of it against 0.82) but 2.8 times too large, against
//! 1.7, in a Cornell box, where rounds err upwards most (docs/notebook/light-vectors.md).

use super::light_vector::{LightVector, usual_gain};
use crate::math::luminance;

/// The gain measured, by number of samples.
#[derive(Clone, Copy, Debug, Default)]
pub struct Stratification {
    tallies: [Tally; TALLIES],
}

/// One tally for each power of two of samples, the last for all above.
const TALLIES: usize = 18;

/// Rounds that the usual gain counts for.
const PRIOR: f64 = 16.0;

/// Sums over pairs of rounds of about as many samples.
#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    /// Σ of variances of the common mean that the differences tell.
    found: f64,
    /// Σ of independent variances of the common mean.
    independent: f64,
    rounds: u32,
}

impl Stratification {
    /// Notes how a round differs from all the samples before it at the same point; to be called before
    /// [`LightVector::add`]. Rounds that are not as large as what was before tell nothing and are left out.
    pub fn note(&mut self, before: &LightVector, round: &LightVector) {
        if before.samples() != round.samples() || round.samples() < 2 {
            return;
        }
        let difference = f64::from(luminance(before.irradiance() - round.irradiance()));
        let mut both = *before;
        both.add(round);
        let tally = &mut self.tallies[tally_of(both.samples())];
        tally.found += 0.25 * difference * difference;
        tally.independent += f64::from(both.independent_variance());
        tally.rounds += 1;
    }

    /// Adds what another has noted.
    pub fn add(&mut self, other: &Self) {
        for (own, more) in self.tallies.iter_mut().zip(&other.tallies) {
            own.found += more.found;
            own.independent += more.independent;
            own.rounds += more.rounds;
        }
    }

    /// Variance of the mean of `samples` stratified samples against that of independent ones: as measured, drawn towards
    /// [`usual_gain`] while few rounds were noted.
    #[must_use]
    pub fn gain(&self, samples: u32) -> f32 {
        let usual = usual_gain(samples);
        let Tally { found, independent, rounds } = self.tallies[tally_of(samples)];
        if independent <= 0.0 {
            return usual;
        }
        let rounds = f64::from(rounds);
        ((found / independent * rounds + f64::from(usual) * PRIOR) / (rounds + PRIOR)) as f32
    }

    /// Variance of the luminance of the irradiance of a vector, (W·m⁻²)²; infinite with fewer than two samples. It is an
    /// expectation over the points that were noted, not a bound for one.
    #[must_use]
    pub fn variance_of_mean(&self, vector: &LightVector) -> f32 {
        vector.independent_variance() * self.gain(vector.samples())
    }
}

const fn tally_of(samples: u32) -> usize {
    let power = samples.checked_ilog2();
    match power {
        Some(power) if (power as usize) < TALLIES => power as usize,
        Some(_) => TALLIES - 1,
        None => 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::hemisphere::{Method, gather};
    use crate::math::sequence::Sequence;
    use glam::Vec3;

    fn round(seed: u64, rays: std::ops::Range<u32>, radiance: fn(u32, Vec3) -> f32) -> LightVector {
        let mut vector = LightVector::default();
        let found = |index, direction| Vec3::splat(radiance(index, direction));
        let sink = |sample| vector.push(Vec3::Z, &sample);
        gather(Method::Stratified, &[Vec3::Z], rays, &Sequence::new(seed), found, sink);
        vector
    }

    fn half(_: u32, direction: Vec3) -> f32 {
        if direction.x + 0.3 * direction.y > 0.2 { 1.0 } else { 0.2 }
    }

    /// Noise at the hit, that no choice of directions lessens.
    fn noise(index: u32, direction: Vec3) -> f32 {
        2.0 * Sequence::new(u64::from(direction.x.to_bits())).independent(index)[0]
    }

    /// The mean square error of many gathers against what their rounds told.
    #[test]
    fn rounds_tell_the_error() {
        for (radiance, low, high) in [(half as fn(u32, Vec3) -> f32, 0.9, 2.2), (noise, 0.8, 1.25)] {
            let mut pool = Stratification::default();
            let truth = round(1, 0..1 << 16, radiance).irradiance().x;
            let (mut square, mut vectors) = (0.0, Vec::new());
            for seed in 2..2002 {
                let (mut vector, more) = (round(seed, 0..32, radiance), round(seed, 32..64, radiance));
                pool.note(&vector, &more);
                vector.add(&more);
                square += (vector.irradiance().x - truth).powi(2) / 2000.0;
                vectors.push(vector);
            }
            let expected = vectors.iter().map(|v| pool.variance_of_mean(v) / 2000.0).sum::<f32>();
            let ratio = expected / square;
            assert!((low..high).contains(&ratio), "{expected} for {square}");
        }
    }

    #[test]
    fn without_measurements_the_usual_gain_stands() {
        let mut pool = Stratification::default();
        let dark = LightVector::default();
        assert_eq!(pool.gain(64), usual_gain(64));
        assert!(pool.variance_of_mean(&dark).is_infinite());
        let [a, b] = [round(1, 0..32, |_, d| d.x + 1.0), round(1, 32..64, |_, d| d.x + 1.0)];
        pool.note(&dark, &a);
        assert_eq!(pool.gain(64), usual_gain(64), "a first round has nothing to differ from");
        (0..1000).for_each(|_| pool.note(&a, &b));
        assert!(pool.gain(64) < 0.1 * usual_gain(64) && pool.gain(128) == usual_gain(128));
        let mut sum = pool;
        sum.add(&pool);
        assert!((sum.gain(100) - pool.gain(64)).abs() < 0.02);
        assert_eq!(tally_of(u32::MAX), TALLIES - 1);
    }
}
