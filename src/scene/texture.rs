//! Textures: texels of four bytes, sampled on the CPU by the rule that the colour pass follows too.

use super::mipmap;
use super::texel::{of_linear, of_shared_exponent, of_srgb};
use glam::{Vec2, Vec3};
use std::sync::OnceLock;

pub(crate) use super::texel::SRGB;
pub use super::texel::{Encoding, srgb_to_linear};

/// Most levels that a mip chain has.
pub const MAX_LEVELS: usize = mipmap::MAX_LEVELS;

/// Index into [`super::Scene::textures`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct TextureId(pub u32);

/// What a texture shows where it is looked up outside of [0, 1].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Wrap {
    /// The image again.
    #[default]
    Repeat,
    /// The texels of its edge.
    Clamp,
    /// The image again, every other time turned over.
    Mirror,
}

/// A decoded image with its mip chain, four bytes a texel, row 0 at the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// Path as written in messages.
    name: String,
    /// Extents of the levels, from the largest: each half of the one before, rounded down, at least 1.
    extents: Vec<[u32; 2]>,
    /// Level after level, top row first.
    texels: Vec<[u8; 4]>,
    encoding: Encoding,
    /// Largest value of a channel.
    peak: f32,
    /// See [`Self::mean`]: several ask.
    mean: OnceLock<Vec3>,
}

impl Texture {
    /// An sRGB texture from the texels of its largest level, top row first; the others are box-filtered in linear light.
    ///
    /// # Panics
    /// If there is not one texel, at least, and as many as the extent says.
    #[must_use]
    pub fn new(name: String, extent: [u32; 2], texels: Vec<[u8; 4]>) -> Self {
        Self::encoded(name, extent, texels, Encoding::Srgb)
    }

    /// The same for texels of any encoding.
    ///
    /// # Panics
    /// As [`Self::new`].
    #[must_use]
    pub fn encoded(name: String, [width, height]: [u32; 2], mut texels: Vec<[u8; 4]>, encoding: Encoding) -> Self {
        assert!(!texels.is_empty() && texels.len() as u64 == u64::from(width) * u64::from(height));
        let peak = match encoding {
            Encoding::Srgb | Encoding::Linear => 1.0,
            Encoding::SharedExponent => texels.iter().map(|&t| of_shared_exponent(t).max_element()).fold(0.0, f32::max),
        };
        let extents = mipmap::extents(width, height);
        mipmap::extend(&mut texels, &extents, encoding);
        Self { name, extents, texels, encoding, peak, mean: OnceLock::new() }
    }

    /// What the texels mean.
    #[must_use]
    pub const fn encoding(&self) -> Encoding {
        self.encoding
    }

    /// Upper bound of what any look-up returns in a channel.
    #[must_use]
    pub const fn peak(&self) -> f32 {
        self.peak
    }

    /// Path as written in messages.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Width and height of each level, the largest first.
    #[must_use]
    pub fn extents(&self) -> &[[u32; 2]] {
        &self.extents
    }

    /// The texels of all levels, level after level, top row first.
    #[must_use]
    pub fn texels(&self) -> &[[u8; 4]] {
        &self.texels
    }

    /// Trilinear look-up of linear RGB, by the formulas of `glsl/include/texture.glsl`; `uv` in OBJ convention (v up).
    /// The gradients are those of `uv` across the footprint, in x and in y; one below a texel, or none, is level 0.
    #[must_use]
    pub fn sample_filtered(&self, uv: Vec2, d_dx: Vec2, d_dy: Vec2, wrap: [Wrap; 2]) -> Vec3 {
        let [width, height] = self.extents[0];
        let size = Vec2::new(width as f32, height as f32);
        let extent = (d_dx * size).length().max((d_dy * size).length());
        // Not a number counts as magnified.
        let lod = if extent > 1.0 { extent.log2().min((self.extents.len() - 1) as f32) } else { 0.0 };
        let level = lod as usize;
        let fine = self.sample_level(level, uv, wrap);
        let share = lod - level as f32;
        if share > 0.0 { fine.lerp(self.sample_level(level + 1, uv, wrap), share) } else { fine }
    }

