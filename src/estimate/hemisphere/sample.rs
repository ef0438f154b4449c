//! What a gather hands out.

use glam::Vec3;

/// Light from one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Unit direction towards where the light comes from.
    pub direction: Vec3,
    /// Radiance, W·sr⁻¹·m⁻².
    pub radiance: Vec3,
    /// Solid angle that the sample stands for, sr: the *mean* of radiance · max(0, n·direction) · weight over the
    /// samples of a gather estimates the irradiance on a surface of normal n, for each n gathered for.
    pub weight: f32,
}

/// What a gather did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Gathered {
    /// Rays traced: calls of `radiance`.
    pub rays: u32,
    /// Samples handed out: fewer where a split cell's ray was dropped.
    pub samples: u32,
}
