//! Mip chains, filtered in linear light.

use super::shared::MAX_LEVELS;
use crate::scene::texture::{Texture, srgb_to_linear};
use std::sync::LazyLock;

/// Linear values of the 256 sRGB codes.
static LINEAR: LazyLock<[f32; 256]> = LazyLock::new(|| std::array::from_fn(|i| srgb_to_linear(i as f32 / 255.0)));
/// sRGB codes of 4096 linear values; next to black, where the curve is steepest, a step is 12.92·255/4095 = 0.8 codes.
static CODES: LazyLock<[u8; 4096]> = LazyLock::new(|| {
    let encode = |c: f32| if c <= 0.003_130_8 { 12.92 * c } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 };
    std::array::from_fn(|i| (encode(i as f32 / 4095.0) * 255.0 + 0.5) as u8)
});

/// Extents of the levels of a texture, from the largest: each half of the one before, rounded down, at least 1.
pub(super) fn extents(width: u32, height: u32) -> Vec<[u32; 2]> {
    let mut levels = vec![[width, height]];
    while let Some(&[w, h]) = levels.last()
        && (w > 1 || h > 1)
        && levels.len() < MAX_LEVELS
    {
        levels.push([(w / 2).max(1), (h / 2).max(1)]);
    }
    levels
}

/// The whole chain, level after level, RGBA8 with R in the low byte.
pub(super) fn chain(texture: &Texture) -> Vec<u32> {
    let extents = extents(texture.width, texture.height);
    let mut texels: Vec<u32> = Vec::with_capacity(extents.iter().map(|[w, h]| *w as usize * *h as usize).sum());
    texels.extend(texture.texels.iter().map(|&t| u32::from_le_bytes(t)));
    let mut start = 0;
    for pair in extents.windows(2) {
        let length = pair[0][0] as usize * pair[0][1] as usize;
        let next = reduce(&texels[start..start + length], pair[0], pair[1]);
        texels.extend(next);
        start += length;
    }
    texels
}

/// Box filter from one level to the next: every source texel counts by the share of it that the target covers.
fn reduce(from: &[u32], [from_w, from_h]: [u32; 2], [to_w, to_h]: [u32; 2]) -> Vec<u32> {
    let columns: Vec<_> = (0..to_w).map(|x| taps(x, from_w, to_w)).collect();
    let mut to = Vec::with_capacity(to_w as usize * to_h as usize);
    for y in 0..to_h {
        let rows = taps(y, from_h, to_h);
        to.extend(columns.iter().map(|columns| {
            let mut sum = [0.0f32; 4];
            for &(row, row_weight) in &rows.0[..rows.1] {
                for &(column, column_weight) in &columns.0[..columns.1] {
                    let weight = row_weight * column_weight;
                    let [r, g, b, a] = from[row as usize * from_w as usize + column as usize].to_le_bytes();
                    for (sum, c) in sum.iter_mut().zip([r, g, b].map(|c| LINEAR[c as usize])) {
                        *sum += weight * c;
                    }
                    sum[3] += weight * f32::from(a);
                }
            }
            let [r, g, b] = [sum[0], sum[1], sum[2]].map(|c| CODES[(c * 4095.0 + 0.5) as usize & 4095]);
            u32::from_le_bytes([r, g, b, (sum[3] + 0.5) as u8])
        }));
    }
    to
}

/// Source texels and weights of target texel `i`, and how many they are: 2, or 3 where the source is odd.
fn taps(i: u32, from: u32, to: u32) -> ([(u32, f32); 3], usize) {
    let ratio = f64::from(from) / f64::from(to);
    let (start, end) = (f64::from(i) * ratio, f64::from(i + 1) * ratio);
    let mut taps = [(0, 0.0); 3];
    let mut count = 0;
    let first = start as u32;
    for source in first..from.min(first + 3) {
        let share = (end.min(f64::from(source + 1)) - start.max(f64::from(source))) / ratio;
        if share > 1e-9 {
            taps[count] = (source, share as f32);
            count += 1;
        }
    }
    (taps, count)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texture(width: u32, height: u32, texel: impl Fn(u32, u32) -> [u8; 4]) -> Texture {
        let texels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| texel(x, y)).collect();
        Texture { name: "test".to_owned(), width, height, texels }
    }

    #[test]
    fn a_uniform_texture_stays_uniform() {
        for (width, height) in [(8, 8), (7, 5), (1, 9), (13, 2)] {
            let chain = chain(&texture(width, height, |_, _| [200, 3, 90, 128]));
            assert!(chain.iter().all(|t| t.to_le_bytes() == [200, 3, 90, 128]), "{width}x{height}");
        }
    }

    #[test]
    fn black_and_white_average_in_linear_light() {
        let chain = chain(&texture(2, 2, |x, y| [if (x + y) % 2 == 0 { 255 } else { 0 }; 4]));
        // Half the light of white is code 188 in sRGB; the mask channel is linear already.
        assert_eq!(chain[4].to_le_bytes(), [188, 188, 188, 128]);
    }

    #[test]
    fn odd_sizes_weigh_every_texel_alike() {
        let chain = chain(&texture(3, 1, |x, _| [0, 0, 0, [30, 60, 90][x as usize]]));
        assert_eq!(chain[3].to_le_bytes()[3], 60);
    }
}
