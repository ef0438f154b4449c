//! What a textured source emits: means over its small parts.

use super::facets::Facet;
use super::receiver::Receiver;
use crate::bsdf::Lobe;
use crate::math::luminance;
use crate::scene::footprint::Footprint;
use crate::scene::{FaceId, Scene, TriangleId};
use glam::{DVec2, DVec3, Vec2, Vec3};

/// A textured source in parts of about equal area, for highlights that are wider than a part: these take the texture's
/// colours from here, without a lookup.
#[derive(Clone, Debug, Default)]
pub struct Parts {
    list: Vec<Part>,
    /// Largest distance of a corner of a part from its middle.
    radius: f32,
    /// Whether parts differ in more than rounding.
    uneven: bool,
}

/// A part of one facet.
#[derive(Clone, Copy, Debug)]
struct Part {
    middle: Vec3,
    /// Normal times area, square scene units.
    area: Vec3,
    /// Mean radiance, W·sr⁻¹·m⁻².
    radiance: Vec3,
}

/// Number of parts aimed at.
const PARTS: f64 = 256.0;
/// Relative difference of radiances that is rounding.
const UNEVEN: f32 = 2e-3;
/// Square of a part's half angle, in widths of the lobe, up to which the lobe is even over it.
const EVEN: f32 = 0.2;

impl Parts {
    /// Cuts up the facets of a source.
    #[must_use]
    pub fn new(scene: &Scene, facets: &[Facet]) -> Self {
        let total: f64 = facets.iter().map(|f| f.area).sum();
        let mut parts = Self::default();
        for facet in facets {
            let n = (facet.area / total * PARTS).sqrt().ceil().clamp(1.0, PARTS) as usize;
            let fineness = texels_across(scene, facet.id).div_ceil(n);
            for corners in cells(n) {
                let middle = corners.iter().sum::<DVec2>() / 3.0;
                parts.list.push(Part {
                    middle: facet.from(DVec3::ZERO, middle.to_array()).as_vec3(),
                    area: (facet.normal * facet.area / (n * n) as f64).as_vec3(),
                    radiance: mean_over(scene, facet.id, corners, fineness),
                });
            }
            parts.radius = parts.radius.max(facet.squared_radius.sqrt() as f32 / n as f32);
        }
        let mean = parts.mean();
        parts.uneven = parts.list.iter().any(|p| (p.radiance - mean).abs().cmpgt(mean * UNEVEN).any());
        parts
    }

    /// Mean radiance, W·sr⁻¹·m⁻², weighed by what each part sends to a surface of unit `normal` at `x`; `None` where
    /// all parts are alike, or none faces it.
    #[must_use]
    pub fn seen(&self, x: Vec3, normal: Vec3, both_sides: bool) -> Option<Vec3> {
        if !self.uneven {
            return None;
        }
        let (mut sum, mut weights) = (Vec3::ZERO, 0.0);
        for part in &self.list {
            let offset = part.middle - x;
            let facing = -part.area.dot(offset);
            let facing = if both_sides { facing.abs() } else { facing };
            let height = normal.dot(offset);
            if facing > 0.0 && height > 0.0 {
                let squared = offset.length_squared();
                let weight = facing * height / (squared * squared);
                sum += part.radiance * weight;
                weights += weight;
            }
        }
        (weights > LEAST).then(|| sum / weights)
    }

    /// Mean radiance weighed by area, W·sr⁻¹·m⁻².
    #[must_use]
    pub fn mean(&self) -> Vec3 {
        let weighed = |p: &Part| (p.radiance * p.area.length()).as_dvec3();
        let area: f64 = self.list.iter().map(|p| f64::from(p.area.length())).sum();
        if area > 0.0 { (self.list.iter().map(weighed).sum::<DVec3>() / area).as_vec3() } else { Vec3::ZERO }
    }

