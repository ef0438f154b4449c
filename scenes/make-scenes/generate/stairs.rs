//! The gallery's balustrade and the spiral stair.

use super::hall::{BAY, BAYS, END, GALLERY};
use super::obj::{Corner, Obj};
use super::paint::{BRASS, DARK_OAK, IRON, Paint};
use super::shapes::{block, lathe, linspace, rod, side, sphere, steps, surface, tube};
use glam::{DVec2, DVec3};

/// Axis of the spiral stair.
pub const AXIS: DVec3 = DVec3::new(2.95, 0.0, -6.4);
const RADIUS: f64 = 1.15;
const TREADS: usize = 19;
/// Angles in degrees from east, turning north: of the first riser, and of one tread.
const START: f64 = 28.0;
const SWEEP: f64 = 16.0;
/// Stretch of the gallery where the stair arrives.
const LANDING: [f64; 2] = [-7.0, -5.8];

/// The balustrade between the columns of the upper arcade.
pub fn balustrade(obj: &mut Obj) {
    for i in 0..BAYS {
        let z = -END + i as f64 * BAY;
        let (a, b) =
            (if i == 0 { z + 0.3 } else { z + 0.2 }, if i + 1 == BAYS { z + BAY - 0.3 } else { z + BAY - 0.2 });
        if i == 0 {
            stretch(obj, a, LANDING[0]);
            stretch(obj, LANDING[1], b);
        } else {
            stretch(obj, a, b);
        }
    }
}

fn stretch(obj: &mut Obj, a: f64, b: f64) {
    let rail = |obj: &mut Obj, y: [f64; 2], half: f64| {
        block(obj, &DARK_OAK, [DVec3::new(4.4 - half, y[0], a), DVec3::new(4.4 + half, y[1], b)], 0.3, side::ALL);
    };
    rail(obj, [GALLERY + 0.05, GALLERY + 0.1], 0.05);
    rail(obj, [GALLERY + 0.92, GALLERY + 0.99], 0.06);
    let profile = [(0.02, 0.0), (0.032, 0.06), (0.02, 0.2), (0.042, 0.36), (0.016, 0.66), (0.028, 0.76), (0.02, 0.82)];
    let spots = steps(a, b, 0.2);
    for pair in spots.windows(2) {
        obj.offset(DVec3::new(4.4, GALLERY + 0.1, (pair[0] + pair[1]) * 0.5), |obj| lathe(obj, &DARK_OAK, &profile, 6));
    }
}

/// Point about the stair's axis at `degrees`, radius and height.
fn about(degrees: f64, r: f64, y: f64) -> DVec3 {
    let (s, c) = degrees.to_radians().sin_cos();
    AXIS + DVec3::new(r * c, y, -r * s)
}

/// The spiral stair from the floor to the gallery.
pub fn spiral(obj: &mut Obj) {
    let rise = GALLERY / (TREADS + 1) as f64;
    obj.offset(AXIS, |obj| {
        lathe(
            obj,
            &IRON,
            &[(0.2, 0.0), (0.2, 0.04), (0.09, 0.07), (0.06, 0.1), (0.06, 2.0), (0.06, 4.95), (0.0, 4.95)],
            12,
        );
        obj.offset(DVec3::Y * 5.02, |obj| sphere(obj, &BRASS, 0.1, 12, 8));
    });
    for i in 0..TREADS {
        let (a, y) = (START + SWEEP * i as f64, rise * (i + 1) as f64);
        tread(obj, a, y);
        let foot = about(a + SWEEP * 0.5, RADIUS - 0.05, y);
        rod(obj, &IRON, [foot, foot + DVec3::Y * 0.92], 0.011, 5);
    }
    let helix = |extra: f64| -> Vec<DVec3> {
        linspace(0.0, TREADS as f64, TREADS * 3)
            .iter()
            .map(|t| about(START + SWEEP * t, RADIUS - 0.05, rise * (t + 0.5) + extra))
            .collect()
    };
    tube(obj, &BRASS, &helix(0.93), 0.028, 8, false);
    stringer(obj, rise);
    landing(obj);
}

