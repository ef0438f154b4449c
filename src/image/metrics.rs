//! Error measures of an image against a reference, in linear radiance.

use glam::Vec3;

/// What keeps relMSE finite where the reference is dark.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Epsilon {
    /// This times the squared mean of the reference: the same verdict whatever the exposure.
    OfMeanSquare(f32),
    /// This, whatever the reference.
    Absolute(f32),
}

impl Default for Epsilon {
    fn default() -> Self {
        Self::OfMeanSquare(0.01)
    }
}

/// Differences over the pixels that count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Metrics {
    /// Root of the mean square difference over pixels and channels, W·sr⁻¹·m⁻².
    pub rmse: f64,
    /// Mean over pixels and channels of d²/(r² + ε), a number.
    pub relmse: f64,
    /// Largest absolute difference of a channel, W·sr⁻¹·m⁻².
    pub max: f64,
    /// Mean of image − reference over pixels and channels, W·sr⁻¹·m⁻²: a bias, where noise cancels.
    pub mean_shift: f64,
    /// Mean of the reference over pixels and channels, W·sr⁻¹·m⁻².
    pub reference_mean: f64,
    /// Pixels counted.
    pub counted: usize,
    /// Pixels left out by the mask.
    pub masked: usize,
    /// Pixels left out because a channel of either image is NaN or infinite; more than 0 is a fault of an image.
    pub not_finite: usize,
}

/// Compares `image` with `reference`, radiances in W·sr⁻¹·m⁻², pixel by pixel; `mask` says which pixels count.
///
/// `None` when no pixel is left to count.
///
/// # Panics
/// If the slices differ in length.
#[must_use]
pub fn compare(image: &[Vec3], reference: &[Vec3], mask: Option<&[bool]>, epsilon: Epsilon) -> Option<Metrics> {
    assert_eq!(image.len(), reference.len(), "images of one size");
    let finite = |i: usize| image[i].is_finite() && reference[i].is_finite();
    let (pixels, masked, not_finite) = select(image.len(), mask, finite);
    let reference_mean = channel_mean(&pixels, |i| reference[i])?;
    let epsilon = epsilon.resolve(reference_mean);
    let (mut square, mut relative, mut max, mut shift) = (0.0, 0.0, 0.0_f64, 0.0);
    for &i in &pixels {
        for channel in 0..3 {
            let r = f64::from(reference[i][channel]);
            let d = f64::from(image[i][channel]) - r;
            square += d * d;
            relative += ratio(d * d, r * r + epsilon);
            max = max.max(d.abs());
            shift += d;
        }
    }
    let n = pixels.len() as f64 * 3.0;
    Some(Metrics {
        rmse: (square / n).sqrt(),
        relmse: relative / n,
        max,
        mean_shift: shift / n,
        reference_mean,
        counted: pixels.len(),
        masked,
        not_finite,
    })
}

/// What a reference's noise alone makes of the measures: no image can be shown to be closer than this.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OwnNoise {
    /// Mean over pixels and channels of variance/(r² + ε).
    pub relmse: f64,
    /// Mean over pixels and channels of the variance, (W·sr⁻¹·m⁻²)².
    pub mean_square: f64,
}

/// The reference's own noise, from the variance of its mean, (W·sr⁻¹·m⁻²)².
///
/// `None` when no pixel is left to count.
///
/// # Panics
/// If the slices differ in length.
#[must_use]
pub fn own_noise(reference: &[Vec3], variance: &[Vec3], mask: Option<&[bool]>, epsilon: Epsilon) -> Option<OwnNoise> {
    assert_eq!(reference.len(), variance.len(), "images of one size");
    let finite = |i: usize| reference[i].is_finite() && variance[i].is_finite();
    let (pixels, ..) = select(reference.len(), mask, finite);
    let epsilon = epsilon.resolve(channel_mean(&pixels, |i| reference[i])?);
    let (mut relative, mut square) = (0.0, 0.0);
    for &i in &pixels {
        for channel in 0..3 {
            let [r, v] = [reference[i], variance[i]].map(|c| f64::from(c[channel]));
            relative += ratio(v, r * r + epsilon);
            square += v;
        }
    }
    let n = pixels.len() as f64 * 3.0;
    Some(OwnNoise { relmse: relative / n, mean_square: square / n })
}

