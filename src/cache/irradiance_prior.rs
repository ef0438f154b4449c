//! Indirect light by place: what surfaces show that neither gathered nor are predicted by any that did.
//!
//! Scenes of thousands of pieces have vertices that no coarser one predicts. Until they gather, the mean of what was gathered in
//! the cells around them, on surfaces that face the same way, is nearer to their light than none: a picture is right in the mean
//! from its first rays on, and no face is black beside lit ones. Nothing is computed with it.

use super::pool::map_bytes;
use crate::estimate::light_vector::LightVector;
use crate::math::nearest_axis;
use glam::{IVec3, Vec3};
use rustc_hash::FxHashMap;
use std::f32::consts::PI;

/// Edges of the cells against the scene's scale, coarse to fine.
const CELLS: [f32; 4] = [1.0, 1.0 / 4.0, 1.0 / 16.0, 1.0 / 64.0];
/// Rays that a larger cell's mean counts for beside a cell's own.
const PRIOR: f32 = 16.0;

/// A cell's size, place and side: the axis along which its surfaces face most.
type Key = (u8, IVec3, u8);
/// The whole scene, whatever way surfaces face.
const ALL: Key = (u8::MAX, IVec3::ZERO, u8::MAX);

/// Means of what was gathered, by place and side.
#[derive(Clone, Debug, Default)]
pub struct IrradiancePrior {
    cells: FxHashMap<Key, Mean>,
    scale: f32,
}

#[derive(Clone, Copy, Debug, Default)]
struct Mean {
    /// Σ rays × irradiance, W·m⁻².
    sum: Vec3,
    rays: f32,
}

impl IrradiancePrior {
    pub(super) fn new(scale: f32) -> Self {
        Self { scale, ..Self::default() }
    }

    /// Takes in a round at a place of this unit normal.
    pub(super) fn note(&mut self, position: Vec3, normal: Vec3, round: &LightVector) {
        let rays = round.samples() as f32;
        for key in self.keys(position, normal) {
            let mean = self.cells.entry(key).or_default();
            mean.sum += round.irradiance() * rays;
            mean.rays += rays;
        }
    }

    /// Diffuse luminance to be expected at a place of this unit normal, W·sr⁻¹·m⁻²: a larger cell's mean is the prior of the
    /// smaller one's.
    pub(super) fn at(&self, position: Vec3, normal: Vec3) -> Vec3 {
        let means = self.keys(position, normal).into_iter().map_while(|key| self.cells.get(&key));
        means.fold(Vec3::ZERO, |larger, mean| {
            let prior = if larger == Vec3::ZERO { 0.0 } else { PRIOR };
            (mean.sum / PI + larger * prior) / (mean.rays + prior)
        })
    }

    /// Takes in that the lights have changed, all by the ratio `common`, by channel, or each by its own.
    pub(super) fn relight(&mut self, common: Option<Vec3>) {
        match common {
            Some(ratio) => self.cells.values_mut().for_each(|mean| mean.sum *= ratio),
            None => self.cells.clear(),
        }
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        map_bytes(&self.cells)
    }

    /// The cells of a place, coarse to fine.
    fn keys(&self, position: Vec3, normal: Vec3) -> [Key; CELLS.len() + 1] {
        let side = nearest_axis(normal);
        let key = |size: usize| (size as u8, (position / (self.scale * CELLS[size])).floor().as_ivec3(), side);
        [ALL, key(0), key(1), key(2), key(3)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::hemisphere::Sample;

    /// A round of so many rays whose mean diffuse luminance is `luminance`.
    fn round(rays: u32, luminance: f32) -> LightVector {
        let mut vector = LightVector::default();
        let sample = Sample { direction: Vec3::Y, radiance: Vec3::splat(luminance), weight: PI };
        (0..rays).for_each(|_| vector.push(Vec3::Y, &sample));
        vector
    }

    fn prior(rounds: &[(Vec3, Vec3, u32, f32)]) -> IrradiancePrior {
        let mut prior = IrradiancePrior::new(1.0);
        rounds.iter().for_each(|&(at, normal, rays, luminance)| prior.note(at, normal, &round(rays, luminance)));
        prior
    }

    #[test]
    fn a_place_is_expected_to_show_what_was_gathered_around_it() {
        let (here, there) = (Vec3::splat(0.01), Vec3::splat(0.9));
        let prior = prior(&[(here, Vec3::Y, 4096, 1.0), (there, Vec3::Y, 4096, 3.0)]);
        let at = |position| prior.at(position, Vec3::Y).x;
        assert!((at(here) - 1.0).abs() < 0.02 && (at(there) - 3.0).abs() < 0.02, "{} {}", at(here), at(there));
        assert!((at(Vec3::splat(0.5)) - 2.0).abs() < 1e-4, "between them, as in the mean: {}", at(Vec3::splat(0.5)));
    }

    #[test]
    fn few_rays_lean_on_those_around() {
        let here = Vec3::splat(0.01);
        let prior = prior(&[(Vec3::splat(0.9), Vec3::Y, 4096, 3.0), (here, Vec3::Y, PRIOR as u32, 1.0)]);
        let value = prior.at(here, Vec3::Y).x;
        assert!(1.0 < value && value < 1.5, "{value}");
    }

    #[test]
    fn surfaces_that_face_elsewhere_show_the_mean_of_all() {
        let here = Vec3::splat(0.01);
        let prior = prior(&[(here, Vec3::Y, 64, 1.0), (here, Vec3::X, 64, 5.0)]);
        assert!((prior.at(here, -Vec3::Z).x - 3.0).abs() < 1e-5);
        assert!(prior.at(here, Vec3::Y).x < 1.2 && prior.at(here, Vec3::X).x > 4.8);
    }

    #[test]
    fn it_follows_the_lights() {
        let here = Vec3::splat(0.01);
        let mut prior = prior(&[(here, Vec3::Y, 64, 2.0)]);
        prior.relight(Some(Vec3::new(1.0, 0.5, 4.0)));
        assert!((prior.at(here, Vec3::Y) - Vec3::new(2.0, 1.0, 8.0)).length() < 1e-4);
        prior.relight(None);
        assert_eq!(prior.at(here, Vec3::Y), Vec3::ZERO);
    }
}