/// A wedge of oak, 4.5 cm thick.
fn tread(obj: &mut Obj, start: f64, top: f64) {
    let mut outline = vec![about(start, 0.055, top), about(start, 0.6, top)];
    outline.extend(linspace(start - 1.5, start + SWEEP + 1.5, 3).iter().map(|&a| about(a, RADIUS - 0.02, top)));
    outline.extend([about(start + SWEEP, 0.6, top), about(start + SWEEP, 0.055, top)]);
    prism(obj, &DARK_OAK, &outline, 0.045);
}

/// Extrudes an outline, counter-clockwise from above, downwards.
fn prism(obj: &mut Obj, paint: &'static Paint, outline: &[DVec3], depth: f64) {
    let down = DVec3::Y * depth;
    // A fan of quads about the middle of the inner edge keeps every piece convex.
    let n = outline.len();
    for k in 0..n / 2 {
        let (a, b, c, d) = (outline[k], outline[k + 1], outline[n - 2 - k], outline[n - 1 - k]);
        if k + 1 < n - 1 - k {
            obj.flat(paint, &[a, b, c, d]);
            obj.flat(paint, &[d - down, c - down, b - down, a - down]);
        }
    }
    for i in 0..n {
        let (a, b) = (outline[i], outline[(i + 1) % n]);
        obj.flat(paint, &[a - down, b - down, b, a]);
    }
}

/// The curved string outside the treads: a band with two smooth sides.
fn stringer(obj: &mut Obj, rise: f64) {
    let ts = linspace(0.0, 1.0, TREADS * 3);
    for (r, outward) in [(RADIUS, true), (RADIUS - 0.02, false)] {
        let p = |t: f64, v: f64| {
            let k = t * TREADS as f64;
            about(START + SWEEP * k, r, rise * (k + 0.5) - 0.16 + v * 0.26)
        };
        if outward {
            surface(obj, &IRON, [&ts, &[0.0, 1.0]], DVec2::ONE, p);
        } else {
            surface(obj, &IRON, [&ts, &[0.0, 1.0]], DVec2::ONE, |t, v| p(t, 1.0 - v));
        }
    }
    for t in ts.windows(2) {
        for (v, flip) in [(0.1, false), (-0.16, true)] {
            let at = |t: f64, r: f64| {
                let k = t * TREADS as f64;
                about(START + SWEEP * k, r, rise * (k + 0.5) + v)
            };
            let mut cell = [at(t[0], RADIUS), at(t[1], RADIUS), at(t[1], RADIUS - 0.02), at(t[0], RADIUS - 0.02)];
            if flip {
                cell.reverse();
            }
            let n = if flip { DVec3::NEG_Y } else { DVec3::Y };
            obj.face(&IRON, &cell.map(|p| Corner { p, n, uv: DVec2::ZERO }));
        }
    }
    for (t, flip) in [(0.0, false), (TREADS as f64, true)] {
        let at = |r: f64, v: f64| about(START + SWEEP * t, r, rise * (t + 0.5) + v);
        let mut end = [at(RADIUS - 0.02, -0.16), at(RADIUS, -0.16), at(RADIUS, 0.1), at(RADIUS - 0.02, 0.1)];
        if flip {
            end.reverse();
        }
        obj.flat(&IRON, &end);
    }
}

/// The platform that joins the last tread to the gallery, with a rail on either side.
fn landing(obj: &mut Obj) {
    let (x0, x1) = (AXIS.x + 0.06, 4.2);
    let lo = DVec3::new(x0, GALLERY - 0.08, LANDING[0]);
    block(obj, &DARK_OAK, [lo, DVec3::new(x1, GALLERY, LANDING[1])], 0.2, side::ALL & !side::BIT[1]);
    for z in [LANDING[0] + 0.03, LANDING[1] - 0.03] {
        // The last tread arrives from the south: that side stays open next to the axis.
        let from = if z > AXIS.z { x0 + 0.75 } else { x0 + 0.03 };
        let ends = [DVec3::new(from, GALLERY + 0.93, z), DVec3::new(4.34, GALLERY + 0.93, z)];
        rod(obj, &BRASS, ends, 0.026, 8);
        for x in steps(from, 4.2, 0.16) {
            rod(obj, &IRON, [DVec3::new(x, GALLERY, z), DVec3::new(x, GALLERY + 0.93, z)], 0.011, 5);
        }
    }
}
