//! Light sources behind one interface: sample, density, bounds, power, closed forms. All that depends on the kind of a
//! source is decided here; a new kind is a variant of [`Source`] and a file of its own. (pbrt's `base/light.h` has the
//! same shape.)

use super::appearance::{Appearance, specular_of};
use super::area::AreaSource;
use super::area_sampler::Sampler;
use super::arrival::Arrival;
use super::bounds::LightBounds;
use super::delta;
use super::environment::{EnvironmentSampler, EnvironmentSource};
use super::receiver::Receiver;
use super::sun::SunSource;
use crate::scene::Scene;
use crate::scene::light::{Light, LightKind};
use glam::Vec3;
use std::f32::consts::PI;
use std::sync::Arc;

/// One source, prepared for sampling.
#[derive(Clone, Debug)]
#[allow(clippy::large_enum_variant, reason = "side by side in one array, which is read where light is sampled")]
pub enum Source {
    /// A single direction at each point.
    Delta(LightKind),
    /// An emissive surface.
    Area(AreaSource),
    /// A picture all around, infinitely far.
    Environment(Arc<EnvironmentSource>),
    /// A disc, infinitely far.
    Sun(SunSource),
}

/// Where a source lies as seen from a place.
#[derive(Clone, Copy, Debug)]
pub enum Place {
    /// Infinitely far in a unit direction.
    Far(Vec3),
    /// About a point.
    Near {
        /// The middle, scene units.
        middle: Vec3,
        /// Half the angle that a sphere around the source takes, radians.
        half_angle: f32,
    },
}

impl Source {
    /// Prepares a light of a scene.
    #[must_use]
    pub fn new(scene: &Scene, light: &Light) -> Self {
        match &light.kind {
            LightKind::Area { triangles } => Self::Area(AreaSource::new(scene, triangles)),
            LightKind::Environment(environment) => Self::Environment(Arc::new(EnvironmentSource::new(environment))),
            LightKind::Sun { direction, half_angle, radiance } => {
                Self::Sun(SunSource::new(*direction, *half_angle, *radiance))
            }
            delta => Self::Delta(delta.clone()),
        }
    }

    /// Where it is, scene units, if that can be changed.
    #[must_use]
    pub const fn position(&self) -> Option<Vec3> {
        match self {
            Self::Delta(kind) => kind.position(),
            Self::Area(_) | Self::Environment(_) | Self::Sun(_) => None,
        }
    }

    /// Puts a source that has a position elsewhere, scene units.
    pub(super) const fn move_to(&mut self, position: Vec3) {
        if let Self::Delta(kind) = self {
            kind.move_to(position);
        }
    }

    /// Whether light has a single direction at each place: one ray tells all about its visibility, and no ray hits the
    /// source by chance.
    #[must_use]
    pub const fn is_delta(&self) -> bool {
        matches!(self, Self::Delta(_))
    }

    /// Whether a ray that hits nothing may meet it.
    #[must_use]
    pub const fn is_around(&self) -> bool {
        matches!(self, Self::Environment(_) | Self::Sun(_))
    }

    /// Whether what arrives without occlusion is known exactly everywhere.
    #[must_use]
    pub fn has_closed_form(&self) -> bool {
        match self {
            Self::Delta(_) | Self::Environment(_) | Self::Sun(_) => true,
            Self::Area(area) => area.has_closed_form(),
        }
    }

    /// A sphere that holds the source, centre and radius in scene units; `None` if it is infinitely far.
    #[must_use]
    pub fn sphere(&self) -> Option<(Vec3, f32)> {
        match self {
            Self::Delta(kind) => kind.position().map(|position| (position, 0.0)),
            Self::Area(area) => Some(area.sphere()),
            Self::Environment(_) | Self::Sun(_) => None,
        }
    }

    /// Where the source lies as seen from `x`; `None` where it sends no light, and for one that is all around.
    #[must_use]
    pub fn place(&self, x: Vec3) -> Option<Place> {
        match self {
            Self::Delta(kind) => delta::arrival(kind, x).map(|arrival| {
                let Arrival { direction, distance, .. } = arrival;
                if distance.is_infinite() {
                    return Place::Far(direction);
                }
                Place::Near { middle: x + direction * distance, half_angle: 0.0 }
            }),
            Self::Area(area) => {
                let (middle, radius) = area.sphere();
                let sine = radius / middle.distance(x).max(radius);
                Some(Place::Near { middle, half_angle: sine.asin() })
            }
            Self::Environment(_) => None,
            Self::Sun(sun) => Some(Place::Far(sun.direction())),
        }
    }

