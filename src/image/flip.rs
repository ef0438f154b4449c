//! FLIP: the difference that an eye sees when it flips between two displayed images \[FLIP].

use super::tone_mapping;
use crate::scene::Display;
use crate::scene::camera::ImageSize;
use glam::Vec3;
use nv_flip::{DEFAULT_PIXELS_PER_DEGREE, FlipImageRgb8};
use rayon::prelude::*;

/// Error map of two displayed (sRGB) images of one size, top row first, each value in [0, 1], at the distance that the
/// authors take: 0.7 m from a monitor of 0.7 m and 3840 pixels, 67 pixels a degree.
///
/// # Panics
/// If an image has not one element a pixel.
#[must_use]
pub fn error_map(image: &[[u8; 3]], reference: &[[u8; 3]], size: ImageSize) -> Vec<f32> {
    assert!(image.len() == size.pixels() && reference.len() == size.pixels(), "one value a pixel");
    let wrap = |pixels: &[[u8; 3]]| FlipImageRgb8::with_data(size.width, size.height, pixels.as_flattened());
    nv_flip::flip(wrap(reference), wrap(image), DEFAULT_PIXELS_PER_DEGREE).to_vec()
}

/// Mean of an error map over the pixels that `mask` lets count; `None` without any.
///
/// # Panics
/// If the slices differ in length.
#[must_use]
pub fn mean(map: &[f32], mask: Option<&[bool]>) -> Option<f64> {
    assert!(mask.is_none_or(|m| m.len() == map.len()), "a mask of the image's size");
    let counted = || map.iter().enumerate().filter(|(i, _)| mask.is_none_or(|m| m[*i]));
    let count = counted().count();
    (count > 0).then(|| counted().map(|(_, &e)| f64::from(e)).sum::<f64>() / count as f64)
}

/// The image of linear radiance, W·sr⁻¹·m⁻², as displayed.
#[must_use]
pub fn displayed(linear: &[Vec3], display: &Display) -> Vec<[u8; 3]> {
    linear.par_iter().map(|&c| tone_mapping::display(c, display.exposure, display.tone_mapping)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: ImageSize = ImageSize { width: 24, height: 16 };

    #[test]
    fn equal_images_do_not_differ_and_black_and_white_do() {
        let [black, white] = [0, 255].map(|c| vec![[c; 3]; SIZE.pixels()]);
        assert!(error_map(&white, &white, SIZE).iter().all(|&e| e == 0.0));
        let opposite = error_map(&white, &black, SIZE);
        assert!(opposite.iter().all(|&e| e > 0.9 && e <= 1.0), "{opposite:?}");
        let one = ImageSize { width: 1, height: 1 };
        assert_eq!(error_map(&white[..1], &white[..1], one), [0.0]);
    }

    #[test]
    fn errors_lie_where_the_images_differ_and_the_mask_selects() {
        let reference = vec![[90; 3]; SIZE.pixels()];
        let mut image = reference.clone();
        image[0] = [255, 0, 0];
        let map = error_map(&image, &reference, SIZE);
        let far = SIZE.pixels() - 1;
        assert!(map[0] > 0.1 && map[far] < 1e-3, "{} {}", map[0], map[far]);
        let mask: Vec<bool> = (0..map.len()).map(|i| i == 0).collect();
        assert!((mean(&map, Some(&mask)).expect("a pixel") - f64::from(map[0])).abs() < 1e-9);
        assert_eq!(mean(&map, Some(&vec![false; map.len()])), None);
    }
}