/// How often images differ by more than their noise explains.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ZTest {
    /// Values (pixels × channels) tested: those with a variance.
    pub values: usize,
    /// Share of them with |z| > [`ZTest::LIMIT`].
    pub share: f64,
}

impl ZTest {
    /// Standard deviations beyond which a difference counts.
    pub const LIMIT: f64 = 3.0;
    /// The share that is beyond the limit when both images estimate the same (a normal distribution).
    pub const EXPECTED: f64 = 0.002_699_796;
}

/// Tests each value's z = d/√(σ² + δ²), where `variance` is the sum of both images' and δ the rounding of half floats.
///
/// `None` when no value has a variance.
///
/// # Panics
/// If the slices differ in length.
#[must_use]
pub fn z_test(image: &[Vec3], reference: &[Vec3], variance: &[Vec3], mask: Option<&[bool]>) -> Option<ZTest> {
    assert!(image.len() == reference.len() && image.len() == variance.len(), "images of one size");
    let finite = |i: usize| image[i].is_finite() && reference[i].is_finite() && variance[i].is_finite();
    let (pixels, ..) = select(image.len(), mask, finite);
    // Rounded to 11 significant bits, an error is uniform in ±2⁻¹² to ±2⁻¹¹ of the value.
    let rounding = |r: f64| (r * 2f64.powi(-11)).powi(2) / 3.0;
    let (mut values, mut beyond) = (0, 0);
    for &i in &pixels {
        for channel in 0..3 {
            let [a, r, v] = [image[i], reference[i], variance[i]].map(|c| f64::from(c[channel]));
            if v > 0.0 {
                values += 1;
                beyond += usize::from((a - r).powi(2) > ZTest::LIMIT.powi(2) * (v + rounding(r)));
            }
        }
    }
    (values > 0).then(|| ZTest { values, share: beyond as f64 / values as f64 })
}

impl Epsilon {
    /// The value to add to r², (W·sr⁻¹·m⁻²)², for a reference of this mean.
    #[must_use]
    pub fn resolve(self, mean: f64) -> f64 {
        match self {
            Self::OfMeanSquare(factor) => f64::from(factor) * mean * mean,
            Self::Absolute(value) => f64::from(value),
        }
    }
}

/// 0/0 is 0: no difference, nothing to relate it to.
fn ratio(numerator: f64, denominator: f64) -> f64 {
    if numerator == 0.0 { 0.0 } else { numerator / denominator }
}

/// The pixels that count, and how many were masked and not finite.
fn select(count: usize, mask: Option<&[bool]>, finite: impl Fn(usize) -> bool) -> (Vec<usize>, usize, usize) {
    assert!(mask.is_none_or(|m| m.len() == count), "a mask of the images' size");
    let unmasked: Vec<usize> = (0..count).filter(|&i| mask.is_none_or(|m| m[i])).collect();
    let masked = count - unmasked.len();
    let total = unmasked.len();
    let pixels: Vec<usize> = unmasked.into_iter().filter(|&i| finite(i)).collect();
    let not_finite = total - pixels.len();
    (pixels, masked, not_finite)
}

