//! A cell of the radiance grid in 62 bits: how many paths, and the sum of what they found with one exponent for three mantissas.
//!
//! A sum of so few bits would swallow small terms once it is large. So it is rounded up as often as what is cut off is worth, by
//! numbers that come of the cell and its paths, not of any clock: the expected sum is the exact one. The noise of that,
//! some 0.4 √(n/3) 2⁻¹² of the sum after n paths, stays below that of the paths themselves, some n^-½, up to [`MOST_PATHS`].

use crate::math::combine;
use crate::math::shared_exponent::SharedExponent;
use glam::Vec3;

/// Paths from which on a cell takes in no more.
pub const MOST_PATHS: u32 = 1 << 15;
/// The sum of what they found.
type Sum = SharedExponent<13>;

/// What paths have told of a cell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cell(u64);

impl Cell {
    /// Bits that are used.
    pub const BITS: u32 = Sum::BITS + MOST_PATHS.ilog2() + 1;

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
        (self.0 >> Sum::BITS) as u32
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
        Sum::unpack(self.0)
    }

    fn new(paths: u32, sum: Vec3, up: f32) -> Self {
        Self(u64::from(paths) << Sum::BITS | Sum::pack(sum, up))
    }
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
    fn a_full_cell_takes_in_no_more_and_extremes_stay_numbers() {
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
