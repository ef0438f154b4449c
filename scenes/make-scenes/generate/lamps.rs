//! The hundred lights: ten strong, ninety small. Emitting meshes of the small ones go to a mesh of their own.

use super::furniture::{TABLE, chain};
use super::hall::{ARCADE, BAY, BAYS, EAST, END, GALLERY, NAVE, ROSE, bay_centre};
use super::obj::{Corner, Obj};
use super::paint::{
    ALABASTER, BRASS, BULB, FAIRY, FIRE, FLAME, IRON, LANTERN, NIGHT_SKY, ROSE_GLASS, STONE, STRIP, WAX,
};
use super::shapes::{block, hoop, lathe, lattice, linspace, rod, side, sphere, surface, tube};
use super::toml::Light;
use glam::{DVec2, DVec3};
use std::f64::consts::{PI, TAU};

/// Pendant globes: north, middle, south.
const PENDANTS: [f64; 3] = [-5.2, 0.0, 5.2];
const PENDANT_HEIGHT: f64 = 6.3;

/// Where the table lamps stand, for [`super::library`] to put the lamps there.
#[must_use]
pub fn desk_lamps() -> Vec<DVec3> {
    let mut spots = Vec::new();
    for centre in super::library::TABLES {
        for (x, z) in [(-0.2, -1.1), (0.2, -0.35), (-0.2, 0.4), (0.2, 1.1)] {
            spots.push(DVec3::new(x, TABLE, centre + z));
        }
    }
    spots
}

/// Rose window, night sky, fire, and three alabaster globes: with the four of [`strong_lights`], ten.
pub fn strong_meshes(obj: &mut Obj) {
    rose(obj);
    // Low enough that the moon shines in over it.
    let (zs, ys) = (linspace(-13.0, 13.0, 2), [-1.0, 5.4]);
    let p = |u: f64, v: f64| DVec3::new(-12.0, ys[0] + (ys[1] - ys[0]) * v, zs[2] - (zs[2] - zs[0]) * u);
    surface(obj, &NIGHT_SKY, [&linspace(0.0, 1.0, 2), &[0.0, 1.0]], DVec2::ONE, p);
    obj.offset(DVec3::new(0.0, 0.26, -END + 0.35), |obj| {
        // A wind-blown tongue of fire in 64 triangles.
        let p = |u: f64, v: f64| {
            let (s, c) = (u * TAU).sin_cos();
            let r = 0.3 * (v * PI).sin().max(0.0) * (1.0 - v) * (1.0 + 0.25 * (3.0 * u * TAU).sin());
            DVec3::new(1.5 * r * c + 0.07 * (4.0 * v).sin(), 0.62 * v, -r * s)
        };
        surface(obj, &FIRE, [&linspace(0.0, 1.0, 8), &[0.0, 0.1, 0.25, 0.45, 0.7, 1.0]], DVec2::ONE, p);
    });
    for z in PENDANTS {
        let centre = DVec3::new(0.0, PENDANT_HEIGHT, z);
        obj.offset(centre, |obj| {
            sphere(obj, &ALABASTER, 0.3, 8, 5);
            hoop(obj, &BRASS, DVec3::Y, 0.325, 0.018, [24, 6]);
            for k in 0..3 {
                let (s, c) = (TAU * f64::from(k) / 3.0).sin_cos();
                rod(obj, &BRASS, [DVec3::new(c, 0.0, s) * 0.325, DVec3::Y * 0.62], 0.008, 5);
            }
        });
        chain(obj, DVec3::new(0.0, 11.0, z), PENDANT_HEIGHT + 0.6);
    }
}

/// The rose: a glowing disc with turned stone mouldings around it.
fn rose(obj: &mut Obj) {
    let centre = DVec3::new(0.0, ROSE.0, -END);
    obj.offset(centre, |obj| {
        glass(obj);
        for (radius, thickness, z) in [(ROSE.1 + 0.02, 0.11, 0.05), (ROSE.1 + 0.2, 0.06, 0.03)] {
            obj.offset(DVec3::Z * z, |obj| hoop(obj, &STONE, DVec3::Z, radius, thickness, [56, 8]));
        }
    });
}

