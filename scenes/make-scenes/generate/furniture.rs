//! What stands in the library: tables, chairs, the armillary sphere, plants, pictures.

use super::obj::Obj;
use super::paint::{
    BRASS, CLOTH_BLUE, CLOTH_GREEN, CLOTH_TAN, DARK_OAK, FRINGE, GLAZE, GLOBE, IRON, LEAF, OAK, PAGE_EDGE, PAGES,
    Paint, RATTAN, RUG, SHADE, SOIL, STEM, TERRACOTTA, VELVET,
};
use super::rng::Rng;
use super::shapes::{block, hoop, lathe, linspace, rod, side, standing, surface, tube};
use glam::{DAffine3, DQuat, DVec2, DVec3};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Height of a table top.
pub const TABLE: f64 = 0.77;

/// A rotation about y, degrees, then a move.
#[must_use]
pub fn placed(position: DVec3, degrees: f64) -> DAffine3 {
    DAffine3::from_rotation_translation(DQuat::from_rotation_y(degrees.to_radians()), position)
}

/// A long table along z, 1.1 m × `length`, centred on the local origin.
pub fn table(obj: &mut Obj, length: f64) {
    let (w, l) = (0.55, length * 0.5);
    block(obj, &OAK, [DVec3::new(-w, TABLE - 0.05, -l), DVec3::new(w, TABLE, l)], 0.14, side::ALL);
    block(
        obj,
        &OAK,
        [DVec3::new(-w + 0.1, TABLE - 0.15, -l + 0.1), DVec3::new(w - 0.1, TABLE - 0.05, l - 0.1)],
        0.4,
        side::ALL & !side::BIT[3],
    );
    let leg = [
        (0.045, 0.0),
        (0.05, 0.05),
        (0.03, 0.09),
        (0.05, 0.2),
        (0.062, 0.36),
        (0.04, 0.5),
        (0.055, 0.55),
        (0.055, 0.62),
    ];
    for x in [-w + 0.17, w - 0.17] {
        for z in [-l + 0.17, l - 0.17] {
            obj.offset(DVec3::new(x, 0.0, z), |obj| lathe(obj, &DARK_OAK, &leg, 12));
        }
    }
}

/// A chair facing local −x, seat centred on the origin.
pub fn chair(obj: &mut Obj) {
    for (x, z) in [(-0.18, -0.18), (-0.18, 0.18), (0.19, -0.18), (0.19, 0.18)] {
        standing(obj, &DARK_OAK, DVec3::new(x, 0.0, z), DVec3::new(0.04, 0.42, 0.04), 0.6);
    }
    block(obj, &DARK_OAK, [DVec3::new(-0.22, 0.42, -0.22), DVec3::new(0.22, 0.45, 0.22)], 0.25, side::ALL);
    block(obj, &VELVET, [DVec3::new(-0.19, 0.45, -0.19), DVec3::new(0.17, 0.49, 0.19)], 0.2, side::NO_BOTTOM);
    let arc = |z: f64, y: f64| DVec3::new(0.2 + 0.06 * (y - 0.45) + 0.05 * (1.0 - (z / 0.22).powi(2)), y, z);
    for k in -2..=2 {
        let z = f64::from(k) * 0.09;
        rod(obj, &DARK_OAK, [arc(z, 0.45), arc(z, 0.9)], 0.012, 5);
    }
    let rail: Vec<DVec3> = linspace(-0.22, 0.22, 8).iter().map(|&z| arc(z, 0.92)).collect();
    tube(obj, &DARK_OAK, &rail, 0.03, 7, false);
}

/// A banker's lamp without its bulb, which belongs at (0, 0.36, 0).
pub fn desk_lamp(obj: &mut Obj) {
    let stand = [
        (0.09, 0.0),
        (0.092, 0.012),
        (0.05, 0.025),
        (0.014, 0.04),
        (0.012, 0.14),
        (0.02, 0.16),
        (0.012, 0.18),
        (0.01, 0.3),
        (0.022, 0.305),
        (0.022, 0.325),
        (0.0, 0.325),
    ];
    lathe(obj, &BRASS, &stand, 12);
    // Outside and inside of the shade, joined at the rim; a chimney on top lets light up.
    let shade = [
        (0.045, 0.455),
        (0.075, 0.45),
        (0.115, 0.415),
        (0.14, 0.365),
        (0.145, 0.335),
        (0.14, 0.335),
        (0.136, 0.362),
        (0.111, 0.411),
        (0.073, 0.445),
        (0.045, 0.455),
    ];
    let upwards: Vec<(f64, f64)> = shade.iter().rev().copied().collect();
    lathe(obj, &SHADE, &upwards, 18);
}

