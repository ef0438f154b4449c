//! Bookcases and the books in them.

use super::obj::{Corner, Obj};
use super::paint::{BOOKS, GLAZE, OAK, PAGE_EDGE};
use super::rng::Rng;
use super::shapes::{block, lathe, side};
use glam::{DVec2, DVec3};

/// Thickness of shelves and uprights.
const BOARD: f64 = 0.035;
/// Depth of a case.
pub const DEPTH: f64 = 0.34;

/// A bookcase in a local frame: x along it from 0, back at z = 0, front facing +z.
pub struct Case {
    /// Width.
    pub width: f64,
    /// Height without the cornice.
    pub height: f64,
    /// Upright divisions.
    pub columns: usize,
    /// Shelves with books.
    pub rows: usize,
}

impl Case {
    /// Adds the case and fills it.
    pub fn build(&self, obj: &mut Obj, rng: &mut Rng) {
        let front = DEPTH;
        for i in 0..=self.columns {
            let x = (self.width - BOARD) * i as f64 / self.columns as f64;
            let hi = DVec3::new(x + BOARD, self.height, front);
            block(obj, &OAK, [DVec3::new(x, 0.0, 0.0), hi], 0.5, side::BIT[0] | side::BIT[1] | side::BIT[5]);
        }
        let cornice =
            [DVec3::new(-0.05, self.height, 0.0), DVec3::new(self.width + 0.05, self.height + 0.09, front + 0.06)];
        block(obj, &OAK, cornice, 0.4, side::ALL & !side::BIT[4]);
        let back = [DVec3::new(0.0, 0.0, 0.0), DVec3::new(self.width, self.height, 0.01)];
        block(obj, &OAK, back, 0.5, side::BIT[5]);
        let plinth = 0.1;
        let pitch = (self.height - plinth) / self.rows as f64;
        for row in 0..self.rows {
            let y = plinth + pitch * row as f64;
            for column in 0..self.columns {
                let bay = (self.width - BOARD) / self.columns as f64;
                let x = bay * column as f64 + BOARD;
                let lo = DVec3::new(x, y - if row == 0 { plinth } else { BOARD }, 0.01);
                let hi = DVec3::new(x + bay - BOARD, y, front - 0.015);
                block(obj, &OAK, [lo, hi], 0.5, side::BIT[2] | side::BIT[3] | side::BIT[5]);
                fill(obj, rng, DVec3::new(x, y, front), bay - BOARD, pitch - BOARD);
            }
        }
    }
}

/// Books on one shelf: sets that stand flush, now and then a pile or a vase.
fn fill(obj: &mut Obj, rng: &mut Rng, at: DVec3, width: f64, clear: f64) {
    let mut x = 0.01;
    while width - x > 0.05 {
        let room = width - x;
        if room > 0.3 && rng.chance(0.02) {
            obj.offset(at + DVec3::new(x + 0.12, 0.0, -0.15), vase);
            x += 0.26;
        } else if room > 0.3 && rng.chance(0.08) {
            x += pile(obj, rng, at + DVec3::X * x, clear);
        } else {
            x += set(obj, rng, at + DVec3::X * x, [room, clear]);
        }
    }
}

/// A run of books of equal height, with covers on its two ends only; returns its width, at most `room`.
fn set(obj: &mut Obj, rng: &mut Rng, at: DVec3, [room, clear]: [f64; 2]) -> f64 {
    let (height, depth) = (clear * rng.range(0.66, 0.93), rng.range(0.17, 0.23));
    let base = at - DVec3::Z * rng.range(0.03, 0.055);
    let (binding, uniform) = (rng.below(64), rng.chance(0.6));
    let mut books = vec![(rng.range(0.034, 0.076).min(room), binding)];
    for _ in 0..rng.below(6) {
        let (thick, other) = (rng.range(0.034, 0.076), rng.below(64));
        if books.iter().map(|b| b.0).sum::<f64>() + thick <= room {
            books.push((thick, if uniform { binding } else { other }));
        }
    }
    let mut x = 0.0;
    for (i, &(thick, binding)) in books.iter().enumerate() {
        obj.offset(base + DVec3::X * x, |obj| {
            upright(obj, DVec3::new(thick, height, depth), binding);
            if i == 0 {
                cover(obj, [[0.0, -depth], [0.0, -BULGE]], height, binding);
            }
            if i + 1 == books.len() {
                cover(obj, [[thick, -BULGE], [thick, -depth]], height, binding);
            }
        });
        x += thick;
    }
    x + 0.003
}

/// A small turned vase.
fn vase(obj: &mut Obj) {
    let profile = [
        (0.035, 0.0),
        (0.075, 0.05),
        (0.09, 0.1),
        (0.07, 0.16),
        (0.035, 0.2),
        (0.03, 0.22),
        (0.045, 0.25),
        (0.025, 0.22),
        (0.0, 0.21),
    ];
    lathe(obj, &GLAZE, &profile, 10);
}