    /// Mean radiance, W·sr⁻¹·m⁻², weighed by the lobe and the cosine at a receiver; `None` where the parts are too coarse for
    /// it, or where none is in it. `nearest` is the distance to the source.
    #[must_use]
    pub fn in_lobe(&self, receiver: &Receiver, nearest: f32, both_sides: bool) -> Option<Vec3> {
        if self.radius * self.radius * (receiver.lobe.exponent() + 2.0) > EVEN * nearest * nearest {
            return None;
        }
        match &receiver.lobe {
            Lobe::Ggx(ggx) => self.weighed(receiver, both_sides, |direction| luminance(ggx.value(direction))),
            lobe => {
                let phong = lobe.as_phong()?;
                let (axis, shininess) = (phong.axis.as_vec3(), phong.shininess as f32);
                self.weighed(receiver, both_sides, |direction| axis.dot(direction).max(0.0).powf(shininess))
            }
        }
    }

    /// The same by the `value` of the lobe in a unit direction, up to a factor.
    fn weighed(&self, receiver: &Receiver, both_sides: bool, value: impl Fn(Vec3) -> f32) -> Option<Vec3> {
        let (mut sum, mut weights) = (Vec3::ZERO, 0.0);
        for part in &self.list {
            let offset = part.middle - receiver.x;
            let facing = -part.area.dot(offset);
            let facing = if both_sides { facing.abs() } else { facing };
            let height = receiver.normal.dot(offset);
            if facing > 0.0 && height > 0.0 {
                let squared = offset.length_squared();
                let weight = value(offset / squared.sqrt()) * facing * height / (squared * squared);
                sum += part.radiance * weight;
                weights += weight;
            }
        }
        (weights > LEAST).then(|| sum / weights)
    }
}

/// Weight below which single precision runs out of digits.
const LEAST: f32 = 1e-30;

/// The n² triangles of a triangle cut n times along each edge, as barycentrics of corners 1 and 2.
fn cells(n: usize) -> impl Iterator<Item = [DVec2; 3]> {
    let at = move |i: usize, j: usize| DVec2::new(i as f64, j as f64) / n as f64;
    let upright = move |(i, j)| [at(i, j), at(i + 1, j), at(i, j + 1)];
    let inverted = move |(i, j)| [at(i + 1, j + 1), at(i, j + 1), at(i + 1, j)];
    let places = move |n: usize| (0..n).flat_map(move |i| (0..n - i).map(move |j| (i, j)));
    places(n).map(upright).chain(places(n - 1).map(inverted))
}

/// Mean of what [`Scene::emitted_over`] returns on the front of a part of a triangle: a regular grid of n² points, filtered over its
/// cells, so that no bright texel is missed where they are larger than texels.
fn mean_over(scene: &Scene, id: TriangleId, corners: [DVec2; 3], n: usize) -> Vec3 {
    let [d_dx, d_dy] = [1, 2].map(|k| ((corners[k] - corners[0]) / n as f64).as_vec2());
    let footprint = Footprint { d_dx, d_dy };
    let emitted = |cell: [DVec2; 3]| {
        let [s, t] = (cell.iter().sum::<DVec2>() / 3.0).to_array();
        let at = corners[0] + (corners[1] - corners[0]) * s + (corners[2] - corners[0]) * t;
        scene.emitted_over(FaceId::new(id, false), at.x as f32, at.y as f32, &footprint).as_dvec3()
    };
    (cells(n).map(emitted).sum::<DVec3>() / (n * n) as f64).as_vec3()
}

/// Subdivisions of a triangle's edges for about two samples a texel, 1 without a texture.
fn texels_across(scene: &Scene, id: TriangleId) -> usize {
    let Some(map) = &scene.material(id).map_ke else { return 1 };
    let [width, height] = scene.texture(map).extents()[0];
    let size = Vec2::new(width as f32, height as f32);
    let [a, b, c] = scene.uvs[id.0 as usize].map(|uv| map.place(uv) * size);
    let longest = (b - a).length().max((c - b).length()).max((a - c).length());
    (2.0 * longest).clamp(8.0, 1024.0) as usize
}
