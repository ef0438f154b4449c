//! Procedural textures: colours are written in sRGB code values, v grows upwards.

use super::rng::hash;
use glam::{DVec2, DVec3};
use image::{GrayImage, ImageFormat, Luma, Rgb, RgbImage};
use std::f64::consts::{PI, TAU};
use std::io::Cursor;

/// A texture: its file name and its PNG.
pub struct Picture {
    /// File name under `textures/`.
    pub name: &'static str,
    /// The encoded file.
    pub png: Vec<u8>,
}

fn colour(name: &'static str, [width, height]: [u32; 2], f: impl Fn(DVec2) -> DVec3) -> image::ImageResult<Picture> {
    let image = RgbImage::from_fn(width, height, |x, y| {
        let c = f(texel_uv(x, y, [width, height])).clamp(DVec3::ZERO, DVec3::ONE) * 255.0;
        // 64 levels a channel: no banding is seen under noise, and the files halve.
        Rgb(c.to_array().map(|v| (v / 4.0).round().min(63.0) as u8 * 4))
    });
    let mut png = Cursor::new(Vec::new());
    image.write_to(&mut png, ImageFormat::Png)?;
    Ok(Picture { name, png: png.into_inner() })
}

fn mask(name: &'static str, size: u32, opaque: impl Fn(DVec2) -> f64) -> image::ImageResult<Picture> {
    let image = GrayImage::from_fn(size, size, |x, y| {
        // Signed distance, in texels around the edge: bilinear filtering then cuts a smooth outline.
        Luma([((opaque(texel_uv(x, y, [size, size])) * f64::from(size) * 0.5 + 0.5).clamp(0.0, 1.0) * 255.0) as u8])
    });
    let mut png = Cursor::new(Vec::new());
    image.write_to(&mut png, ImageFormat::Png)?;
    Ok(Picture { name, png: png.into_inner() })
}

fn texel_uv(x: u32, y: u32, [width, height]: [u32; 2]) -> DVec2 {
    DVec2::new((f64::from(x) + 0.5) / f64::from(width), 1.0 - (f64::from(y) + 0.5) / f64::from(height))
}

/// Value noise with period `period`, smooth, in [0, 1].
fn noise(p: DVec2, period: i64, salt: u64) -> f64 {
    let cell = p.floor();
    let f = p - cell;
    let f = f * f * (DVec2::splat(3.0) - 2.0 * f);
    let at =
        |dx: i64, dy: i64| hash((cell.x as i64 + dx).rem_euclid(period), (cell.y as i64 + dy).rem_euclid(period), salt);
    let low = at(0, 0) + (at(1, 0) - at(0, 0)) * f.x;
    let high = at(0, 1) + (at(1, 1) - at(0, 1)) * f.x;
    low + (high - low) * f.y
}

/// Four octaves over the unit square, repeating; `base` cells in the first.
fn fractal(uv: DVec2, base: i64, salt: u64) -> f64 {
    (0..4).map(|o| noise(uv * (base << o) as f64, base << o, salt + o) * 0.5f64.powi(o as i32 + 1)).sum::<f64>()
        / 0.9375
}

fn mix(a: DVec3, b: DVec3, t: f64) -> DVec3 {
    a.lerp(b, t.clamp(0.0, 1.0))
}

