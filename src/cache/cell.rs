//! A cell of the radiance grid in 62 bits: how many paths, and the sum of what they found with one exponent for three mantissas.
//!
//! A sum of so few bits would swallow small terms once it is large. So it is rounded up as often as what is cut off is worth, by
//! numbers that come of the cell and its paths, not of any clock: the expected sum is the exact one. The noise of that,
//! some 0.4 √(n/3) 2⁻¹² of the sum after n paths, stays below that of the paths themselves, some n^-½, up to [`MOST_PATHS`].

use crate::math::combine;
use glam::Vec3;

/// Paths from which on a cell takes in no more.
pub const MOST_PATHS: u32 = 1 << 15;
/// Bits of a channel's mantissa.
const MANTISSA: u32 = 13;
/// The greatest mantissa. What is packed stays below it by 1, so that rounding up never passes it.
const GREATEST: f32 = ((1 << MANTISSA) - 1) as f32;
/// Bits of the exponent.
const EXPONENT: u32 = 7;
/// Powers of two that the stored exponents stand for: radiance from 10⁻²⁰ to 10¹³ W·sr⁻¹·m⁻² keeps its precision in sums.
const EXPONENTS: [i32; 2] = [-80, -80 + (1 << EXPONENT) - 1];
/// Where the fields begin: three mantissas, the exponent, the number of paths.
const AT_EXPONENT: u32 = 3 * MANTISSA;
const AT_PATHS: u32 = AT_EXPONENT + EXPONENT;

/// What paths have told of a cell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cell(u64);

impl Cell {
    /// Bits that are used.
    pub const BITS: u32 = AT_PATHS + MOST_PATHS.ilog2() + 1;

    /// From the bits of another.
    pub const fn from_bits(bits: u64) -> Self {
        Self(bits)
    }

    /// Its [`BITS`](Self::BITS) bits.
    pub const fn bits(self) -> u64 {
        self.0
    }

    /// How many paths.
    pub const fn paths(self) -> u32 {
        (self.0 >> AT_PATHS) as u32
    }

    /// Mean of the radiance that they found, W·sr⁻¹·m⁻²; 0 without any.
    pub fn mean(self) -> Vec3 {
        self.sum() / self.paths().max(1) as f32
    }

    /// The cell with one more path in it, of a radiance in W·sr⁻¹·m⁻². `seed` tells the cells apart.
    #[must_use]
    pub fn with(self, radiance: Vec3, seed: u64) -> Self {
        let paths = self.paths();
        if paths >= MOST_PATHS {
            return self;
        }
        let random = combine(seed, u64::from(paths)) >> (u64::BITS - f32::MANTISSA_DIGITS);
        let cut = random as f32 / (1_u32 << f32::MANTISSA_DIGITS) as f32;
        Self::new(paths + 1, self.sum() + radiance, cut)
    }

    /// The cell in light that is `factor` times as bright, by channel.
    #[must_use]
    pub fn scaled(self, factor: Vec3) -> Self {
        Self::new(self.paths(), self.sum() * factor, 0.5)
    }

    fn sum(self) -> Vec3 {
        let channel = |i: u32| (self.0 >> (i * MANTISSA) & ((1 << MANTISSA) - 1)) as f32;
        let exponent = (self.0 >> AT_EXPONENT & ((1 << EXPONENT) - 1)) as i32 + EXPONENTS[0];
        Vec3::new(channel(0), channel(1), channel(2)) * power_of_two(exponent)
    }

    /// A sum, of which what is less than a unit of the mantissas is rounded up if it is more than 1 − `up` of it. What no
    /// radiance can be counts as none.
    fn new(paths: u32, sum: Vec3, up: f32) -> Self {
        let most = (GREATEST - 1.0) * power_of_two(EXPONENTS[1]);
        let sum = sum.max(Vec3::ZERO).min(Vec3::splat(most));
        let unit = exponent_for(sum.max_element());
        let scaled = sum * power_of_two(-unit);
        let mantissas = scaled.to_array().into_iter().rev().fold(0, |bits, x| bits << MANTISSA | (x + up) as u64);
        Self(u64::from(paths) << AT_PATHS | ((unit - EXPONENTS[0]) as u64) << AT_EXPONENT | mantissas)
    }
}