    /// Radiant flux in all directions, W: roughly, for a directional light or a spot; from infinity, what falls on the scene's disc.
    #[must_use]
    pub fn power(&self, scene: &Scene) -> Vec3 {
        match self {
            Self::Delta(kind) => delta::power(kind, scene),
            Self::Area(area) => area.power(),
            Self::Environment(environment) => environment.fluence() * (PI / 4.0 * scene.diagonal().powi(2)),
            Self::Sun(sun) => sun.facing() * (PI / 4.0 * scene.diagonal().powi(2)),
        }
    }

    /// Upper bound of the luminance of the unoccluded irradiance at `x` on a surface of unit `normal`, W·m⁻²; 0 only
    /// where no light can arrive.
    #[must_use]
    pub fn bound(&self, x: Vec3, normal: Vec3) -> f32 {
        match self {
            Self::Delta(kind) => delta::strength(kind, x, normal),
            Self::Area(area) => area.bounds.bound(x, normal),
            Self::Environment(environment) => environment.bound(normal),
            Self::Sun(sun) => sun.bound(normal),
        }
    }

    /// What gives the same bound; `None` for light from infinity.
    pub(super) fn bounds(&self) -> Option<LightBounds> {
        match self {
            Self::Delta(kind) => delta::bounds(kind),
            Self::Area(area) => Some(area.bounds),
            Self::Environment(_) | Self::Sun(_) => None,
        }
    }

    /// The luminance of the unoccluded irradiance itself, W·m⁻², but for area lights near `x`, and textured ones,
    /// roughly: what to order lights by. 0 where the bound is.
    #[must_use]
    pub fn strength(&self, x: Vec3, normal: Vec3) -> f32 {
        match self {
            Self::Delta(kind) => delta::strength(kind, x, normal),
            Self::Area(area) => area.strength(x, normal),
            Self::Environment(environment) => environment.strength(normal),
            Self::Sun(sun) => sun.strength(normal),
        }
    }

    /// Unoccluded irradiance, W·m⁻², as roughly as [`Self::strength`].
    #[must_use]
    pub fn rough_irradiance(&self, x: Vec3, normal: Vec3) -> Vec3 {
        match self {
            Self::Delta(kind) => delta::arrival(kind, x).map_or(Vec3::ZERO, |arrival| arrival.irradiance(normal)),
            Self::Area(area) => area.rough_irradiance(x, normal),
            Self::Environment(environment) => environment.irradiance(normal),
            Self::Sun(sun) => sun.irradiance(normal),
        }
    }

