//! Directions of an environment, drawn by brightness and by the cosine to a surface.
//!
//! The picture is cut into cells of about a twentieth of a radian squared. A cell is drawn by what it sends to the surface, a texel in it by its
//! share of the cell's light: two searches in tables of sums, which keep strata of the square. So only the cells' weights depend on the
//! surface, a hundred products.

use super::environment_texels::{clipped, texel_vectors};
use crate::math::luminance;
use crate::scene::environment::{Environment, Picture};
use glam::{DVec3, Vec3};
use std::f32::consts::{FRAC_PI_2, PI, TAU};
use std::ops::Range;

/// Columns and rows of cells at most.
const COLUMNS: usize = 16;
const ROWS: usize = 8;

/// The cells of a picture, with sums over their texels.
#[derive(Clone, Debug)]
pub(super) struct Cells {
    size: [u32; 2],
    /// Columns and rows of cells.
    count: [usize; 2],
    list: Vec<Cell>,
    /// Of each column of cells, row by row of texels: sums of luminance times solid angle from the first row of the cell on.
    rows: Vec<f32>,
    /// Row by row of texels: sums of luminance from the first texel of the cell on.
    texels: Vec<f32>,
}

/// A part of the picture.
#[derive(Clone, Copy, Debug, Default)]
struct Cell {
    /// Unit direction of its middle in the world, and the sine of how far it reaches from there; 2 for more than a right angle.
    middle: Vec3,
    reach: f32,
    /// Luminance of its light, W·m⁻²: the sum, and with directions.
    power: f32,
    vector: Vec3,
}

/// Weights of the cells for a surface.
#[derive(Clone, Debug)]
pub(super) struct Weights {
    cells: [f32; COLUMNS * ROWS],
    rows: [f32; ROWS],
    total: f32,
}

/// A direction that was drawn.
#[derive(Clone, Copy, Debug)]
pub(super) struct Drawn {
    /// Unit direction in the world.
    pub direction: Vec3,
    /// Column and row of its texel.
    pub texel: [u32; 2],
    /// Its density, sr⁻¹.
    pub density: f32,
}

/// Least weight of a cell that a surface sees a part of, against what it sends facing it.
const LEAST: f32 = 0.02;

/// First texel of each part where `count` texels are cut into `parts`.
fn cut(count: u32, parts: usize, at: usize) -> u32 {
    (u64::from(count) * at as u64 / parts as u64) as u32
}

impl Cells {
    pub(super) fn new(environment: &Environment) -> Self {
        let picture = &environment.picture;
        let [width, height] = picture.size();
        let count = [COLUMNS.min(width as usize), ROWS.min(height as usize)];
        let mut cells = Self {
            size: [width, height],
            count,
            list: Vec::new(),
            rows: vec![0.0; count[0] * height as usize],
            texels: vec![0.0; (width * height) as usize],
        };
        cells.add_up(picture);
        let vectors = texel_vectors(picture.size());
        for (row, column) in (0..count[1]).flat_map(|row| (0..count[0]).map(move |column| (row, column))) {
            let (xs, ys) = (cells.columns(column), cells.rows_of(row));
            let last = cells.rows[column * height as usize + ys.end as usize - 1];
            let mut vector = DVec3::ZERO;
            for y in ys.clone() {
                let texels = &picture.texels()[(y * width) as usize..];
                let along = |x: u32| vectors.of(x, y) * f64::from(luminance(texels[x as usize]));
                vector += xs.clone().map(along).sum::<DVec3>();
            }
            let (middle, reach) = cone(picture, &xs, &ys);
            let [middle, vector] = [middle, vector.as_vec3()].map(|own| environment.axes * own);
            cells.list.push(Cell { middle, reach, power: last, vector });
        }
        cells
    }

    /// Sums over the texels of each cell.
    fn add_up(&mut self, picture: &Picture) {
        let [width, height] = self.size;
        for column in 0..self.count[0] {
            for row in 0..self.count[1] {
                let mut power = 0.0_f64;
                for y in self.rows_of(row) {
                    let mut sum = 0.0_f64;
                    for x in self.columns(column) {
                        let at = (y * width + x) as usize;
                        sum += f64::from(luminance(picture.texels()[at]));
                        self.texels[at] = sum as f32;
                    }
                    power += sum * f64::from(picture.solid_angle(y));
                    self.rows[column * height as usize + y as usize] = power as f32;
                }
            }
        }
    }

    fn columns(&self, column: usize) -> Range<u32> {
        cut(self.size[0], self.count[0], column)..cut(self.size[0], self.count[0], column + 1)
    }

    fn rows_of(&self, row: usize) -> Range<u32> {
        cut(self.size[1], self.count[1], row)..cut(self.size[1], self.count[1], row + 1)
    }

    /// Weights for a surface of unit `normal`; cells that lie up to `below`, the sine of an angle, below its horizon get some, for what is
    /// not quite of that normal.
    pub(super) fn weights(&self, normal: Vec3, below: f32) -> Weights {
        let mut weights = Weights { cells: [0.0; COLUMNS * ROWS], rows: [0.0; ROWS], total: 0.0 };
        let [columns, _] = self.count;
        for (at, cell) in self.list.iter().enumerate() {
            let weight = cell.weight(normal, below);
            weights.cells[at] = weight;
            weights.rows[at / columns] += weight;
        }
        weights.total = weights.rows.iter().sum();
        weights
    }