    fn sample_level(&self, level: usize, uv: Vec2, wrap: [Wrap; 2]) -> Vec3 {
        let first = mipmap::chain_length(&self.extents[..level]);
        let (texels, extent) = (&self.texels[first..], self.extents[level]);
        match self.encoding {
            Encoding::Srgb => {
                let table: &[f32; 256] = &SRGB;
                bilinear(texels, extent, uv, wrap, |texel| of_srgb(texel, table))
            }
            Encoding::SharedExponent => bilinear(texels, extent, uv, wrap, of_shared_exponent),
            Encoding::Linear => bilinear(texels, extent, uv, wrap, of_linear),
        }
    }

    /// Mean linear RGB over all texels of level 0.
    #[must_use]
    pub fn mean(&self) -> Vec3 {
        *self.mean.get_or_init(|| self.add_up())
    }

    fn add_up(&self) -> Vec3 {
        // Row by row, so that f32 does not lose what it adds to a large sum.
        let [width, height] = self.extents[0];
        let rows = self.texels.chunks(width as usize).take(height as usize);
        let table: &[f32; 256] = &SRGB;
        let sum = |texels: &[[u8; 4]]| -> Vec3 {
            match self.encoding {
                Encoding::Srgb => texels.iter().map(|&t| of_srgb(t, table)).sum(),
                Encoding::SharedExponent => texels.iter().map(|&t| of_shared_exponent(t)).sum(),
                Encoding::Linear => texels.iter().map(|&t| of_linear(t)).sum(),
            }
        };
        rows.map(|row| sum(row) / width as f32).sum::<Vec3>() / height as f32
    }

    /// Linear RGB at `uv`, bilinear at level 0.
    #[must_use]
    pub fn rgb(&self, uv: Vec2, wrap: [Wrap; 2]) -> Vec3 {
        self.sample_level(0, uv, wrap)
    }

    /// Mask value at `uv`, bilinear at level 0.
    #[must_use]
    pub fn alpha(&self, uv: Vec2, wrap: [Wrap; 2]) -> f32 {
        bilinear(&self.texels, self.extents[0], uv, wrap, |texel| Vec3::splat(mask(texel))).x
    }
}

/// The texel that repeats at `i`, which is at most one outside: without a division, of which a look-up would make eight.
fn within(i: i64, count: u32) -> usize {
    let count = i64::from(count);
    (if i < 0 {
        i + count
    } else if i >= count {
        i - count
    } else {
        i
    }) as usize
}

/// Mask value of a texel.
fn mask([.., a]: [u8; 4]) -> f32 {
    f32::from(a) / 255.0
}

/// The same as `f32::floor`, which is a call of the C library where the processor is not known to have the instruction.
fn floor(c: f32) -> f32 {
    /// From here on there are no fractions.
    const WHOLE: f32 = (1 << 23) as f32;
    if c.abs() >= WHOLE {
        return c;
    }
    let truncated = c as i32 as f32;
    if truncated > c { truncated - 1.0 } else { truncated }
}

/// A coordinate where the image, so many texels wide, is looked up where it does not repeat.
fn held(c: f32, size: f32, wrap: Wrap) -> f32 {
    let c = match wrap {
        Wrap::Repeat => return c,
        Wrap::Clamp => c,
        Wrap::Mirror => {
            let half = c * 0.5;
            1.0 - (2.0 * (half - floor(half)) - 1.0).abs()
        }
    };
    // Between the middles of the outer texels nothing repeats.
    c.max(0.5 / size).min(1.0 - 0.5 / size)
}

/// Bilinear look-up in one level, of what `texel` makes of a texel.
#[inline]
fn bilinear(
    texels: &[[u8; 4]],
    [width, height]: [u32; 2],
    uv: Vec2,
    wrap: [Wrap; 2],
    texel: impl Fn([u8; 4]) -> Vec3,
) -> Vec3 {
    let size = Vec2::new(width as f32, height as f32);
    let uv = if wrap == [Wrap::Repeat; 2] {
        uv
    } else {
        Vec2::new(held(uv.x, size.x, wrap[0]), held(uv.y, size.y, wrap[1]))
    };
    // Non-finite coordinates are rejected by the loader; wrapping first keeps the integers small. The same as `rem_euclid(1.0)`, bit
    // for bit, without its division.
    let wrapped = |c: f32| c - floor(c);
    let x = wrapped(uv.x) * size.x - 0.5;
    let y = wrapped(1.0 - uv.y) * size.y - 0.5;
    let (x0, y0) = (floor(x), floor(y));
    let (fx, fy) = (x - x0, y - y0);
    let (x0, y0) = (x0 as i64, y0 as i64);
    let columns = [within(x0, width), within(x0 + 1, width)];
    let row = |y: i64| {
        let row = &texels[within(y, height) * width as usize..];
        texel(row[columns[0]]).lerp(texel(row[columns[1]]), fx)
    };
    let (top, bottom) = (row(y0), row(y0 + 1));
    top.lerp(bottom, fy)
}