/// An open book lying on y = 0, text towards local +z.
pub fn open_book(obj: &mut Obj) {
    let rise = |t: f64| 0.035 * (t * PI).sin().powf(0.7) * (1.0 - 0.4 * t) + 0.006;
    for s in [-1.0, 1.0] {
        for (lift, sheet) in [(1.0, 0.0), (1.35, 0.004)] {
            let p = move |u: f64, v: f64| {
                let t = if s > 0.0 { u } else { 1.0 - u };
                DVec3::new(s * 0.15 * t.clamp(0.0, 1.0), rise(t.clamp(1e-3, 1.0)) * lift + sheet * t, 0.11 - 0.22 * v)
            };
            surface(obj, &PAGES, [&linspace(0.0, 1.0, 10), &linspace(0.0, 1.0, 4)], DVec2::ONE, p);
        }
    }
    block(obj, &VELVET, [DVec3::new(-0.158, 0.0, -0.117), DVec3::new(0.158, 0.005, 0.117)], 0.2, side::NO_BOTTOM);
}

/// A few books lying about on a table.
pub fn stack(obj: &mut Obj, rng: &mut Rng, count: usize) {
    const BINDINGS: [&Paint; 5] = [&VELVET, &CLOTH_BLUE, &CLOTH_GREEN, &CLOTH_TAN, &DARK_OAK];
    let mut y = 0.0;
    for _ in 0..count {
        let size = DVec3::new(rng.range(0.2, 0.26), rng.range(0.028, 0.05), rng.range(0.15, 0.19));
        let binding = BINDINGS[rng.below(5) as usize];
        obj.at(placed(DVec3::Y * y, rng.range(-14.0, 14.0)), |obj| hardback(obj, binding, size));
        y += size.y + 0.001;
    }
}

/// A closed book lying on y = 0, its spine at +z; `size` is length, thickness, width.
fn hardback(obj: &mut Obj, binding: &'static Paint, size: DVec3) {
    const BOARD: f64 = 0.004;
    const INSET: f64 = 0.006;
    let (x, z) = (size.x * 0.5, size.z * 0.5);
    for y in [0.0, size.y - BOARD] {
        block(obj, binding, [DVec3::new(-x, y, -z), DVec3::new(x, y + BOARD, z)], 0.3, side::ALL);
    }
    let inside = [BOARD, size.y - BOARD];
    let sides = side::BIT[0] | side::BIT[1] | side::BIT[4];
    let pages = [DVec3::new(INSET - x, inside[0], INSET - z), DVec3::new(x - INSET, inside[1], z - BOARD)];
    block(obj, &PAGE_EDGE, pages, 0.3, sides);
    let spine = [DVec3::new(-x, inside[0], z - BOARD), DVec3::new(x, inside[1], z)];
    block(obj, binding, spine, 0.3, sides | side::BIT[5]);
}

/// A rug of `width` × `length`, 12 mm thick, along z.
pub fn rug(obj: &mut Obj, width: f64, length: f64) {
    const THICK: f64 = 0.012;
    let (us, vs) = (linspace(0.0, 1.0, (width / 0.16) as usize), linspace(0.0, 1.0, (length / 0.16) as usize));
    let p = |u: f64, v: f64| DVec3::new((u - 0.5) * width, THICK, (0.5 - v) * length);
    surface(obj, &RUG, [&us, &vs], DVec2::ONE, p);
    let (x, z) = (width * 0.5, length * 0.5);
    let sides = side::BIT[0] | side::BIT[1] | side::BIT[4] | side::BIT[5];
    block(obj, &FRINGE, [DVec3::new(-x, 0.0, -z), DVec3::new(x, THICK, z)], 0.3, sides);
}

/// The armillary sphere on its stand; its centre is at height 1.75.
pub fn armillary(obj: &mut Obj) {
    let stand = [
        (0.42, 0.0),
        (0.42, 0.06),
        (0.36, 0.1),
        (0.16, 0.14),
        (0.09, 0.22),
        (0.07, 0.4),
        (0.12, 0.5),
        (0.07, 0.6),
        (0.06, 0.8),
        (0.1, 0.86),
        (0.05, 0.9),
        (0.0, 0.9),
    ];
    lathe(obj, &DARK_OAK, &stand, 24);
    obj.offset(DVec3::Y * 1.75, |obj| {
        let pole = DVec3::new(0.4, 0.917, 0.0);
        for (axis, radius, thickness) in [
            (DVec3::Z, 0.8, 0.024),
            (DVec3::Y, 0.86, 0.028),
            (pole, 0.76, 0.018),
            (DVec3::new(0.0, 0.92, 0.39), 0.7, 0.016),
            (DVec3::new(0.917, -0.4, 0.0), 0.66, 0.014),
            (DVec3::new(0.3, 0.2, 0.9), 0.6, 0.014),
        ] {
            hoop(obj, &BRASS, axis, radius, thickness, [40, 6]);
        }
        for (axis, height, radius) in [(pole, 0.45, 0.62), (pole, -0.45, 0.62)] {
            obj.offset(pole * height, |obj| hoop(obj, &BRASS, axis, radius, 0.012, [40, 5]));
        }
        rod(obj, &IRON, [pole * -0.84, pole * -0.2], 0.012, 6);
        rod(obj, &IRON, [pole * 0.2, pole * 0.84], 0.012, 6);
    });
    for k in 0..4 {
        let (s, c) = (FRAC_PI_2 * f64::from(k) + 0.4).sin_cos();
        let path: Vec<DVec3> = linspace(0.0, 1.0, 8)
            .iter()
            .map(|t| {
                DVec3::new(
                    c * (0.05 + 0.81 * (t * FRAC_PI_2).sin()),
                    0.87 + 0.88 * (1.0 - (t * FRAC_PI_2).cos()),
                    s * (0.05 + 0.81 * (t * FRAC_PI_2).sin()),
                )
            })
            .collect();
        tube(obj, &BRASS, &path, 0.018, 6, false);
    }
}