/// The disc of the rose in 48 triangles, its texture across the whole.
fn glass(obj: &mut Obj) {
    let corner = |k: usize, r: f64| {
        let (s, c) = (TAU * k as f64 / 16.0).sin_cos();
        let p = DVec3::new(c * r * ROSE.1, s * r * ROSE.1, 0.02);
        Corner { p, n: DVec3::Z, uv: DVec2::new(c, s) * r * 0.5 + DVec2::splat(0.5) }
    };
    for k in 0..16 {
        obj.face(&ROSE_GLASS, &[corner(k, 0.0), corner(k, 0.5), corner(k + 1, 0.5)]);
        obj.face(&ROSE_GLASS, &[corner(k, 0.5), corner(k, 1.0), corner(k + 1, 1.0), corner(k + 1, 0.5)]);
    }
}

/// The strong lights without geometry.
#[must_use]
pub fn strong_lights() -> Vec<Light> {
    let d = DVec3::new;
    vec![
        Light::directional("moon", d(0.66, -0.55, 0.34), d(5.0, 6.9, 11.2)),
        Light::point("armillary", d(0.0, 1.75, 0.0), d(12.0, 8.0, 4.0)),
        Light::spot("stair", d(2.2, 8.6, -4.6), d(0.13, -1.0, -0.32), d(150.0, 106.0, 62.0), [12.0, 24.0]),
        Light::spot("south_wall", d(0.0, 8.4, 1.5), d(0.0, -0.62, 1.0), d(38.0, 44.0, 60.0), [20.0, 38.0]),
    ]
}

/// The bodies that carry small lights: candlesticks, lanterns, wires.
pub fn fittings(obj: &mut Obj) {
    for at in candles() {
        candle(obj, at);
    }
    for at in lanterns() {
        lantern_frame(obj, at);
    }
    for i in 0..BAYS {
        tube(obj, &IRON, &swag(i, 20), 0.006, 4, false);
    }
}

/// The meshes of the small area lights: 8 bulbs, 20 flames, 10 lanterns, 25 fairy lights, 10 strips.
pub fn small_meshes(obj: &mut Obj) {
    for at in desk_lamps() {
        obj.offset(at + DVec3::Y * 0.375, |obj| sphere(obj, &BULB, 0.036, 6, 4));
    }
    for at in candles() {
        obj.offset(at + DVec3::Y * 0.17, |obj| {
            lathe(obj, &FLAME, &[(0.0, 0.0), (0.013, 0.016), (0.01, 0.036), (0.0, 0.07)], 6)
        });
    }
    for at in lanterns() {
        let size = DVec3::new(0.07, 0.11, 0.07);
        obj.offset(at, |obj| block(obj, &LANTERN, [-size, size], 1.0, side::ALL));
    }
    for i in 0..BAYS {
        for at in swag(i, 6).iter().take(6).skip(1) {
            obj.offset(*at - DVec3::Y * 0.035, |obj| sphere(obj, &FAIRY, 0.03, 6, 4));
        }
    }
    for i in 0..BAYS {
        for y in [2.77, GALLERY + 2.37] {
            // On the inner side of the valance, facing the books.
            let (z, ys) = (bay_centre(i), [y - 0.085, y - 0.035]);
            lattice(
                obj,
                &STRIP,
                [DVec3::X * (EAST - 0.638), DVec3::Y, DVec3::Z],
                [&ys, &[z - 1.1, z + 1.1]],
                |_, _| true,
            );
        }
    }
}

/// Feet of the twenty candles: five on either end of the mantel, two on every window sill.
fn candles() -> Vec<DVec3> {
    let mut feet = Vec::new();
    for s in [-1.0, 1.0] {
        for k in 0..5 {
            let k = f64::from(k);
            feet.push(DVec3::new(s * (0.75 + 0.14 * k), 2.0, -END + 0.3 + 0.2 * (k % 2.0)));
        }
    }
    for i in 0..BAYS {
        for dz in [-0.5, 0.46] {
            feet.push(DVec3::new(-NAVE - 0.12, 1.2, bay_centre(i) + dz));
        }
    }
    feet
}

