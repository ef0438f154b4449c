//! Thick walls with round-headed openings: the windows and the arcades.

use super::obj::{Corner, Obj};
use super::paint::Paint;
use super::shapes::{lattice, steps};
use glam::{DVec2, DVec3};
use std::f64::consts::PI;

/// A wall along local +x from 0, front in the plane z = 0 facing +z, pierced once a bay.
pub struct ArchedWall {
    /// Number of bays.
    pub bays: usize,
    /// Width of a bay, metres.
    pub bay: f64,
    /// Half the width of an opening, which is also the radius of its arch.
    pub half: f64,
    /// Height of the wall's foot, of the sill, of the springing, of the top.
    pub heights: [f64; 4],
    /// Thickness.
    pub depth: f64,
    /// Cell size.
    pub cell: f64,
    /// Segments of an arch.
    pub segments: usize,
}

/// A strip of wall between two neighbouring verticals.
struct Column {
    u: [f64; 2],
    /// Centre of the opening that it crosses; `None` in a pier.
    opening: Option<f64>,
}

impl ArchedWall {
    /// Adds the wall: both faces, the reveals, the ends and the top.
    pub fn build(&self, obj: &mut Obj, paint: &'static Paint) {
        for column in self.columns() {
            self.above(obj, paint, &column);
            let sill = if column.opening.is_some() { self.heights[1] } else { self.heights[2] };
            let levels = self.levels();
            let below: Vec<f64> = levels.into_iter().filter(|&y| y <= sill + 1e-9).collect();
            for rows in below.windows(2) {
                self.both(
                    obj,
                    paint,
                    [[column.u[0], rows[0]], [column.u[1], rows[0]], [column.u[1], rows[1]], [column.u[0], rows[1]]],
                );
            }
            if column.opening.is_some() {
                self.soffit(obj, paint, &column);
            }
        }
        for bay in 0..self.bays {
            self.jambs(obj, paint, (bay as f64 + 0.5) * self.bay);
        }
        self.rim(obj, paint);
    }

    fn columns(&self) -> Vec<Column> {
        let mut columns = Vec::new();
        let mut add = |us: &[f64], opening| {
            columns.extend(us.windows(2).map(|w| Column { u: [w[0], w[1]], opening }));
        };
        for bay in 0..self.bays {
            let start = bay as f64 * self.bay;
            let centre = start + self.bay * 0.5;
            add(&steps(start, centre - self.half, self.cell), None);
            let arc: Vec<f64> = (0..=self.segments)
                .map(|i| centre - self.half * (PI * i as f64 / self.segments as f64).cos())
                .collect();
            add(&arc, Some(centre));
            add(&steps(centre + self.half, start + self.bay, self.cell), None);
        }
        columns
    }

    fn levels(&self) -> Vec<f64> {
        let [foot, sill, spring, _] = self.heights;
        let mut levels = if sill > foot { steps(foot, sill, self.cell) } else { vec![foot] };
        if spring > sill {
            levels.extend_from_slice(&steps(sill, spring, self.cell)[1..]);
        }
        levels
    }

    /// Height of the opening's edge, or of the springing in a pier.
    fn edge(&self, u: f64, opening: Option<f64>) -> f64 {
        let spring = self.heights[2];
        opening.map_or(spring, |c| spring + (self.half.powi(2) - (u - c).powi(2)).max(0.0).sqrt())
    }

    /// The part above the springing; rows fan out from the arch to the straight top.
    fn above(&self, obj: &mut Obj, paint: &'static Paint, column: &Column) {
        let rows = ((self.heights[3] - self.heights[2]) / self.cell).ceil() as usize;
        let y = |u: f64, row: usize| {
            let edge = self.edge(u, column.opening);
            edge + (self.heights[3] - edge) * row as f64 / rows as f64
        };
        let [u0, u1] = column.u;
        for row in 0..rows {
            self.both(obj, paint, [[u0, y(u0, row)], [u1, y(u1, row)], [u1, y(u1, row + 1)], [u0, y(u0, row + 1)]]);
        }
    }

    /// A cell on the front and on the back.
    fn both(&self, obj: &mut Obj, paint: &'static Paint, cell: [[f64; 2]; 4]) {
        let front = cell.map(|[x, y]| DVec3::new(x, y, 0.0));
        let mut back = cell.map(|[x, y]| DVec3::new(x, y, -self.depth));
        back.reverse();
        obj.flat(paint, &front);
        obj.flat(paint, &back);
    }

    fn depths(&self) -> Vec<f64> {
        steps(-self.depth, 0.0, self.cell)
    }

    /// The underside of the arch and the sill of one column.
    fn soffit(&self, obj: &mut Obj, paint: &'static Paint, column: &Column) {
        let Some(centre) = column.opening else { return };
        let spring = self.heights[2];
        for z in self.depths().windows(2) {
            let corner = |u: f64, z: f64| {
                let p = DVec3::new(u, self.edge(u, column.opening), z);
                let n = DVec3::new(centre - u, spring - p.y, 0.0);
                Corner { p, n, uv: DVec2::new(n.x.atan2(-n.y) * self.half, z) / paint.tile }
            };
            let [u0, u1] = column.u;
            obj.face(paint, &[corner(u0, z[0]), corner(u1, z[0]), corner(u1, z[1]), corner(u0, z[1])]);
        }
        if self.heights[1] > self.heights[0] {
            let origin = DVec3::Y * self.heights[1];
            lattice(obj, paint, [origin, DVec3::Z, DVec3::X], [&self.depths(), &column.u], |_, _| true);
        }
    }

    /// The two upright reveals of an opening.
    fn jambs(&self, obj: &mut Obj, paint: &'static Paint, centre: f64) {
        let levels: Vec<f64> = self.levels().into_iter().filter(|&y| y >= self.heights[1] - 1e-9).collect();
        let (left, right) = (DVec3::X * (centre - self.half), DVec3::X * (centre + self.half));
        let zs = self.depths();
        lattice(obj, paint, [left, DVec3::Y, DVec3::Z], [&levels, &zs], |_, _| true);
        lattice(obj, paint, [right, DVec3::Z, DVec3::Y], [&zs, &levels], |_, _| true);
    }

    /// Ends and top, which close the shell.
    fn rim(&self, obj: &mut Obj, paint: &'static Paint) {
        let length = self.bays as f64 * self.bay;
        let (ys, zs) = ([self.heights[0], self.heights[3]], [-self.depth, 0.0]);
        lattice(obj, paint, [DVec3::ZERO, DVec3::Z, DVec3::Y], [&zs, &ys], |_, _| true);
        lattice(obj, paint, [DVec3::X * length, DVec3::Y, DVec3::Z], [&ys, &zs], |_, _| true);
        let top = DVec3::Y * self.heights[3];
        lattice(obj, paint, [top, DVec3::Z, DVec3::X], [&self.depths(), &steps(0.0, length, self.cell)], |_, _| true);
    }
}