/// A few books lying on one another; returns the room they took.
fn pile(obj: &mut Obj, rng: &mut Rng, at: DVec3, clear: f64) -> f64 {
    let (mut y, length) = (0.0, rng.range(0.2, 0.25));
    while y < clear * 0.6 {
        let size = DVec3::new(rng.range(0.03, 0.05), length - rng.range(0.0, 0.03), 0.2);
        lying(obj, at + DVec3::new(0.0, y, -rng.range(0.03, 0.06)), size, rng.below(64));
        y += size.x;
    }
    length + 0.01
}

/// A cell of the binding atlas.
fn atlas(binding: u64, u: f64, v: f64) -> DVec2 {
    DVec2::new((binding % 8) as f64 + 0.04 + 0.92 * u, (binding / 8) as f64 + 0.02 + 0.96 * v) / 8.0
}

/// Depth of a spine's rounding, equal for all, so that neighbours meet at the hinge.
const BULGE: f64 = 0.008;

/// Spine and top of a book, spine at z = 0 facing +z, standing on y = 0; `size` is thickness, height, depth.
fn upright(obj: &mut Obj, size: DVec3, binding: u64) {
    let (w, h, d) = (size.x, size.y, size.z);
    let columns = [(0.0, -BULGE, -0.5), (0.5, 0.0, 0.0), (1.0, -BULGE, 0.5)];
    for pair in columns.windows(2) {
        let corner = |(u, z, nx): (f64, f64, f64), v: f64| Corner {
            p: DVec3::new(w * u, h * v, z),
            n: DVec3::new(nx, 0.0, 1.0),
            uv: atlas(binding, u, v),
        };
        obj.face(&BOOKS, &[corner(pair[0], 0.0), corner(pair[1], 0.0), corner(pair[1], 1.0), corner(pair[0], 1.0)]);
    }
    let top = [(0.0, -BULGE), (0.5, 0.0), (1.0, -BULGE), (1.0, -d), (0.0, -d)];
    obj.flat(&PAGE_EDGE, &top.map(|(u, z)| DVec3::new(w * u, h, z)));
}

/// A plain upright board between two points (x, z), seen with the first on the left.
fn cover(obj: &mut Obj, [a, b]: [[f64; 2]; 2], height: f64, binding: u64) {
    let p = |[x, z]: [f64; 2], y: f64| DVec3::new(x, y, z);
    plain(obj, [p(a, 0.0), p(b, 0.0), p(b, height), p(a, height)], binding);
}

/// Leather without gilding, from the quiet part of the atlas.
fn plain(obj: &mut Obj, points: [DVec3; 4], binding: u64) {
    let n = (points[1] - points[0]).cross(points[3] - points[0]);
    let uvs = [(0.2, 0.25), (0.8, 0.25), (0.8, 0.5), (0.2, 0.5)];
    let mut uv = uvs.iter().map(|&(u, v)| atlas(binding, u, v));
    obj.face(&BOOKS, &points.map(|p| Corner { p, n, uv: uv.next().unwrap_or_default() }));
}

/// A closed book on its side, spine at z = 0 facing +z; `size` is thickness, length along x, depth.
fn lying(obj: &mut Obj, at: DVec3, size: DVec3, binding: u64) {
    let (h, l, d) = (size.x, size.y, size.z);
    let p = |x: f64, y: f64, z: f64| at + DVec3::new(x * l, y * h, -z * d);
    let spine = [p(0.0, 0.0, 0.0), p(1.0, 0.0, 0.0), p(1.0, 1.0, 0.0), p(0.0, 1.0, 0.0)];
    let uvs = [(0.0, 1.0), (0.0, 0.0), (1.0, 0.0), (1.0, 1.0)];
    let mut uv = uvs.iter().map(|&(u, v)| atlas(binding, u, v));
    obj.face(&BOOKS, &spine.map(|p| Corner { p, n: DVec3::Z, uv: uv.next().unwrap_or_default() }));
    plain(obj, [p(0.0, 1.0, 0.0), p(1.0, 1.0, 0.0), p(1.0, 1.0, 1.0), p(0.0, 1.0, 1.0)], binding);
    // The underside shows where it juts out over the book below.
    plain(obj, [p(0.0, 0.0, 1.0), p(1.0, 0.0, 1.0), p(1.0, 0.0, 0.0), p(0.0, 0.0, 0.0)], binding);
    for (a, b) in [([1.0, 0.0], [1.0, 1.0]), ([1.0, 1.0], [0.0, 1.0]), ([0.0, 1.0], [0.0, 0.0])] {
        obj.flat(&PAGE_EDGE, &[p(a[0], 0.0, a[1]), p(b[0], 0.0, b[1]), p(b[0], 1.0, b[1]), p(a[0], 1.0, a[1])]);
    }
}
