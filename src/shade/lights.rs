//! Light arriving at a point without occlusion, and an upper bound of it.

pub use super::area::{AreaSource, ClosedForm};
pub use super::area_sampler::Sampler;
pub use super::area_specular::Receiver;
use crate::math::luminance;
use crate::scene::light::{Light, LightKind, spot_falloff};
use crate::scene::{Scene, TriangleId};
use glam::Vec3;
use rustc_hash::FxHashMap;

/// Light from one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arrival {
    /// Unit direction towards the light.
    pub direction: Vec3,
    /// Distance to the light, infinite for a directional one.
    pub distance: f32,
    /// Irradiance on a plane facing the light, W·m⁻²; for a sample of an area light, as if all of it were there.
    pub facing: Vec3,
    /// The same with the mean radiance of the whole light in place of that of the sampled point: equal but for textured
    /// emitters.
    pub mean_facing: Vec3,
    /// Solid angle that the sample stands for, the inverse of its density; 0 where light has a single direction.
    pub measure: f32,
}

impl Arrival {
    /// Light of one colour all over its source.
    const fn uniform(direction: Vec3, distance: f32, facing: Vec3) -> Self {
        Self { direction, distance, facing, mean_facing: facing, measure: 0.0 }
    }
}

/// All sources of a scene in the order of [`Scene::lights`].
#[derive(Clone, Debug)]
pub struct Lights {
    /// The sources.
    pub sources: Vec<Source>,
    /// The source that each emissive triangle belongs to.
    of_triangle: FxHashMap<TriangleId, u32>,
}

/// One source, prepared for sampling.
#[derive(Clone, Debug)]
pub enum Source {
    /// A single direction at each point.
    Delta(LightKind),
    /// An emissive surface.
    Area(AreaSource),
}

impl Lights {
    /// Prepares the lights of a scene.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        let members = scene.lights.iter().zip(0..).filter_map(|(light, source)| match &light.kind {
            LightKind::Area { triangles } => Some(triangles.iter().map(move |&t| (t, source))),
            _ => None,
        });
        Self {
            sources: scene.lights.iter().map(|light| Source::new(scene, light)).collect(),
            of_triangle: members.flatten().collect(),
        }
    }

    /// The area light that a triangle is part of, as an index into [`Self::sources`].
    #[must_use]
    pub fn of_triangle(&self, triangle: TriangleId) -> Option<usize> {
        self.of_triangle.get(&triangle).map(|&source| source as usize)
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
            Self::Delta(kind) => delta_luminance(kind, x, normal),
            Self::Area(area) => area.bound(x, normal),
        }
    }

    /// The luminance of the unoccluded irradiance itself, but for area lights near `x`, and textured ones, roughly: what to
    /// order lights by. 0 where the bound is.
    #[must_use]
    pub fn strength(&self, x: Vec3, normal: Vec3) -> f32 {
        match self {
            Self::Delta(kind) => delta_luminance(kind, x, normal),
            Self::Area(area) => area.strength(x, normal),
        }
    }
}

fn delta_luminance(kind: &LightKind, x: Vec3, normal: Vec3) -> f32 {
    delta_arrival(kind, x).map_or(0.0, |a| luminance(a.facing) * a.direction.dot(normal).max(0.0))
}

/// Light of a point, spot or directional source at `x`; `None` where it sends none.
#[must_use]
pub fn delta_arrival(kind: &LightKind, x: Vec3) -> Option<Arrival> {
    let from_point = |position: Vec3, intensity: Vec3| {
        let offset = position - x;
        let squared = offset.length_squared();
        (squared > 0.0).then(|| {
            let distance = squared.sqrt();
            Arrival::uniform(offset / distance, distance, intensity / squared)
        })
    };
    match *kind {
        LightKind::Point { position, intensity } => from_point(position, intensity),
        LightKind::Spot { position, direction, intensity, cos_inner, cos_outer } => {
            let arrival = from_point(position, intensity)?;
            let falloff = spot_falloff(-arrival.direction.dot(direction), cos_inner, cos_outer);
            (falloff > 0.0).then(|| Arrival::uniform(arrival.direction, arrival.distance, arrival.facing * falloff))
        }
        LightKind::Directional { direction, irradiance } => {
            Some(Arrival::uniform(-direction, f32::INFINITY, irradiance))
        }
        LightKind::Area { .. } => None,
    }
}