/// A palm in a pot: arching stems with cut-out leaves on both sides.
pub fn palm(obj: &mut Obj, rng: &mut Rng, stems: usize) {
    let pot = [(0.14, 0.0), (0.19, 0.26), (0.215, 0.27), (0.215, 0.33), (0.19, 0.33), (0.18, 0.29), (0.0, 0.29)];
    lathe(obj, &TERRACOTTA, &pot[..6], 18);
    lathe(obj, &SOIL, &pot[5..], 18);
    for k in 0..stems {
        let turn = TAU * (k as f64 + rng.range(0.0, 0.6)) / stems as f64;
        let (s, c) = turn.sin_cos();
        let out = DVec3::new(c, 0.0, -s);
        let (reach, height) = (rng.range(0.35, 0.75), rng.range(0.7, 1.5));
        let stem = |t: f64| out * (0.05 + reach * t * t) + DVec3::Y * (0.29 + height * (t - 0.28 * t * t * t));
        let path: Vec<DVec3> = linspace(0.0, 1.0, 7).iter().map(|&t| stem(t)).collect();
        tube(obj, &STEM, &path, 0.009, 5, false);
        for i in 0..9 {
            let t = 0.35 + 0.65 * f64::from(i) / 8.0;
            let along = (stem(t + 0.02) - stem(t - 0.02)).normalize();
            let across = along.cross(DVec3::Y).normalize_or(DVec3::X);
            for s in [-1.0, 1.0] {
                let length = 0.34 * (1.15 - 0.55 * t) * rng.range(0.85, 1.1);
                let aim = (across * s + along * 0.7 + DVec3::Y * rng.range(-0.1, 0.25)).normalize();
                leaf(obj, stem(t), aim, along, length);
            }
        }
    }
}

/// A drooping leaf of cut-out quads, seen from both sides.
fn leaf(obj: &mut Obj, root: DVec3, aim: DVec3, up: DVec3, length: f64) {
    let width = aim.cross(up).cross(aim).normalize_or(DVec3::Y) * length * 0.17;
    let p = |u: f64, v: f64| root + aim * (length * v) - DVec3::Y * (0.35 * length * v * v) + width * (2.0 * u - 1.0);
    surface(obj, &LEAF, [&[0.0, 1.0], &linspace(0.0, 1.0, 3)], DVec2::ONE, p);
}

/// A framed picture of `size` in the plane z = 0 facing +z, centred on the origin.
pub fn painting(obj: &mut Obj, paint: &'static Paint, size: DVec2) {
    let (w, h, b) = (size.x * 0.5, size.y * 0.5, 0.09);
    let p = |u: f64, v: f64| DVec3::new((u - 0.5) * size.x, (v - 0.5) * size.y, 0.02);
    surface(obj, paint, [&linspace(0.0, 1.0, 8), &linspace(0.0, 1.0, 6)], DVec2::ONE, p);
    let bars = [
        ([-w - b, -h - b], [w + b, -h]),
        ([-w - b, h], [w + b, h + b]),
        ([-w - b, -h], [-w, h]),
        ([w, -h], [w + b, h]),
    ];
    for (lo, hi) in bars {
        let ends = [DVec3::new(lo[0], lo[1], 0.0), DVec3::new(hi[0], hi[1], 0.06)];
        block(obj, &BRASS, ends, 0.25, side::ALL & !side::BIT[4]);
    }
}

