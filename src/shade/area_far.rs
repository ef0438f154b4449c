//! Area lights from afar: each polygon as a point in its middle.

use super::area::AreaSource;
use super::facets::Outlines;
use super::phong::lobe;
use crate::math::polygon::edges;
use glam::{DVec3, Vec3};

/// The polygons of a source as points.
#[derive(Clone, Debug, Default)]
pub struct Distant {
    /// Middle and area vector of each polygon.
    polygons: Vec<(Vec3, Vec3)>,
    /// Distance from the source's centre from which they stand in for the polygons.
    from: f32,
}

/// Distance in radii of the largest polygon from which a point stands in for it: its error falls with the square, and is
/// below 3e-4 then (measured: tests/area_lights.rs).
const RADII: f32 = 40.0;
/// Square of a source's half angle, in widths of the lobe, up to which a highlight sees it as one direction.
const ONE_DIRECTION: f32 = 0.05;

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
        let polygons = outlines.polygons.iter().map(|p| point(&outlines.corners[p.corners.clone()], p.base)).collect();
        Self { polygons, from: radius + RADII * largest as f32 + centre.abs().max_element() * 1e-5 }
    }
}

impl AreaSource {
    /// Whether the source is so far from `x` that its polygons count as points.
    #[must_use]
    pub fn is_distant(&self, x: Vec3) -> bool {
        self.centre.distance_squared(x) > self.distant.from * self.distant.from
    }

    /// Unoccluded irradiance from afar.
    #[must_use]
    pub fn distant_irradiance(&self, x: Vec3, normal: Vec3) -> Vec3 {
        let of_polygon = |&(middle, area): &(Vec3, Vec3)| {
            let offset = middle - x;
            let squared = offset.length_squared();
            let facing = -area.dot(offset);
            let facing = if self.both_sides { facing.abs() } else { facing.max(0.0) };
            normal.dot(offset).max(0.0) * facing / (squared * squared)
        };
        self.mean_radiance() * self.distant.polygons.iter().map(of_polygon).sum::<f32>()
    }

    /// Unoccluded highlight from afar; `None` if the source is not far, or wider than the lobe can overlook.
    #[must_use]
    pub fn distant_specular(&self, x: Vec3, normal: Vec3, to_eye: Vec3, shininess: f32) -> Option<Vec3> {
        let offset = self.centre - x;
        let half_angle = self.radius * self.radius / offset.length_squared();
        let narrow = self.is_distant(x) && !self.textured && half_angle * (shininess + 2.0) < ONE_DIRECTION;
        narrow.then(|| {
            let value = lobe(shininess, normal, offset.normalize_or(normal), to_eye);
            if value == 0.0 { Vec3::ZERO } else { self.distant_irradiance(x, normal) * value }
        })
    }
}