    /// The source as a surface of unit `normal` at `x` sees it without occlusion.
    #[must_use]
    pub fn appearance(&self, x: Vec3, normal: Vec3) -> Appearance<'_> {
        match self {
            Self::Delta(kind) => Appearance::Direction(delta::arrival(kind, x)),
            Self::Area(area) if area.is_distant(x, normal) => {
                Appearance::Distant(area, area.distant_irradiance(x, normal))
            }
            Self::Area(area) => {
                area.closed_form(x).map_or(Appearance::Sampled(area), |form| Appearance::Form(area, form))
            }
            Self::Environment(environment) => Appearance::Around(environment),
            Self::Sun(sun) => Appearance::Disc(sun),
        }
    }

    /// Unoccluded highlight, W·sr⁻¹·m⁻², of a textured source in its mean colour; `None` where no light arrives or
    /// there is no closed form.
    #[must_use]
    pub fn mean_specular(&self, receiver: &Receiver) -> Option<Vec3> {
        match self {
            Self::Delta(kind) => Some(specular_of(&delta::arrival(kind, receiver.x)?, receiver)),
            Self::Area(area) => area.mean_specular(receiver),
            Self::Environment(environment) => Some(environment.specular(receiver)),
            Self::Sun(sun) => Some(sun.specular(receiver)),
        }
    }

    /// Prepares sampling from `x`, for any surface there whose normals are about `normal`.
    #[must_use]
    pub fn sampler(&self, x: Vec3, normal: Vec3) -> SourceSampler<'_> {
        match self {
            Self::Delta(kind) => SourceSampler::Direction(delta::arrival(kind, x)),
            Self::Area(area) => SourceSampler::Area(area.at(x)),
            Self::Environment(environment) => SourceSampler::Environment(environment.sampler(normal)),
            Self::Sun(sun) => SourceSampler::Sun(sun),
        }
    }

    /// The light that arrives at a surface at `x` of unit `normal` from the point of the source chosen by `u` ∈ [0,
    /// 1)²; `None` where none does. The mean of [`Arrival::irradiance`] over u is the unoccluded irradiance. Strata of
    /// u are kept.
    #[must_use]
    pub fn sample_for(&self, scene: &Scene, surface: (Vec3, Vec3), u: [f32; 2]) -> Option<Arrival> {
        match self {
            Self::Delta(kind) => delta::arrival(kind, surface.0),
            Self::Area(area) => area.sample_for(scene, surface, u),
            Self::Environment(environment) => environment.sample_for(surface.1, u),
            Self::Sun(sun) => Some(sun.sample(u)),
        }
    }

    /// Density with which [`Self::sample_for`] takes the direction of the point of the source that lies `offset` from
    /// the surface (of a source that is infinitely far, the unit direction to it), sr⁻¹; 0 for light of a single direction, which no other way of sampling finds.
    #[must_use]
    pub fn density_for(&self, surface: (Vec3, Vec3), offset: Vec3) -> f32 {
        match self {
            Self::Delta(_) => 0.0,
            Self::Area(area) => area.density_for(surface, offset),
            Self::Environment(environment) => environment.density_for(surface.1, offset),
            Self::Sun(sun) => sun.density(offset),
        }
    }

    /// Radiance that a ray in a unit direction meets which hits nothing, W·sr⁻¹·m⁻².
    #[must_use]
    pub fn radiance_at_infinity(&self, direction: Vec3) -> Vec3 {
        match self {
            Self::Delta(_) | Self::Area(_) => Vec3::ZERO,
            Self::Environment(environment) => environment.radiance(direction),
            Self::Sun(sun) => sun.radiance(direction),
        }
    }

    /// What is looked at there, filtered over `angle`, radians, W·sr⁻¹·m⁻².
    #[must_use]
    pub fn seen_at_infinity(&self, direction: Vec3, angle: f32) -> Vec3 {
        match self {
            Self::Delta(_) | Self::Area(_) => Vec3::ZERO,
            Self::Environment(environment) => environment.environment().seen(direction, angle),
            Self::Sun(sun) => sun.seen(direction, angle),
        }
    }

    /// As [`Self::sample_for`] for any surface at `x`, points in proportion to area: far more variance, and nothing to
    /// prepare.
    #[must_use]
    pub fn sample_by_area(&self, scene: &Scene, x: Vec3, u: [f32; 2]) -> Option<Arrival> {
        match self {
            Self::Delta(kind) => delta::arrival(kind, x),
            Self::Area(area) => area.sample(scene, x, u),
            // By solid angle, whatever the surface.
            Self::Environment(environment) => environment.sample_for(Vec3::ZERO, u),
            Self::Sun(sun) => Some(sun.sample(u)),
        }
    }
}

/// Sampling of a source from one place.
#[derive(Clone, Debug)]
#[allow(clippy::large_enum_variant, reason = "one at a time on the stack, in the inner loop")]
pub enum SourceSampler<'a> {
    /// A single direction, if light comes from there.
    Direction(Option<Arrival>),
    /// A point of an emissive surface.
    Area(Sampler<'a>),
    /// A direction of an environment.
    Environment(EnvironmentSampler<'a>),
    /// A point of a disc.
    Sun(&'a SunSource),
}

impl SourceSampler<'_> {
    /// The light that arrives from the point of the source chosen by `u` ∈ [0, 1)², which is asked for only where there
    /// is a choice; `None` where none does. The mean of [`Arrival::irradiance`] over u is the unoccluded irradiance.
    #[must_use]
    pub fn sample(&self, scene: &Scene, u: impl FnOnce() -> [f32; 2]) -> Option<Arrival> {
        match self {
            Self::Direction(arrival) => *arrival,
            Self::Area(sampler) => sampler.sample(scene, u()),
            Self::Environment(sampler) => sampler.sample(u()),
            Self::Sun(sun) => Some(sun.sample(u())),
        }
    }
}
