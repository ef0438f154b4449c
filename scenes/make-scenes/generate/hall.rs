//! The library's building: floor, walls, windows, arcades, vault, hearth. x runs east, y up, z south; metres.

use super::arch::ArchedWall;
use super::obj::{Corner, Obj};
use super::paint::{BRICK, DARK_OAK, FLAGS, LEAD, LOG, PLANKS, PLASTER, Paint, STARS, STONE};
use super::shapes::{block, lathe, lattice, linspace, rod, side, stations, steps, tube};
use glam::{DAffine3, DMat3, DVec2, DVec3};
use std::f64::consts::PI;

/// Half the width of the nave, which is the vault's radius.
pub const NAVE: f64 = 4.2;
/// Half the length of the hall.
pub const END: f64 = 8.0;
/// Number of bays and their length.
pub const BAYS: usize = 5;
/// Length of a bay.
pub const BAY: f64 = 3.2;
/// East face of the arcade wall.
pub const ARCADE: f64 = 4.6;
/// East wall.
pub const EAST: f64 = 7.0;
/// Level of the gallery floor.
pub const GALLERY: f64 = 4.0;
/// Springing of the vault.
pub const SPRING: f64 = 6.8;
/// Centre and radius of the rose window, on the north wall.
pub const ROSE: (f64, f64) = (7.7, 1.7);
/// Half the size of a column's plinth.
const PLINTH: f64 = 0.26;

/// Frame of a wall whose front faces east (`true`) or west, at `x`.
fn wall_frame(x: f64, faces_east: bool) -> DAffine3 {
    let s = if faces_east { 1.0 } else { -1.0 };
    let axes = DMat3::from_cols(DVec3::new(0.0, 0.0, -s), DVec3::Y, DVec3::new(s, 0.0, 0.0));
    DAffine3::from_mat3_translation(axes, DVec3::new(x, 0.0, s * END))
}

/// Centre of bay `i`.
#[must_use]
pub fn bay_centre(i: usize) -> f64 {
    -END + (i as f64 + 0.5) * BAY
}

/// Builds everything that does not move.
pub fn build(obj: &mut Obj) {
    floor(obj);
    west_wall(obj);
    (0..BAYS).for_each(|i| window(obj, bay_centre(i)));
    end_walls(obj);
    vault(obj);
    aisle(obj);
    arcades(obj);
    hearth(obj);
}

/// Whether a spot of the floor is under a column or the hearth's masonry.
fn built_over(x: f64, z: f64) -> bool {
    let border = (z + END).rem_euclid(BAY).min(BAY - (z + END).rem_euclid(BAY));
    let column = (x - 4.4).abs() < PLINTH && border < PLINTH && z.abs() < END - 1.0;
    let pilaster = (NAVE..ARCADE).contains(&x) && z.abs() > END - 0.3;
    column || pilaster || (z < -END + 0.7 && (0.75..1.3).contains(&x.abs()))
}

fn floor(obj: &mut Obj) {
    let xs = stations(&[-NAVE, -1.3, -0.75, 0.75, 1.3, 4.4 - PLINTH, NAVE, ARCADE, 4.4 + PLINTH, EAST], 0.22);
    let mut marks = vec![-END, -END + 0.3, -END + 0.7];
    for i in 1..BAYS {
        let z = -END + i as f64 * BAY;
        marks.extend([z - PLINTH, z + PLINTH]);
    }
    marks.extend([END - 0.3, END]);
    let zs = stations(&marks, 0.22);
    lattice(obj, &FLAGS, [DVec3::ZERO, DVec3::Z, DVec3::X], [&zs, &xs], |z, x| !built_over(x, z));
}

fn west_wall(obj: &mut Obj) {
    let wall = ArchedWall {
        bays: BAYS,
        bay: BAY,
        half: 0.85,
        heights: [0.0, 1.2, 4.6, SPRING],
        depth: 0.5,
        cell: 0.3,
        segments: 14,
    };
    obj.at(wall_frame(-NAVE, true), |obj| wall.build(obj, &STONE));
}

