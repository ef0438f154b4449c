//! Tone mapping on the CPU: what PNG files are made with, and the twin that tests the combine shader.
//!
//! Order: exposure, operator, sRGB encoding, rounding to 8 bits. Every input has a defined result: after exposure
//! a channel that is NaN or negative counts as 0 and one above [`MAX_INPUT`] as that; the shader does the same.

use crate::scene::ToneMapping;
use glam::{Mat3, Vec3};

/// Upper bound on exposed radiance, W·sr⁻¹·m⁻²: far in the shoulder of every operator, with a square that f32 holds
/// exactly enough.
pub const MAX_INPUT: f32 = 1e6;

/// Rec.709 luminance weights.
const LUMINANCE: Vec3 = Vec3::new(0.2126, 0.7152, 0.0722);

/// The 8-bit sRGB colour that displays the linear radiance `linear`, W·sr⁻¹·m⁻², at `exposure_stops`.
#[must_use]
pub fn display(linear: Vec3, exposure_stops: f32, operator: ToneMapping) -> [u8; 3] {
    let mapped = tone_map(exposed(linear, exposure_stops), operator);
    mapped.to_array().map(|c| (encode_srgb(c) * 255.0 + 0.5) as u8)
}

/// Radiance times 2^stops, made finite and non-negative.
#[must_use]
pub fn exposed(linear: Vec3, stops: f32) -> Vec3 {
    let scaled = linear * stops.exp2();
    // The comparison is false for NaN, which thus becomes 0.
    Vec3::from_array(scaled.to_array().map(|c| if c > 0.0 { c.min(MAX_INPUT) } else { 0.0 }))
}

/// Applies an operator to finite radiance ≥ 0; the result is display-linear, in [0, 1].
#[must_use]
pub fn tone_map(c: Vec3, operator: ToneMapping) -> Vec3 {
    let mapped = match operator {
        ToneMapping::Clamp => c,
        ToneMapping::Reinhard => c / (1.0 + c.dot(LUMINANCE)),
        ToneMapping::Aces => aces(c),
        ToneMapping::Agx => agx(c),
        ToneMapping::PbrNeutral => pbr_neutral(c),
    };
    mapped.clamp(Vec3::ZERO, Vec3::ONE)
}

/// sRGB opto-electronic transfer function (IEC 61966-2-1); values outside [0, 1] are clamped.
#[must_use]
pub fn encode_srgb(linear: f32) -> f32 {
    let c = linear.clamp(0.0, 1.0);
    if c <= 0.003_130_8 { c * 12.92 } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 }
}

/// ACES filmic curve in Narkowicz's fit, a channel at a time ["ACES Filmic Tone Mapping Curve", 2016].
fn aces(c: Vec3) -> Vec3 {
    (c * (c * 2.51 + 0.03)) / (c * (c * 2.43 + 0.59) + 0.14)
}

/// `AgX`, base look, in Wrensch's polynomial approximation ["Minimal AgX Implementation", 2023].
fn agx(c: Vec3) -> Vec3 {
    const INSET: Mat3 = Mat3::from_cols_array(&[
        0.842_479_06,
        0.042_328_242,
        0.042_375_655,
        0.078_433_6,
        0.878_468_64,
        0.078_433_6,
        0.079_223_745,
        0.079_166_13,
        0.879_143,
    ]);
    const OUTSET: Mat3 = Mat3::from_cols_array(&[
        1.196_879,
        -0.052_896_85,
        -0.052_971_635,
        -0.098_020_88,
        1.151_903_1,
        -0.098_043_45,
        -0.099_029_74,
        -0.098_961_18,
        1.151_073_7,
    ]);
    const MIN_EV: f32 = -12.473_93;
    const MAX_EV: f32 = 4.026_069;
    let inset = INSET * c;
    let log = Vec3::from_array(inset.to_array().map(|x| {
        // log2 of 0 is −∞, which the clamp brings to MIN_EV.
        (x.log2().clamp(MIN_EV, MAX_EV) - MIN_EV) / (MAX_EV - MIN_EV)
    }));
    let outset = OUTSET * agx_contrast(log);
    // The curve yields values for a 2.2 display; back to linear, as the sRGB encoding follows.
    Vec3::from_array(outset.to_array().map(|x| x.max(0.0).powf(2.2)))
}

/// Sixth-degree fit of `AgX`'s default contrast curve on [0, 1].
fn agx_contrast(x: Vec3) -> Vec3 {
    let x2 = x * x;
    let x4 = x2 * x2;
    15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2 + 0.1191 * x - 0.002_32
}

