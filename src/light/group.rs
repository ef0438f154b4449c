//! Light groups: a single source, or several small ones near each other whose visible fraction is sampled together.
//!
//! What a group sends without occlusion is the exact sum over its members; only the fraction of it that is visible is
//! shared: E = E_closed × (Σ v g / Σ g) over points of its members, g the unoccluded contribution of a point, as for
//! one area light (docs/method/direct-light.md).

use super::bounds::LightBounds;
use super::lighting::ratio_by_channel;
use super::source::Source;
use glam::Vec3;

/// The sources that share a light group.
#[derive(Clone, Copy, Debug)]
pub enum LightGroup<'a> {
    /// One source.
    Single(&'a Source),
    /// Several small ones near each other.
    Shared(Members<'a>),
}

/// A group with its sources.
#[derive(Clone, Copy, Debug)]
pub struct Members<'a> {
    pub(super) group: &'a SharedGroup,
    /// All sources of the scene.
    pub(super) sources: &'a [Source],
}

/// Small sources near each other.
#[derive(Clone, Debug)]
pub struct SharedGroup {
    /// Indices of the sources, ascending.
    members: Vec<u32>,
    /// What each counts times beside the others.
    factors: Vec<Vec3>,
    /// What all count times: they change together without anything known of the group becoming wrong.
    common: Vec3,
    /// A sphere that holds all, scene units.
    centre: Vec3,
    radius: f32,
    /// What they send at most, from outside of it, with the members' factors.
    bounds: LightBounds,
}

/// Distance in radii from which a group's bound is that of all its power in its sphere.
const FAR: f32 = 4.0;
/// What a member that is off counts as in a group's strength: 0 is for lights that do not reach a place at all.
const OFF: f32 = 1e-6;

impl SharedGroup {
    pub(super) fn new(sources: &[Source], members: Vec<u32>) -> Self {
        let factors = vec![Vec3::ONE; members.len()];
        let (centre, radius, bounds) = (Vec3::ZERO, 0.0, LightBounds::default());
        let mut group = Self { members, factors, common: Vec3::ONE, centre, radius, bounds };
        group.enclose(sources);
        group
    }

    /// Takes over where its sources are.
    pub(super) fn enclose(&mut self, sources: &[Source]) {
        let spheres = || self.members.iter().filter_map(|&m| sources[m as usize].sphere());
        let lo = spheres().map(|(c, r)| c - r).fold(Vec3::INFINITY, Vec3::min);
        let hi = spheres().map(|(c, r)| c + r).fold(Vec3::NEG_INFINITY, Vec3::max);
        let centre = (lo + hi) * 0.5;
        let radius = spheres().map(|(c, r)| c.distance(centre) + r).fold(0.0, f32::max);
        (self.centre, self.radius) = (centre, radius);
        self.update_bounds(sources);
    }

    fn update_bounds(&mut self, sources: &[Source]) {
        let members = self.members.iter().zip(&self.factors);
        let strengths = members.map(|(&m, factor)| strength(&sources[m as usize]) * factor.max_element());
        self.bounds = LightBounds::of_sphere(self.centre, self.radius, strengths.sum());
    }

    /// Indices of its sources.
    pub(super) fn members(&self) -> &[u32] {
        &self.members
    }

    /// What all members count times.
    pub(super) const fn common(&self) -> Vec3 {
        self.common
    }

    /// Takes over what its sources count times, in the order of the scene's lights; whether they changed against each other.
    pub(super) fn relight(&mut self, sources: &[Source], all: &[Vec3]) -> bool {
        let new: Vec<Vec3> = self.members.iter().map(|&m| all[m as usize]).collect();
        let ratio = ratio_by_channel(&self.factors, &new);
        self.common = ratio.unwrap_or(Vec3::ONE);
        if ratio.is_none() {
            self.factors = new;
            self.update_bounds(sources);
        }
        ratio.is_none()
    }
}

/// Upper bound of the luminance of a source's irradiance × squared distance, W·sr⁻¹.
fn strength(source: &Source) -> f32 {
    source.bounds().map_or(0.0, |bounds| bounds.strength())
}

impl<'a> LightGroup<'a> {
    /// The sources with what each counts times beside the others.
    pub fn sources(self) -> impl Iterator<Item = (&'a Source, Vec3)> {
        let (single, group) = match self {
            Self::Single(source) => (Some((source, Vec3::ONE)), None),
            Self::Shared(members) => (None, Some(members.sources())),
        };
        single.into_iter().chain(group.into_iter().flatten())
    }