/// A candle 14 cm high in a brass dish.
fn candle(obj: &mut Obj, at: DVec3) {
    obj.offset(at, |obj| {
        lathe(obj, &BRASS, &[(0.045, 0.0), (0.055, 0.012), (0.03, 0.012), (0.022, 0.02)], 10);
        lathe(obj, &WAX, &[(0.021, 0.012), (0.02, 0.15), (0.012, 0.146), (0.0, 0.144)], 10);
        rod(obj, &IRON, [DVec3::Y * 0.144, DVec3::Y * 0.168], 0.002, 3);
    });
}

/// Centres of the ten lanterns: one a bay in the aisle and one above it in the gallery.
fn lanterns() -> Vec<DVec3> {
    let x = (ARCADE + EAST) * 0.5 - 0.1;
    (0..BAYS).flat_map(|i| [DVec3::new(x, 2.75, bay_centre(i)), DVec3::new(x, 6.0, bay_centre(i))]).collect()
}

/// An iron cage with a roof, hung on a chain.
fn lantern_frame(obj: &mut Obj, at: DVec3) {
    let ceiling = if at.y < GALLERY { GALLERY - 0.2 } else { 6.8 };
    obj.offset(at, |obj| {
        for (x, z) in [(-0.1, -0.1), (-0.1, 0.1), (0.1, -0.1), (0.1, 0.1)] {
            block(
                obj,
                &IRON,
                [DVec3::new(x - 0.007, -0.15, z - 0.007), DVec3::new(x + 0.007, 0.16, z + 0.007)],
                1.0,
                side::ALL,
            );
        }
        block(obj, &IRON, [DVec3::new(-0.115, -0.165, -0.115), DVec3::new(0.115, -0.15, 0.115)], 0.3, side::ALL);
        lathe(obj, &IRON, &[(0.0, 0.16), (0.17, 0.16), (0.165, 0.175), (0.03, 0.27), (0.012, 0.3), (0.0, 0.3)], 4);
    });
    chain(obj, DVec3::new(at.x, ceiling, at.z), at.y + 0.29);
}

/// A string of lights hanging across a bay of the gallery's front, in `count` pieces.
fn swag(bay: usize, count: usize) -> Vec<DVec3> {
    linspace(0.0, 1.0, count)
        .iter()
        .map(|t| {
            let z = -END + (bay as f64 + 0.5) * BAY + (t - 0.5) * (BAY - 0.3);
            DVec3::new(NAVE - 0.07, 4.0 - 0.28 * 4.0 * t * (1.0 - t), z)
        })
        .collect()
}

/// The small lights without geometry: six picture lights, eleven points.
#[must_use]
pub fn small_lights() -> Vec<Light> {
    let d = DVec3::new;
    let warm = d(1.0, 0.68, 0.38);
    let mut lights = Vec::new();
    for (i, (place, _, facing)) in super::library::paintings().into_iter().enumerate() {
        let from = place + facing * 0.9 + DVec3::Y * 1.5;
        let aim = (place - DVec3::Y * 0.1 - from).normalize();
        lights.push(Light::spot(&format!("picture_{}", i + 1), from, aim, warm * 9.0, [18.0, 34.0]));
    }
    for (i, at) in super::library::palms().into_iter().enumerate() {
        lights.push(Light::point(&format!("palm_{}", i + 1), at + d(0.42, 0.12, 0.3), d(0.55, 0.48, 0.26)));
    }
    let others = [
        ("under_stair", d(2.4, 0.3, -5.9), warm * 0.9),
        ("screen", d(3.6, 0.9, 7.4), d(0.9, 0.55, 0.26)),
        ("nook", d(-3.3, 1.9, 6.9), warm * 0.8),
        ("gallery_south", d(5.8, 5.0, 7.3), warm * 0.7),
        ("gallery_north", d(5.8, 5.0, -7.3), warm * 0.7),
        ("aisle_south", d(5.8, 0.8, 7.3), warm * 0.6),
        ("aisle_north", d(5.8, 0.8, -7.3), warm * 0.6),
    ];
    lights.extend(others.into_iter().map(|(name, at, power)| Light::point(name, at, power)));
    lights
}