/// Khronos PBR Neutral [Khronos, "PBR Neutral Tone Mapper", 2024]: base colours under grey light stay as they are.
fn pbr_neutral(c: Vec3) -> Vec3 {
    const START_COMPRESSION: f32 = 0.8 - 0.04;
    const DESATURATION: f32 = 0.15;
    let least = c.min_element();
    let offset = if least < 0.08 { least - 6.25 * least * least } else { 0.04 };
    let c = c - offset;
    let peak = c.max_element();
    if peak < START_COMPRESSION {
        return c;
    }
    let d = 1.0 - START_COMPRESSION;
    let new_peak = 1.0 - d * d / (peak + d - START_COMPRESSION);
    let whiteness = 1.0 - 1.0 / (DESATURATION * (peak - new_peak) + 1.0);
    (c * (new_peak / peak)).lerp(Vec3::splat(new_peak), whiteness)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::texture::srgb_to_linear;
    use ToneMapping::{Aces, Agx, Clamp, PbrNeutral, Reinhard};

    fn grey(x: f32, operator: ToneMapping) -> f32 {
        let mapped = tone_map(Vec3::splat(x), operator);
        assert!((mapped.max_element() - mapped.min_element()) < 2e-3, "{operator:?} keeps greys grey: {mapped}");
        mapped.y
    }

    #[test]
    fn known_values() {
        // Computed in double precision from the published formulas, outside this program.
        let expected = [
            (Clamp, [0.0, 0.18, 1.0, 1.0]),
            (Reinhard, [0.0, 0.152_542_4, 0.5, 0.909_090_9]),
            (Aces, [0.0, 0.266_898_9, 0.803_797_5, 1.0]),
            (Agx, [0.0, 0.214_53, 0.590_21, 0.955_36]),
            (PbrNeutral, [0.0, 0.14, 0.869_090_9, 0.993_898_3]),
        ];
        for (operator, values) in expected {
            for (x, value) in [0.0, 0.18, 1.0, 10.0].into_iter().zip(values) {
                assert!((grey(x, operator) - value).abs() < 1e-5, "{operator:?} {x}: {}", grey(x, operator));
            }
        }
        let orange = tone_map(Vec3::new(1.0, 0.2, 0.05), Agx);
        assert!(orange.abs_diff_eq(Vec3::new(0.653_36, 0.253_62, 0.107_88), 1e-4), "{orange}");
    }

    #[test]
    fn colours_keep_or_lose_saturation_as_published() {
        let red = Vec3::new(10.0, 0.1, 0.1);
        // Reinhard on luminance keeps ratios before clipping.
        let dim = tone_map(red * 0.01, Reinhard);
        assert!((dim.x / dim.y - 100.0).abs() < 1e-2);
        // PBR Neutral and AgX bring bright saturated colours towards white.
        for operator in [PbrNeutral, Agx] {
            let bright = tone_map(red * 10.0, operator);
            assert!(bright.y > 0.3, "{operator:?} {bright}");
        }
        // PBR Neutral leaves a base colour as it is but for the 0.04 of the Fresnel term.
        let base = tone_map(Vec3::new(0.5, 0.3, 0.2), PbrNeutral);
        assert!(base.abs_diff_eq(Vec3::new(0.46, 0.26, 0.16), 1e-6));
    }

    #[test]
    fn grey_ramps_rise_and_stay_in_range() {
        for (_, operator) in ToneMapping::NAMES {
            let mut last = -1.0;
            for i in 0..400 {
                let value = grey((i as f32 * 0.05 - 14.0).exp2(), operator);
                assert!(value >= last - 1e-6 && (0.0..=1.0).contains(&value), "{operator:?} {i}: {value} < {last}");
                last = value;
            }
        }
    }

    #[test]
    fn any_input_has_a_defined_colour() {
        for (_, operator) in ToneMapping::NAMES {
            let black = display(Vec3::ZERO, 0.0, operator);
            assert_eq!(display(Vec3::NAN, 0.0, operator), black);
            assert_eq!(display(Vec3::splat(-1.0), 0.0, operator), black);
            assert_eq!(display(Vec3::ONE, f32::NAN, operator), black);
            let white = display(Vec3::splat(MAX_INPUT), 0.0, operator);
            assert!(white[1] >= 250, "{operator:?} {white:?}");
            assert_eq!(display(Vec3::INFINITY, 0.0, operator), white);
            assert_eq!(display(Vec3::MAX, 100.0, operator), white);
        }
    }

    #[test]
    fn exposure_is_in_stops_and_first() {
        for (_, operator) in ToneMapping::NAMES {
            assert_eq!(display(Vec3::splat(0.1), 2.0, operator), display(Vec3::splat(0.4), 0.0, operator));
        }
    }

    #[test]
    fn encoding_inverts_the_texture_decoding() {
        for code in 0..=255_u8 {
            let linear = srgb_to_linear(f32::from(code) / 255.0);
            assert_eq!(display(Vec3::splat(linear), 0.0, Clamp), [code; 3]);
        }
    }
}