fn smooth(a: f64, b: f64, x: f64) -> f64 {
    let t = ((x - a) / (b - a)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

const fn rgb(r: f64, g: f64, b: f64) -> DVec3 {
    DVec3::new(r, g, b)
}

/// All textures of the library.
///
/// # Errors
/// If a PNG cannot be encoded.
pub fn all() -> image::ImageResult<Vec<Picture>> {
    Ok(vec![
        colour("flags.png", [512, 512], flags)?,
        colour("planks.png", [256, 256], planks)?,
        colour("plaster.png", [256, 256], plaster)?,
        colour("stone.png", [256, 256], stone)?,
        colour("stars.png", [256, 256], stars)?,
        colour("oak.png", [256, 256], oak)?,
        colour("books.png", [256, 256], books)?,
        colour("pages.png", [128, 128], pages)?,
        colour("rug.png", [256, 512], rug)?,
        colour("brick.png", [128, 128], brick)?,
        colour("leaf.png", [64, 64], leaf)?,
        mask("leaf_mask.png", 64, leaf_edge)?,
        mask("rattan_mask.png", 64, rattan_edge)?,
        colour("painting_moon.png", [256, 192], painting_moon)?,
        colour("painting_sun.png", [256, 192], painting_sun)?,
        colour("globe.png", [256, 128], globe)?,
        colour("rose.png", [512, 512], rose)?,
        colour("night.png", [512, 128], night)?,
    ])
}

fn flags(uv: DVec2) -> DVec3 {
    let cell = (uv * 4.0).floor();
    let inside = uv * 4.0 - cell;
    let turn = hash(cell.x as i64, cell.y as i64, 1) * 3.0;
    let vein = (fractal(uv + turn, 3, 2) * 9.0 + turn).sin().abs().powf(0.35);
    let dark = (cell.x + cell.y) as i64 % 2 == 0;
    let tone = if dark {
        mix(rgb(0.5, 0.42, 0.36), rgb(0.25, 0.2, 0.19), vein)
    } else {
        mix(rgb(0.72, 0.63, 0.52), rgb(0.88, 0.83, 0.73), vein)
    };
    let edge = inside.min(DVec2::ONE - inside).min_element();
    mix(rgb(0.3, 0.27, 0.24), tone * (0.93 + 0.1 * hash(cell.x as i64, cell.y as i64, 3)), smooth(0.008, 0.02, edge))
}

/// Wood grain along u.
fn grain(uv: DVec2, salt: u64) -> f64 {
    let bend = fractal(uv * DVec2::new(1.0, 1.0), 2, salt) * 3.0;
    let rings = (uv.y * 24.0 + bend * 2.4).sin() * 0.5 + 0.5;
    rings * 0.6 + noise(uv * DVec2::new(8.0, 128.0), 128, salt + 9) * 0.4
}

fn planks(uv: DVec2) -> DVec3 {
    let row = (uv.y * 8.0).floor();
    let shift = hash(row as i64, 0, 4);
    let along = (uv.x * 2.0 + shift).fract();
    let board = hash(row as i64, ((uv.x * 2.0 + shift).floor() as i64).rem_euclid(2), 5);
    let tone = mix(rgb(0.42, 0.26, 0.15), rgb(0.66, 0.45, 0.27), grain(uv + DVec2::splat(0.0), 6) * 0.6 + board * 0.5);
    let gap = (uv.y * 8.0).fract().min(1.0 - (uv.y * 8.0).fract()) * 0.5;
    tone * smooth(0.0, 0.03, gap.min(along.min(1.0 - along) * 4.0)).max(0.35)
}

fn oak(uv: DVec2) -> DVec3 {
    mix(rgb(0.4, 0.25, 0.14), rgb(0.62, 0.42, 0.25), grain(uv, 7))
}

fn plaster(uv: DVec2) -> DVec3 {
    mix(rgb(0.76, 0.68, 0.57), rgb(0.86, 0.79, 0.68), fractal(uv, 4, 8))
}

fn stone(uv: DVec2) -> DVec3 {
    let row = (uv.y * 4.0).floor();
    let x = uv.x * 2.0 + if row as i64 % 2 == 0 { 0.0 } else { 0.5 };
    let block = hash(x.floor() as i64 % 2, row as i64, 10);
    let tone = mix(rgb(0.68, 0.62, 0.53), rgb(0.82, 0.76, 0.66), fractal(uv, 8, 11) * 0.7 + block * 0.4);
    let joint = (x.fract().min(1.0 - x.fract()) * 0.5).min((uv.y * 4.0).fract().min(1.0 - (uv.y * 4.0).fract()) * 0.25);
    tone * (0.72 + 0.28 * smooth(0.004, 0.014, joint))
}

fn stars(uv: DVec2) -> DVec3 {
    let ground = mix(rgb(0.2, 0.29, 0.52), rgb(0.28, 0.38, 0.62), fractal(uv, 4, 12));
    let cell = (uv * 5.0).floor();
    let jitter = DVec2::new(hash(cell.x as i64, cell.y as i64, 13), hash(cell.x as i64, cell.y as i64, 14));
    let d = uv * 5.0 - cell - DVec2::splat(0.3) - jitter * 0.4;
    let size = 0.13 + 0.13 * hash(cell.x as i64, cell.y as i64, 15);
    let points = d.length() / (0.55 + 0.45 * (d.y.atan2(d.x) * 6.0).cos().max(-0.6));
    mix(rgb(0.98, 0.82, 0.42), ground, smooth(size * 0.8, size, points))
}

fn books(uv: DVec2) -> DVec3 {
    const LEATHER: [DVec3; 8] = [
        rgb(0.46, 0.13, 0.11),
        rgb(0.18, 0.27, 0.2),
        rgb(0.2, 0.25, 0.42),
        rgb(0.5, 0.33, 0.18),
        rgb(0.36, 0.22, 0.15),
        rgb(0.62, 0.52, 0.36),
        rgb(0.3, 0.15, 0.26),
        rgb(0.19, 0.37, 0.4),
    ];
    let cell = (uv * 8.0).floor();
    let f = uv * 8.0 - cell;
    let (i, j) = (cell.x as i64, cell.y as i64);
    let base = LEATHER[(i as usize + j as usize * 3) % 8]
        * (0.8 + 0.4 * hash(i, j, 16))
        * (0.9 + 0.2 * noise(f * 16.0, 64, 17));
    let gold = rgb(0.86, 0.68, 0.34);
    let bands = [0.1, 0.14, 0.62 + 0.1 * hash(i, j, 18), 0.86, 0.9];
    let band = bands.iter().any(|b| (f.y - b).abs() < 0.014);
    let label = hash(i, j, 19) > 0.5 && (f.y - 0.75).abs() < 0.07;
    let lettering = label && (f.x - 0.5).abs() < 0.32 && hash((f.x * 14.0) as i64, (f.y * 32.0) as i64, 20) > 0.45;
    match (band || lettering, label) {
        (true, _) => gold,
        (false, true) => base * 0.45,
        _ => base,
    }
}

fn pages(uv: DVec2) -> DVec3 {
    let paper = mix(rgb(0.9, 0.84, 0.71), rgb(0.95, 0.91, 0.8), fractal(uv, 4, 21));
    let line = (uv.y * 26.0).floor();
    let inside = (0.12..0.88).contains(&uv.x) && (0.1..0.9).contains(&uv.y);
    let last = 0.7 + 0.25 * hash(line as i64, 0, 22);
    let ink =
        inside && (uv.y * 26.0).fract() < 0.45 && uv.x < last && hash((uv.x * 60.0) as i64, line as i64, 23) > 0.22;
    if ink { paper * 0.35 } else { paper }
}

/// Border and three medallions of the rug; u across, v along (twice as long).
fn rug(uv: DVec2) -> DVec3 {
    let (red, navy, cream, gold) =
        (rgb(0.52, 0.13, 0.12), rgb(0.15, 0.18, 0.34), rgb(0.82, 0.74, 0.58), rgb(0.75, 0.52, 0.24));
    let p = DVec2::new(uv.x - 0.5, (uv.y - 0.5) * 2.0).abs();
    let inset = (0.5 - p.x).min(1.0 - p.y);
    // Warp and weft.
    let weave = if ((uv.x * 256.0) as i64 + (uv.y * 512.0) as i64) % 2 == 0 { 0.94 } else { 1.02 };
    let diamonds = |scale: f64| ((p.x * scale).fract() - 0.5).abs() + ((p.y * scale).fract() - 0.5).abs();
    let tone = if inset < 0.02 {
        navy
    } else if inset < 0.03 {
        gold
    } else if inset < 0.12 {
        if diamonds(11.0) < 0.28 {
            cream
        } else if diamonds(11.0) < 0.42 {
            red
        } else {
            navy
        }
    } else if inset < 0.135 {
        gold
    } else {
        medallions(p, [red, navy, cream, gold], diamonds(22.0))
    };
    tone * weave
}

fn medallions(p: DVec2, [red, navy, cream, gold]: [DVec3; 4], small: f64) -> DVec3 {
    let centre = if p.y < 0.3 { 0.0 } else { 0.56 };
    let d = DVec2::new(p.x, p.y - centre);
    let r = d.length() * (1.0 + 0.12 * (d.y.atan2(d.x) * 8.0).cos());
    match r {
        r if r < 0.06 => gold,
        r if r < 0.1 => navy,
        r if r < 0.12 => cream,
        r if r < 0.19 => {
            if small < 0.3 {
                gold
            } else {
                navy
            }
        }
        r if r < 0.21 => cream,
        _ if small < 0.16 => gold,
        _ => red,
    }
}

fn brick(uv: DVec2) -> DVec3 {
    let row = (uv.y * 8.0).floor();
    let x = uv.x * 4.0 + if row as i64 % 2 == 0 { 0.0 } else { 0.5 };
    let tone = mix(
        rgb(0.4, 0.2, 0.15),
        rgb(0.58, 0.32, 0.23),
        hash((x.floor() as i64).rem_euclid(4), row as i64, 25) * 0.7 + fractal(uv, 8, 26) * 0.3,
    );
    let joint = (x.fract().min(1.0 - x.fract()) * 2.0).min((uv.y * 8.0).fract().min(1.0 - (uv.y * 8.0).fract()));
    mix(rgb(0.55, 0.5, 0.45), tone, smooth(0.06, 0.14, joint))
}

fn leaf(uv: DVec2) -> DVec3 {
    let across = (uv.x - 0.5).abs();
    let vein = ((uv.y * 9.0 - across * 7.0).fract() - 0.5).abs();
    let tone = mix(rgb(0.16, 0.36, 0.13), rgb(0.3, 0.52, 0.2), uv.y * 0.6 + 0.4 * vein);
    if across < 0.02 { rgb(0.5, 0.65, 0.35) } else { tone }
}

/// A pointed leaf along v with a nibbled edge.
fn leaf_edge(uv: DVec2) -> f64 {
    let width = 0.42 * (PI * uv.y.powf(0.8)).sin() * (1.0 - 0.12 * ((uv.y * 44.0).sin() * 0.5 + 0.5));
    width - (uv.x - 0.5).abs()
}

/// A woven lattice: two families of diagonal bars.
fn rattan_edge(uv: DVec2) -> f64 {
    let bar = |t: f64| 0.085 - ((t * 2.0).rem_euclid(1.0) - 0.5).abs() * 0.5;
    bar(uv.x + uv.y).max(bar(uv.x - uv.y))
}

fn painting_moon(uv: DVec2) -> DVec3 {
    let sky = mix(rgb(0.3, 0.36, 0.5), rgb(0.06, 0.09, 0.22), uv.y + 0.2 * fractal(uv, 4, 27));
    let moon = (uv - DVec2::new(0.68, 0.72)).length();
    let sky = mix(rgb(0.97, 0.93, 0.78), sky + rgb(0.3, 0.28, 0.2) * (-moon * 5.0).exp(), smooth(0.07, 0.085, moon));
    (0..4).fold(sky, |back, layer| {
        let far = f64::from(layer);
        let ridge = 0.5 - 0.11 * far + 0.13 * (noise(DVec2::new(uv.x * (3.0 + far * 2.0), far), 64, 28) - 0.3);
        let tone = mix(rgb(0.28, 0.33, 0.42), rgb(0.06, 0.1, 0.09), far / 3.0);
        if uv.y < ridge { tone * (0.85 + 0.3 * fractal(uv * 1.0, 8, 29)) } else { back }
    })
}

fn painting_sun(uv: DVec2) -> DVec3 {
    let sea = uv.y < 0.38;
    let v = if sea { 0.76 - uv.y } else { uv.y };
    let cloud = fractal(DVec2::new(uv.x, v * 2.0), 4, 30);
    let sky = mix(rgb(0.95, 0.6, 0.26), rgb(0.36, 0.4, 0.55), (v - 0.38) * 2.2 + 0.5 * (cloud - 0.4));
    let sun = DVec2::new(uv.x - 0.36, v - 0.46).length();
    let lit = mix(rgb(1.0, 0.93, 0.7), sky, smooth(0.04, 0.09, sun));
    let ripple = 0.75 + 0.35 * noise(DVec2::new(uv.x * 6.0, uv.y * 60.0), 64, 31);
    let tone = if sea { lit * ripple } else { lit };
    let boat = DVec2::new(uv.x - 0.62, uv.y - 0.36);
    let sail = boat.y > 0.02 && boat.y < 0.36 && boat.x > 0.0 && boat.x < (0.36 - boat.y) * 0.42;
    let hull = boat.y.abs() < 0.022 && (-0.07 - boat.y..0.16 + boat.y).contains(&boat.x);
    if sail {
        rgb(0.5, 0.22, 0.16)
    } else if hull {
        rgb(0.14, 0.1, 0.09)
    } else {
        tone
    }
}

fn globe(uv: DVec2) -> DVec3 {
    let latitude = (uv.y - 0.5).abs() * 2.0;
    let land = fractal(uv, 6, 32) - 0.1 * latitude > 0.5;
    let tone =
        if land { mix(rgb(0.7, 0.58, 0.32), rgb(0.4, 0.42, 0.22), fractal(uv, 16, 33)) } else { rgb(0.3, 0.46, 0.52) };
    let net = (uv.x * 24.0).fract() < 0.06 || (uv.y * 12.0).fract() < 0.06;
    if net { tone * 0.75 } else { tone }
}

/// Tracery of the rose: rings of petals of coloured glass in dark lead.
fn rose(uv: DVec2) -> DVec3 {
    const GLASS: [DVec3; 6] = [
        rgb(0.18, 0.3, 0.95),
        rgb(0.95, 0.2, 0.16),
        rgb(0.98, 0.72, 0.2),
        rgb(0.2, 0.62, 0.9),
        rgb(0.55, 0.25, 0.85),
        rgb(0.16, 0.7, 0.48),
    ];
    let d = (uv - DVec2::splat(0.5)) * 2.0;
    let (r, turn) = (d.length(), d.y.atan2(d.x) / TAU + 0.5);
    let (ring, count) = match r {
        r if r < 0.2 => (0, 6.0),
        r if r < 0.52 => (1, 12.0),
        r if r < 0.8 => (2, 24.0),
        _ => (3, 48.0),
    };
    let radii = [0.0, 0.2, 0.52, 0.8, 0.97];
    let along = (r - radii[ring]) / (radii[ring + 1] - radii[ring]);
    let petal = (turn * count).fract() - 0.5;
    // Petals narrow towards both ends, like round-headed lights.
    let width = 0.46 * (1.0 - (2.0 * along - 1.0).powi(4)).max(0.0).sqrt();
    let lead = (width - petal.abs()) * TAU * r.max(0.05) / count;
    let piece = (turn * count) as i64;
    let pick = (piece + ring as i64 * 2 + i64::from(along > 0.55) * (1 + ring as i64)) as usize % 6;
    let shade = 0.75 + 0.35 * hash(piece, ring as i64, 34);
    let cross = ((along - 0.55).abs() * (radii[ring + 1] - radii[ring]) - 0.008) * 0.7;
    mix(DVec3::ZERO, GLASS[pick] * shade, smooth(0.002, 0.012, lead.min(cross).min(0.985 - r)))
}

/// Night sky over roofs and trees; u along the horizon, v up.
fn night(uv: DVec2) -> DVec3 {
    let sky = mix(rgb(0.5, 0.62, 0.86), rgb(0.0, 0.0, 0.02), uv.y.powf(0.55));
    let star = hash((uv.x * 512.0) as i64, (uv.y * 128.0) as i64, 36) > 0.997 && uv.y > 0.35;
    let tree =
        0.22 + 0.2 * noise(DVec2::new(uv.x * 14.0, 0.0), 14, 37) + 0.06 * noise(DVec2::new(uv.x * 96.0, 1.0), 96, 38);
    let roof = 0.12 + 0.2 * hash((uv.x * 20.0) as i64, 0, 39) - 0.08 * ((uv.x * 20.0).fract() - 0.5).abs();
    if uv.y < roof {
        let pane = [(uv.x * 120.0).fract(), (uv.y * 40.0).fract()].iter().all(|f| (0.3..0.75).contains(f));
        let lit = pane && hash((uv.x * 120.0) as i64, (uv.y * 40.0) as i64, 40) > 0.75;
        if lit { rgb(0.95, 0.65, 0.28) } else { rgb(0.05, 0.06, 0.1) }
    } else if uv.y < tree {
        rgb(0.07, 0.1, 0.15)
    } else if star {
        rgb(0.8, 0.85, 1.0)
    } else {
        sky
    }
}
