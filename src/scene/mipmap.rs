//! Mip chains, filtered in linear light.

use super::texture::SRGB;
use std::sync::LazyLock;

/// sRGB codes of 4096 linear values; next to black, where the curve is steepest, a step is 12.92·255/4095 = 0.8 codes.
static CODES: LazyLock<[u8; 4096]> = LazyLock::new(|| {
    let encode = |c: f32| if c <= 0.003_130_8 { 12.92 * c } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 };
    std::array::from_fn(|i| (encode(i as f32 / 4095.0) * 255.0 + 0.5) as u8)
});

/// Most levels of a chain: enough for 16384 texels a side.
pub(super) const MAX_LEVELS: usize = 15;

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

/// Appends to `texels`, which hold level 0, all further levels of a chain with these `extents`.
pub(super) fn extend(texels: &mut Vec<[u8; 4]>, extents: &[[u32; 2]]) {
    texels.reserve_exact(extents.iter().skip(1).map(|[w, h]| *w as usize * *h as usize).sum());
    let mut start = 0;
    for pair in extents.windows(2) {
        let next = reduce(&texels[start..], pair[0], pair[1]);
        start = texels.len();
        texels.extend(next);
    }
}

/// Box filter from one level to the next: every source texel counts by the share of it that the target covers.
fn reduce(from: &[[u8; 4]], [from_w, from_h]: [u32; 2], [to_w, to_h]: [u32; 2]) -> Vec<[u8; 4]> {
    let (linear, codes) = (&*SRGB, &*CODES);
    let columns: Vec<_> = (0..to_w).map(|x| taps(x, from_w, to_w)).collect();
    let mut to = Vec::with_capacity(to_w as usize * to_h as usize);
    for y in 0..to_h {
        let rows = taps(y, from_h, to_h);
        to.extend(columns.iter().map(|columns| {
            let mut sum = [0.0f32; 4];
            for &(row, row_weight) in &rows.0[..rows.1] {
                for &(column, column_weight) in &columns.0[..columns.1] {
                    let weight = row_weight * column_weight;
                    let [r, g, b, a] = from[row as usize * from_w as usize + column as usize];
                    for (sum, c) in sum.iter_mut().zip([r, g, b].map(|c| linear[c as usize])) {
                        *sum += weight * c;
                    }
                    sum[3] += weight * f32::from(a);
                }
            }
            let [r, g, b] = [sum[0], sum[1], sum[2]].map(|c| codes[(c * 4095.0 + 0.5) as usize & 4095]);
            [r, g, b, (sum[3] + 0.5) as u8]
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

    fn chain(width: u32, height: u32, texel: impl Fn(u32, u32) -> [u8; 4]) -> Vec<[u8; 4]> {
        let mut texels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| texel(x, y)).collect();
        extend(&mut texels, &extents(width, height));
        texels
    }

    #[test]
    fn a_uniform_texture_stays_uniform() {
        for (width, height) in [(8, 8), (7, 5), (1, 9), (13, 2)] {
            let chain = chain(width, height, |_, _| [200, 3, 90, 128]);
            assert!(chain.iter().all(|&t| t == [200, 3, 90, 128]), "{width}x{height}");
        }
    }

    #[test]
    fn black_and_white_average_in_linear_light() {
        let chain = chain(2, 2, |x, y| [if (x + y) % 2 == 0 { 255 } else { 0 }; 4]);
        // Half the light of white is code 188 in sRGB; the mask channel is linear already.
        assert_eq!(chain[4], [188, 188, 188, 128]);
    }

    #[test]
    fn odd_sizes_weigh_every_texel_alike() {
        let chain = chain(3, 1, |x, _| [0, 0, 0, [30, 60, 90][x as usize]]);
        assert_eq!(chain[3][3], 60);
    }
}