    /// Upper bound of the luminance of the unoccluded irradiance at `x` on a surface of unit `normal`, W·m⁻²; 0 only
    /// where no light can arrive.
    #[must_use]
    pub fn bound(self, x: Vec3, normal: Vec3) -> f32 {
        match self {
            Self::Single(source) => source.bound(x, normal),
            Self::Shared(members) => members.bound(x, normal),
        }
    }

    /// What gives the same bound at places that are not [near](Self::is_near); `None` if nothing does anywhere.
    pub(super) fn bounds(self) -> Option<LightBounds> {
        match self {
            Self::Single(source) => source.bounds(),
            Self::Shared(members) => Some(members.group.bounds),
        }
    }

    /// Whether only [`Self::bound`] itself tells the bound at `x`: that of a group is the sum over its members there.
    pub(super) fn is_near(self, x: Vec3) -> bool {
        match self {
            Self::Single(source) => source.bounds().is_none(),
            Self::Shared(members) => members.is_near(x),
        }
    }

    /// The luminance of the unoccluded irradiance itself, W·m⁻², roughly: what to order lights by; 0 only where no
    /// light can arrive, whatever sources are on.
    #[must_use]
    pub fn strength(self, x: Vec3, normal: Vec3) -> f32 {
        match self {
            Self::Single(source) => source.strength(x, normal),
            Self::Shared(members) => members.strength(x, normal),
        }
    }

    /// Whether one ray tells all about its visibility.
    #[must_use]
    pub const fn is_delta(self) -> bool {
        match self {
            Self::Single(source) => source.is_delta(),
            Self::Shared(_) => false,
        }
    }

    /// Whether what arrives without occlusion is known exactly everywhere.
    #[must_use]
    pub fn has_closed_form(self) -> bool {
        match self {
            Self::Single(source) => source.has_closed_form(),
            // Others are not grouped.
            Self::Shared(_) => true,
        }
    }

    /// Number of sources.
    #[must_use]
    pub fn count(self) -> u32 {
        match self {
            Self::Single(_) => 1,
            Self::Shared(members) => members.count(),
        }
    }

    /// Number of points that tell all about its visibility, if any does.
    #[must_use]
    pub fn all_points(self) -> Option<u32> {
        let is_delta = match self {
            Self::Single(source) => source.is_delta(),
            // Members are of one kind.
            Self::Shared(members) => members.member(0).is_delta(),
        };
        is_delta.then(|| self.count())
    }
}

impl<'a> Members<'a> {
    fn sources(self) -> impl Iterator<Item = (&'a Source, Vec3)> {
        let members = self.group.members.iter().zip(&self.group.factors);
        members.map(move |(&m, &factor)| (&self.sources[m as usize], factor))
    }

    /// Number of sources.
    pub(super) fn count(self) -> u32 {
        self.group.members.len() as u32
    }

    /// The source of member `at`.
    pub(super) fn member(self, at: usize) -> &'a Source {
        &self.sources[self.source(at)]
    }

    /// What member `at` counts times beside the others.
    pub(super) fn factor(self, at: usize) -> Vec3 {
        self.group.factors[at]
    }

    /// Height of the highest part over a surface's horizon.
    fn highest(self, x: Vec3, normal: Vec3) -> f32 {
        (self.group.centre - x).dot(normal) + self.group.radius
    }

    fn bound(self, x: Vec3, normal: Vec3) -> f32 {
        if self.highest(x, normal) < 0.0 {
            return 0.0;
        }
        if self.is_near(x) { self.bounds(x, normal).sum() } else { self.group.bounds.bound(x, normal) }
    }

    fn is_near(self, x: Vec3) -> bool {
        self.group.centre.distance_squared(x) < (FAR * self.group.radius).powi(2)
    }

    /// Bounds of its members one by one, W·m⁻².
    pub(super) fn bounds(self, x: Vec3, normal: Vec3) -> impl Iterator<Item = f32> + 'a {
        self.sources().map(move |(source, factor)| source.bound(x, normal) * factor.max_element())
    }

    /// Index among the scene's sources of member `at`.
    pub(super) fn source(self, at: usize) -> usize {
        self.group.members[at] as usize
    }

    fn strength(self, x: Vec3, normal: Vec3) -> f32 {
        if self.highest(x, normal) < 0.0 {
            return 0.0;
        }
        self.sources().map(|(source, factor)| source.strength(x, normal) * factor.max_element().max(OFF)).sum()
    }
}
