//! Light that leaves surfaces where gather rays hit them, averaged by the cells of a grid over the scene
//! (docs/method/indirect-light.md): what one path has found serves all rays that come near, whether a camera sees the
//! place or not. After the hash grids of \[BFK18\].
//!
//! A cell's mean is unbiased for all the rays that fall into it. What a single reader gets wrong is how light changes
//! within a cell, whose size is bounded by the length of the ray, so that it evens out over the hemisphere.

use super::cell::Cell;
use super::cell_table::{CellTable, KEY_BITS};
use crate::math::nearest_axis;
use glam::Vec3;
use std::f32::consts::PI;

/// Greatest edge of the coarsest cell that a ray reads, against the ray's length.
const SHARE: f32 = 0.5;
/// Level of the smallest of those: 1/256 of the scene's diagonal. Rays that are shorter than a cell do not read it:
/// in a recess it may hold what is outside.
const FINEST: f32 = 8.0;
/// Levels that a ray reads, each of half the edge of the one before, the finest that knows enough.
const DEPTH: u8 = 3;
/// Paths that a cell must have seen before it is read.
const ENOUGH: f32 = 16.0;
/// The same against the rays that one vertex is expected to send into the cell, whose noise they share.
const ENOUGH_OF_OWN: f32 = 2.0;
/// Rays of a vertex that may read cells coarser than the finest: what those average over must not stay in the mean.
const COARSE_FOR: u32 = 512;
/// Cells at most where memory is not short.
const MOST_CELLS: usize = 1 << 21;
/// Levels of the finest cells that there are.
const MOST_LEVEL: u32 = FINEST as u32 + DEPTH as u32 - 1;
/// Bits of a side.
const SIDE_BITS: u32 = 3;
const _: () = assert!(3 * MOST_LEVEL + 1 + SIDE_BITS <= KEY_BITS);
/// How far the grid begins before the scene's bounds, in diagonals: walls in planes of the grid would fall into two
/// cells by rounding.
const MARGIN: Vec3 = Vec3::new(0.0137, 0.0171, 0.0193);
/// Edge of the grid, in diagonals: with its margin, no scene is longer along an axis.
const EDGE: f32 = 1.02;

/// Means of the radiance that leaves surfaces, by place and side.
#[derive(Clone, Debug, Default)]
pub struct RadianceGrid {
    cells: CellTable,
    origin: Vec3,
    /// Its edge, scene units.
    size: f32,
    /// No more cells than this are made; where none is, paths go on.
    most_cells: usize,
}

/// The cells that hold a hit: the finest, of which the others follow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CellKey {
    place: [u16; 3],
    level: u8,
    side: u8,
}

/// What a path found to leave the surface at a hit.
#[derive(Clone, Copy, Debug)]
pub struct Deposit {
    /// Where.
    pub key: CellKey,
    /// Radiance, W·sr⁻¹·m⁻².
    pub radiance: Vec3,
}

impl CellKey {
    /// One number for the cell `up` levels above the finest: a 1, three coordinates of as many bits as its level says, its side.
    fn packed(self, up: u8) -> u64 {
        let bits = self.level - up;
        self.place.iter().fold(1, |key, &p| key << bits | u64::from(p >> up)) << SIDE_BITS | u64::from(self.side)
    }
}

impl RadianceGrid {
    /// An empty grid over a scene that begins at `low` and has this diagonal.
    #[must_use]
    pub fn new(low: Vec3, diagonal: f32) -> Self {
        let cells = CellTable::default();
        Self { cells, origin: low - MARGIN * diagonal, size: diagonal * EDGE, most_cells: MOST_CELLS }
    }

    /// Makes no cells any more that would take more than so many bytes in all.
    pub fn limit(&mut self, bytes: usize) {
        self.most_cells = (bytes / CellTable::MOST_BYTES).min(MOST_CELLS);
    }

    /// The cells of a hit at `position`, on the side of its surface that `facing` points to (of any length), by a ray
    /// of length `distance`.
    #[must_use]
    pub fn key(&self, position: Vec3, facing: Vec3, distance: f32) -> CellKey {
        let wanted = SHARE * distance / self.size;
        let level = (-wanted.log2()).ceil().clamp(0.0, FINEST) as u8 + DEPTH - 1;
        let place = (position - self.origin) / self.edge(level);
        let last = (1 << level) - 1;
        CellKey { place: place.to_array().map(|p| (p as u16).min(last)), level, side: nearest_axis(facing) }
    }

    fn edge(&self, level: u8) -> f32 {
        self.size / (1_u32 << level) as f32
    }

    /// Radiance that leaves a hit's surroundings, if enough paths ended there for a ray of length `distance`, one of
    /// `own` rays of its vertex.
    #[must_use]
    pub fn read(&self, key: CellKey, distance: f32, own: u32) -> Option<Vec3> {
        let levels = if own < COARSE_FOR { DEPTH } else { 1 };
        (0..levels).find_map(|up| {
            let width = self.edge(key.level - up) / distance;
            let cell = (width < 1.0).then(|| self.cells.get(key.packed(up))).flatten()?;
            let enough = ENOUGH + ENOUGH_OF_OWN * own as f32 * width * width / PI;
            (cell.paths() as f32 >= enough).then(|| cell.mean())
        })
    }

    /// Takes in what paths found.
    pub fn add(&mut self, deposits: &[Deposit]) {
        for deposit in deposits {
            for up in (0..DEPTH).rev() {
                let key = deposit.key.packed(up);
                let change = |cell: Cell| cell.with(deposit.radiance, key);
                match self.cells.len() < self.most_cells {
                    true => self.cells.change_or_make(key, change),
                    false => self.cells.change(key, change),
                }
            }
        }
    }

