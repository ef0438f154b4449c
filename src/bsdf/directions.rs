//! Unit directions about an axis.

use glam::Vec3;
use std::f32::consts::TAU;

/// A unit direction chosen by `u` ∈ [0, 1)² in proportion to the cosine at a unit `normal`: of density cosθ/π, sr⁻¹.
#[must_use]
pub fn sample_diffuse(normal: Vec3, [u, v]: [f32; 2]) -> Vec3 {
    around(normal, u.sqrt(), v)
}

/// The unit direction at angle acos(`cosine`) from a unit `axis`, turned about it by `turn` ∈ [0, 1).
pub(super) fn around(axis: Vec3, cosine: f32, turn: f32) -> Vec3 {
    let (x, y) = axis.any_orthonormal_pair();
    let (sin, cos) = (turn * TAU).sin_cos();
    let radius = (1.0 - cosine * cosine).max(0.0).sqrt();
    x * (radius * cos) + y * (radius * sin) + axis * cosine
}
