//! What is hidden by depth that is there: the host's test of what is yet to be drawn.
//!
//! Occluders are drawn first, and what lies behind them all over is then left out \[HC11\] \[HA15\]. Here they are those faces that covered
//! most of the picture before; which ones they are changes what the test saves, and nothing of what is seen.

use super::raster::Footprint;
use std::ops::Range;

/// Side of a tile, pixels.
const TILE: usize = 8;
/// Side of what is looked at pixel by pixel: larger triangles are few, and take long to look at.
const SMALL: usize = 12;

/// Reversed depth of an image, with the farthest of each tile.
pub(super) struct Occlusion<'a> {
    depth: &'a [f32],
    width: usize,
    tiles: Vec<f32>,
    across: usize,
}

impl<'a> Occlusion<'a> {
    /// Depth of an image, row by row.
    pub(super) fn new(depth: &'a [f32], width: usize) -> Self {
        let across = width.div_ceil(TILE);
        let mut tiles = Vec::with_capacity(across * (depth.len() / width.max(1)).div_ceil(TILE));
        for rows in depth.chunks(TILE * width) {
            let first = tiles.len();
            tiles.resize(first + across, f32::INFINITY);
            for row in rows.chunks(width) {
                for (farthest, depths) in tiles[first..].iter_mut().zip(row.chunks(TILE)) {
                    *farthest = depths.iter().fold(*farthest, |a, &b| a.min(b));
                }
            }
        }
        Self { depth, width, tiles, across }
    }

    /// Whether something nearer is at every pixel that a triangle may cover, as far as tiles tell, and pixels if it is small.
    pub(super) fn hides(&self, footprint: &Footprint) -> bool {
        let Footprint { columns, rows, .. } = footprint;
        let is_small = columns.len().max(rows.len()) <= SMALL;
        let tiles = |range: &Range<usize>| range.start / TILE..range.end.div_ceil(TILE);
        let shows = |x: usize, y: usize, nearest: f32| self.depth[y * self.width + x] <= nearest;
        columns.is_empty()
            || rows.is_empty()
            || tiles(rows).all(|y| {
                tiles(columns).all(|x| {
                    self.tiles[y * self.across + x] > footprint.nearest
                        || is_small && !footprint.any_within(within(columns, x), within(rows, y), shows)
                })
            })
    }
}

/// The part of a range that lies in a tile.
fn within(range: &Range<usize>, tile: usize) -> Range<usize> {
    range.start.max(tile * TILE)..range.end.min((tile + 1) * TILE)
}

#[cfg(test)]
mod tests {
    use super::super::raster::Raster;
    use super::*;
    use crate::scene::camera::{Camera, ImageSize, View};
    use glam::{Vec2, Vec3};

    #[test]
    fn hidden_is_what_is_farther_at_each_of_its_pixels() {
        let camera = Camera { position: Vec3::ZERO, look_at: Vec3::NEG_Z, up: Vec3::Y, vertical_fov: 90.0 };
        let view = View { near: 0.1, ..View::new(&camera, ImageSize { width: 20, height: 20 }, 1.0) };
        let raster = Raster::new(&view, Vec2::ZERO, Vec3::splat(9.0), 8);
        let triangle = |z: f32| [Vec3::new(-2.0, -1.5, z), Vec3::new(2.0, -1.5, z), Vec3::new(0.0, 1.5, z - 0.5)];
        let hides = |depth: &[f32], z: f32| {
            Occlusion::new(depth, 20).hides(&raster.footprint(triangle(z).map(|p| raster.project(p))).unwrap())
        };
        let wall = vec![0.1 / 4.0; 400];
        assert!(hides(&wall, -4.01));
        assert!(!hides(&wall, -3.9));
        let mut hole = wall.clone();
        hole[0] = 0.0;
        assert!(hides(&hole, -4.01), "not where the triangle is");
        hole[10 * 20 + 10] = 0.0;
        assert!(!hides(&hole, -4.01));
        assert!(!hides(&[0.0; 400], -8.0), "nothing there");
    }

    #[test]
    fn a_triangle_without_extent_hides_behind_nothing() {
        let camera = Camera { position: Vec3::ZERO, look_at: Vec3::NEG_Z, up: Vec3::Y, vertical_fov: 90.0 };
        let view = View { near: 0.1, ..View::new(&camera, ImageSize { width: 20, height: 20 }, 1.0) };
        let raster = Raster::new(&view, Vec2::ZERO, Vec3::splat(9.0), 8);
        // Seen edge-on: its depth at a pixel centre is anything.
        let thin = [Vec3::new(0.15, -1.0, -3.0), Vec3::new(0.15, 1.0, -3.0), Vec3::new(0.3, 0.0, -6.0)];
        let footprint = raster.footprint(thin.map(|p| raster.project(p))).unwrap();
        assert!(!Occlusion::new(&[0.1; 400], 20).hides(&footprint));
    }
}
