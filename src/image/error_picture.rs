//! A picture of signed relative errors, for `diff -o`.

use crate::math::luminance;
use glam::Vec3;

/// Relative errors up to this are shown as none.
const SMALLEST: f32 = 1e-3;
/// Decades of relative error from [`SMALLEST`] to the ends of the map.
const DECADES: f32 = 3.0;
/// Left out by the mask.
const MASKED: [u8; 3] = [64; 3];
/// Not a number, or infinite, in either image.
const NOT_FINITE: [u8; 3] = [255, 0, 255];

/// The colour map "`RdBu`" of `ColorBrewer` [Brewer03] from its middle: even steps to the eye, and told
/// apart by readers who do not see red and green alike.
const BRIGHTER: [[u8; 3]; 6] =
    [[247, 247, 247], [253, 219, 199], [244, 165, 130], [214, 96, 77], [178, 24, 43], [103, 0, 31]];
const DARKER: [[u8; 3]; 6] =
    [[247, 247, 247], [209, 229, 240], [146, 197, 222], [67, 147, 195], [33, 102, 172], [5, 48, 97]];

/// Signed relative error of luminance, (image − reference)/√(reference² + ε), a colour a pixel: red where the image is
/// too bright, blue where it is too dark, by the logarithm of its size from 0.1 % (white) to 100 %.
///
/// `epsilon` is that of the relMSE, the square of a radiance.
///
/// # Panics
/// If the slices differ in length.
#[must_use]
pub fn paint(image: &[Vec3], reference: &[Vec3], mask: Option<&[bool]>, epsilon: f64) -> Vec<[u8; 3]> {
    assert_eq!(image.len(), reference.len(), "images of one size");
    let colour = |(i, (&a, &b)): (usize, (&Vec3, &Vec3))| {
        if mask.is_some_and(|m| !m[i]) {
            return MASKED;
        }
        if !a.is_finite() || !b.is_finite() {
            return NOT_FINITE;
        }
        let (a, b) = (f64::from(luminance(a)), f64::from(luminance(b)));
        let error = if a == b { 0.0 } else { (a - b) / (b * b + epsilon).sqrt() };
        of_error(error as f32)
    };
    image.iter().zip(reference).enumerate().map(colour).collect()
}

fn of_error(error: f32) -> [u8; 3] {
    let map = if error > 0.0 { BRIGHTER } else { DARKER };
    let size = ((error.abs() / SMALLEST).max(1.0).log10() / DECADES).min(1.0) * (map.len() - 1) as f32;
    let step = (size as usize).min(map.len() - 2);
    let share = size - step as f32;
    let mix = |c: usize| f32::from(map[step][c]) * (1.0 - share) + f32::from(map[step + 1][c]) * share;
    [0, 1, 2].map(|c| mix(c).round() as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_say_sign_and_size() {
        let reference = [1.0, 1.0, 1.0, 1.0, 1.0, 0.0, 1.0].map(Vec3::splat);
        let image = [1.0, 1.0005, 3.0, 0.0, 1.01, 0.0, f32::NAN].map(Vec3::splat);
        let painted = paint(&image, &reference, None, 0.0);
        assert_eq!(painted[..4], [BRIGHTER[0], BRIGHTER[0], BRIGHTER[5], DARKER[5]]);
        // 1 % is a third of the way: 5/3 steps.
        let expected = [0, 1, 2].map(|c| {
            (f32::from(BRIGHTER[1][c]) + (f32::from(BRIGHTER[2][c]) - f32::from(BRIGHTER[1][c])) * 2.0 / 3.0).round()
        });
        assert!((0..3).all(|c| (f32::from(painted[4][c]) - expected[c]).abs() <= 1.0), "{:?}", painted[4]);
        assert_eq!(painted[5..], [BRIGHTER[0], NOT_FINITE]);
        let mask = [false; 7];
        assert_eq!(paint(&image, &reference, Some(&mask), 0.0), [MASKED; 7]);
    }
}
