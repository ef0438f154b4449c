//! A reference image that can be looked at while it is sampled: coarse at first, and interrupted at any time for a small loss.
//!
//! The image is cut into blocks, and what lies at the same place of each is sampled together: the first part has one pixel of each
//! block, which stands for all of it until later parts bring the rest. Each pixel gets the samples that it gets when all are sampled at
//! once, so that after whole passes the image is the same to the bit.

use super::accumulator::Accumulator;
use super::settings::Settings;
use crate::light::context::SceneContext;
use crate::scene::camera::{ImageSize, View};
use glam::Vec4;

/// Side of a block, pixels, at most; a power of two.
const BLOCK: u32 = 8;

/// Pixels that are worth sampling together, at least: fewer would not keep all threads busy.
const TOGETHER: usize = 4096;

/// A reference image in parts.
pub struct Progressive {
    view: View,
    /// In the order in which they are sampled.
    parts: Vec<Part>,
    /// Number of the part that is next.
    next: usize,
    /// Mean radiance, W·sr⁻¹·m⁻², and coverage, by pixel; of one without a sample, what stands for it.
    picture: Vec<Vec4>,
}

/// Pixels at the same place of each block.
struct Part {
    sums: Accumulator,
    /// Side of the square, to the right and down, that each stands for at first.
    side: u32,
}

impl Progressive {
    /// Nothing sampled yet of a view.
    #[must_use]
    pub fn new(view: &View) -> Self {
        let parts = places(block(view.size)).into_iter().map(|place| Part::new(view, place)).collect();
        Self { view: *view, parts, next: 0, picture: vec![Vec4::ZERO; view.size.pixels()] }
    }

    /// Samples that each pixel has got.
    #[must_use]
    pub fn samples(&self) -> u32 {
        self.parts.last().map_or(0, |last| last.sums.samples())
    }

    /// Whether there is anything to look at.
    #[must_use]
    pub fn has_begun(&self) -> bool {
        self.next > 0 || self.samples() > 0
    }

    /// Mean radiance, W·sr⁻¹·m⁻², and coverage of each pixel as far as it is known, row by row.
    #[must_use]
    pub fn picture(&self) -> &[Vec4] {
        &self.picture
    }

    /// Takes one more sample of the pixels of the next part; whether that was done. `stop` is asked every few pixels: what it breaks
    /// off is left out.
    pub fn advance(&mut self, context: &SceneContext<'_>, settings: Settings, stop: impl Fn() -> bool + Sync) -> bool {
        let Self { view, parts, next, picture } = self;
        let Part { sums, side } = &mut parts[*next];
        if !sums.pass(context, view, settings, stop).finished {
            return false;
        }
        let side = if sums.samples() == 1 { *side } else { 1 };
        sums.means().for_each(|(pixel, mean)| fill(picture, view.size, (pixel, side), mean));
        *next = (*next + 1) % parts.len();
        true
    }

    /// Takes samples up to the end of a pass: each pixel has got as many then.
    pub fn finish_pass(&mut self, context: &SceneContext<'_>, settings: Settings) {
        while self.advance(context, settings, || false) && self.next > 0 {}
    }
}

impl Part {
    fn new(view: &View, Place { x, y, block, side }: Place) -> Self {
        let ImageSize { width, height } = view.size;
        let row = |row: u32| (x..width).step_by(block as usize).map(move |column| row * width + column);
        let pixels = (y..height).step_by(block as usize).flat_map(row).collect();
        Self { sums: Accumulator::over(view, pixels), side }
    }
}

/// A place of a block, with the side of what it stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Place {
    x: u32,
    y: u32,
    block: u32,
    side: u32,
}

/// Side of the blocks of an image: the largest whose parts keep threads busy.
fn block(size: ImageSize) -> u32 {
    let mut block = BLOCK;
    while block > 1 && size.pixels() / ((block * block) as usize) < TOGETHER {
        block /= 2;
    }
    block
}

/// The places of a block: those that halve the distance between those before come next.
fn places(block: u32) -> Vec<Place> {
    let mut places = Vec::new();
    let mut side = block;
    while side > 0 {
        let is_new = |&(x, y): &(u32, u32)| side == block || x % (2 * side) != 0 || y % (2 * side) != 0;
        let steps = || (0..block).step_by(side as usize);
        let all = steps().flat_map(|y| steps().map(move |x| (x, y)));
        places.extend(all.filter(is_new).map(|(x, y)| Place { x, y, block, side }));
        side /= 2;
    }
    places
}

/// Fills the square to the right of a pixel and below, as far as it lies in the image.
fn fill(picture: &mut [Vec4], size: ImageSize, (pixel, side): (u32, u32), value: Vec4) {
    let (x, y) = (pixel % size.width, pixel / size.width);
    let (right, bottom) = ((x + side).min(size.width), (y + side).min(size.height));
    for row in y..bottom {
        let row = (row * size.width) as usize;
        picture[row + x as usize..row + right as usize].fill(value);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn places_get_denser_and_are_each_there_once() {
        let all = places(8);
        assert_eq!(all.iter().map(|place| (place.x, place.y)).collect::<HashSet<_>>().len(), 64);
        let sides: Vec<u32> = all.iter().map(|place| place.side).collect();
        assert!(sides.is_sorted_by(|a, b| a >= b));
        assert_eq!([8, 4, 2, 1].map(|side| sides.iter().filter(|of| **of == side).count()), [1, 3, 12, 48]);
        assert_eq!(places(1), [Place { x: 0, y: 0, block: 1, side: 1 }]);
    }

    #[test]
    fn small_images_are_not_cut_up() {
        let side = |width, height| block(ImageSize { width, height });
        assert_eq!([side(64, 48), side(256, 192), side(1024, 768)], [1, 2, 8]);
    }
}
