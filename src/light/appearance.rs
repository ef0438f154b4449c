//! What of a source a place sees without occlusion: in closed form where there is one.

use super::area::AreaSource;
use super::arrival::Arrival;
use super::closed_form::ClosedForm;
use super::environment::EnvironmentSource;
use super::receiver::Receiver;
use super::sun::SunSource;
use crate::math::sequence::Sequence;
use crate::scene::Scene;
use glam::Vec3;

/// An unoccluded source at a place and for a normal there.
#[allow(clippy::large_enum_variant, reason = "one at a time on the stack, in the inner loop")]
pub enum Appearance<'a> {
    /// Light from one direction, if any.
    Direction(Option<Arrival>),
    /// An area light so far that it is points; their irradiance, W·m⁻².
    Distant(&'a AreaSource, Vec3),
    /// An area light of a closed form.
    Form(&'a AreaSource, ClosedForm<'a>),
    /// An area light of too many triangles.
    Sampled(&'a AreaSource),
    /// A picture all around.
    Around(&'a EnvironmentSource),
    /// A disc, infinitely far.
    Disc(&'a SunSource),
}

/// Points that stand in for a closed form where there is none.
const ESTIMATE_POINTS: u32 = 8;

impl Appearance<'_> {
    /// Whether [`Self::irradiance`] is exact.
    #[must_use]
    pub const fn is_exact(&self) -> bool {
        !matches!(self, Self::Sampled(_))
    }

    /// Unit mean direction of the source's light at `x`, and how wide it is, |V|/Φ: 1 from one direction, 1/2 from an even hemisphere.
    #[must_use]
    pub fn spread(&self, x: Vec3, normal: Vec3) -> (Vec3, f32) {
        let to_centre = |area: &AreaSource| (area.centre - x).normalize_or(normal);
        match self {
            Self::Direction(arrival) => (arrival.map_or(normal, |arrival| arrival.direction), 1.0),
            Self::Distant(area, _) | Self::Sampled(area) => (to_centre(area), 1.0),
            Self::Form(_, form) => form.spread(),
            // About even: what the picture holds is not looked at.
            Self::Around(_) => (normal, 0.5),
            Self::Disc(sun) => (sun.direction(), 1.0),
        }
    }

    /// Unoccluded irradiance on the surface of the receiver, W·m⁻²: from a few points where there is no closed form.
    #[must_use]
    pub fn irradiance(&self, scene: &Scene, receiver: &Receiver) -> Vec3 {
        let Receiver { x, normal, .. } = *receiver;
        match self {
            Self::Direction(arrival) => arrival.map_or(Vec3::ZERO, |arrival| arrival.irradiance(normal)),
            Self::Distant(_, irradiance) => *irradiance,
            Self::Form(area, form) => area.irradiance(form, x, normal),
            Self::Sampled(area) => estimate(scene, area, x, normal),
            Self::Around(environment) => environment.irradiance(normal),
            Self::Disc(sun) => sun.irradiance(normal),
        }
    }

    /// Unoccluded highlight ∫ lobe · L cosθ dω, W·sr⁻¹·m⁻². A texture does not colour what is darker than `floor`, in
    /// luminance.
    #[must_use]
    pub fn specular(&self, scene: &Scene, receiver: &Receiver, floor: f32) -> Vec3 {
        match self {
            Self::Direction(arrival) => arrival.map_or(Vec3::ZERO, |arrival| specular_of(&arrival, receiver)),
            Self::Distant(area, irradiance) => {
                let as_direction = area.distant_specular(receiver, *irradiance);
                as_direction.unwrap_or_else(|| area.specular(scene, receiver, floor))
            }
            Self::Form(area, form) => area.specular_of(scene, form, receiver, floor),
            Self::Sampled(area) => area.specular(scene, receiver, floor),
            Self::Around(environment) => environment.specular(receiver),
            Self::Disc(sun) => sun.specular(receiver),
        }
    }
}

/// Highlight of light from a single direction, W·sr⁻¹·m⁻².
pub(super) fn specular_of(arrival: &Arrival, receiver: &Receiver) -> Vec3 {
    arrival.irradiance(receiver.normal) * receiver.lobe.value(arrival.direction)
}

/// Unoccluded irradiance of a source of too many triangles, W·m⁻², from a few of its points.
fn estimate(scene: &Scene, source: &AreaSource, x: Vec3, normal: Vec3) -> Vec3 {
    let (sampler, sequence) = (source.at(x), Sequence::new(0));
    let irradiance = |i| {
        let [u, v, ..] = sequence.point(i);
        sampler.sample(scene, [u, v]).map_or(Vec3::ZERO, |arrival| arrival.irradiance(normal))
    };
    (0..ESTIMATE_POINTS).map(irradiance).sum::<Vec3>() / ESTIMATE_POINTS as f32
}
