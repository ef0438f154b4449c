//! Highlights that lie between the corners of a triangle.
//!
//! A highlight peaks where the normal n is the half vector h between light and eye. Both are nearly linear over a small
//! triangle, so that the peak is where the triangle with corners n − h in the space of directions comes nearest to its origin.

use super::receiver::Receiver;
use super::source::{Place, Source};
use crate::bsdf::Gloss;
use crate::math::triangle::nearest_to_origin;
use glam::Vec3;
use std::f32::consts::PI;

/// A glossy triangle, seen by an eye.
#[derive(Clone, Copy, Debug)]
pub struct GlossyTriangle {
    positions: [Vec3; 3],
    normals: [Vec3; 3],
    eye: Vec3,
    gloss: Gloss,
    middle: SurfacePoint,
    /// Largest distance of a corner, and of its normal, from the middle's.
    extent: f32,
    bend: f32,
}

/// A point of the triangle with its normal.
#[derive(Clone, Copy, Debug)]
struct SurfacePoint {
    x: Vec3,
    normal: Vec3,
}

/// The brightest point of a light's highlight on a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Peak {
    /// Where, barycentric.
    pub at: [f32; 3],
    /// Unoccluded specular luminance there (a textured light has its mean colour), W·sr⁻¹·m⁻².
    pub specular: Vec3,
    /// Share of the triangle that the highlight covers, ≤ 1.
    pub share: f32,
}

/// Distance between normal and half vector, in standard deviations of the lobe, at which a highlight has faded.
const FADED: f32 = 3.0;
/// Size of a triangle in standard deviations of the lobe up to which its corners show the highlight well enough.
const RESOLVED: f32 = 0.5;
/// Steps of the search for the peak; each looks at a third of the triangle before, around the point found.
const STEPS: usize = 4;
const SHRINK: f32 = 0.35;

impl GlossyTriangle {
    /// A triangle with unit shading normals at its corners.
    #[must_use]
    pub fn new(positions: [Vec3; 3], normals: [Vec3; 3], gloss: Gloss, eye: Vec3) -> Self {
        let x = (positions[0] + positions[1] + positions[2]) / 3.0;
        let normal = (normals[0] + normals[1] + normals[2]).normalize_or(normals[0]);
        let farthest =
            |all: [Vec3; 3], from: Vec3| all.map(|p| p.distance_squared(from)).into_iter().fold(0.0, f32::max);
        let (extent, bend) = (farthest(positions, x).sqrt(), farthest(normals, normal).sqrt());
        Self { positions, normals, eye, gloss, middle: SurfacePoint { x, normal }, extent, bend }
    }

    fn place(&self, w: [f32; 3]) -> SurfacePoint {
        let mix = |v: [Vec3; 3]| v[0] * w[0] + v[1] * w[1] + v[2] * w[2];
        SurfacePoint { x: mix(self.positions), normal: mix(self.normals).normalize_or(self.normals[0]) }
    }

    /// Standard deviation of the lobe in n − h: cos(2δ)^s is about exp(−2sδ²).
    fn deviation(&self) -> f32 {
        0.5 / self.gloss.exponent().max(1.0).sqrt()
    }

    /// The peak of a light's highlight; `None` where it is off the triangle, or wide enough for the corners to show it,
    /// or the light has no closed form. Highlights that cannot exceed `floor`, in luminance, W·sr⁻¹·m⁻², are passed
    /// over.
    #[must_use]
    pub fn peak(&self, source: &Source, floor: f32) -> Option<Peak> {
        let light = source.place(self.middle.x)?;
        if !self.may_hide(light) {
            return None;
        }
        let (at, area) = self.nearest(light)?;
        let place = self.place(at);
        let ceiling = source.bound(place.x, place.normal) * (self.gloss.exponent() + 2.0) / (2.0 * PI);
        if ceiling <= floor {
            return None;
        }
        let to_eye = (self.eye - place.x).normalize_or(place.normal);
        let lobe = self.gloss.seen(place.normal, to_eye);
        let receiver = Receiver { x: place.x, normal: place.normal, to_eye, lobe };
        let blob = PI * (self.deviation().powi(2) + light.half_angle().powi(2) * 0.25);
        Some(Peak { at, specular: source.mean_specular(&receiver)?, share: (blob / area.max(blob)).min(1.0) })
    }

    /// Whether the light's highlight can peak on the triangle without its corners showing it.
    fn may_hide(&self, light: Place) -> bool {
        let to_light = light.direction(self.middle.x);
        let to_eye = self.eye - self.middle.x;
        let half = to_light + to_eye.normalize_or(self.middle.normal);
        // A half vector turns by half the angle that the directions turn by, more where they are far apart.
        let turn = self.extent * (light.nearness(self.middle.x) + to_eye.length_recip()) / half.length().max(0.1);
        let spread = self.bend + turn;
        if spread < RESOLVED * self.deviation() {
            return false;
        }
        let gap = self.middle.normal.distance(half.normalize_or(self.middle.normal));
        gap < 1.5 * spread + light.half_angle() * 0.5 + FADED * self.deviation()
    }

