//! Greedy colouring of faces by the bounds of their patches on the screen: patches of one colour do not overlap, so one
//! stencil reference and two draws serve them all (docs/lavapipe.md).

use crate::scene::camera::{ImageSize, View};
use glam::{Mat4, Vec2, Vec3};

/// Pixels of a cell's side: finer cells find fewer false overlaps and cost more to fill.
const CELL: u32 = 4;
/// Colours that one mask holds; patches beyond wait for the next batch.
pub(super) const COLOURS: u32 = 64;

/// A rectangle of cells, both ends included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Cells {
    x: [u32; 2],
    y: [u32; 2],
}

/// Projects points to cells.
pub(super) struct Projector {
    clip_from_world: Mat4,
    near: f32,
    size: ImageSize,
}

impl Projector {
    pub(super) fn new(view: &View, jitter: Vec2) -> Self {
        Self { clip_from_world: view.clip_from_world(jitter), near: view.near, size: view.size }
    }

    /// Pixels that a triangle covers, hidden or not; infinite if a corner lies before the near plane.
    pub(super) fn area(&self, corners: [Vec3; 3]) -> f32 {
        let clip = corners.map(|p| self.clip_from_world * p.extend(1.0));
        if clip.iter().any(|c| c.w <= self.near) {
            return f32::INFINITY;
        }
        let size = Vec2::new(self.size.width as f32, self.size.height as f32);
        let [a, b, c] = clip.map(|c| Vec2::new(c.x, c.y) / c.w * 0.5 * size);
        0.5 * (b - a).perp_dot(c - a).abs()
    }

    /// The cells that the hull of `points` may touch; all of them if a point lies before the near plane.
    pub(super) fn cells(&self, points: impl IntoIterator<Item = Vec3>) -> Cells {
        let last = Vec2::new(self.size.width as f32 - 1.0, self.size.height as f32 - 1.0);
        let (mut low, mut high) = (Vec2::INFINITY, Vec2::NEG_INFINITY);
        for point in points {
            let clip = self.clip_from_world * point.extend(1.0);
            if clip.w <= self.near {
                (low, high) = (Vec2::ZERO, last);
                break;
            }
            let pixel = (Vec2::new(clip.x, clip.y) / clip.w + 1.0) * 0.5 * (last + 1.0);
            (low, high) = (low.min(pixel), high.max(pixel));
        }
        // One pixel more on each side: the rasteriser snaps vertices.
        let cell = |p: Vec2| (p.clamp(Vec2::ZERO, last) / CELL as f32).as_uvec2();
        let (low, high) = (cell(low - 1.0), cell(high + 1.0));
        Cells { x: [low.x, high.x], y: [low.y, high.y] }
    }
}

/// Which colours touch each cell.
pub(super) struct Colouring {
    columns: u32,
    masks: Vec<u64>,
}

impl Colouring {
    pub(super) fn new(size: ImageSize) -> Self {
        let columns = size.width.div_ceil(CELL);
        Self { columns, masks: vec![0; columns as usize * size.height.div_ceil(CELL) as usize] }
    }

    /// The lowest colour that is free in all cells of these rectangles, now taken; `None` if there is none.
    pub(super) fn take(&mut self, rectangles: &[Cells]) -> Option<u32> {
        let columns = self.columns as usize;
        let rows = || {
            let rows = rectangles.iter().flat_map(|cells| (cells.y[0]..=cells.y[1]).map(move |y| (cells.x, y)));
            rows.map(|(x, y)| {
                let row = y as usize * columns;
                row + x[0] as usize..=row + x[1] as usize
            })
        };
        let used = rows().flat_map(|row| &self.masks[row]).fold(0, |all, mask| all | mask);
        let colour = (!used).trailing_zeros();
        if colour >= COLOURS {
            return None;
        }
        for row in rows() {
            self.masks[row].iter_mut().for_each(|mask| *mask |= 1 << colour);
        }
        Some(colour)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn overlapping_patches_differ_and_distant_ones_share() {
        let mut colouring = Colouring::new(ImageSize { width: 64, height: 64 });
        let left = Cells { x: [0, 7], y: [0, 15] };
        let right = Cells { x: [8, 15], y: [0, 15] };
        let across = Cells { x: [7, 8], y: [3, 3] };
        assert_eq!(colouring.take(&[left]), Some(0));
        assert_eq!(colouring.take(&[right]), Some(0));
        assert_eq!(colouring.take(&[across]), Some(1));
        let taken: Vec<_> = (0..COLOURS).map(|_| colouring.take(&[across])).collect();
        assert_eq!(taken[COLOURS as usize - 3], Some(COLOURS - 1));
        assert_eq!(taken[COLOURS as usize - 2], None);
        let mut colouring = Colouring::new(ImageSize { width: 64, height: 64 });
        assert_eq!([colouring.take(&[left, right]), colouring.take(&[right])], [Some(0), Some(1)]);
    }
}
