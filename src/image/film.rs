//! Film: the mean of jittered redraws in linear light, and where in the pixel each is taken.

use crate::scene::camera::ImageSize;
use glam::{Vec2, Vec4};

/// Sub-pixel offsets from the pixel centre, each in [−½, ½], for `count` redraws; a box filter of one pixel.
///
/// One sample is the centre. More are an N-rooks pattern: x takes each of the `count` equal strata once, and so does
/// y, in the order of the golden-ratio sequence k·φ mod 1, which spreads any number of points evenly in the square.
/// Their mean is exactly the centre, so that the averaged image is not shifted against an unjittered one.
#[must_use]
pub fn jitter(count: u32) -> Vec<Vec2> {
    // k·φ mod 1 in 32-bit fixed point: distinct for distinct k, since the factor is odd.
    let mut order: Vec<u32> = (0..count).collect();
    order.sort_by_key(|&k| k.wrapping_mul(0x9E37_79B9));
    let stratum = |i: u32| (i as f32 + 0.5) / count as f32 - 0.5;
    let mut offsets = vec![Vec2::ZERO; count as usize];
    for (rank, &k) in (0..count).zip(&order) {
        offsets[k as usize] = Vec2::new(stratum(k), stratum(rank));
    }
    offsets
}

/// Sum of redraws of one image: RGB linear radiance, W·sr⁻¹·m⁻², A coverage.
#[derive(Clone, Debug)]
pub struct Film {
    size: ImageSize,
    sum: Vec<Vec4>,
    redraws: u32,
}

impl Film {
    /// An empty film.
    #[must_use]
    pub fn new(size: ImageSize) -> Self {
        Self { size, sum: vec![Vec4::ZERO; size.pixels()], redraws: 0 }
    }

    /// Image size.
    #[must_use]
    pub const fn size(&self) -> ImageSize {
        self.size
    }

    /// Redraws added.
    #[must_use]
    pub const fn redraws(&self) -> u32 {
        self.redraws
    }

    /// Adds one redraw, top row first. The result depends on the order of redraws only, never on threads.
    ///
    /// # Panics
    /// If `image` has not as many pixels as the film.
    pub fn add(&mut self, image: &[Vec4]) {
        assert_eq!(image.len(), self.sum.len(), "a redraw has the film's size");
        for (sum, &pixel) in self.sum.iter_mut().zip(image) {
            *sum += pixel;
        }
        self.redraws += 1;
    }

    /// The mean of the redraws, RGB in W·sr⁻¹·m⁻²; black and uncovered without any.
    #[must_use]
    pub fn mean(&self) -> Vec<Vec4> {
        let weight = 1.0 / self.redraws.max(1) as f32;
        self.sum.iter().map(|&s| s * weight).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_sample_is_the_centre() {
        assert_eq!(jitter(1), [Vec2::ZERO]);
        assert!(jitter(0).is_empty());
    }

    #[test]
    fn every_count_is_stratified_both_ways_and_centred() {
        for count in [2, 3, 4, 5, 8, 9, 16, 64, 100, 1024] {
            let offsets = jitter(count);
            let mean = offsets.iter().sum::<Vec2>() / count as f32;
            assert!(mean.length() < 1e-6, "{count}: {mean}");
            for axis in 0..2 {
                let mut strata: Vec<u32> =
                    offsets.iter().map(|o| ((o[axis] + 0.5) * count as f32).floor() as u32).collect();
                strata.sort_unstable();
                assert!(strata.iter().copied().eq(0..count), "{count}, axis {axis}");
            }
        }
    }

    #[test]
    fn five_samples_are_the_best_lattice() {
        // Four-connected neighbours at knight's moves: the known optimum for five points.
        let cells: Vec<Vec2> = jitter(5).iter().map(|o| (*o + 0.5) * 5.0 - 0.5).collect();
        for (k, cell) in cells.iter().enumerate() {
            let expected = Vec2::new(k as f32, (3 * k % 5) as f32);
            assert!(cell.distance(expected) < 1e-5, "{cell} {expected}");
        }
    }

    #[test]
    fn an_edge_converges_faster_than_at_random() {
        // Coverage of half planes through the centre, where symmetry makes the exact value one half; N random samples
        // have a standard error of 0.5/√N.
        for count in [16, 64, 256] {
            let offsets = jitter(count);
            let error = |degrees: u8| {
                let normal = Vec2::from_angle(f32::from(degrees).to_radians());
                let side =
                    |o: &Vec2| if o.dot(normal).abs() < 1e-5 { 0.5 } else { f32::from(u8::from(o.dot(normal) > 0.0)) };
                offsets.iter().map(side).sum::<f32>() / count as f32 - 0.5
            };
            let rms = ((0..180).map(|d| error(d).powi(2)).sum::<f32>() / 180.0).sqrt();
            assert!(rms < 0.3 * 0.5 / (count as f32).sqrt(), "{count}: {rms}");
        }
    }

    #[test]
    fn the_mean_is_taken_in_linear_light() {
        let mut film = Film::new(ImageSize { width: 2, height: 1 });
        assert_eq!(film.mean(), [Vec4::ZERO; 2]);
        film.add(&[Vec4::new(1.0, 2.0, 4.0, 1.0), Vec4::ZERO]);
        film.add(&[Vec4::new(3.0, 0.0, 0.0, 0.0), Vec4::ONE]);
        assert_eq!(film.mean(), [Vec4::new(2.0, 1.0, 2.0, 0.5), Vec4::splat(0.5)]);
        assert_eq!(film.redraws(), 2);
    }
}
