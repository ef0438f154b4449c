//! A lamp that was measured, as it hangs in a scene.

use super::distribution::Distribution;
use crate::math::content_hash::ContentHash;
use crate::math::luminance;
use crate::scene::light::spot_falloff;
use glam::{Mat3, Vec3};

/// Luminous efficacy by which photometric quantities become radiometric, lm·W⁻¹ (docs/units.md).
pub const EFFICACY: f32 = 683.0;

/// Radiant intensity by direction of a light at a point.
#[derive(Clone, Debug, PartialEq)]
pub struct Lamp {
    distribution: Distribution,
    /// From the lamp's frame to the world.
    frame: Mat3,
    /// W·sr⁻¹ for a candela, by channel.
    watts: Vec3,
    /// Cosines of the half angles of a spot's cone, inner and outer.
    cone: Option<[f32; 2]>,
    /// All of it, W.
    power: Vec3,
}

/// How a lamp is hung and what it is made to emit.
#[derive(Clone, Copy, Debug)]
pub struct Hanging {
    /// From the lamp's frame to the world; its z is the way that it shines.
    pub frame: Mat3,
    /// Colour, of any luminance above 0: that of white is what was measured.
    pub colour: Vec3,
    /// Luminous flux in place of what was measured, lumen.
    pub flux: Option<f32>,
    /// Factor on all of it.
    pub scale: f32,
    /// See [`Lamp`].
    pub cone: Option<[f32; 2]>,
    /// What it emits with its axis as it hangs against upright.
    pub tilt: f32,
}

impl Lamp {
    /// Hangs a lamp; `None` where it would emit nothing.
    #[must_use]
    pub fn new(distribution: Distribution, hanging: &Hanging) -> Option<Self> {
        let measured = distribution.flux();
        let colour = hanging.colour / luminance(hanging.colour);
        let factor = hanging.flux.map_or(hanging.tilt, |flux| flux / measured) * hanging.scale;
        let watts = colour * (factor / EFFICACY);
        let power = watts * measured;
        let lamp = Self { distribution, frame: hanging.frame, watts, cone: hanging.cone, power };
        (measured > 0.0 && power.is_finite() && power.max_element() > 0.0).then_some(lamp)
    }

    /// Radiant intensity in a unit direction away from it, W·sr⁻¹.
    #[must_use]
    pub fn intensity(&self, direction: Vec3) -> Vec3 {
        let candela = self.distribution.candela(self.frame.transpose() * direction);
        let axis = self.frame.z_axis;
        let cone = self.cone.map_or(1.0, |[inner, outer]| spot_falloff(direction.dot(axis), inner, outer));
        self.watts * (candela * cone)
    }

    /// The most in any direction, W·sr⁻¹.
    #[must_use]
    pub fn peak(&self) -> Vec3 {
        self.watts * self.distribution.peak()
    }

    /// Adds where it sends light, as a shape, to one hash, and how much to another.
    pub(in crate::scene) fn add_to(&self, place: &mut ContentHash, power: &mut ContentHash) {
        self.distribution.add_to(place);
        place.frame(&self.frame);
        place.floats(self.cone.as_ref().map_or(&[], |cone| cone));
        power.points(&[self.watts]);
    }

    /// Radiant flux without a cone, W.
    #[must_use]
    pub const fn power(&self) -> Vec3 {
        self.power
    }
}
