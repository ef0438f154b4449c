//! How much of a highlight is visible where light comes from all around, by directions that were traced.
//!
//! Directions drawn for irradiance seldom fall into a narrow lobe. Where enough do, they tell what of the highlight is visible; where not,
//! those around it tell what of the sky near the lobe is, each for the solid angle that it stands for: what occludes is larger than the lobe,
//! mostly.

use crate::light::arrival::Arrival;
use crate::light::receiver::Receiver;
use crate::math::luminance;
use glam::Vec3;
use smallvec::SmallVec;

/// Directions that tell enough, were they of equal weight.
const ENOUGH: f32 = 6.0;
/// Exponents of the cosine to the mirrored eye, the narrowest first, by which directions near the lobe count.
const AROUND: [i32; 4] = [64, 16, 4, 1];

/// A direction that was traced.
struct Traced {
    /// What it adds to the highlight.
    weight: f32,
    /// Solid angle that it stands for, times the cosine to the normal.
    projected: f32,
    /// Cosine to the mirrored eye.
    near: f32,
    visible: bool,
}

/// Visible share of a highlight by directions that were traced, each with whether it is free; `lobe` tells the lobe in a direction, sr⁻¹.
/// `None` where no direction tells anything.
pub fn lobe_share(
    receiver: &Receiver,
    lobe: impl Fn(Vec3) -> f32,
    traced: impl Iterator<Item = (Arrival, bool)>,
) -> Option<f32> {
    let Receiver { normal, to_eye, .. } = *receiver;
    let mirrored = normal * (2.0 * normal.dot(to_eye)) - to_eye;
    let traced: SmallVec<[Traced; 64]> = traced
        .filter_map(|(arrival, visible)| {
            let cosine = normal.dot(arrival.direction);
            (cosine > 0.0).then(|| Traced {
                weight: luminance(arrival.facing) * cosine * lobe(arrival.direction),
                projected: arrival.measure * cosine,
                near: mirrored.dot(arrival.direction).max(0.0),
                visible,
            })
        })
        .collect();
    let exact = Shares::of(traced.iter().map(|t| (t.weight, t.visible)));
    if exact.effective() >= ENOUGH {
        return exact.share();
    }
    let around = |exponent: i32| Shares::of(traced.iter().map(|t| (t.projected * t.near.powi(exponent), t.visible)));
    let enough = AROUND.into_iter().map(around).find(|shares| shares.effective() >= ENOUGH);
    enough.unwrap_or_else(|| around(1)).share()
}

/// Weighted directions.
struct Shares {
    visible: f32,
    all: f32,
    squares: f32,
}

impl Shares {
    fn of(weighted: impl Iterator<Item = (f32, bool)>) -> Self {
        let mut shares = Self { visible: 0.0, all: 0.0, squares: 0.0 };
        for (weight, visible) in weighted {
            shares.all += weight;
            shares.squares += weight * weight;
            shares.visible += if visible { weight } else { 0.0 };
        }
        shares
    }

    /// How many of equal weight tell as much.
    fn effective(&self) -> f32 {
        if self.squares > 0.0 { self.all * self.all / self.squares } else { 0.0 }
    }

    fn share(&self) -> Option<f32> {
        (self.all > 1e-12).then(|| self.visible / self.all)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::Gloss;
    use crate::math::hemisphere::Density;
    use crate::math::sequence::Sequence;

    fn arrivals(count: u32) -> impl Iterator<Item = Arrival> {
        (0..count).map(|i| {
            let [u, v, ..] = Sequence::new(3).point(i);
            let direction = Density::Cosine.direction(Vec3::Y, [u, v]);
            let measure = Density::Cosine.pdf(direction.y).recip();
            Arrival { direction, distance: f32::INFINITY, facing: Vec3::splat(measure), measure }
        })
    }

    fn receiver(to_eye: Vec3, shininess: f32) -> Receiver {
        let lobe = Gloss::Phong { shininess, mirror: false }.seen(Vec3::Y, to_eye);
        Receiver { x: Vec3::ZERO, normal: Vec3::Y, to_eye, lobe }
    }

    fn share(to_eye: Vec3, exponent: i32, is_visible: impl Fn(Vec3) -> bool) -> f32 {
        let receiver = receiver(to_eye, exponent as f32);
        let mirrored = Vec3::new(-to_eye.x, to_eye.y, -to_eye.z);
        let lobe = |direction: Vec3| mirrored.dot(direction).max(0.0).powi(exponent);
        lobe_share(&receiver, lobe, arrivals(64).map(|a| (a, is_visible(a.direction)))).expect("some")
    }

    /// Half of the sky is hidden: highlights well on either side are whole or gone, however narrow, those astride are half there.
    #[test]
    fn narrow_lobes_see_what_is_around_them() {
        let (left, right) = (Vec3::new(-0.8, 0.6, 0.0), Vec3::new(0.8, 0.6, 0.0));
        for exponent in [30, 1000, 100_000] {
            let [open, hidden, astride] =
                [left, right, Vec3::Y].map(|to_eye| share(to_eye, exponent, |direction| direction.x > 0.0));
            assert!(open > 0.95 && hidden < 0.05, "{exponent}: {open} {hidden}");
            assert!((astride - 0.5).abs() < 0.25, "{exponent}: {astride}");
        }
    }

    /// A sun that most directions were drawn for decides by itself once the lobe holds it.
    #[test]
    fn a_bright_spot_in_the_lobe_decides() {
        let spot = Vec3::new(0.6, 0.8, 0.0);
        let receiver = receiver(Vec3::new(-0.6, 0.8, 0.0), 50.0);
        let sun = Arrival { direction: spot, distance: f32::INFINITY, facing: Vec3::splat(3.0), measure: 1e-5 };
        let traced = arrivals(16).map(|a| (a, true)).chain((0..48).map(|_| (sun, false)));
        let found = lobe_share(&receiver, |d| spot.dot(d).max(0.0).powi(50), traced);
        assert!(found.is_some_and(|share| share < 0.1), "{found:?}");
    }
}