fn channel_mean(pixels: &[usize], value: impl Fn(usize) -> Vec3) -> Option<f64> {
    let sum: f64 = pixels.iter().map(|&i| value(i).as_dvec3().element_sum()).sum();
    (!pixels.is_empty()).then(|| sum / (pixels.len() as f64 * 3.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    const REFERENCE: [Vec3; 2] = [Vec3::new(1.0, 2.0, 3.0), Vec3::new(0.0, 0.0, 0.0)];
    const IMAGE: [Vec3; 2] = [Vec3::new(1.5, 2.0, 2.0), Vec3::new(0.1, 0.0, 0.0)];

    fn close(a: f64, b: f64) {
        assert!((a - b).abs() < 1e-6 * b.abs().max(1.0), "{a} is not {b}");
    }

    #[test]
    fn values_computed_by_hand() {
        let m = compare(&IMAGE, &REFERENCE, None, Epsilon::default()).expect("pixels");
        // Mean 6/6 = 1, so ε = 0.01; squares 0.25, 0, 1, 0.01, 0, 0.
        close(m.reference_mean, 1.0);
        close(m.rmse, (1.26_f64 / 6.0).sqrt());
        close(m.relmse, (0.25 / 1.01 + 1.0 / 9.01 + 0.01 / 0.01) / 6.0);
        close(m.max, 1.0);
        close(m.mean_shift, -0.4 / 6.0);
        assert_eq!((m.counted, m.masked, m.not_finite), (2, 0, 0));
        let absolute = compare(&IMAGE, &REFERENCE, None, Epsilon::Absolute(0.1)).expect("pixels");
        close(absolute.relmse, (0.25 / 1.1 + 1.0 / 9.1 + 0.01 / 0.1) / 6.0);
    }

    #[test]
    fn masked_pixels_count_nowhere() {
        let m = compare(&IMAGE, &REFERENCE, Some(&[true, false]), Epsilon::default()).expect("pixels");
        close(m.reference_mean, 2.0);
        close(m.relmse, (0.25 / 1.04 + 1.0 / 9.04) / 3.0);
        assert_eq!((m.counted, m.masked), (1, 1));
        assert_eq!(compare(&IMAGE, &REFERENCE, Some(&[false, false]), Epsilon::default()), None);
        assert_eq!(compare(&[], &[], None, Epsilon::default()), None);
    }

    #[test]
    fn pixels_that_are_not_numbers_are_counted_apart() {
        let bad = [IMAGE[0], Vec3::new(0.0, f32::NAN, 0.0)];
        let m = compare(&bad, &REFERENCE, None, Epsilon::default()).expect("pixels");
        assert_eq!((m.counted, m.not_finite), (1, 1));
        close(m.rmse, (1.25_f64 / 3.0).sqrt());
        let m = compare(&IMAGE, &[REFERENCE[0], Vec3::INFINITY], None, Epsilon::default()).expect("pixels");
        assert_eq!((m.counted, m.not_finite), (1, 1));
    }

    #[test]
    fn a_black_reference_has_no_error_only_against_black() {
        let black = [Vec3::ZERO; 2];
        close(compare(&black, &black, None, Epsilon::default()).expect("pixels").relmse, 0.0);
        assert!(compare(&IMAGE, &black, None, Epsilon::default()).expect("pixels").relmse.is_infinite());
    }

    #[test]
    fn relmse_does_not_depend_on_exposure() {
        let scaled = |pixels: &[Vec3]| pixels.iter().map(|&p| p * 64.0).collect::<Vec<_>>();
        let one = compare(&IMAGE, &REFERENCE, None, Epsilon::default()).expect("pixels").relmse;
        let two = compare(&scaled(&IMAGE), &scaled(&REFERENCE), None, Epsilon::default()).expect("pixels").relmse;
        close(one, two);
    }

    #[test]
    fn z_counts_what_noise_does_not_explain() {
        let variance = [Vec3::new(0.02, 0.02, 0.2), Vec3::new(0.0, 0.0, 0.01)];
        // z: 0.5/0.141 = 3.5, 0, 1/0.447 = 2.2; then without variance twice, and 0.
        let z = z_test(&IMAGE, &REFERENCE, &variance, None).expect("values");
        assert_eq!(z.values, 4);
        close(z.share, 0.25);
        assert_eq!(z_test(&IMAGE, &REFERENCE, &[Vec3::ZERO; 2], None), None);
        assert_eq!(z_test(&IMAGE, &REFERENCE, &variance, Some(&[false, true])).expect("values").values, 1);
        // What half floats round away is no difference, however sure the reference is.
        let rounded = REFERENCE.map(|r| r * (1.0 + 2f32.powi(-12)));
        close(z_test(&rounded, &REFERENCE, &[Vec3::splat(1e-20); 2], None).expect("values").share, 0.0);
    }

    #[test]
    fn own_error_is_what_noise_of_that_variance_measures() {
        let variance = [Vec3::new(0.25, 0.0, 1.0), Vec3::new(0.01, 0.0, 0.0)];
        let own = own_noise(&REFERENCE, &variance, None, Epsilon::default()).expect("pixels");
        let measured = compare(&IMAGE, &REFERENCE, None, Epsilon::default()).expect("pixels");
        close(own.relmse, measured.relmse);
        close(own.mean_square, measured.rmse.powi(2));
        let masked = own_noise(&REFERENCE, &variance, Some(&[true, false]), Epsilon::default()).expect("pixels");
        close(masked.relmse, (0.25 / 1.04 + 1.0 / 9.04) / 3.0);
    }
}