/// Lead bars of the window centred on `z`.
fn window(obj: &mut Obj, z: f64) {
    const X: f64 = -NAVE - 0.28;
    let bar = |obj: &mut Obj, lo: DVec3, hi: DVec3| {
        let half = DVec3::new(0.02, 0.014, 0.014);
        block(obj, &LEAD, [lo - half, hi + half], 0.8, side::ALL);
    };
    for k in -1..=1 {
        let dz = f64::from(k) * 0.425;
        let top = 4.6 + (0.85f64.powi(2) - dz * dz).sqrt() - 0.03;
        bar(obj, DVec3::new(X, 1.22, z + dz), DVec3::new(X, top, z + dz));
    }
    for k in 0..7 {
        let y = 1.7 + f64::from(k) * 0.4833;
        // Clear of the uprights by their own depth, as saddle bars are.
        let x = X + 0.042;
        bar(obj, DVec3::new(x, y, z - 0.83), DVec3::new(x, y, z + 0.83));
    }
    let arc = |radius: f64| -> Vec<DVec3> {
        linspace(0.0, PI, 14)
            .iter()
            .map(|t| DVec3::new(X - 0.05, 4.6 + radius * t.sin(), z + radius * t.cos()))
            .collect()
    };
    tube(obj, &LEAD, &arc(0.45), 0.016, 5, false);
}

/// North and south walls of the nave, up to the vault, and of the aisle.
fn end_walls(obj: &mut Obj) {
    for (z, inwards) in [(-END, 1.0), (END, -1.0)] {
        let xs: Vec<f64> = (0..=40).map(|i| -NAVE * (PI * f64::from(i) / 40.0).cos()).collect();
        for pair in xs.windows(2) {
            end_column(obj, z, if inwards > 0.0 { [pair[0], pair[1]] } else { [pair[1], pair[0]] });
        }
        for ys in [[0.0, GALLERY - 0.2], [GALLERY, SPRING]] {
            let (us, vs) = (steps(ARCADE * inwards, EAST * inwards, 0.3), steps(ys[0], ys[1], 0.3));
            let mut us = us;
            us.sort_by(f64::total_cmp);
            lattice(obj, &PLASTER, [DVec3::Z * z, DVec3::X * inwards, DVec3::Y], [&us, &vs], |_, _| true);
        }
    }
}

/// One upright strip of an end wall between x\[0\] and x\[1\], seen from inside with x\[0\] on the left.
fn end_column(obj: &mut Obj, z: f64, x: [f64; 2]) {
    let crown = |x: f64| SPRING + (NAVE * NAVE - x * x).max(0.0).sqrt();
    let mut rows: Vec<[f64; 2]> = steps(0.0, SPRING, 0.27).into_iter().map(|y| [y, y]).collect();
    rows.extend(linspace(0.0, 1.0, 14)[1..].iter().map(|t| x.map(|x| SPRING + (crown(x) - SPRING) * t)));
    for pair in rows.windows(2) {
        let cell = [
            DVec3::new(x[0], pair[0][0], z),
            DVec3::new(x[1], pair[0][1], z),
            DVec3::new(x[1], pair[1][1], z),
            DVec3::new(x[0], pair[1][0], z),
        ];
        // Behind the rose there is nothing to light.
        let hidden = z < 0.0 && cell.iter().all(|p| DVec2::new(p.x, p.y - ROSE.0).length() < ROSE.1);
        if !hidden {
            obj.flat(&PLASTER, &cell);
        }
    }
}

/// Point of the barrel at angle θ (0 east) and radius r.
fn barrel(theta: f64, r: f64, z: f64) -> DVec3 {
    DVec3::new(r * theta.cos(), SPRING + r * theta.sin(), z)
}

