//! Static meshes: the samples of one light, sparse over vertices and slots.

use super::pool::Sparse;
use glam::Vec3;

/// What a vertex knows of one light.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Visibility {
    /// Points of the light tested so far; 0 means not sampled yet. A delta light needs one.
    pub points: u32,
    /// Visibility of the newest points, bit 0 the newest: bit i is point `points - 1 - i` of the sequence.
    pub mask: u16,
}

/// How many points a [`Visibility`] remembers one by one; older ones live on in the sums.
pub const REMEMBERED: u32 = u16::BITS;

impl Visibility {
    /// Notes the visibility of the next point.
    pub fn push(&mut self, visible: bool) {
        self.points += 1;
        self.mask = self.mask << 1 | u16::from(visible);
    }

    /// The remembered points, newest first: index in the sequence, and whether the point is visible.
    pub fn remembered(self) -> impl Iterator<Item = (u32, bool)> {
        (0..self.points.min(REMEMBERED)).map(move |i| (self.points - 1 - i, self.mask >> i & 1 == 1))
    }
}

/// What a slot (one normal of a vertex) knows of an area light: sums over all points of all rounds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AreaSum {
    /// Σ of irradiance samples, W·m⁻².
    pub irradiance: Vec3,
    /// Σ of squared luminance of the samples.
    pub square: f32,
}

impl AreaSum {
    /// Mean irradiance over `points` samples.
    #[must_use]
    pub fn mean(&self, points: u32) -> Vec3 {
        if points == 0 { Vec3::ZERO } else { self.irradiance / points as f32 }
    }

    /// Variance of the mean's luminance as if the points were independent: an upper estimate, since they are stratified.
    #[must_use]
    pub fn variance_of_mean(&self, points: u32) -> f32 {
        if points < 2 {
            return 0.0;
        }
        let n = points as f32;
        let mean = crate::math::luminance(self.irradiance) / n;
        ((self.square / n - mean * mean) / (n - 1.0)).max(0.0)
    }
}

/// The static mesh of one light.
#[derive(Clone, Debug, Default)]
pub struct Layer {
    /// By vertex.
    pub visibility: Sparse<Visibility>,
    /// By slot; written for area lights only. For the others direction, distance and emission are analytic, so a
    /// change of the light's colour or power costs no ray.
    pub sums: Sparse<AreaSum>,
}
