//! Lights: those of the scene file, and one area light a connected emissive component.

use super::environment::Environment;
use super::ids::TriangleId;
use super::photometry::Lamp;
use glam::Vec3;
use std::sync::Arc;

/// A light source.
#[derive(Clone, Debug, PartialEq)]
pub struct Light {
    /// Name for logs and edits: the `name` of the scene file, or `light N`, or the emissive material's name.
    pub name: String,
    /// What it is.
    pub kind: LightKind,
}

/// The kinds of light. Units are radiometric, linear Rec.709 RGB.
#[derive(Clone, Debug, PartialEq)]
pub enum LightKind {
    /// A point light: irradiance E = I cosθ / d².
    Point {
        /// Position, scene units.
        position: Vec3,
        /// Radiant intensity, W·sr⁻¹.
        intensity: Vec3,
    },
    /// A spot light: a point light times a smooth cone.
    Spot {
        /// Position, scene units.
        position: Vec3,
        /// Unit axis, pointing away from the light.
        direction: Vec3,
        /// Radiant intensity on the axis, W·sr⁻¹.
        intensity: Vec3,
        /// Cosine of the half angle inside which the intensity is full.
        cos_inner: f32,
        /// Cosine of the half angle outside which it is nil (< `cos_inner`).
        cos_outer: f32,
    },
    /// A point light as it was measured: its intensity depends on the direction.
    Lamp {
        /// Position, scene units.
        position: Vec3,
        /// What it sends where.
        lamp: Arc<Lamp>,
    },
    /// Parallel light.
    Directional {
        /// Unit direction in which the light travels.
        direction: Vec3,
        /// Irradiance on a plane perpendicular to it, W·m⁻².
        irradiance: Vec3,
    },
    /// Light from all around, infinitely far.
    Environment(Arc<Environment>),
    /// A disc of even radiance, infinitely far.
    Sun {
        /// Unit direction to its middle.
        direction: Vec3,
        /// Half of the angle that it takes, radians.
        half_angle: f32,
        /// Radiance, W·sr⁻¹·m⁻².
        radiance: Vec3,
    },
    /// A connected emissive component of the geometry.
    Area {
        /// Its triangles, in ascending order.
        triangles: Vec<TriangleId>,
    },
}

/// A light as it is made to be, against what the scene says of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightState {
    /// What it emits counts times, by channel: 1 as loaded, 0 switched off.
    pub factor: Vec3,
    /// Where it is, scene units; `None` where the scene says. Only lights that [have a position](LightKind::position) go by it.
    pub position: Option<Vec3>,
}

impl Default for LightState {
    /// As the scene says.
    fn default() -> Self {
        Self::times(Vec3::ONE)
    }
}

impl LightState {
    /// A light that stays where it is and counts times `factor`, by channel.
    #[must_use]
    pub const fn times(factor: Vec3) -> Self {
        Self { factor, position: None }
    }
}

impl LightKind {
    /// Where the light is, scene units; `None` for one at infinity, and for geometry.
    #[must_use]
    pub const fn position(&self) -> Option<Vec3> {
        match self {
            Self::Point { position, .. } | Self::Spot { position, .. } | Self::Lamp { position, .. } => Some(*position),
            Self::Directional { .. } | Self::Environment(_) | Self::Sun { .. } | Self::Area { .. } => None,
        }
    }

    /// Why the light cannot be moved, if it cannot, to go on after its name.
    const fn why_fixed(&self) -> Option<&'static str> {
        match self {
            Self::Point { .. } | Self::Spot { .. } | Self::Lamp { .. } => None,
            Self::Directional { .. } | Self::Environment(_) | Self::Sun { .. } => {
                Some("is infinitely far: it has no place to move")
            }
            Self::Area { .. } => Some("is geometry: it stays where it is"),
        }
    }

    /// Puts a light that has a position elsewhere, scene units; others stay as they are.
    pub const fn move_to(&mut self, to: Vec3) {
        if let Self::Point { position, .. } | Self::Spot { position, .. } | Self::Lamp { position, .. } = self {
            *position = to;
        }
    }

    /// Whether the light is a single direction at each point (point, spot, directional): one shadow ray is exact.
    #[must_use]
    pub const fn is_delta(&self) -> bool {
        match self {
            Self::Point { .. } | Self::Spot { .. } | Self::Lamp { .. } | Self::Directional { .. } => true,
            Self::Environment(_) | Self::Sun { .. } | Self::Area { .. } => false,
        }
    }
}

/// Why none of the lights of a name can be moved, if so, to go on after the name.
#[must_use]
pub fn why_fixed(lights: &[Light], name: &str) -> Option<&'static str> {
    let named = lights.iter().filter(|light| light.name == name);
    named.map(|light| light.kind.why_fixed()).min().flatten()
}

/// Cone falloff of a spot light: smoothstep of the cosine between the outer and the inner half angle.
#[must_use]
pub fn spot_falloff(cos_angle: f32, cos_inner: f32, cos_outer: f32) -> f32 {
    let t = ((cos_angle - cos_outer) / (cos_inner - cos_outer).max(1e-6)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
