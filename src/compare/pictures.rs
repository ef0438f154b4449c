//! Pictures of a comparison: what each mode shows at the end, and masks of what is wrong with it.

use super::artefacts::Mark;
use crate::error::{Error, Result};
use crate::image::{flip, png};
use crate::scene::Display;
use crate::scene::camera::ImageSize;
use glam::Vec3;

/// Marks as they are painted: vermilion, blue and yellow of a palette that colour-blind readers tell apart \[Okabe08].
const COLOURS: [(Mark, [u8; 3]); 3] =
    [(Mark::Stale, [213, 94, 0]), (Mark::Foreign, [0, 150, 230]), (Mark::Wrong, [240, 228, 66])];

/// Width and height of the part that is shown enlarged, pixels.
const ZOOM: [u32; 2] = [96, 72];

/// The pictures of a run, PNG files in memory.
#[derive(Clone, Debug, Default)]
pub struct Pictures {
    /// The last picture as displayed.
    pub image: Vec<u8>,
    /// What is wrong with it.
    pub mask: Vec<u8>,
    /// A part of the picture.
    pub image_part: Vec<u8>,
    /// The same part of the mask.
    pub mask_part: Vec<u8>,
}

/// A rectangle of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    /// Left and top.
    pub corner: [u32; 2],
    /// Width and height.
    pub size: ImageSize,
}

impl Pictures {
    /// Paints a picture as displayed, with its marks and a part of both.
    ///
    /// # Errors
    /// [`Error::Internal`] if it cannot be encoded.
    pub fn new(size: ImageSize, shown: &[[u8; 3]], marks: &[Mark], part: Part) -> Result<Self> {
        let painted = painted(shown, marks);
        Ok(Self {
            image: encode(size, shown)?,
            mask: encode(size, &painted)?,
            image_part: encode(part.size, &part.of(size, shown))?,
            mask_part: encode(part.size, &part.of(size, &painted))?,
        })
    }
}

/// The marks over the picture, which is dimmed and without colour.
fn painted(shown: &[[u8; 3]], marks: &[Mark]) -> Vec<[u8; 3]> {
    let paint = |(pixel, mark): (&[u8; 3], &Mark)| {
        let colour = COLOURS.iter().find(|(m, _)| m == mark).map(|c| c.1);
        let grey = (pixel.iter().map(|&c| u32::from(c)).sum::<u32>() / 8) as u8;
        colour.unwrap_or([grey; 3])
    };
    shown.iter().zip(marks).map(paint).collect()
}

fn encode(size: ImageSize, pixels: &[[u8; 3]]) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    png::encode(&mut bytes, size, pixels.as_flattened())
        .map_err(|e| Error::Internal(format!("a picture cannot be encoded: {e}")))?;
    Ok(bytes)
}

/// Radiance as displayed.
#[must_use]
pub fn displayed(radiance: &[Vec3], display: &Display) -> Vec<[u8; 3]> {
    flip::displayed(radiance, display)
}

impl Part {
    /// The part of an image where two pictures differ most; the middle if they do not.
    #[must_use]
    pub fn most_different(size: ImageSize, shown: &[[u8; 3]], wanted: &[[u8; 3]]) -> Self {
        let difference = |(a, b): (&[u8; 3], &[u8; 3])| a.iter().zip(b).map(|(a, b)| u32::from(a.abs_diff(*b))).sum();
        let differences: Vec<u32> = shown.iter().zip(wanted).map(difference).collect();
        let part = ImageSize { width: ZOOM[0].min(size.width), height: ZOOM[1].min(size.height) };
        let step = |whole: u32, part: u32| (0..=whole - part).step_by((part as usize / 4).max(1));
        let corners = step(size.height, part.height).flat_map(|y| step(size.width, part.width).map(move |x| [x, y]));
        let sum = |corner: &[u32; 2]| Self { corner: *corner, size: part }.of(size, &differences).iter().sum::<u32>();
        let centre = [(size.width - part.width) / 2, (size.height - part.height) / 2];
        let best = corners.map(|corner| (sum(&corner), corner)).max_by_key(|c| c.0).filter(|c| c.0 > 0);
        Self { corner: best.map_or(centre, |c| c.1), size: part }
    }

    fn of<T: Copy>(&self, whole: ImageSize, pixels: &[T]) -> Vec<T> {
        let row = |y: u32| {
            let start = ((self.corner[1] + y) * whole.width + self.corner[0]) as usize;
            pixels[start..start + self.size.width as usize].iter().copied()
        };
        (0..self.size.height).flat_map(row).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_part_lies_where_the_pictures_differ() {
        let size = ImageSize { width: 300, height: 200 };
        let wanted = vec![[100; 3]; size.pixels()];
        let mut shown = wanted.clone();
        assert_eq!(Part::most_different(size, &shown, &wanted).corner, [102, 64]);
        for y in 150..160 {
            shown[y * 300 + 250] = [100, 90, 130];
        }
        let part = Part::most_different(size, &shown, &wanted);
        assert!(part.corner[0] <= 250 && part.corner[0] + 96 > 250, "{part:?}");
        assert!(part.corner[1] <= 150 && part.corner[1] + 72 >= 160, "{part:?}");
        let tiny = ImageSize { width: 5, height: 4 };
        assert_eq!(Part::most_different(tiny, &[[0; 3]; 20], &[[9; 3]; 20]).size, tiny);
    }

    #[test]
    fn marks_are_seen_on_any_picture() {
        let white = painted(&[[255; 3]; 2], &[Mark::Nothing, Mark::Stale]);
        assert!(white[0][0] < 100 && white[1] == [213, 94, 0]);
    }
}
