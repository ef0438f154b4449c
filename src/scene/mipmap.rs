//! Mip chains, filtered in linear light.

use super::texel::{CODES, Encoding, SRGB, of_shared_exponent, of_srgb, shared_exponent};
use glam::Vec4;
use rayon::prelude::*;

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

/// Texels of a whole chain with these `extents`.
pub(super) fn chain_length(extents: &[[u32; 2]]) -> usize {
    extents.iter().map(|[w, h]| *w as usize * *h as usize).sum()
}

/// Appends to `texels`, which hold level 0, all further levels of a chain with these `extents`.
pub(super) fn extend(texels: &mut Vec<[u8; 4]>, extents: &[[u32; 2]], encoding: Encoding) {
    let level_0 = texels.len();
    // In place: a second chain of the largest textures would take another 1.4 GB.
    texels.resize(chain_length(extents), [0; 4]);
    let mut rest = texels.as_mut_slice();
    let mut length = level_0;
    for pair in extents.windows(2) {
        let (from, after) = rest.split_at_mut(length);
        let [w, h] = pair[1];
        length = w as usize * h as usize;
        reduce(from, pair[0], &mut after[..length], pair[1], encoding);
        rest = after;
    }
}

/// Box filter from one level to the next: every source texel counts by the share of it that the target covers.
fn reduce(from: &[[u8; 4]], from_extent: [u32; 2], to: &mut [[u8; 4]], to_extent: [u32; 2], encoding: Encoding) {
    match encoding {
        Encoding::Srgb => {
            let (linear, codes) = (&*SRGB, &*CODES);
            let decode = |texel: [u8; 4]| of_srgb(texel, linear).extend(f32::from(texel[3]));
            let code = |c: f32| codes[(c * 4095.0 + 0.5) as usize & 4095];
            let encode = |sum: Vec4| [code(sum.x), code(sum.y), code(sum.z), (sum.w + 0.5) as u8];
            reduce_by(from, from_extent, to, to_extent, decode, encode);
        }
        Encoding::SharedExponent => {
            let decode = |texel| of_shared_exponent(texel).extend(0.0);
            let encode = |sum: Vec4| shared_exponent(sum.truncate());
            reduce_by(from, from_extent, to, to_extent, decode, encode);
        }
        Encoding::Linear => {
            let decode = |texel: [u8; 4]| Vec4::from(texel.map(f32::from));
            let encode = |sum: Vec4| sum.to_array().map(|c| (c + 0.5) as u8);
            reduce_by(from, from_extent, to, to_extent, decode, encode);
        }
    }
}

fn reduce_by(
    from: &[[u8; 4]],
    [from_w, from_h]: [u32; 2],
    to: &mut [[u8; 4]],
    [to_w, to_h]: [u32; 2],
    decode: impl Fn([u8; 4]) -> Vec4 + Sync,
    encode: impl Fn(Vec4) -> [u8; 4] + Sync,
) {
    let columns: Vec<_> = (0..to_w).map(|x| taps(x, from_w, to_w)).collect();
    to.par_chunks_exact_mut(to_w as usize).with_min_len(MIN_ROWS).enumerate().for_each(|(y, target)| {
        let rows = taps(y as u32, from_h, to_h);
        for (target, columns) in target.iter_mut().zip(&columns) {
            let mut sum = Vec4::ZERO;
            for &(row, row_weight) in &rows.0[..rows.1] {
                for &(column, column_weight) in &columns.0[..columns.1] {
                    let texel = from[row as usize * from_w as usize + column as usize];
                    sum += row_weight * column_weight * decode(texel);
                }
            }
            *target = encode(sum);
        }
    });
}

/// Rows that a worker takes at least.
const MIN_ROWS: usize = 16;

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
    use glam::Vec3;

    fn chain(width: u32, height: u32, texel: impl Fn(u32, u32) -> [u8; 4]) -> Vec<[u8; 4]> {
        let mut texels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| texel(x, y)).collect();
        extend(&mut texels, &extents(width, height), Encoding::Srgb);
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
    fn bright_texels_average_beyond_one() {
        let mut texels = vec![shared_exponent(Vec3::splat(40.0)), [0; 4], [0; 4], shared_exponent(Vec3::splat(0.5))];
        extend(&mut texels, &extents(2, 2), Encoding::SharedExponent);
        assert!((of_shared_exponent(texels[4]).x - 40.5 / 4.0).abs() < 0.04);
    }

    #[test]
    fn odd_sizes_weigh_every_texel_alike() {
        let chain = chain(3, 1, |x, _| [0, 0, 0, [30, 60, 90][x as usize]]);
        assert_eq!(chain[3][3], 60);
    }
}
