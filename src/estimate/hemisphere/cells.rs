//! Cells of the square that stands for a hemisphere, one ray each, and the queue of those to split.

use super::sample::{Gathered, Sample};
use crate::math::hemisphere::{Direction, Mixture};
use crate::math::luminance;
use crate::math::sequence::Sequence;
use glam::Vec3;
use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::ops::Range;

/// A rectangle of the square with the one ray through it.
#[derive(Clone, Copy, Debug)]
pub struct Cell {
    low: [f32; 2],
    size: [f32; 2],
    /// Where in the square the ray passes: uniform in the cell.
    point: [f32; 2],
    direction: Direction,
    radiance: Vec3,
}

impl Cell {
    /// Share of the square.
    pub const fn area(&self) -> f32 {
        self.size[0] * self.size[1]
    }

    /// Luminance that the ray found.
    pub fn luminance(&self) -> f32 {
        luminance(self.radiance)
    }

    /// The four quarters of the cell.
    pub fn quarters(&self) -> [Quarter; 4] {
        let size = self.size.map(|s| 0.5 * s);
        [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]
            .map(|[x, y]| Quarter { low: [self.low[0] + x * size[0], self.low[1] + y * size[1]], size })
    }

    /// Which of [`Self::quarters`] the ray passes through.
    pub fn quarter_of_ray(&self) -> usize {
        let right = |axis: usize| usize::from(self.point[axis] >= self.low[axis] + 0.5 * self.size[axis]);
        right(0) + 2 * right(1)
    }

    /// The cell's ray in a quarter that it passes through.
    pub const fn shrunk_to(&self, quarter: Quarter) -> Self {
        Self { low: quarter.low, size: quarter.size, ..*self }
    }
}

/// A rectangle without a ray yet.
#[derive(Clone, Copy, Debug)]
pub struct Quarter {
    low: [f32; 2],
    size: [f32; 2],
}

/// Sends rays through cells.
pub struct Tracer<'a, R> {
    mixture: &'a Mixture<'a>,
    sequence: &'a Sequence,
    rays: Range<u32>,
    radiance: R,
    traced: u32,
}

impl<'a, R: FnMut(u32, Vec3) -> Vec3> Tracer<'a, R> {
    /// Rays are numbered from `rays.start`, and there are at most as many as `rays` is long.
    pub const fn new(mixture: &'a Mixture<'a>, sequence: &'a Sequence, rays: Range<u32>, radiance: R) -> Self {
        Self { mixture, sequence, rays, radiance, traced: 0 }
    }

    /// Whether `count` rays more are allowed.
    pub const fn affords(&self, count: u32) -> bool {
        self.rays.end - self.rays.start - self.traced >= count
    }

    /// A grid of cells, row by row, each with its ray. Rows cut the square's first coordinate.
    pub fn grid(&mut self, rows: u32, columns: u32) -> Vec<Cell> {
        let size = [1.0 / rows as f32, 1.0 / columns as f32];
        let places = (0..rows).flat_map(|row| (0..columns).map(move |column| [row as f32, column as f32]));
        places.filter_map(|[r, c]| self.shoot(Quarter { low: [r * size[0], c * size[1]], size })).collect()
    }

    /// Sends a ray through a uniform point of a rectangle.
    pub fn shoot(&mut self, Quarter { low, size }: Quarter) -> Option<Cell> {
        let index = self.rays.start + self.traced;
        // The points of the sequence avoid each other: given what earlier ones found, the next is not uniform.
        let random = self.sequence.independent(index);
        let point = [low[0] + size[0] * random[0], low[1] + size[1] * random[1]];
        let direction = self.mixture.at(point)?;
        self.traced += 1;
        Some(Cell { low, size, point, direction, radiance: (self.radiance)(index, direction.direction) })
    }

    /// Luminance of what a cell adds to the irradiance, W·m⁻², the mean over all normals.
    pub fn irradiance(&self, cell: &Cell) -> f32 {
        let Direction { direction, measure } = cell.direction;
        cell.area() * measure * self.mixture.mean_cosine(direction) * cell.luminance()
    }

    /// Hands the cells out as samples.
    pub fn finish(self, cells: &[Cell], mut sink: impl FnMut(Sample)) -> Gathered {
        let samples = cells.len() as u32;
        for cell in cells {
            let Direction { direction, measure } = cell.direction;
            sink(Sample { direction, radiance: cell.radiance, weight: cell.area() * samples as f32 * measure });
        }
        Gathered { rays: self.traced, samples }
    }
}

/// Cells by key, the largest first; among equals the one that waits longest.
#[derive(Default)]
pub struct Queue {
    heap: BinaryHeap<Entry>,
    pushed: u32,
}

impl Queue {
    /// Queues cell number `cell`.
    pub fn push(&mut self, key: f32, cell: usize) {
        self.heap.push(Entry { key, serial: self.pushed, cell });
        self.pushed += 1;
    }

    /// The key and number of the cell to split next.
    pub fn pop(&mut self) -> Option<(f32, usize)> {
        self.heap.pop().map(|entry| (entry.key, entry.cell))
    }
}

struct Entry {
    key: f32,
    serial: u32,
    cell: usize,
}

impl Ord for Entry {
    fn cmp(&self, other: &Self) -> Ordering {
        self.key.total_cmp(&other.key).then(other.serial.cmp(&self.serial))
    }
}

impl PartialOrd for Entry {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Entry {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Entry {}
