//! Running sums over the visible leaves, in which the image's error is estimated.

use super::view::Accounted;

/// Sums over the image, weighted by pixels.
#[derive(Clone, Copy, Debug, Default)]
pub struct ImageError {
    pixels: f64,
    light: f64,
    error: f64,
    /// Of the reference luminances of leaves that may hide something, squared.
    unseen: f64,
}

/// What a leaf adds to the sums, a pixel.
#[derive(Clone, Copy, Debug)]
pub struct LeafError {
    /// Pixels that it covers.
    pub pixels: f32,
    /// Mean shown luminance, W·sr⁻¹·m⁻².
    pub light: f32,
    /// Expected square error, (W·sr⁻¹·m⁻²)².
    pub error: f32,
    /// Square of its reference luminance, (W·sr⁻¹·m⁻²)²; 0 if it is known to hide nothing.
    pub unseen: f32,
}

impl ImageError {
    /// Replaces what a leaf contributed by what it contributes now; `None` for one that is no leaf any more or not
    /// visible.
    pub fn replace(&mut self, accounted: &mut Accounted, leaf: Option<LeafError>) {
        let before = std::mem::replace(accounted, leaf.map_or(Accounted::default(), LeafError::accounted));
        let change = |now: f32, before: f32| f64::from(now) - f64::from(before);
        self.pixels += change(accounted.pixels, before.pixels);
        self.light += change(accounted.light, before.light);
        self.error += change(accounted.error, before.error);
        self.unseen += change(accounted.unseen, before.unseen);
    }

    /// Replaces what a leaf of the indirect layer contributed, pixels × square error.
    pub fn replace_indirect(&mut self, accounted: &mut f32, error: f32) {
        self.error += f64::from(error) - f64::from(*accounted);
        *accounted = error;
    }

    /// Mean shown luminance of the image, W·sr⁻¹·m⁻².
    #[must_use]
    pub fn mean(&self) -> f32 {
        if self.pixels > 0.0 { (self.light / self.pixels).max(0.0) as f32 } else { 0.0 }
    }

    /// Expected RMSE over the mean; where leaves may hide something, the square error expected is `miss_rate` times
    /// the square of their reference luminance.
    #[must_use]
    pub fn relative(&self, miss_rate: f32) -> Option<f32> {
        let known = self.pixels > 0.0 && self.light > 0.0;
        let error = self.error.max(0.0) + f64::from(miss_rate) * self.unseen.max(0.0);
        known.then(|| ((error / self.pixels).sqrt() / (self.light / self.pixels)) as f32)
    }
}

impl LeafError {
    fn accounted(self) -> Accounted {
        let Self { pixels, light, error, unseen } = self;
        Accounted { pixels, light: pixels * light, error: pixels * error, unseen: pixels * unseen }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn leaf(pixels: f32, light: f32, error: f32, unseen: f32) -> Option<LeafError> {
        Some(LeafError { pixels, light, error, unseen })
    }

    #[test]
    fn the_estimate_is_the_rms_over_the_mean_of_what_is_accounted() {
        let mut image = ImageError::default();
        let (mut a, mut b) = (Accounted::default(), Accounted::default());
        assert_eq!(image.relative(0.0), None);
        image.replace(&mut a, leaf(3.0, 2.0, 0.04, 0.0));
        image.replace(&mut b, leaf(1.0, 6.0, 0.16, 36.0));
        assert!((image.mean() - 3.0).abs() < 1e-6);
        // √((3 · 0.04 + 0.16) / 4) / 3, and with a hundredth of 36 on one of four pixels.
        assert!((image.relative(0.0).unwrap() - (0.07_f32).sqrt() / 3.0).abs() < 1e-6);
        assert!((image.relative(0.01).unwrap() - (0.16_f32).sqrt() / 3.0).abs() < 1e-6);
    }

    #[test]
    fn what_leaves_the_image_leaves_nothing_behind() {
        let mut image = ImageError::default();
        let (mut a, mut indirect) = (Accounted::default(), 0.0);
        image.replace(&mut a, leaf(5.0, 1.0, 0.5, 1.0));
        image.replace_indirect(&mut indirect, 2.0);
        image.replace(&mut a, leaf(2.0, 3.0, 0.25, 0.0));
        image.replace_indirect(&mut indirect, 0.0);
        assert!((image.relative(1.0).unwrap() - 0.5 / 3.0).abs() < 1e-6);
        image.replace(&mut a, None);
        assert_eq!((image.relative(1.0), image.mean()), (None, 0.0));
    }
}
