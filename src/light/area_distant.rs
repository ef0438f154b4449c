//! Area lights from afar: each polygon as a point in its middle.

use super::facets::Outlines;
use crate::math::polygon::edges;
use glam::{DVec3, Vec3};

/// The polygons of a source as points.
#[derive(Clone, Debug, Default)]
pub struct Distant {
    polygons: Vec<Points>,
    /// Distance from the source's centre from which they stand in for the polygons, scene units.
    pub(super) from: f32,
    /// The same where a few per cent do.
    pub(super) rough_from: f32,
}

/// Polygons computed side by side.
const LANES: usize = 8;

/// Middles and area vectors of some polygons, coordinate by coordinate; spare ones have no area.
#[derive(Clone, Copy, Debug)]
struct Points {
    middle: [[f32; LANES]; 3],
    area: [[f32; LANES]; 3],
}

impl Points {
    fn new(points: &[(Vec3, Vec3)]) -> Self {
        let at = |lane: usize| points.get(lane).copied().unwrap_or((points[0].0, Vec3::ZERO));
        let coordinates =
            |of: fn((Vec3, Vec3)) -> Vec3| [0, 1, 2].map(|axis| std::array::from_fn(|lane| of(at(lane))[axis]));
        Self { middle: coordinates(|p| p.0), area: coordinates(|p| p.1) }
    }

    /// Sum of cosθ cosθ_l A / d² at `x` for a receiver of unit `normal`; exact also where that is negative.
    fn irradiance(&self, x: Vec3, normal: Vec3, both_sides: bool) -> f32 {
        let ([mx, my, mz], [ax, ay, az]) = (&self.middle, &self.area);
        let back = if both_sides { 1.0 } else { 0.0 };
        let mut terms = [0.0; LANES];
        // A plain loop, which compilers turn into vector instructions.
        for lane in 0..LANES {
            let (dx, dy, dz) = (mx[lane] - x.x, my[lane] - x.y, mz[lane] - x.z);
            let away = ax[lane] * dx + ay[lane] * dy + az[lane] * dz;
            let facing = (-away).max(back * away);
            let squared = dx * dx + dy * dy + dz * dz;
            terms[lane] = (normal.x * dx + normal.y * dy + normal.z * dz) * facing / (squared * squared);
        }
        terms.iter().sum()
    }
}

/// Distance in radii of the largest polygon from which a point stands in for it. Its error falls with the square: 1.0e-4 of
/// what a receiver facing the source gets, 1.8e-4 of the irradiance itself where that is not grazing (measured:
/// tests/light/area.rs).
const RADII: f32 = 128.0;
/// The same where a few per cent do.
const ROUGH_RADII: f32 = 12.0;

impl Distant {
    /// Prepares the polygons of a source of the given centre and radius.
    #[must_use]
    pub fn new(outlines: &Outlines, centre: Vec3, radius: f32) -> Self {
        let mut largest = 0.0_f64;
        let mut point = |corners: &[DVec3], base: DVec3| {
            let area: DVec3 = edges(corners).map(|(a, b)| a.cross(b) * 0.5).sum();
            let unit = area.normalize_or_zero();
            // Area-weighted centroid of the fan from the first corner.
            let moment: DVec3 = edges(corners).map(|(a, b)| (a + b) * (a.cross(b).dot(unit) / 6.0)).sum();
            let middle = moment / area.length().max(f64::MIN_POSITIVE);
            largest = corners.iter().map(|c| c.distance(middle)).fold(largest, f64::max);
            ((base + middle).as_vec3(), area.as_vec3())
        };
        let points: Vec<(Vec3, Vec3)> =
            outlines.polygons.iter().map(|p| point(&outlines.corners[p.corners.clone()], p.base)).collect();
        let polygons = points.chunks(LANES).map(Points::new).collect();
        let from = |radii: f32| radius + radii * largest as f32 + centre.abs().max_element() * 1e-5;
        Self { polygons, from: from(RADII), rough_from: from(ROUGH_RADII) }
    }

    /// Σ cosθ cosθ_l A / d² of the points at `x` for a receiver of unit `normal`, sr: the irradiance for radiance 1.
    pub(super) fn form_factor(&self, x: Vec3, normal: Vec3, both_sides: bool) -> f32 {
        self.polygons.iter().map(|p| p.irradiance(x, normal, both_sides)).sum::<f32>()
    }
}
