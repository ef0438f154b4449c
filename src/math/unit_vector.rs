//! Unit vectors in 32 bits: the sphere unfolded onto a square by way of an octahedron \[Cigolle14\].

use glam::{Vec2, Vec3};

/// Steps from the middle of the square to its rim.
const STEPS: f32 = i16::MAX as f32;

/// A unit vector to within 7·10⁻⁵; those along the axes exactly.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UnitVector([i16; 2]);

impl UnitVector {
    /// The nearest to a vector of any length; one of length 0 or none counts as Z.
    #[must_use]
    pub fn new(vector: Vec3) -> Self {
        let size = vector.abs().element_sum();
        let at = if size > 0.0 && size.is_finite() { vector / size } else { Vec3::Z };
        let at = if at.z < 0.0 { folded(at.truncate()) } else { at.truncate() };
        Self((at * STEPS).round().to_array().map(|x| x as i16))
    }

    /// Its bits.
    #[must_use]
    pub const fn bits(self) -> u32 {
        let Self([x, y]) = self;
        (x as u16 as u32) << 16 | y as u16 as u32
    }

    /// The vector.
    #[must_use]
    #[inline]
    pub fn get(self) -> Vec3 {
        let at = Vec2::from_array(self.0.map(f32::from)) / STEPS;
        let z = 1.0 - at.abs().element_sum();
        let at = if z < 0.0 { folded(at) } else { at };
        at.extend(z).normalize()
    }
}

/// The lower half of the octahedron lies beyond the diagonals of the square, turned over them.
fn folded(at: Vec2) -> Vec2 {
    (1.0 - Vec2::new(at.y, at.x).abs()) * Vec2::ONE.copysign(at)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::mix;
    use std::f32::consts::TAU;

    #[test]
    fn directions_are_kept() {
        for i in 0..20_000_u64 {
            let random = |what: u64| (mix(3 * i + what) >> 40) as f32 / (1 << 24) as f32;
            let (z, turn) = (2.0 * random(0) - 1.0, random(1) * TAU);
            let direction = (Vec2::from_angle(turn) * (1.0 - z * z).sqrt()).extend(z);
            for length in [1.0, 1e-20, 1e20] {
                let found = UnitVector::new(direction * length).get();
                assert!((found - direction).length() < 7e-5, "{direction} {found}");
                assert!((found.length() - 1.0).abs() < 1e-6, "{found}");
            }
        }
    }

    #[test]
    fn axes_are_kept_exactly_and_what_has_no_direction_gets_one() {
        for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
            assert_eq!([axis, -axis].map(|axis| UnitVector::new(axis).get()), [axis, -axis]);
        }
        for none in [Vec3::ZERO, Vec3::NAN, Vec3::INFINITY] {
            assert_eq!(UnitVector::new(none).get(), Vec3::Z);
        }
    }
}