fn vault(obj: &mut Obj) {
    let thetas = linspace(0.0, PI, 40);
    let ribs: Vec<[f64; 2]> = (0..=BAYS)
        .map(|i| {
            let z = -END + i as f64 * BAY;
            [(z - 0.15).max(-END), (z + 0.15).min(END)]
        })
        .collect();
    for pair in ribs.windows(2) {
        for z in steps(pair[0][1], pair[1][0], 0.33).windows(2) {
            for t in thetas.windows(2) {
                barrel_cell(obj, &STARS, NAVE, [t[0], t[1]], [z[0], z[1]]);
            }
        }
    }
    for &[z0, z1] in &ribs {
        rib(obj, &thetas, z0, z1);
    }
}

/// A cell of a barrel seen from inside.
fn barrel_cell(obj: &mut Obj, paint: &'static Paint, r: f64, t: [f64; 2], z: [f64; 2]) {
    let corner = |t: f64, z: f64| Corner {
        p: barrel(t, r, z),
        n: -DVec3::new(t.cos(), t.sin(), 0.0),
        uv: DVec2::new(z, t * NAVE) / paint.tile,
    };
    obj.face(paint, &[corner(t[0], z[0]), corner(t[0], z[1]), corner(t[1], z[1]), corner(t[1], z[0])]);
}

/// A transverse arch of stone under the vault.
fn rib(obj: &mut Obj, thetas: &[f64], z0: f64, z1: f64) {
    const INNER: f64 = NAVE - 0.22;
    for t in thetas.windows(2) {
        barrel_cell(obj, &STONE, INNER, [t[0], t[1]], [z0, z1]);
        let side =
            |z: f64| [barrel(t[0], INNER, z), barrel(t[1], INNER, z), barrel(t[1], NAVE, z), barrel(t[0], NAVE, z)];
        if z1 < END {
            let mut south = side(z1);
            south.reverse();
            obj.flat(&STONE, &south);
        }
        if z0 > -END {
            obj.flat(&STONE, &side(z0));
        }
    }
    for s in [-1.0, 1.0] {
        let (a, b) = (s * INNER, s * NAVE);
        let lo = DVec3::new(a.min(b), SPRING - 0.35, z0);
        block(obj, &STONE, [lo, DVec3::new(a.max(b), SPRING, z1)], 0.2, side::ALL);
    }
}

/// The aisle: east wall, ceilings, gallery floor.
fn aisle(obj: &mut Obj) {
    let zs = steps(-END, END, 0.27);
    let xs = steps(ARCADE, EAST, 0.27);
    for ys in [[0.0, GALLERY - 0.2], [GALLERY, SPRING]] {
        let ys = steps(ys[0], ys[1], 0.3);
        lattice(obj, &PLASTER, [DVec3::X * EAST, DVec3::Z, DVec3::Y], [&zs, &ys], |_, _| true);
        let top = DVec3::Y * ys[ys.len() - 1];
        lattice(obj, &PLASTER, [top, DVec3::X, DVec3::Z], [&xs, &zs], |_, _| true);
    }
    lattice(obj, &PLANKS, [DVec3::Y * GALLERY, DVec3::Z, DVec3::X], [&zs, &xs], |_, _| true);
}

/// Both storeys of the arcade with their columns.
fn arcades(obj: &mut Obj) {
    for (foot, top) in [(2.2, GALLERY), (5.3, SPRING)] {
        let heights = [foot, foot, foot, top];
        let wall = ArchedWall { bays: BAYS, bay: BAY, half: 1.3, heights, depth: 0.4, cell: 0.3, segments: 16 };
        obj.at(wall_frame(NAVE, false), |obj| wall.build(obj, &STONE));
    }
    for i in 1..BAYS {
        let z = -END + i as f64 * BAY;
        obj.offset(DVec3::new(4.4, 0.0, z), |obj| column(obj, 2.2, PLINTH));
        obj.offset(DVec3::new(4.4, GALLERY, z), |obj| column(obj, 1.3, 0.19));
    }
    for z in [-END, END - 0.3] {
        for [y0, y1] in [[0.0, 2.2], [GALLERY, 5.3]] {
            let lo = DVec3::new(NAVE, y0, z);
            let hidden = side::BIT[3] | if z < 0.0 { side::BIT[4] } else { side::BIT[5] };
            block(obj, &STONE, [lo, DVec3::new(ARCADE, y1, z + 0.3)], 0.25, side::NO_BOTTOM & !hidden);
        }
    }
}

