//! The paper's hemisphere [FP03 §4.2]: cells of equal solid angle, split until they are homogeneous.
//!
//! The paper leaves three things open. *Inhomogeneity*, which orders the queue, is here the relative deviation of a cell's
//! luminance from that of the cell that it came from, times solid angle. *The band* is relative to the luminance before
//! the split, but never to less than a twentieth of the hemisphere's mean, or black cells would take every ray. *ε* is
//! relative to the irradiance, so that it holds in any unit.

use super::cells::{Cell, Queue, Tracer};
use super::sample::{Gathered, Sample};
use crate::math::hemisphere::Mixture;
use crate::math::sequence::Sequence;
use glam::Vec3;
use std::f32::consts::PI;
use std::ops::Range;

/// When cells and the hemisphere are good enough.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thresholds {
    /// A cell is homogeneous if each ray after its split lies within this share of the luminance before it: 0.05 to 0.2.
    pub band: f32,
    /// Share of the solid angle that must be homogeneous: 0.5 to 0.9.
    pub homogeneous: f32,
    /// Relative change of the irradiance a new ray below which the estimate counts as converged.
    pub convergence: f32,
}

impl Default for Thresholds {
    fn default() -> Self {
        Self { band: 0.1, homogeneous: 0.7, convergence: 1e-3 }
    }
}

/// Cells of the first grid: heights and turns about the normal.
const GRID: [u32; 2] = [3, 4];
/// Luminance that the band is relative to at least, against the hemisphere's mean.
const FLOOR: f32 = 0.05;

/// Gathers until `thresholds` are met, with at most as many rays as `rays` is long.
pub fn gather(
    thresholds: &Thresholds,
    mixture: &Mixture<'_>,
    rays: Range<u32>,
    sequence: &Sequence,
    radiance: impl FnMut(u32, Vec3) -> Vec3,
    sink: impl FnMut(Sample),
) -> Gathered {
    let cap = rays.end - rays.start;
    let rows = GRID[0] * mixture.lobes() as u32;
    let mut tracer = Tracer::new(mixture, sequence, rays, radiance);
    // With fewer rays than the grid has cells, there is a sector a ray.
    let mut cells = if cap < rows * GRID[1] { tracer.grid(1, cap) } else { tracer.grid(rows, GRID[1]) };
    let mut queue = Queue::default();
    (0..cells.len()).for_each(|cell| queue.push(f32::INFINITY, cell));
    let mut irradiance: f32 = cells.iter().map(|cell| tracer.irradiance(cell)).sum();
    let mut homogeneous = 0.0;
    while tracer.affords(4)
        && let Some((_, cell)) = queue.pop()
    {
        let parent = cells[cell];
        let quarters: Vec<Cell> = parent.quarters().into_iter().filter_map(|q| tracer.shoot(q)).collect();
        let change = quarters.iter().map(|q| tracer.irradiance(q)).sum::<f32>() - tracer.irradiance(&parent);
        irradiance += change;
        let scale = parent.luminance().max(FLOOR * irradiance / PI).max(f32::MIN_POSITIVE);
        let deviation = |quarter: &Cell| (quarter.luminance() - parent.luminance()).abs() / scale;
        let even = quarters.iter().all(|q| deviation(q) <= thresholds.band);
        if even {
            homogeneous += parent.area();
        }
        for (i, quarter) in quarters.into_iter().enumerate() {
            let at = if i == 0 { cell } else { cells.len() };
            if !even {
                queue.push(deviation(&quarter) * quarter.area(), at);
            }
            if i == 0 { cells[at] = quarter } else { cells.push(quarter) }
        }
        if homogeneous >= thresholds.homogeneous && change.abs() <= 4.0 * thresholds.convergence * irradiance {
            break;
        }
    }
    tracer.finish(&cells, sink)
}
