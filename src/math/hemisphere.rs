//! Directions over hemispheres: a frame about a normal, and maps of the unit square that keep its areas in proportion to
//! solid angle or to projected solid angle, so that strata of the square stay strata of the light.

use glam::Vec3;
use std::f32::consts::{PI, TAU};

/// How directions are spread over a hemisphere.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Density {
    /// In proportion to the cosine to the normal: cosθ/π, sr⁻¹.
    Cosine,
    /// Evenly: 1/(2π), sr⁻¹.
    Uniform,
}

impl Density {
    /// The unit direction about the unit `normal` for a point of the square [0, 1)²: the first coordinate is sin²θ (cosine)
    /// or 1 − cosθ (uniform), the second the turn about the normal.
    #[must_use]
    #[inline]
    pub fn direction(self, normal: Vec3, [u, v]: [f32; 2]) -> Vec3 {
        let cosine = match self {
            Self::Cosine => (1.0 - u).sqrt(),
            Self::Uniform => 1.0 - u,
        };
        let sine = match self {
            Self::Cosine => u.sqrt(),
            Self::Uniform => (u * (2.0 - u)).sqrt(),
        };
        let (sin_turn, cos_turn) = (v * TAU).sin_cos();
        let (x, y) = normal.any_orthonormal_pair();
        x * (sine * cos_turn) + y * (sine * sin_turn) + normal * cosine
    }

    /// Density of [`Self::direction`], sr⁻¹, for a direction at `cosine` to the normal; 0 below the horizon.
    #[must_use]
    #[inline]
    pub fn pdf(self, cosine: f32) -> f32 {
        match self {
            Self::Cosine => cosine.max(0.0) / PI,
            Self::Uniform if cosine > 0.0 => 1.0 / TAU,
            Self::Uniform => 0.0,
        }
    }

    /// The least density at which [`Self::direction`] draws; a smaller one is a rounding error of the cosine.
    #[inline]
    const fn least_pdf(self) -> f32 {
        match self {
            // The lowest cosine is the root of the last step of f32 below 1: 2⁻¹².
            Self::Cosine => 1.0 / (4096.0 * PI),
            Self::Uniform => 1.0 / TAU,
        }
    }
}

/// The same share of directions about each of several normals.
///
/// One set of directions drawn from the mixture serves all the normals: weighted by the reciprocal of the whole
/// mixture's density, it estimates the irradiance of each without bias.
#[derive(Clone, Copy, Debug)]
pub struct Mixture<'a> {
    normals: &'a [Vec3],
    density: Density,
}

/// A direction and what it stands for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Direction {
    /// Unit direction.
    pub direction: Vec3,
    /// Reciprocal of the mixture's density there, sr.
    pub measure: f32,
}

impl<'a> Mixture<'a> {
    /// The mixture about unit `normals`; with none of them there are no directions.
    #[must_use]
    pub const fn new(normals: &'a [Vec3], density: Density) -> Self {
        Self { normals, density }
    }

    /// Number of normals.
    #[must_use]
    pub const fn lobes(&self) -> usize {
        self.normals.len()
    }

    /// The direction of a point of the square [0, 1)². The square is cut along its first coordinate into one strip a
    /// normal. `None` without normals.
    #[must_use]
    #[inline]
    pub fn at(&self, [u, v]: [f32; 2]) -> Option<Direction> {
        let stretched = u * self.normals.len() as f32;
        let lobe = (stretched as usize).min(self.normals.len().checked_sub(1)?);
        // Just under 1, where the product above was rounded up.
        let within = (stretched - lobe as f32).min(1.0 - f32::EPSILON / 2.0);
        let direction = self.density.direction(self.normals[lobe], [within, v]);
        let least = self.density.least_pdf() / self.normals.len() as f32;
        Some(Direction { direction, measure: self.pdf(direction).max(least).recip() })
    }

    /// Density of the directions, sr⁻¹.
    #[must_use]
    #[inline]
    pub fn pdf(&self, direction: Vec3) -> f32 {
        let sum: f32 = self.normals.iter().map(|n| self.density.pdf(n.dot(direction))).sum();
        sum / self.normals.len() as f32
    }

    /// Mean over the normals of the cosine, 0 below a horizon.
    #[must_use]
    #[inline]
    pub fn mean_cosine(&self, direction: Vec3) -> f32 {
        let sum: f32 = self.normals.iter().map(|n| n.dot(direction).max(0.0)).sum();
        sum / self.normals.len() as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sequence::Sequence;

    /// The mean of measure · f over the square is the integral of f: here of the cosine to each normal, π.
    #[test]
    fn every_normal_of_a_mixture_sees_a_whole_hemisphere() {
        let normals = [Vec3::Z, Vec3::new(0.6, 0.0, 0.8), Vec3::new(0.0, -0.28, 0.96)];
        let sequence = Sequence::new(5);
        for density in [Density::Cosine, Density::Uniform] {
            for count in 1..=normals.len() {
                let mixture = Mixture::new(&normals[..count], density);
                for normal in &normals[..count] {
                    let term = |i| {
                        let [u, v, ..] = sequence.point(i);
                        let Direction { direction, measure } = mixture.at([u, v]).unwrap();
                        assert!(direction.is_normalized() && measure.is_finite());
                        f64::from(normal.dot(direction).max(0.0) * measure)
                    };
                    let mean = (0..16_384).map(term).sum::<f64>() / 16_384.0;
                    assert!((mean / std::f64::consts::PI - 1.0).abs() < 2e-3, "{density:?}, {count}: {mean}");
                }
            }
        }
    }

    #[test]
    fn corners_of_the_square_are_directions_too() {
        let normals = [Vec3::X, Vec3::NEG_Y, Vec3::Z];
        let last = 1.0 - f32::EPSILON / 2.0;
        for density in [Density::Cosine, Density::Uniform] {
            let mixture = Mixture::new(&normals, density);
            for u in [0.0, 1.0 / 3.0, 0.999_999_9 / 3.0, 2.0 / 3.0, last] {
                let Direction { direction, measure } = mixture.at([u, last]).unwrap();
                assert!(direction.is_normalized() && (0.0..=3.0 * 4096.0 * PI * 1.001).contains(&measure), "{measure}");
            }
        }
        assert_eq!(Mixture::new(&[], Density::Cosine).at([0.5, 0.5]), None);
    }
}
