//! Colour luminance, hashing for seeds, sampling sequences, hemispheres, light of polygons, triangles.

pub mod content_hash;
pub mod hemisphere;
pub mod phong_polygon;
pub mod polygon;
pub mod sequence;
pub mod shared_exponent;
pub mod spherical_triangle;
pub mod triangle;
pub mod unit_vector;

use glam::Vec3;

/// Rec.709 luminance Y of a linear RGB colour, in the unit of the colour.
#[must_use]
#[inline]
pub fn luminance(rgb: Vec3) -> f32 {
    rgb.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

/// A 64-bit mix (the finaliser of SplitMix64, Steele et al. 2014): all output bits depend on all input bits.
#[must_use]
#[inline]
pub const fn mix(x: u64) -> u64 {
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// Combines a seed with one more value.
#[must_use]
#[inline]
pub const fn combine(seed: u64, value: u64) -> u64 {
    mix(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ mix(value.wrapping_add(0x9e37_79b9_7f4a_7c15)))
}

/// The axis that a normal is nearest to, of any length, with its sign: 0 to 5.
#[must_use]
pub fn nearest_axis(normal: Vec3) -> u8 {
    let axis = normal.abs().max_position();
    2 * axis as u8 + u8::from(normal[axis] < 0.0)
}