#[cfg(test)]
mod tests {
    use super::*;

    const REPEAT: [Wrap; 2] = [Wrap::Repeat; 2];

    /// One texel in four is white.
    fn dots() -> Texture {
        let texel = |i: usize| if [i, i / 8].iter().all(|k| k.is_multiple_of(2)) { [255; 4] } else { [0, 0, 0, 255] };
        Texture::new("dots".to_owned(), [8, 8], (0..64).map(texel).collect())
    }

    #[test]
    fn a_footprint_of_a_texel_or_less_is_the_bilinear_look_up() {
        let texture = dots();
        for uv in [Vec2::new(0.1, 0.3), Vec2::new(-2.7, 5.55)] {
            for gradient in [0.0, 0.05, 0.125, f32::NAN] {
                let filtered = texture.sample_filtered(uv, Vec2::X * gradient, Vec2::Y * gradient, REPEAT);
                assert_eq!(filtered, texture.rgb(uv, REPEAT), "{uv} {gradient}");
            }
        }
    }

    #[test]
    fn levels_blend_by_the_logarithm_of_the_longer_side() {
        let texture = dots();
        let uv = Vec2::new(1.0 / 16.0, 15.0 / 16.0);
        // The white texel at level 0, a quarter of white from level 1 on.
        let quarter = texture.sample_filtered(uv, Vec2::X * 2.0 / 8.0, Vec2::ZERO, REPEAT).x;
        assert!((quarter - 0.25).abs() < 3e-3, "{quarter}");
        let half_way = texture.sample_filtered(uv, Vec2::Y * 2f32.sqrt() / 8.0, Vec2::X / 100.0, REPEAT).x;
        assert!((half_way - (1.0 + quarter) / 2.0).abs() < 1e-5, "{half_way}");
        for beyond in [1e3, f32::INFINITY] {
            assert!((texture.sample_filtered(uv, Vec2::splat(beyond), Vec2::ZERO, REPEAT).x - 0.25).abs() < 3e-3);
        }
    }

    #[test]
    fn a_clamped_texture_goes_on_as_its_edge() {
        let texel = |i: usize| [[255, 0, 0, 0], [0, 0, 0, 255], [0, 0, 0, 255], [0, 0, 255, 0]][i % 4];
        let texture = Texture::new("row".to_owned(), [4, 1], (0..4).map(texel).collect());
        for v in [-3.0, 0.5, 7.0] {
            for u in [-0.2, -9.0, 0.0, 0.125] {
                assert_eq!(texture.rgb(Vec2::new(u, v), [Wrap::Clamp; 2]), Vec3::X, "{u}");
                assert_eq!(texture.alpha(Vec2::new(u, v), [Wrap::Clamp; 2]), 0.0, "{u}");
            }
            for u in [1.0, 0.875, 42.0] {
                assert!((texture.rgb(Vec2::new(u, v), [Wrap::Clamp; 2]) - Vec3::Z).length() < 1e-6, "{u}");
            }
            for (u, same) in [(1.3, 0.7), (-0.2, 0.2), (2.6, 0.6), (-1.1, 0.9), (1.0, 0.95), (4.0, 0.0)] {
                let [turned, plain] = [u, same].map(|u| texture.rgb(Vec2::new(u, v), [Wrap::Mirror, Wrap::Repeat]));
                assert!((turned - plain).length() < 1e-5, "{u}");
            }
            let repeated = [0.1, 1.1].map(|u| texture.rgb(Vec2::new(u, v), REPEAT));
            assert!((repeated[0] - repeated[1]).length() < 1e-5);
        }
    }
}