    /// The direction chosen by `u` ∈ [0, 1)²; `None` where nothing sends any light.
    pub(super) fn draw(&self, environment: &Environment, weights: &Weights, [u, v]: [f32; 2]) -> Option<Drawn> {
        let ([width, height], [columns, rows]) = (self.size, self.count);
        let (row, v) = choose(&weights.rows[..rows], v * weights.total)?;
        let of_row = &weights.cells[row * columns..][..columns];
        let (column, u) = choose(of_row, u * weights.rows[row])?;
        let (xs, ys) = (self.columns(column), self.rows_of(row));
        let sums = &self.rows[column * height as usize..][ys.start as usize..ys.end as usize];
        let (y, v) = search(sums, v)?;
        let y = ys.start + y as u32;
        let sums = &self.texels[(y * width) as usize..][xs.start as usize..xs.end as usize];
        let (x, u) = search(sums, u)?;
        let texel = [xs.start + x as u32, y];
        let [top, bottom] = [y, y + 1].map(|y| environment.picture.cosine(y));
        let cosine = top + (bottom - top) * v;
        let turn = ((texel[0] as f32 + u) / width as f32 - 0.5) * TAU;
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        let direction = environment.axes * Vec3::new(sine * turn.sin(), cosine, sine * turn.cos());
        let density = self.density(environment, weights, texel);
        (density > 0.0).then_some(Drawn { direction: direction.normalize(), texel, density })
    }

    /// Density, sr⁻¹, with which directions of a texel are drawn.
    pub(super) fn density(&self, environment: &Environment, weights: &Weights, [x, y]: [u32; 2]) -> f32 {
        let ([width, height], [columns, _]) = (self.size, self.count);
        let part = |at: u32, of: u32, parts: usize| {
            let guess = (u64::from(at) * parts as u64 / u64::from(of)) as usize;
            // Where cells are not alike, the one after may begin here.
            if guess + 1 < parts && cut(of, parts, guess + 1) <= at { guess + 1 } else { guess }
        };
        let (column, row) = (part(x, width, columns), part(y, height, self.count[1]));
        let weight = weights.cells[row * columns + column];
        if weight <= 0.0 || weights.total <= 0.0 {
            return 0.0;
        }
        let (xs, ys) = (self.columns(column), self.rows_of(row));
        let of_rows = share(&self.rows[column * height as usize..][ys.start as usize..ys.end as usize], y - ys.start);
        let of_row = share(&self.texels[(y * width) as usize..][xs.start as usize..xs.end as usize], x - xs.start);
        weight / weights.total * of_rows * of_row / environment.picture.solid_angle(y)
    }
}

impl Cell {
    /// About what it sends to a surface of unit `normal`, W·m⁻²; 0 only where no direction in it is above the horizon.
    fn weight(&self, normal: Vec3, below: f32) -> f32 {
        if self.power <= 0.0 || normal.dot(self.middle) + self.reach + below <= 0.0 {
            return 0.0;
        }
        let (cosine, reach) = (normal.dot(self.vector) / self.power, self.reach.min(1.0).max(below));
        clipped(cosine, reach).max(LEAST) * self.power
    }
}

/// The unit direction of the middle of a block of texels in the picture's frame, and the sine of how far it reaches from there.
fn cone(picture: &Picture, xs: &Range<u32>, ys: &Range<u32>) -> (Vec3, f32) {
    let [width, height] = picture.size().map(|n| n as f32);
    let direction = |x: f32, y: f32| {
        let ((sin_turn, cos_turn), (sin_down, cos_down)) =
            (((x / width - 0.5) * TAU).sin_cos(), (y * PI / height).sin_cos());
        Vec3::new(sin_down * sin_turn, cos_down, sin_down * cos_turn)
    };
    let [x, y] = [xs, ys].map(|range| [range.start as f32, (range.start + range.end) as f32 * 0.5, range.end as f32]);
    let middle = direction(x[1], y[1]);
    let reach =
        y.iter().flat_map(|&y| x.map(|x| direction(x, y).dot(middle).clamp(-1.0, 1.0).acos())).fold(0.0, f32::max);
    let is_narrow = reach < FRAC_PI_2 && x[2] - x[0] < width * 0.3;
    (middle, if is_narrow { (reach + 1e-3).sin() } else { 2.0 })
}

/// The first whose running sum exceeds `target`, and where in it the target lies, in [0, 1).
fn choose(weights: &[f32], mut target: f32) -> Option<(usize, f32)> {
    let mut last = None;
    for (at, &weight) in weights.iter().enumerate().filter(|(_, weight)| **weight > 0.0) {
        if target < weight {
            return Some((at, (target / weight).clamp(0.0, BELOW_ONE)));
        }
        target -= weight;
        last = Some((at, BELOW_ONE));
    }
    last
}

/// The same for running sums, by the share `u` ∈ [0, 1) of the last.
fn search(sums: &[f32], u: f32) -> Option<(usize, f32)> {
    let &last = sums.last()?;
    if last <= 0.0 {
        return None;
    }
    let target = u * last;
    let at = sums.partition_point(|&sum| sum <= target).min(sums.len() - 1);
    let before = if at == 0 { 0.0 } else { sums[at - 1] };
    Some((at, ((target - before) / (sums[at] - before)).clamp(0.0, BELOW_ONE)))
}

/// Share of one of those in the last of the running sums.
fn share(sums: &[f32], at: u32) -> f32 {
    let at = at as usize;
    let before = if at == 0 { 0.0 } else { sums[at - 1] };
    let last = sums[sums.len() - 1];
    if last > 0.0 { (sums[at] - before) / last } else { 0.0 }
}

/// The largest number below 1.
const BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;
