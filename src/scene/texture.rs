//! Textures: 8-bit texels, sampled on the CPU by the rule that the colour pass follows too.

use glam::{Vec2, Vec3, Vec4};

/// Index into [`super::Scene::textures`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct TextureId(pub u32);

/// A decoded image, RGBA8, row 0 at the top. RGB is sRGB-encoded, A is linear (the cut-out mask of `map_d`).
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// Path as written in messages.
    pub name: String,
    /// Width in texels, ≥ 1.
    pub width: u32,
    /// Height in texels, ≥ 1.
    pub height: u32,
    /// `width * height` texels, top row first.
    pub texels: Vec<[u8; 4]>,
}

/// sRGB electro-optical transfer function (IEC 61966-2-1), encoded [0, 1] to linear [0, 1].
#[must_use]
pub fn srgb_to_linear(c: f32) -> f32 {
    if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}

/// Linear values of the 256 sRGB codes.
static SRGB: std::sync::LazyLock<[f32; 256]> =
    std::sync::LazyLock::new(|| std::array::from_fn(|i| srgb_to_linear(i as f32 / 255.0)));

impl Texture {
    /// The texel at integer coordinates, repeated; linear RGB and A.
    #[must_use]
    pub fn texel(&self, x: i64, y: i64) -> Vec4 {
        let column = x.rem_euclid(i64::from(self.width)) as usize;
        let row = y.rem_euclid(i64::from(self.height)) as usize;
        let [r, g, b, a] = self.texels[row * self.width as usize + column];
        Vec4::new(SRGB[r as usize], SRGB[g as usize], SRGB[b as usize], f32::from(a) / 255.0)
    }

    /// Bilinear, repeating look-up at level 0; `uv` in OBJ convention (v up).
    #[must_use]
    pub fn sample(&self, uv: Vec2) -> Vec4 {
        // Non-finite coordinates are rejected by the loader; wrapping first keeps the integers small.
        let x = uv.x.rem_euclid(1.0) * self.width as f32 - 0.5;
        let y = (1.0 - uv.y).rem_euclid(1.0) * self.height as f32 - 0.5;
        let (x0, y0) = (x.floor(), y.floor());
        let (fx, fy) = (x - x0, y - y0);
        let (x0, y0) = (x0 as i64, y0 as i64);
        let top = self.texel(x0, y0).lerp(self.texel(x0 + 1, y0), fx);
        let bottom = self.texel(x0, y0 + 1).lerp(self.texel(x0 + 1, y0 + 1), fx);
        top.lerp(bottom, fy)
    }

    /// Mean linear RGB over all texels.
    #[must_use]
    pub fn mean(&self) -> Vec3 {
        let sum = |texels: &[[u8; 4]]| {
            texels
                .iter()
                .map(|t| Vec3::new(SRGB[t[0] as usize], SRGB[t[1] as usize], SRGB[t[2] as usize]))
                .sum::<Vec3>()
        };
        // Row by row, so that f32 does not lose what it adds to a large sum.
        let rows: Vec3 = self.texels.chunks(self.width as usize).map(|row| sum(row) / self.width as f32).sum();
        rows / self.height as f32
    }

    /// Linear RGB at `uv`.
    #[must_use]
    pub fn rgb(&self, uv: Vec2) -> Vec3 {
        self.sample(uv).truncate()
    }

    /// Mask value at `uv`.
    #[must_use]
    pub fn alpha(&self, uv: Vec2) -> f32 {
        self.sample(uv).w
    }
}
