//! What all sources emit at a time, and by how much it changes from one time to another.

use crate::math::luminance;
use glam::Vec3;

/// What all sources emit at a time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Lighting {
    /// What each source counts times, by channel, against what the scene says: 1 as loaded, 0 switched off.
    pub factors: Vec<Vec3>,
    /// Where each is, scene units, if it can be moved.
    pub positions: Vec<Option<Vec3>>,
    /// What they emit together, roughly, W.
    pub power: Vec3,
}

impl Lighting {
    /// How many times as bright the sources are together in `to`; 1 where there is no telling, because all are off in
    /// either.
    #[must_use]
    pub fn brightening(&self, to: &Self) -> f32 {
        let ratio = luminance(to.power) / luminance(self.power);
        if ratio.is_finite() && ratio > 0.0 { ratio } else { 1.0 }
    }

    /// What each channel of all light is multiplied by to get from `self` to `to`; `None` if sources change
    /// differently, if one that is on has moved, or if a channel was or is dark.
    #[must_use]
    pub fn common_ratio(&self, to: &Self) -> Option<Vec3> {
        let is_on = |source: usize| (self.factors[source], to.factors[source]) != (Vec3::ZERO, Vec3::ZERO);
        let mut moved = self.positions.iter().zip(&to.positions).map(|(from, to)| from != to).enumerate();
        if moved.any(|(source, moved)| moved && is_on(source)) {
            return None;
        }
        let pairs = || self.factors.iter().zip(&to.factors).filter(|&(&a, &b)| (a, b) != (Vec3::ZERO, Vec3::ZERO));
        let ratio = pairs().next().map(|(&a, &b)| b / a)?;
        let common = pairs().all(|(&a, &b)| (b - a * ratio).abs().cmple(b * 1e-6).all());
        (common && ratio.is_finite() && ratio.min_element() > 0.0).then_some(ratio)
    }
}

/// What all of `from` are multiplied by to get `to`, channel by channel (a dark one by 1); `None` if they differ.
pub(super) fn ratio_by_channel(from: &[Vec3], to: &[Vec3]) -> Option<Vec3> {
    let channel = |c: usize| {
        let pairs = || from.iter().zip(to).map(|(f, t)| (f[c], t[c]));
        let (most, its) = pairs().fold((0.0, 0.0), |best, pair| if pair.0 > best.0 { pair } else { best });
        let ratio = if most > 0.0 { its / most } else { 1.0 };
        pairs().all(|(f, t)| (t - f * ratio).abs() <= t * 1e-6).then_some(ratio)
    };
    Some(Vec3::new(channel(0)?, channel(1)?, channel(2)?))
}
