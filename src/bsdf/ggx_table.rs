//! What GGX reflects, and the linearly transformed cosines that it is fitted by, tabulated by roughness and cosine
//! (docs/method/ggx_table.py).

use glam::DMat3;
use std::sync::LazyLock;

/// Rows, one a roughness, and columns, one a cosine.
pub const SIZE: usize = 32;
/// Least roughness that is told from a mirror: α is its square. A highlight is narrower than any light there.
pub const LEAST_ROUGHNESS: f32 = 0.03;
/// F₀ of dielectrics in glTF 2.0: that of an index of refraction of 1.5.
pub const DIELECTRIC: f32 = 0.04;
/// Steps of the means over cosines.
const STEPS: usize = 256;

/// Entries of the file.
const FIELDS: usize = 6;
static FILE: &[u8; SIZE * SIZE * FIELDS * 4] = include_bytes!("ggx_table.bin");

/// GGX of one roughness seen at one cosine: what is tabulated.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Entry([f32; FIELDS]);

struct Tables {
    /// By roughness, then by cosine.
    entries: Vec<Entry>,
    /// Means of E and B over an even hemisphere, by roughness.
    means: Vec<Albedo>,
}

static TABLES: LazyLock<Tables> = LazyLock::new(|| {
    let field = |bytes: &[u8]| f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
    let entry = |bytes: &[u8]| Entry(std::array::from_fn(|i| field(&bytes[4 * i..])));
    let entries: Vec<Entry> = FILE.chunks_exact(4 * FIELDS).map(entry).collect();
    let means = (0..SIZE).map(|row| mean(&entries[row * SIZE..][..SIZE])).collect();
    Tables { entries, means }
});

/// ∫ 2μ f(μ) dμ of the albedos in a row.
fn mean(row: &[Entry]) -> Albedo {
    let mut sum = Albedo::default();
    for step in 0..STEPS {
        let cosine = (step as f32 + 0.5) / STEPS as f32;
        let (column, share) = place((1.0 - cosine).sqrt());
        let weight = 2.0 * cosine / STEPS as f32;
        let at = Albedo::of(row[column].between(row[column + 1], share));
        sum.whole += at.whole * weight;
        sum.grazing += at.grazing * weight;
    }
    sum
}

/// Albedo of single scattering by GGX.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Albedo {
    /// Where all facets reflect all light.
    pub whole: f32,
    /// Where they reflect (1 − cosθ_d)⁵ of it.
    pub grazing: f32,
}

impl Albedo {
    fn of(entry: Entry) -> Self {
        Self { whole: entry.0[0], grazing: entry.0[1] }
    }

    fn between(self, other: Self, share: f32) -> Self {
        let mix = |a: f32, b: f32| a + (b - a) * share;
        Self { whole: mix(self.whole, other.whole), grazing: mix(self.grazing, other.grazing) }
    }
}

impl Entry {
    fn between(self, other: Self, share: f32) -> Self {
        Self(std::array::from_fn(|i| self.0[i] + (other.0[i] - self.0[i]) * share))
    }
}

/// Cell and place in it for a coordinate in [0, 1].
fn place(x: f32) -> (usize, f32) {
    let at = x.clamp(0.0, 1.0) * (SIZE - 1) as f32;
    let cell = (at as usize).min(SIZE - 2);
    (cell, at - cell as f32)
}

/// A roughness in the table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    row: usize,
    share: f32,
}

impl Row {
    /// The row of a perceptual roughness.
    pub fn of(roughness: f32) -> Self {
        let (row, share) = place((roughness - LEAST_ROUGHNESS) / (1.0 - LEAST_ROUGHNESS));
        Self { row, share }
    }

    /// Albedo in the direction at `cosine` to the normal.
    #[inline]
    pub fn albedo(self, cosine: f32) -> Albedo {
        Albedo::of(self.entry(cosine))
    }

    /// Mean albedo over an even hemisphere.
    #[inline]
    pub fn mean(self) -> Albedo {
        let means = &TABLES.means;
        means[self.row].between(means[self.row + 1], self.share)
    }

    /// The matrix that takes the clamped cosine to the lobe of width `alpha` seen at `cosine`, inverted; in the frame of x towards
    /// the eye along the surface, y, and the normal.
    pub fn inverse(self, alpha: f32, cosine: f32) -> DMat3 {
        let Entry([_, _, m11, m22, m13, angle]) = self.entry(cosine);
        let [m11, m22, m13] = [m11, m22, m13].map(|m| f64::from(m * alpha));
        let (sin, cos) = f64::from(angle).sin_cos();
        // Rows: R transposed, then the inverse of the shear and scale.
        let turned = DMat3::from_cols_array_2d(&[[cos, 0.0, -sin], [0.0, 1.0, 0.0], [sin, 0.0, cos]]);
        let scaled =
            DMat3::from_cols_array_2d(&[[m11.recip(), 0.0, 0.0], [0.0, m22.recip(), 0.0], [-m13 / m11, 0.0, 1.0]]);
        scaled * turned
    }

    fn entry(self, cosine: f32) -> Entry {
        let (column, share) = place((1.0 - cosine).max(0.0).sqrt());
        let row = |row: usize| {
            let entries = &TABLES.entries[row * SIZE + column..];
            entries[0].between(entries[1], share)
        };
        row(self.row).between(row(self.row + 1), self.share)
    }
}
