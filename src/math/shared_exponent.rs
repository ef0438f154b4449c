//! Colours in few bits: one exponent for three mantissas, as in RGB9E5, of any length.

use glam::Vec3;

/// Bits of the exponent.
const EXPONENT: u32 = 7;
/// Powers of two that a unit of the mantissas may stand for.
const UNITS: [i32; 2] = [-80, -80 + (1 << EXPONENT) - 1];

/// Three channels with mantissas of `M` bits, 22 at most, and one exponent: from 10⁻²⁰ to 10¹⁷ the greatest channel is kept to a part in
/// 2ᴹ, the others as finely.
pub struct SharedExponent<const M: u32>;

impl<const M: u32> SharedExponent<M> {
    /// Bits that are used.
    pub const BITS: u32 = 3 * M + EXPONENT;
    /// The greatest mantissa. What is packed stays below it by 1, so that rounding up never passes it.
    const GREATEST: f32 = ((1 << M) - 1) as f32;

    /// The bits of a colour, of which what is less than a unit of the mantissas is rounded up where it is more than 1 − `up` of one;
    /// 1/2 rounds to the nearest. What no light can be counts as none.
    #[inline]
    pub fn pack(colour: Vec3, up: f32) -> u64 {
        let most = (Self::GREATEST - 1.0) * power_of_two(UNITS[1]);
        let colour = colour.max(Vec3::ZERO).min(Vec3::splat(most));
        let unit = Self::unit_for(colour.max_element());
        let scaled = (colour * power_of_two(-unit)).to_array();
        let mantissas = scaled.into_iter().rev().fold(0, |bits, x| bits << M | (x + up) as u64);
        ((unit - UNITS[0]) as u64) << (3 * M) | mantissas
    }

    /// The colour of the lowest [`BITS`](Self::BITS) bits.
    #[inline]
    pub fn unpack(bits: u64) -> Vec3 {
        let channel = |i: u32| (bits >> (i * M) & ((1 << M) - 1)) as f32;
        let unit = (bits >> (3 * M) & ((1 << EXPONENT) - 1)) as i32 + UNITS[0];
        Vec3::new(channel(0), channel(1), channel(2)) * power_of_two(unit)
    }

    /// The exponent of the unit in which a number takes most of the bits of a mantissa.
    fn unit_for(x: f32) -> i32 {
        // The exponent of the number itself; of 0 less than any.
        let of_x = (x.to_bits() >> (f32::MANTISSA_DIGITS - 1)) as i32 - (f32::MAX_EXP - 1);
        let unit = (of_x - M as i32 + 1).max(UNITS[0]);
        unit + i32::from(x * power_of_two(-unit) > Self::GREATEST - 1.0)
    }
}

/// 2ⁿ for n of f32's normal numbers.
const fn power_of_two(n: i32) -> f32 {
    f32::from_bits(((n + f32::MAX_EXP - 1) as u32) << (f32::MANTISSA_DIGITS - 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn nearest<const M: u32>(colour: Vec3) -> Vec3 {
        SharedExponent::<M>::unpack(SharedExponent::<M>::pack(colour, 0.5))
    }

    fn is_kept<const M: u32>(colour: Vec3) {
        let error = (nearest::<M>(colour) - colour).abs().max_element();
        assert!(error <= colour.max_element() * 2.0_f32.powi(-(M as i32)), "{M} {colour}: {error}");
    }

    #[test]
    fn colours_are_kept_to_a_unit_of_the_mantissa() {
        for power in -60..=40 {
            for mantissa in [1.0, 1.3, 1.999_9, 1.999_999] {
                let colour = Vec3::new(0.37, 1.0, 1e-3) * mantissa * 2.0_f32.powi(power);
                is_kept::<9>(colour);
                is_kept::<13>(colour);
                is_kept::<14>(colour);
            }
        }
        assert_eq!([0.0, 1.0, 3.0, 0.125].map(|x| nearest::<13>(Vec3::splat(x)).y), [0.0, 1.0, 3.0, 0.125]);
    }

    #[test]
    fn extremes_stay_numbers() {
        for most in [f32::MAX, f32::INFINITY] {
            let found = nearest::<13>(Vec3::new(most, 1.0, most));
            assert!(found.is_finite() && found.x > 1e17, "{found}");
        }
        for none in [f32::NAN, -1.0, f32::NEG_INFINITY, f32::MIN_POSITIVE, 1e-40, -0.0] {
            assert_eq!(nearest::<13>(Vec3::splat(none)), Vec3::ZERO, "{none}");
        }
        assert_eq!(SharedExponent::<13>::pack(Vec3::splat(f32::MAX), 0.999_999) >> SharedExponent::<13>::BITS, 0);
    }

    #[test]
    fn what_is_cut_off_is_rounded_up_as_often_as_it_is_worth() {
        let colour = Vec3::new(1.000_03, 0.5, 0.1);
        let packed = |i: u32| SharedExponent::<13>::unpack(SharedExponent::<13>::pack(colour, i as f32 / 4096.0));
        let mean = (0..4096).map(packed).sum::<Vec3>() / 4096.0;
        assert!((mean - colour).abs().max_element() < 2e-6, "{mean}");
    }
}
