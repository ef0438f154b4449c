//! Contribution-driven cells: split where the light's spread times the cell's projected solid angle is greatest.
//!
//! In the square of the cosine density every area is projected solid angle, so a cell adds its area times π times its
//! radiance to the mean irradiance of the normals, and no cosine is left in the choice. A pilot grid takes three eighths
//! of the rays. A split sends three rays: the quarter that its ray passes through keeps it, which leaves one uniform
//! ray a cell. A cell's key falls by no more than 16 times a split, so that none is starved for ever.

use super::cells::{Cell, Queue, Tracer};
use super::sample::{Gathered, Sample};
use crate::math::hemisphere::Mixture;
use crate::math::sequence::Sequence;
use glam::Vec3;
use std::ops::Range;

/// Share of the rays that the pilot grid takes.
const PILOT: f32 = 0.375;
/// Columns (turns about the normal) a row (heights) of the pilot grid, for one normal.
const ASPECT: f32 = 3.0;
/// What a key keeps at least when its cell is split.
const DECAY: f32 = 1.0 / 16.0;

/// Gathers with at most as many rays as `rays` is long; up to two of them may be left over.
pub fn gather(
    mixture: &Mixture<'_>,
    rays: Range<u32>,
    sequence: &Sequence,
    radiance: impl FnMut(u32, Vec3) -> Vec3,
    sink: impl FnMut(Sample),
) -> Gathered {
    let pilot = Pilot::new(rays.end - rays.start, mixture.lobes() as u32);
    let mut tracer = Tracer::new(mixture, sequence, rays, radiance);
    let mut cells = tracer.grid(pilot.rows, pilot.columns);
    let mut queue = Queue::default();
    for cell in 0..cells.len() {
        queue.push(pilot.spread(&cells, cell) * cells[cell].area(), cell);
    }
    while tracer.affords(3)
        && let Some((key, cell)) = queue.pop()
    {
        let quarters = split(&cells[cell], &mut tracer);
        let luminances = || quarters.iter().map(Cell::luminance);
        let spread = luminances().fold(f32::MIN, f32::max) - luminances().fold(f32::MAX, f32::min);
        for (i, quarter) in quarters.into_iter().enumerate() {
            let at = if i == 0 { cell } else { cells.len() };
            queue.push((spread * quarter.area()).max(key * DECAY), at);
            if i == 0 { cells[at] = quarter } else { cells.push(quarter) }
        }
    }
    tracer.finish(&cells, sink)
}

/// The quarters of a cell; its ray stays in the one that it passes through.
fn split<R: FnMut(u32, Vec3) -> Vec3>(cell: &Cell, tracer: &mut Tracer<'_, R>) -> Vec<Cell> {
    let kept = cell.quarter_of_ray();
    let quarters = cell.quarters().into_iter().enumerate();
    quarters.filter_map(|(i, q)| if i == kept { Some(cell.shrunk_to(q)) } else { tracer.shoot(q) }).collect()
}

/// The grid that finds out where light varies.
struct Pilot {
    rows: u32,
    columns: u32,
    /// Rows of one normal's strip.
    height: u32,
}

impl Pilot {
    fn new(rays: u32, lobes: u32) -> Self {
        let share = rays as f32 * PILOT;
        let height = ((share / (ASPECT * lobes as f32)).sqrt().round() as u32).max(1);
        let rows = (height * lobes).min(rays);
        let columns = ((share / rows as f32) as u32).max(1);
        Self { rows, columns, height }
    }

    /// The greatest difference of luminance, W·sr⁻¹·m⁻², between a cell and its neighbours in the same strip.
    fn spread(&self, cells: &[Cell], cell: usize) -> f32 {
        let (row, column) = (cell as u32 / self.columns, cell as u32 % self.columns);
        let sideways = [(row, (column + 1) % self.columns), (row, (column + self.columns - 1) % self.columns)];
        let up = (row % self.height > 0).then(|| (row - 1, column));
        let down = ((row + 1) % self.height > 0 && row + 1 < self.rows).then_some((row + 1, column));
        let own = cells[cell].luminance();
        let difference = |(r, c): (u32, u32)| (cells[(r * self.columns + c) as usize].luminance() - own).abs();
        sideways.into_iter().chain(up).chain(down).map(difference).fold(0.0, f32::max)
    }
}