/// A folding screen of three rattan leaves, each 0.6 × 1.7 m, along local x.
pub fn screen(obj: &mut Obj) {
    for k in 0..3 {
        let turn = if k % 2 == 0 { 24.0 } else { -24.0 };
        let hinge = DVec3::new(0.56 * f64::from(k), 0.0, if k % 2 == 0 { 0.0 } else { -0.244 });
        obj.at(placed(hinge, turn), |obj| {
            for x in [0.0, 0.56] {
                standing(obj, &DARK_OAK, DVec3::new(x + 0.015, 0.0, 0.0), DVec3::new(0.03, 1.7, 0.03), 0.5);
            }
            for y in [0.12, 1.64] {
                block(obj, &DARK_OAK, [DVec3::new(0.03, y, -0.015), DVec3::new(0.56, y + 0.04, 0.015)], 0.6, side::ALL);
            }
            let p = |u: f64, v: f64| DVec3::new(0.03 + 0.53 * u, 0.16 + 1.48 * v, 0.0);
            surface(obj, &RATTAN, [&linspace(0.0, 1.0, 3), &linspace(0.0, 1.0, 8)], DVec2::new(4.0, 11.0), p);
        });
    }
}

/// A cloth hanging in folds from a rod at height 7.2, its pattern on both sides, in the plane z = 0.
pub fn tapestry(obj: &mut Obj) {
    let (width, top, bottom) = (1.15, 7.2, 4.7);
    rod(obj, &BRASS, [DVec3::new(-0.68, top, 0.06), DVec3::new(0.68, top, 0.06)], 0.022, 8);
    let p = |u: f64, v: f64| {
        let fold = (1.0 - 0.5 * v) * 0.045 * (u * 5.0 * PI).cos();
        DVec3::new((u - 0.5) * width, bottom + (top - bottom - 0.02) * v, 0.06 + fold)
    };
    surface(obj, &RUG, [&linspace(0.0, 1.0, 24), &linspace(0.0, 1.0, 10)], DVec2::ONE, p);
}

/// A chain of oval links hanging from `top` down to `bottom`.
pub fn chain(obj: &mut Obj, top: DVec3, bottom: f64) {
    const LINK: f64 = 0.13;
    let count = ((top.y - bottom) / LINK).round().max(1.0) as usize;
    let pitch = (top.y - bottom) / count as f64;
    for i in 0..count {
        let side = if i % 2 == 0 { DVec3::X } else { DVec3::Z };
        let centre = top - DVec3::Y * (pitch * (i as f64 + 0.5));
        let path: Vec<DVec3> = (0..8)
            .map(|k| {
                let (s, c) = (TAU * f64::from(k) / 8.0).sin_cos();
                centre + DVec3::Y * (c * (pitch * 0.5 + 0.008)) + side * (s * 0.03)
            })
            .collect();
        tube(obj, &BRASS, &path, 0.009, 3, true);
    }
}

/// A library globe on a turned stand.
pub fn globe(obj: &mut Obj) {
    let stand = [
        (0.24, 0.0),
        (0.24, 0.03),
        (0.08, 0.07),
        (0.04, 0.14),
        (0.06, 0.3),
        (0.03, 0.4),
        (0.03, 0.5),
        (0.06, 0.52),
        (0.0, 0.53),
    ];
    lathe(obj, &DARK_OAK, &stand, 16);
    obj.offset(DVec3::Y * 0.86, |obj| {
        // A lathe counts v in metres: the map must cover the whole height once.
        let ts = linspace(0.0, 1.0, 14);
        let us = linspace(0.0, 1.0, 24);
        surface(obj, &GLOBE, [&us, &ts], DVec2::ONE, |u, v| {
            let ((s, c), (sv, cv)) = ((u * TAU).sin_cos(), (v * PI).sin_cos());
            DVec3::new(sv * c, -cv, -sv * s) * 0.3
        });
        hoop(obj, &BRASS, DVec3::Y, 0.34, 0.014, [32, 6]);
        hoop(obj, &BRASS, DVec3::X, 0.33, 0.012, [32, 6]);
    });
    for k in 0..3 {
        let (s, c) = (TAU * f64::from(k) / 3.0).sin_cos();
        rod(obj, &BRASS, [DVec3::new(c * 0.05, 0.48, s * 0.05), DVec3::new(c * 0.34, 0.85, s * 0.34)], 0.012, 6);
    }
}

/// A tall vase on a plinth.
pub fn vase(obj: &mut Obj) {
    standing(obj, &DARK_OAK, DVec3::ZERO, DVec3::new(0.36, 0.7, 0.36), 0.2);
    obj.offset(DVec3::Y * 0.7, |obj| {
        let profile = [
            (0.09, 0.0),
            (0.1, 0.02),
            (0.16, 0.14),
            (0.19, 0.26),
            (0.17, 0.38),
            (0.1, 0.47),
            (0.065, 0.53),
            (0.07, 0.56),
            (0.1, 0.6),
            (0.09, 0.6),
            (0.045, 0.53),
            (0.0, 0.5),
        ];
        lathe(obj, &GLAZE, &profile, 24);
    });
}
