//! Light arriving at a point without occlusion, and an upper bound of it.

use crate::math::luminance;
use crate::scene::light::{Light, LightKind, spot_falloff};
use crate::scene::{EmissionSide, FaceId, Scene, TriangleId};
use glam::Vec3;

/// Light from one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arrival {
    /// Unit direction towards the light.
    pub direction: Vec3,
    /// Distance to the light, infinite for a directional one.
    pub distance: f32,
    /// Irradiance on a plane facing the light, W·m⁻²; for a sample of an area light, as if its whole area were there.
    pub facing: Vec3,
}

/// All sources of a scene in the order of [`Scene::lights`].
#[derive(Clone, Debug)]
pub struct Lights {
    /// The sources.
    pub sources: Vec<Source>,
}

/// One source, prepared for sampling.
#[derive(Clone, Debug)]
pub enum Source {
    /// A single direction at each point.
    Delta(LightKind),
    /// An emissive surface.
    Area(AreaSource),
}

/// An emissive component prepared for sampling by area.
#[derive(Clone, Debug)]
pub struct AreaSource {
    triangles: Vec<Emitter>,
    /// Running sums of the areas, ending in `area`.
    cumulative: Vec<f32>,
    area: f32,
    both_sides: bool,
    /// Luminance of the untextured emission, an upper bound since texels are ≤ 1.
    peak: f32,
    centre: Vec3,
    radius: f32,
}

/// A triangle of an area source.
#[derive(Clone, Copy, Debug)]
struct Emitter {
    id: TriangleId,
    corner: Vec3,
    edges: [Vec3; 2],
    normal: Vec3,
}

impl Lights {
    /// Prepares the lights of a scene.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        Self { sources: scene.lights.iter().map(|light| Source::new(scene, light)).collect() }
    }
}

impl Source {
    fn new(scene: &Scene, light: &Light) -> Self {
        match &light.kind {
            LightKind::Area { triangles } => Self::Area(AreaSource::new(scene, triangles)),
            delta => Self::Delta(delta.clone()),
        }
    }

    /// Upper bound of the luminance of the unoccluded irradiance at `x` on a surface of unit `normal`; 0 only where
    /// no light can arrive.
    #[must_use]
    pub fn bound(&self, x: Vec3, normal: Vec3) -> f32 {
        match self {
            Self::Delta(kind) => {
                delta_arrival(kind, x).map_or(0.0, |a| luminance(a.facing) * a.direction.dot(normal).max(0.0))
            }
            Self::Area(area) => area.bound(x, normal),
        }
    }
}

/// Light of a point, spot or directional source at `x`; `None` where it sends none.
#[must_use]
pub fn delta_arrival(kind: &LightKind, x: Vec3) -> Option<Arrival> {
    let from_point = |position: Vec3, intensity: Vec3| {
        let offset = position - x;
        let squared = offset.length_squared();
        (squared > 0.0).then(|| {
            let distance = squared.sqrt();
            Arrival { direction: offset / distance, distance, facing: intensity / squared }
        })
    };
    match *kind {
        LightKind::Point { position, intensity } => from_point(position, intensity),
        LightKind::Spot { position, direction, intensity, cos_inner, cos_outer } => {
            let mut arrival = from_point(position, intensity)?;
            let falloff = spot_falloff(-arrival.direction.dot(direction), cos_inner, cos_outer);
            arrival.facing *= falloff;
            (falloff > 0.0).then_some(arrival)
        }
        LightKind::Directional { direction, irradiance } => {
            Some(Arrival { direction: -direction, distance: f32::INFINITY, facing: irradiance })
        }
        LightKind::Area { .. } => None,
    }
}

impl Emitter {
    fn new(scene: &Scene, id: TriangleId) -> Self {
        let [a, b, c] = scene.corners(id);
        Self { id, corner: a, edges: [b - a, c - a], normal: scene.geometric_normal(id) }
    }
}

impl AreaSource {
    fn new(scene: &Scene, triangles: &[TriangleId]) -> Self {
        let mut area = 0.0_f64;
        let mut cumulative = Vec::with_capacity(triangles.len());
        let (mut lo, mut hi) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for &t in triangles {
            area += f64::from(scene.area_vector(t).length()) * 0.5;
            cumulative.push(area as f32);
            for p in scene.corners(t) {
                (lo, hi) = (lo.min(p), hi.max(p));
            }
        }
        let peak = triangles.first().map_or(0.0, |&t| luminance(scene.material(t).ke));
        Self {
            triangles: triangles.iter().map(|&t| Emitter::new(scene, t)).collect(),
            cumulative,
            area: area as f32,
            both_sides: scene.emission_side == EmissionSide::Both,
            peak,
            centre: (lo + hi) * 0.5,
            radius: (hi - lo).length() * 0.5,
        }
    }

    /// The light that arrives at `x` from the point of the source chosen by `u` ∈ [0, 1)²; `None` where that point
    /// faces away. The mean of `facing · max(0, n·direction)` over u is the unoccluded irradiance.
    #[must_use]
    pub fn sample(&self, scene: &Scene, x: Vec3, u: [f32; 2]) -> Option<Arrival> {
        let target = u[0] * self.area;
        let index = self.cumulative.partition_point(|&c| c <= target).min(self.triangles.len() - 1);
        let before = if index == 0 { 0.0 } else { self.cumulative[index - 1] };
        let within = ((target - before) / (self.cumulative[index] - before)).clamp(0.0, 1.0);
        // Uniform on the triangle, strata kept: √ maps the area, the second coordinate slides along.
        let root = within.sqrt();
        let (b1, b2) = (root * (1.0 - u[1]), root * u[1]);
        let emitter = &self.triangles[index];
        let point = emitter.corner + emitter.edges[0] * b1 + emitter.edges[1] * b2;
        let offset = point - x;
        let squared = offset.length_squared();
        if squared <= 0.0 {
            return None;
        }
        let distance = squared.sqrt();
        let direction = offset / distance;
        let cosine = -emitter.normal.dot(direction);
        if cosine == 0.0 || (cosine < 0.0 && !self.both_sides) {
            return None;
        }
        let radiance = scene.emitted_at(FaceId::new(emitter.id, cosine < 0.0), b1, b2);
        Some(Arrival { direction, distance, facing: radiance * (cosine.abs() * self.area / squared) })
    }

    fn bound(&self, x: Vec3, normal: Vec3) -> f32 {
        let offset = self.centre - x;
        if offset.dot(normal) < -self.radius {
            return 0.0;
        }
        let nearest = (offset.length() - self.radius).max(0.0);
        // E ≤ L π, and E ≤ L A / d² with the nearest distance.
        self.peak * std::f32::consts::PI.min(self.area / (nearest * nearest).max(f32::MIN_POSITIVE))
    }
}
