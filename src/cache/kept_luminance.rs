//! Luminance of a slot in 64 bits: what is shown and predicted from, not what estimates are added up in.

use crate::math::shared_exponent::SharedExponent;
use glam::Vec3;

/// Diffuse luminance at a slot, from the lights or from everything else.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Luminance {
    /// Diffuse luminance D, W·sr⁻¹·m⁻².
    pub diffuse: Vec3,
    /// Variance of the luminance of D, (W·sr⁻¹·m⁻²)².
    pub variance: f32,
    /// Whether there is a value at all.
    pub known: bool,
    /// Whether it is a guess, from before the lights changed or from coarser vertices: to be shown, but not to be
    /// computed with.
    pub stale: bool,
    /// Whether it is what coarser base vertices predict.
    pub coarse: bool,
}

/// D, to 6·10⁻⁵ of its brightest channel at most: a hundredth of what a picture shows of it.
type Diffuse = SharedExponent<14>;

/// Bits of the variance: the exponent of f32 and four of its mantissa, so that it is right to 3 %.
const VARIANCE: u32 = 12;
/// Bits of an f32 that are left out; the sign is never set.
const LEFT_OUT: u32 = u32::BITS - 1 - VARIANCE;
/// Flags: known, stale, coarse.
const FLAGS: u32 = 3;
const _: () = assert!(Diffuse::BITS + VARIANCE + FLAGS == u64::BITS);

/// A [`Luminance`] as it is kept.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct KeptLuminance([u32; 2]);

impl KeptLuminance {
    pub(super) fn new(light: Luminance) -> Self {
        let Luminance { diffuse, variance, known, stale, coarse } = light;
        let flags = u64::from(known) << 2 | u64::from(stale) << 1 | u64::from(coarse);
        let bits = (Diffuse::pack(diffuse, 0.5) << VARIANCE | u64::from(shortened(variance))) << FLAGS | flags;
        Self([bits as u32, (bits >> u32::BITS) as u32])
    }

    #[inline]
    pub(super) fn get(self) -> Luminance {
        let bits = u64::from(self.0[1]) << u32::BITS | u64::from(self.0[0]);
        let has = |flag: u32| bits >> flag & 1 == 1;
        let variance = (bits >> FLAGS) as u32 & ((1 << VARIANCE) - 1);
        Luminance {
            diffuse: Diffuse::unpack(bits >> (FLAGS + VARIANCE)),
            variance: f32::from_bits(variance << LEFT_OUT),
            known: has(2),
            stale: has(1),
            coarse: has(0),
        }
    }
}

/// The upper bits of a variance, rounded; what no variance can be counts as none.
fn shortened(variance: f32) -> u32 {
    (variance.max(0.0).abs().to_bits() + (1 << (LEFT_OUT - 1))) >> LEFT_OUT
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kept(diffuse: Vec3, variance: f32) -> Luminance {
        KeptLuminance::new(Luminance { diffuse, variance, ..Luminance::default() }).get()
    }

    #[test]
    fn what_is_kept_is_right_to_what_the_bits_tell() {
        for power in -30..=30 {
            let size = 1.37 * 2.0_f32.powi(power);
            let light = kept(Vec3::new(1.0, 0.2, 0.6) * size, size * size);
            let error = (light.diffuse - Vec3::new(1.0, 0.2, 0.6) * size).abs().max_element();
            assert!(error <= size * 6.2e-5, "{error} {size}");
            assert!((light.variance / (size * size) - 1.0).abs() < 0.032, "{} {size}", light.variance);
        }
    }

    #[test]
    fn nothing_stays_nothing_and_extremes_stay_numbers() {
        assert_eq!(KeptLuminance::default().get(), Luminance::default());
        assert_eq!(kept(Vec3::ZERO, -0.0), Luminance::default());
        assert_eq!(kept(Vec3::NAN, f32::NAN), Luminance::default());
        let most = kept(Vec3::splat(f32::INFINITY), f32::INFINITY);
        assert!(most.diffuse.is_finite() && most.variance.is_infinite(), "{most:?}");
        assert!(!kept(Vec3::ONE, f32::MAX).variance.is_nan());
        assert!(kept(Vec3::ONE, f32::MIN_POSITIVE).variance > 0.0);
    }

    #[test]
    fn flags_are_kept_apart() {
        for flags in 0..8 {
            let [known, stale, coarse] = [4, 2, 1].map(|flag| flags & flag != 0);
            let light = Luminance { diffuse: Vec3::ONE, variance: 0.25, known, stale, coarse };
            assert_eq!(KeptLuminance::new(light).get(), light);
        }
    }
}
