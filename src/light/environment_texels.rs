//! The directions of the texels of an environment's picture, integrated exactly.

use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// Mean of what is above 0 of a cosine that varies by ± `reach` about its mean.
pub(super) fn clipped(cosine: f32, reach: f32) -> f32 {
    if cosine >= reach {
        cosine
    } else if cosine <= -reach {
        0.0
    } else {
        (cosine + reach) * (cosine + reach) / (4.0 * reach)
    }
}

/// ∫ d dω over each texel, in the picture's own frame.
pub(super) struct TexelVectors {
    /// By column: ∫ sin φ dφ, ∫ cos φ dφ.
    columns: Vec<[f64; 2]>,
    /// By row: ∫ sin²θ dθ, and ∫ sinθ cosθ dθ times the width of a column.
    rows: Vec<[f64; 2]>,
    /// By row, sr.
    pub solid_angles: Vec<f64>,
}

/// Prepares them for a picture of so many columns and rows.
pub(super) fn texel_vectors([columns, rows]: [u32; 2]) -> TexelVectors {
    let [width, height] = [columns, rows].map(f64::from);
    let column = |x: f64| {
        let [left, right] = [x, x + 1.0].map(|x| (x / width - 0.5) * TAU);
        [left.cos() - right.cos(), right.sin() - left.sin()]
    };
    let row = |y: f64| {
        let [top, bottom] = [y, y + 1.0].map(|y| y * PI / height);
        let level = 0.5 * (bottom - top) - 0.25 * ((2.0 * bottom).sin() - (2.0 * top).sin());
        [level, 0.5 * (bottom.sin().powi(2) - top.sin().powi(2)) * TAU / width]
    };
    let solid_angle = |y: f64| 2.0 * ((y + 0.5) * PI / height).sin() * (0.5 * PI / height).sin() * TAU / width;
    TexelVectors {
        columns: (0..columns).map(|x| column(f64::from(x))).collect(),
        rows: (0..rows).map(|y| row(f64::from(y))).collect(),
        solid_angles: (0..rows).map(|y| solid_angle(f64::from(y))).collect(),
    }
}

impl TexelVectors {
    /// Of a texel, sr.
    pub(super) fn of(&self, x: u32, y: u32) -> DVec3 {
        let ([sine, cosine], [level, up]) = (self.columns[x as usize], self.rows[y as usize]);
        DVec3::new(sine * level, up, cosine * level)
    }
}