    /// Where n comes nearest to h, and the area of the triangle in n − h; `None` if it stays farther than highlights reach.
    fn nearest(&self, light: Place) -> Option<([f32; 3], f32)> {
        let gap = |w: [f32; 3]| {
            let place = self.place(w);
            let to_eye = (self.eye - place.x).normalize_or(place.normal);
            place.normal - (light.direction(place.x) + to_eye).normalize_or(place.normal)
        };
        let mut corners = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let (mut best, mut area) = ([0.0; 3], 0.0);
        for step in 0..STEPS {
            let gaps = corners.map(gap);
            if step == 0 {
                area = (gaps[1] - gaps[0]).cross(gaps[2] - gaps[0]).length() * 0.5;
            }
            let w = nearest_to_origin(gaps);
            best = [0, 1, 2].map(|i| (0..3).map(|k| corners[k][i] * w[k]).sum());
            let linear = gaps[0] * w[0] + gaps[1] * w[1] + gaps[2] * w[2];
            let (found, doubt) = (gap(best), linear.distance(gap(best)));
            if found.length().min(linear.length()) - 2.0 * doubt > light.half_angle() * 0.5 + FADED * self.deviation() {
                return None;
            }
            if doubt < 0.3 * self.deviation() {
                break;
            }
            corners = corners.map(|c| [0, 1, 2].map(|i| best[i] + (c[i] - best[i]) * SHRINK));
        }
        Some((best, area))
    }
}

/// Directions to a light, as far as a highlight goes.
impl Place {
    fn direction(self, x: Vec3) -> Vec3 {
        match self {
            Self::Far(direction) => direction,
            Self::Near { middle, .. } => (middle - x).normalize_or_zero(),
        }
    }

    /// One over the distance.
    fn nearness(self, x: Vec3) -> f32 {
        match self {
            Self::Far(_) => 0.0,
            Self::Near { middle, .. } => (middle - x).length_recip(),
        }
    }

    /// Half the angle that the light takes, radians.
    const fn half_angle(self) -> f32 {
        match self {
            Self::Far(_) => 0.0,
            Self::Near { half_angle, .. } => half_angle,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sequence::Sequence;
    use crate::scene::light::LightKind;

    const SHARP: Gloss = Gloss::Phong { shininess: 300.0, mirror: false };

    /// The peak found on bent triangles, large and small, is as bright as the brightest point of a fine grid.
    #[test]
    fn peaks_are_as_bright_as_a_grid_search_finds() {
        let sequence = Sequence::new(2);
        let point = |i| Vec3::from_slice(&sequence.point(i)[..3]) * 2.0 - Vec3::ONE;
        let (mut tried, mut missed) = (0, 0);
        for i in 0..400 {
            let normals = [0, 1, 2].map(|k| (Vec3::Z + point(8 * i + k) * 0.3).normalize());
            let positions = [3, 4, 5].map(|k| point(8 * i + k) * Vec3::new(1.0, 1.0, 0.1));
            let [eye, position] = [6, 7].map(|k| point(8 * i + k) * 2.0 + Vec3::Z * 4.0);
            let source = Source::Delta(LightKind::Point { position, intensity: Vec3::ONE });
            let triangle = GlossyTriangle::new(positions, normals, SHARP, eye);
            let specular = |w: [f32; 3]| {
                let SurfacePoint { x, normal } = triangle.place(w);
                let to_eye = (eye - x).normalize();
                let receiver = Receiver { x, normal, to_eye, lobe: SHARP.seen(normal, to_eye) };
                source.mean_specular(&receiver).map_or(0.0, |s| s.x)
            };
            let n = 150_u16;
            let grid = (0..=n).flat_map(|j| (0..=n - j).map(move |k| (j, k)));
            let at = |(j, k)| [j, k, n - j - k].map(|x| f32::from(x) / f32::from(n));
            let brightest = grid.map(|g| specular(at(g))).fold(0.0, f32::max);
            let corners = [at((n, 0)), at((0, n)), at((0, 0))].map(specular);
            if brightest < 0.05 || corners.iter().any(|&c| c > 0.5 * brightest) {
                continue;
            }
            tried += 1;
            let found = triangle.peak(&source, 0.0);
            missed += u32::from(found.is_none_or(|peak| peak.specular.x < 0.9 * brightest));
        }
        assert!(tried > 50 && missed * 50 <= tried, "{missed} of {tried} missed");
    }
}
