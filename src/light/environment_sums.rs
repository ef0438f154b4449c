//! Irradiance of an environment on a surface of any normal without occlusion.
//!
//! It is a smooth function of the normal but for small bright things, which leave a kink where they set. So a table over normals holds
//! what most of the picture sends, and the brightest blocks of texels are added one by one.

use super::environment_texels::{clipped, texel_vectors};
use crate::math::luminance;
use crate::scene::environment::Picture;
use glam::{DMat3, DVec3, Mat3, Vec3};
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};

/// Blocks of texels along width and height, at most.
const BLOCKS: [u32; 2] = [64, 32];
/// Steps of the table round the axis and from pole to pole.
const STEPS: [usize; 2] = [128, 64];
/// Share of all light from which on a block is added by itself, and how many are at most.
const BRIGHT: f32 = 2e-3;
const MOST_BRIGHT: usize = 32;

/// Irradiance by the normal, in the picture's own frame.
#[derive(Clone, Debug)]
pub(super) struct IrradianceTable {
    /// Row by row from the upper pole, W·m⁻².
    nodes: Vec<Vec3>,
    bright: Vec<Block>,
}

/// The light of a block of texels.
#[derive(Clone, Copy, Debug)]
struct Block {
    /// ∫ L dω by channel, W·m⁻².
    power: Vec3,
    /// ∫ L d dω: channels are columns.
    vector: Mat3,
    /// Mean direction by luminance, shorter than 1 where directions differ.
    mean: Vec3,
    /// How far a cosine varies over it.
    reach: f32,
}

impl Block {
    fn irradiance(&self, normal: Vec3) -> Vec3 {
        let cosine = normal.dot(self.mean);
        if cosine >= self.reach {
            return self.vector.transpose() * normal;
        }
        self.power * clipped(cosine, self.reach)
    }
}

impl IrradianceTable {
    pub(super) fn new(picture: &Picture) -> Self {
        let mut blocks = blocks(picture);
        let total: f32 = blocks.iter().map(|block| luminance(block.power)).sum();
        blocks.sort_by(|a, b| luminance(b.power).total_cmp(&luminance(a.power)));
        let is_bright = |block: &&Block| luminance(block.power) > BRIGHT * total;
        let bright = blocks.iter().take(MOST_BRIGHT).take_while(is_bright).count();
        let rest = blocks.split_off(bright);
        let [around, down] = STEPS;
        let node = |index: usize| {
            let (row, column) = (index / (around + 1), index % (around + 1));
            let (sin_down, cos_down) = (row as f64 * PI / down as f64).sin_cos();
            let (sin_turn, cos_turn) = (column as f64 * TAU / around as f64).sin_cos();
            let normal = DVec3::new(sin_down * sin_turn, cos_down, sin_down * cos_turn).as_vec3();
            rest.iter().map(|block| block.irradiance(normal)).sum::<Vec3>()
        };
        let nodes = (0..(around + 1) * (down + 1)).into_par_iter().map(node).collect();
        Self { nodes, bright: blocks }
    }

    /// Irradiance on a surface of a unit normal of the picture's frame, W·m⁻².
    pub(super) fn at(&self, normal: Vec3) -> Vec3 {
        let [around, down] = STEPS;
        let turn = normal.x.atan2(normal.z) / std::f32::consts::TAU;
        let x = (turn - turn.floor()) * around as f32;
        let y = normal.y.clamp(-1.0, 1.0).acos() / std::f32::consts::PI * down as f32;
        let (column, row) = ((x as usize).min(around - 1), (y as usize).min(down - 1));
        let (fx, fy) = (x - column as f32, y - row as f32);
        let of_row = |row: usize| {
            let at = row * (around + 1) + column;
            self.nodes[at].lerp(self.nodes[at + 1], fx)
        };
        let smooth = of_row(row).lerp(of_row(row + 1), fy);
        smooth + self.bright.iter().map(|block| block.irradiance(normal)).sum::<Vec3>()
    }
}