/// A column of `height` with a square plinth, turned base, tapering shaft, and capital with its slab.
fn column(obj: &mut Obj, height: f64, plinth: f64) {
    let s = plinth / 0.26;
    let slab = 0.1 * s;
    block(obj, &STONE, [DVec3::new(-plinth, 0.0, -plinth), DVec3::new(plinth, 0.12 * s, plinth)], 0.3, side::NO_BOTTOM);
    let shaft = height - slab;
    let mut profile = vec![(0.24 * s, 0.12 * s), (0.255 * s, 0.15 * s), (0.24 * s, 0.18 * s), (0.2 * s, 0.2 * s)];
    profile.extend([(0.215 * s, 0.225 * s), (0.2 * s, 0.25 * s), (0.185 * s, 0.26 * s)]);
    let (low, high) = (0.26 * s, shaft - 0.24 * s);
    // Entasis: the shaft swells a little before it narrows.
    profile.extend(steps(low, high, 0.22)[1..].iter().map(|&y| {
        let t = (y - low) / (high - low);
        ((0.185 - 0.03 * t * t) * s, y)
    }));
    profile.extend([(0.18 * s, high), (0.18 * s, high + 0.03 * s), (0.157 * s, high + 0.03 * s)]);
    profile.extend([
        (0.165 * s, high + 0.08 * s),
        (0.19 * s, high + 0.15 * s),
        (0.24 * s, high + 0.21 * s),
        (0.25 * s, shaft),
    ]);
    lathe(obj, &STONE, &profile, 16);
    let half = DVec3::new(0.27, 0.0, 0.33);
    block(obj, &STONE, [DVec3::Y * shaft - half, DVec3::Y * height + half], 0.3, side::ALL);
}

/// The fireplace on the north wall, and its logs.
fn hearth(obj: &mut Obj) {
    let (back, front) = (-END, -END + 0.7);
    let no_back = side::NO_BOTTOM & !side::BIT[4];
    for s in [-1.0, 1.0] {
        let x: [f64; 2] = if s < 0.0 { [-1.3, -0.75] } else { [0.75, 1.3] };
        block(obj, &STONE, [DVec3::new(x[0], 0.0, back), DVec3::new(x[1], 1.9, front)], 0.2, no_back);
    }
    let (lo, hi) = (DVec3::new(-0.75, 1.1, back), DVec3::new(0.75, 1.9, front));
    block(obj, &STONE, [lo, hi], 0.2, side::BIT[2] | side::BIT[5]);
    let (xs, ys) = (steps(-0.75, 0.75, 0.15), steps(0.0, 1.1, 0.15));
    lattice(obj, &BRICK, [DVec3::Z * (back + 0.04), DVec3::X, DVec3::Y], [&xs, &ys], |_, _| true);
    block(
        obj,
        &DARK_OAK,
        [DVec3::new(-1.5, 1.9, back), DVec3::new(1.5, 2.0, front + 0.14)],
        0.25,
        side::ALL & !side::BIT[4],
    );
    for (x, y, along) in [
        (-0.16, 0.07, DVec3::new(0.03, 0.0, 0.22)),
        (0.14, 0.07, DVec3::new(-0.04, 0.0, 0.22)),
        (0.0, 0.2, DVec3::new(0.4, 0.0, 0.03)),
    ] {
        let c = DVec3::new(x, y, back + 0.35);
        rod(obj, &LOG, [c - along, c + along], 0.065, 8);
    }
}
