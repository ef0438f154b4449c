//! How the four bytes of a texel stand for linear values.

use glam::Vec3;
use std::sync::LazyLock;

/// What the bytes of a texture mean; `glsl/include/texture.glsl` decodes them alike.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Encoding {
    /// RGB by the sRGB curve, at most 1; A linear, the cut-out mask of `map_d`.
    #[default]
    Srgb,
    /// RGB of any brightness: 8-bit mantissas with one exponent of 2 in A, biased by 128, as in Radiance files
    /// \[Ward91\]. 0 is black.
    SharedExponent,
    /// RGB linear, at most 1: roughness, normals. A is of no use.
    Linear,
}

/// The brightest value that a texel keeps: sums over it stay finite.
pub(super) const MAX_VALUE: f32 = 1e12;

/// sRGB electro-optical transfer function (IEC 61966-2-1), encoded [0, 1] to linear [0, 1].
#[must_use]
pub fn srgb_to_linear(c: f32) -> f32 {
    if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}

/// Its inverse.
pub(super) fn linear_to_srgb(c: f32) -> f32 {
    if c <= 0.003_130_8 { 12.92 * c } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 }
}

/// sRGB code of a linear value; what is outside of [0, 1] is brought there, not a number to 0.
pub(super) fn srgb_code(linear: f32) -> u8 {
    (linear_to_srgb(linear.clamp(0.0, 1.0)) * 255.0).round() as u8
}

/// Linear values of the 256 sRGB codes.
pub(crate) static SRGB: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|i| srgb_to_linear(i as f32 / 255.0)));

/// sRGB codes of 4096 linear values; next to black, where the curve is steepest, a step is 12.92·255/4095 = 0.8 codes.
pub(super) static CODES: LazyLock<[u8; 4096]> =
    LazyLock::new(|| std::array::from_fn(|i| (linear_to_srgb(i as f32 / 4095.0) * 255.0 + 0.5) as u8));

/// The texel of a linear colour, by shared exponent. Each channel is right to half a step of the brightest one's mantissa.
pub(super) fn shared_exponent(colour: Vec3) -> [u8; 4] {
    // Black where it is not a number.
    let colour = Vec3::from(colour.to_array().map(|c| if c > 0.0 { c.min(MAX_VALUE) } else { 0.0 }));
    let largest = colour.max_element();
    // Smaller ones have no normal factor on the device.
    if largest < 1e-30 {
        return [0; 4];
    }
    // The exponent with which the largest mantissa is in [128, 256), one more where it rounds up to 256.
    let mut exponent = (largest.to_bits() >> 23) as i32 - 126;
    if largest * factor(exponent).recip() >= 255.5 {
        exponent += 1;
    }
    let [r, g, b] = (colour * factor(exponent).recip()).to_array().map(|c| (c + 0.5) as u8);
    [r, g, b, (exponent + 128) as u8]
}

/// What a mantissa of that exponent counts times: 2^(exponent − 8).
fn factor(exponent: i32) -> f32 {
    f32::from_bits(((exponent + 119) as u32) << 23)
}

/// The linear colour of a texel by shared exponent.
#[inline]
pub(super) fn of_shared_exponent([r, g, b, e]: [u8; 4]) -> Vec3 {
    // 0 and factors that are not normal numbers are black.
    let factor = f32::from_bits(u32::from(e.saturating_sub(9)) << 23);
    Vec3::new(f32::from(r), f32::from(g), f32::from(b)) * factor
}

/// The values of a linear texel.
#[inline]
pub(super) fn of_linear([r, g, b, _]: [u8; 4]) -> Vec3 {
    Vec3::new(f32::from(r), f32::from(g), f32::from(b)) / 255.0
}

/// The linear colour of an sRGB texel.
#[inline]
pub(super) fn of_srgb([r, g, b, _]: [u8; 4], table: &[f32; 256]) -> Vec3 {
    Vec3::new(table[r as usize], table[g as usize], table[b as usize])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shared_exponents_keep_what_radiance_files_hold() {
        for texel in [[160, 0, 0, 133], [128, 1, 255, 128], [200, 3, 90, 90], [255, 255, 255, 160], [0; 4]] {
            assert_eq!(shared_exponent(of_shared_exponent(texel)), texel);
        }
        assert_eq!(of_shared_exponent([160, 160, 160, 133]), Vec3::splat(20.0));
    }

    #[test]
    fn shared_exponents_are_right_to_half_a_step() {
        for i in 0..2000 {
            let x = 2f32.powf(i as f32 / 50.0 - 20.0);
            let colour = Vec3::new(x, x * 0.3, x * 0.01);
            let error = (of_shared_exponent(shared_exponent(colour)) - colour).abs().max_element();
            assert!(error <= x / 255.0, "{x}: {error}");
        }
    }

    #[test]
    fn no_value_is_beyond_what_a_texel_can_hold() {
        let odd = Vec3::new(f32::NAN, -1.0, f32::INFINITY);
        let back = of_shared_exponent(shared_exponent(odd));
        assert_eq!((back.x, back.y), (0.0, 0.0));
        assert!((back.z / MAX_VALUE - 1.0).abs() < 0.01);
        assert_eq!(srgb_code(f32::NAN), 0);
    }
}