/// The picture in blocks.
fn blocks(picture: &Picture) -> Vec<Block> {
    let size = picture.size();
    // Texels of small pictures are cut up: their light is not from about one direction.
    let parts = [0, 1].map(|axis| BLOCKS[axis].div_ceil(size[axis]));
    let [width, height] = [0, 1].map(|axis| size[axis] * parts[axis]);
    let count = BLOCKS;
    let vectors = texel_vectors([width, height]);
    let range = |of: u32, parts: u32, at: u32| {
        let first = |at: u32| (u64::from(of) * u64::from(at) / u64::from(parts)) as u32;
        first(at)..first(at + 1)
    };
    let block = |index: u32| {
        let (mut power, mut vector) = (DVec3::ZERO, DMat3::ZERO);
        for y in range(height, count[1], index / count[0]) {
            let row = &picture.texels()[(y / parts[1] * size[0]) as usize..];
            for x in range(width, count[0], index % count[0]) {
                let radiance = row[(x / parts[0]) as usize].as_dvec3();
                let along = vectors.of(x, y);
                power += radiance * vectors.solid_angles[y as usize];
                vector += DMat3::from_cols(along * radiance.x, along * radiance.y, along * radiance.z);
            }
        }
        let power = power.as_vec3();
        let vector = vector.as_mat3();
        let mean = vector * Vec3::new(0.2126, 0.7152, 0.0722) / luminance(power).max(f32::MIN_POSITIVE);
        // Of the variance of directions, half is along any one of two axes; a strip of half-width r has r²/3.
        let reach = (1.5 * (1.0 - mean.length_squared()).max(0.0)).sqrt().max(1e-4);
        Block { power, vector, mean, reach }
    };
    (0..count[0] * count[1]).into_par_iter().map(block).filter(|block| luminance(block.power) > 0.0).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sequence::Sequence;

    /// Irradiance texel by texel, each cut into parts where the horizon crosses it.
    fn brute_force(picture: &Picture, normal: Vec3) -> Vec3 {
        let parts = 4 * BLOCKS[0].div_ceil(picture.size()[0]);
        let [width, height] = picture.size();
        let mut sum = DVec3::ZERO;
        for (y, x) in (0..height * parts).flat_map(|y| (0..width * parts).map(move |x| (y, x))) {
            let down = (f64::from(y) + 0.5) * PI / f64::from(height * parts);
            let turn = ((f64::from(x) + 0.5) / f64::from(width * parts) - 0.5) * TAU;
            let direction = DVec3::new(down.sin() * turn.sin(), down.cos(), down.sin() * turn.cos());
            let area = down.sin() * PI / f64::from(height * parts) * TAU / f64::from(width * parts);
            let cosine = direction.dot(normal.as_dvec3()).max(0.0);
            sum += picture.texels()[(y / parts * width + x / parts) as usize].as_dvec3() * (cosine * area);
        }
        sum.as_vec3()
    }

    fn check(picture: &Picture) {
        let table = IrradianceTable::new(picture);
        let point = |i| Vec3::from_slice(&Sequence::new(5).point(i)[..3]) * 2.0 - Vec3::ONE;
        let normals = (0..24).map(|i| point(i).normalize()).chain([Vec3::Y, Vec3::NEG_Y, Vec3::Z]);
        let exact: Vec<(Vec3, Vec3)> = normals.map(|normal| (normal, brute_force(picture, normal))).collect();
        let most = exact.iter().map(|(_, e)| e.max_element()).fold(0.0, f32::max);
        for (normal, exact) in exact {
            let found = table.at(normal);
            assert!((found - exact).abs().max_element() < 1.5e-3 * most, "{normal}: {found} {exact} of {most}");
        }
    }

    #[test]
    fn irradiance_is_the_integral_of_the_picture() {
        let noise = |i: u32| Vec3::from_slice(&Sequence::new(3).point(i)[..3]);
        let smooth = |i: u32| {
            Vec3::new((i / 128) as f32, 20.0, 64.0 - (i / 128) as f32) * (1.0 + ((i % 128) as f32 * 0.05).sin())
        };
        check(&Picture::new([128, 64], (0..128 * 64).map(smooth).collect()));
        check(&Picture::new([100, 37], (0..3700).map(noise).collect()));
        check(&Picture::new([3, 2], (0..6).map(noise).collect()));
        check(&Picture::new([1, 1], vec![Vec3::ONE]));
    }

    #[test]
    fn one_bright_texel_is_exact_up_to_where_it_sets() {
        let mut texels = vec![Vec3::splat(0.01); 128 * 64];
        texels[20 * 128 + 77] = Vec3::new(1e5, 9e4, 8e4);
        let picture = Picture::new([128, 64], texels);
        check(&picture);
        let sun = texel_vectors(picture.size()).of(77, 20).normalize().as_vec3();
        let table = IrradianceTable::new(&picture);
        let across = sun.any_orthonormal_vector();
        let most = table.at(sun).x;
        for degrees in [60.0_f32, 85.0, 87.5, 93.0, 120.0] {
            let (sine, cosine) = degrees.to_radians().sin_cos();
            let found = table.at(sun * cosine + across * sine).x;
            assert!((found / most - cosine.max(0.0)).abs() < 1e-3, "{degrees}: {found} of {most}");
        }
    }
}
