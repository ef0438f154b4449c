//! Light that arrives at a place from one direction: what every source is sampled to.

use glam::Vec3;

/// Light from one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arrival {
    /// Unit direction towards the light.
    pub direction: Vec3,
    /// Distance to the light, scene units; infinite for a directional one.
    pub distance: f32,
    /// Irradiance on a plane facing the light, W·m⁻²; for a sample of an area light, as if all of it were there.
    pub facing: Vec3,
    /// Solid angle that the sample stands for, sr, the inverse of its density; 0 where light has a single direction.
    pub measure: f32,
}

impl Arrival {
    /// Light that comes from a single direction: `facing` is its irradiance on a plane facing it, W·m⁻².
    pub(super) const fn single(direction: Vec3, distance: f32, facing: Vec3) -> Self {
        Self { direction, distance, facing, measure: 0.0 }
    }

    /// Irradiance on a surface of unit `normal`, W·m⁻².
    #[must_use]
    pub fn irradiance(&self, normal: Vec3) -> Vec3 {
        self.facing * normal.dot(self.direction).max(0.0)
    }
}
