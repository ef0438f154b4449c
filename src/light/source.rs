//! Light sources behind one interface: sample, density, bounds, power, closed forms. All that depends on the kind of a
//! source is decided here; a new kind is a variant of [`Source`] and a file of its own. (pbrt's `base/light.h` has the
//! same shape.)

use super::appearance::{Appearance, specular_of};
use super::area::AreaSource;
use super::area_sampler::Sampler;
use super::arrival::Arrival;
use super::bounds::LightBounds;
use super::delta;
use super::receiver::Receiver;
use crate::scene::Scene;
use crate::scene::light::{Light, LightKind};
use glam::Vec3;

/// One source, prepared for sampling.
#[derive(Clone, Debug)]
#[allow(clippy::large_enum_variant, reason = "side by side in one array, which is read where light is sampled")]
pub enum Source {
    /// A single direction at each point.
    Delta(LightKind),
    /// An emissive surface.
    Area(AreaSource),
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
            delta => Self::Delta(delta.clone()),
        }
    }

    /// Where it is, scene units, if that can be changed.
    #[must_use]
    pub const fn position(&self) -> Option<Vec3> {
        match self {
            Self::Delta(kind) => kind.position(),
            Self::Area(_) => None,
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

    /// Whether what arrives without occlusion is known exactly everywhere.
    #[must_use]
    pub fn has_closed_form(&self) -> bool {
        match self {
            Self::Delta(_) => true,
            Self::Area(area) => area.has_closed_form(),
        }
    }

    /// A sphere that holds the source, centre and radius in scene units; `None` if it is infinitely far.
    #[must_use]
    pub fn sphere(&self) -> Option<(Vec3, f32)> {
        match self {
            Self::Delta(kind) => kind.position().map(|position| (position, 0.0)),
            Self::Area(area) => Some(area.sphere()),
        }
    }

    /// Where the source lies as seen from `x`; `None` where it sends no light.
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
        }
    }

    /// Radiant flux in all directions, W: roughly, for a directional light or a spot.
    #[must_use]
    pub fn power(&self, scene: &Scene) -> Vec3 {
        match self {
            Self::Delta(kind) => delta::power(kind, scene),
            Self::Area(area) => area.power(),
        }
    }

    /// Upper bound of the luminance of the unoccluded irradiance at `x` on a surface of unit `normal`, W·m⁻²; 0 only
    /// where no light can arrive.
    #[must_use]
    pub fn bound(&self, x: Vec3, normal: Vec3) -> f32 {
        match self {
            Self::Delta(kind) => delta::strength(kind, x, normal),
            Self::Area(area) => area.bounds.bound(x, normal),
        }
    }

    /// What gives the same bound; `None` for light from infinity.
    pub(super) fn bounds(&self) -> Option<LightBounds> {
        match self {
            Self::Delta(kind) => delta::bounds(kind),
            Self::Area(area) => Some(area.bounds),
        }
    }

    /// The luminance of the unoccluded irradiance itself, W·m⁻², but for area lights near `x`, and textured ones,
    /// roughly: what to order lights by. 0 where the bound is.
    #[must_use]
    pub fn strength(&self, x: Vec3, normal: Vec3) -> f32 {
        match self {
            Self::Delta(kind) => delta::strength(kind, x, normal),
            Self::Area(area) => area.strength(x, normal),
        }
    }

    /// Unoccluded irradiance, W·m⁻², as roughly as [`Self::strength`].
    #[must_use]
    pub fn rough_irradiance(&self, x: Vec3, normal: Vec3) -> Vec3 {
        match self {
            Self::Delta(kind) => delta::arrival(kind, x).map_or(Vec3::ZERO, |arrival| arrival.irradiance(normal)),
            Self::Area(area) => area.rough_irradiance(x, normal),
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
        }
    }

    /// Unoccluded highlight, W·sr⁻¹·m⁻², of a textured source in its mean colour; `None` where no light arrives or
    /// there is no closed form.
    #[must_use]
    pub fn mean_specular(&self, receiver: &Receiver) -> Option<Vec3> {
        match self {
            Self::Delta(kind) => Some(specular_of(&delta::arrival(kind, receiver.x)?, receiver)),
            Self::Area(area) => area.mean_specular(receiver),
        }
    }

    /// Prepares sampling from `x`, for any surface there.
    #[must_use]
    pub fn sampler(&self, x: Vec3) -> SourceSampler<'_> {
        match self {
            Self::Delta(kind) => SourceSampler::Direction(delta::arrival(kind, x)),
            Self::Area(area) => SourceSampler::Area(area.at(x)),
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
        }
    }

    /// Density with which [`Self::sample_for`] takes the direction of the point of the source that lies `offset` from
    /// the surface, sr⁻¹; 0 for light of a single direction, which no other way of sampling finds.
    #[must_use]
    pub fn density_for(&self, surface: (Vec3, Vec3), offset: Vec3) -> f32 {
        match self {
            Self::Delta(_) => 0.0,
            Self::Area(area) => area.density_for(surface, offset),
        }
    }

    /// As [`Self::sample_for`] for any surface at `x`, points in proportion to area: far more variance, and nothing to
    /// prepare.
    #[must_use]
    pub fn sample_by_area(&self, scene: &Scene, x: Vec3, u: [f32; 2]) -> Option<Arrival> {
        match self {
            Self::Delta(kind) => delta::arrival(kind, x),
            Self::Area(area) => area.sample(scene, x, u),
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
}

impl SourceSampler<'_> {
    /// The light that arrives from the point of the source chosen by `u` ∈ [0, 1)², which is asked for only where there
    /// is a choice; `None` where none does. The mean of [`Arrival::irradiance`] over u is the unoccluded irradiance.
    #[must_use]
    pub fn sample(&self, scene: &Scene, u: impl FnOnce() -> [f32; 2]) -> Option<Arrival> {
        match self {
            Self::Direction(arrival) => *arrival,
            Self::Area(sampler) => sampler.sample(scene, u()),
        }
    }
}