/// The exponent of the unit in which a number takes most of the bits of a mantissa.
fn exponent_for(x: f32) -> i32 {
    // The exponent of the number itself; of 0 less than any.
    let of_x = (x.to_bits() >> (f32::MANTISSA_DIGITS - 1)) as i32 - (f32::MAX_EXP - 1);
    let unit = (of_x - MANTISSA as i32 + 1).max(EXPONENTS[0]);
    unit + i32::from(x * power_of_two(-unit) > GREATEST - 1.0)
}

/// 2ⁿ for n of f32's normal numbers.
const fn power_of_two(n: i32) -> f32 {
    f32::from_bits(((n + f32::MAX_EXP - 1) as u32) << (f32::MANTISSA_DIGITS - 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cell that has seen these, one after the other.
    fn seen(radiance: impl Iterator<Item = Vec3>) -> Cell {
        radiance.fold(Cell::default(), |cell, radiance| cell.with(radiance, 7))
    }

    #[test]
    fn a_cell_that_saw_nothing_is_dark() {
        let cell = Cell::default();
        assert_eq!((cell.paths(), cell.mean()), (0, Vec3::ZERO));
        let dark = seen([Vec3::ZERO; 20].into_iter());
        assert_eq!((dark.paths(), dark.mean()), (20, Vec3::ZERO));
    }

    #[test]
    fn one_path_is_kept_to_a_part_in_four_thousand_of_its_brightest_channel() {
        for power in -60..=40 {
            for mantissa in [1.0, 1.3, 1.999_999] {
                let radiance = Vec3::new(1.0, 0.37, 1e-3) * mantissa * 2.0_f32.powi(power);
                let error = (seen([radiance].into_iter()).mean() - radiance).abs();
                assert!(error.max_element() <= radiance.x / 4000.0, "{radiance}: {error}");
            }
        }
    }

    #[test]
    fn extremes_stay_numbers() {
        let most = seen([f32::MAX, f32::INFINITY].map(Vec3::splat).into_iter());
        assert!(most.mean().is_finite() && most.mean().x > 1e17, "{most:?}");
        let none = seen([f32::NAN, -1.0, f32::MIN_POSITIVE, 1e-40].map(Vec3::splat).into_iter());
        assert!((none.paths(), none.mean().x) == (4, 0.0), "{none:?}");
        let full = Cell::new(MOST_PATHS, Vec3::splat(f32::MAX), 0.999);
        assert_eq!(full.bits() >> Cell::BITS, 0);
        assert_eq!(full.with(Vec3::ONE, 7), full, "it takes in no more");
    }

    /// Terms of a ten thousandth of the sum, less than its unit: cut off, they would be lost, and rounded, too.
    #[test]
    fn small_terms_beside_a_large_sum_are_not_lost() {
        let (terms, small) = (30_000, 1e-4);
        let means = (0..16).map(|seed| {
            let paths = (0..terms).map(|i| if i == 0 { 1.0 } else { small });
            let cell = paths.fold(Cell::default(), |cell, x| cell.with(Vec3::splat(x), seed));
            cell.mean().y * terms as f32
        });
        let found = means.sum::<f32>() / 16.0;
        let expected = 1.0 + small * (terms - 1) as f32;
        assert!((found / expected - 1.0).abs() < 4e-3, "{found} {expected}");
    }

    /// Half of the paths find something, as much as they differ in the end: the noise is theirs, not the rounding's.
    #[test]
    fn rounding_adds_less_noise_than_paths_have() {
        for paths in [100, 3000, MOST_PATHS] {
            let found = |seed: u64| {
                let cell = (0..paths).fold(Cell::default(), |cell, i| cell.with(Vec3::splat((i % 2) as f32), seed));
                cell.mean().x
            };
            let square = (0..64).map(|seed| (found(seed) / 0.5 - 1.0).powi(2)).sum::<f32>() / 64.0;
            let of_paths = 1.0 / paths as f32;
            assert!(square < 1.2 * of_paths, "{paths}: {} {}", square.sqrt(), of_paths.sqrt());
        }
    }

    #[test]
    fn other_light_scales_it() {
        let cell = seen([Vec3::new(1.0, 2.0, 3.0); 100].into_iter()).scaled(Vec3::new(2.0, 0.5, 0.0));
        assert!((cell.mean() - Vec3::new(2.0, 1.0, 0.0)).abs().max_element() < 2e-3, "{}", cell.mean());
        assert_eq!(cell.paths(), 100);
    }
}