    /// Takes in that the lights have changed, all by the ratio `common`, by channel, or each by its own.
    pub fn relight(&mut self, common: Option<Vec3>) {
        match common {
            Some(ratio) => self.cells.change_all(|cell| cell.scaled(ratio)),
            None => self.cells = CellTable::default(),
        }
    }

    /// Bytes held.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.cells.bytes()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid() -> RadianceGrid {
        RadianceGrid::new(Vec3::ZERO, 1.0)
    }

    fn deposit(grid: &RadianceGrid, position: Vec3, radiance: f32) -> Deposit {
        Deposit { key: grid.key(position, Vec3::Y, 0.1), radiance: Vec3::splat(radiance) }
    }

    #[test]
    fn a_cell_is_read_when_it_has_seen_enough_paths() {
        let mut grid = grid();
        let at = Vec3::new(0.3, 0.0, 0.4);
        let key = grid.key(at, Vec3::Y, 0.1);
        let paths: Vec<Deposit> = (0..ENOUGH as u32).map(|i| deposit(&grid, at, i as f32)).collect();
        grid.add(&paths[1..]);
        assert_eq!(grid.read(key, 0.1, 0), None);
        grid.add(&paths[..1]);
        let mean = (ENOUGH - 1.0) / 2.0;
        assert_eq!(grid.read(key, 0.1, 0), Some(Vec3::splat(mean)));
        // A vertex that would send more rays there than the cell has seen paths does not rest on it.
        assert_eq!(grid.read(key, 0.1, 100_000), None);
        // In a recess, where rays are shorter than cells, it may be another light.
        let paths: Vec<Deposit> =
            (0..100).map(|_| Deposit { key: grid.key(at, Vec3::Y, 5e-4), radiance: Vec3::ONE }).collect();
        grid.add(&paths);
        assert_eq!(grid.read(grid.key(at, Vec3::Y, 5e-4), 5e-4, 0), None);
        // Neither does the other side of the surface, nor a place far off.
        assert_eq!(grid.read(grid.key(at, -Vec3::Y, 0.1), 0.1, 0), None);
        assert_eq!(grid.read(grid.key(at + Vec3::X * 0.2, Vec3::Y, 0.1), 0.1, 0), None);
    }

    #[test]
    fn coarser_cells_serve_the_first_rays_only() {
        let mut grid = grid();
        let edge = grid.edge(grid.key(Vec3::ZERO, Vec3::Y, 0.1).level);
        // In each of two finer cells of a coarser one nearly as many paths as it takes.
        let places = [20.5, 21.5].map(|x| grid.origin + Vec3::new(x, 20.5, 20.5) * edge);
        let paths: Vec<Deposit> = places.iter().map(|&at| deposit(&grid, at, 1.0)).collect();
        (1..ENOUGH as u32).for_each(|_| grid.add(&paths));
        let key = paths[0].key;
        assert_eq!(grid.read(key, 0.1, COARSE_FOR - 1), Some(Vec3::ONE));
        assert_eq!(grid.read(key, 0.1, COARSE_FOR), None);
    }

    #[test]
    fn coarser_cells_hold_the_finer_ones() {
        let grid = grid();
        for i in 0..1000 {
            let t = i as f32 * 1e-3;
            let position = Vec3::new(t, (t * 37.0).fract(), (t * 71.0).fract());
            let fine = grid.key(position, Vec3::X, 0.05);
            let coarse = grid.key(position, Vec3::X, 0.1);
            assert_eq!(fine.level, coarse.level + 1);
            assert_eq!(fine.packed(1), coarse.packed(0), "{position}");
        }
    }

    #[test]
    fn cells_are_smaller_than_half_the_ray() {
        let grid = grid();
        for distance in [0.01, 0.1, 0.37, 1.0] {
            let coarsest = grid.key(Vec3::ZERO, Vec3::X, distance).level - (DEPTH - 1);
            assert!(grid.edge(coarsest) <= SHARE * distance, "{distance}");
        }
    }

    #[test]
    fn a_full_grid_makes_no_more_cells_but_goes_on_learning() {
        let mut grid = grid();
        let first = Deposit { key: grid.key(Vec3::splat(0.5), Vec3::Y, 1.0), radiance: Vec3::ONE };
        grid.add(&[first]);
        let place = |i: u32| CellKey { place: [i, i >> 10, i >> 20].map(|p| (p & 1023) as u16), level: 10, side: 0 };
        for i in 0..MOST_CELLS as u32 {
            grid.add(&[Deposit { key: place(i), radiance: Vec3::ONE }]);
        }
        assert_eq!(grid.cells.len(), MOST_CELLS);
        let last = Deposit { key: CellKey { place: [7; 3], level: 9, side: 3 }, radiance: Vec3::ONE };
        grid.add(&[last; ENOUGH as usize]);
        assert_eq!(grid.read(last.key, 1.0, 0), None);
        grid.add(&[first; ENOUGH as usize]);
        assert_eq!(grid.read(first.key, 1.0, 0), Some(Vec3::ONE));
    }

    #[test]
    fn light_that_changes_alike_scales_cells_and_other_light_empties_them() {
        let mut grid = grid();
        let at = Vec3::splat(0.5);
        let key = grid.key(at, Vec3::Y, 0.1);
        grid.add(&vec![deposit(&grid, at, 2.0); ENOUGH as usize]);
        grid.relight(Some(Vec3::new(1.0, 0.5, 4.0)));
        assert_eq!(grid.read(key, 0.1, 0), Some(Vec3::new(2.0, 1.0, 8.0)));
        grid.relight(None);
        assert_eq!(grid.read(key, 0.1, 0), None);
    }
}
