//! Light arriving at a point without occlusion, and an upper bound of it.

pub use super::area::{AreaSource, ClosedForm};
pub use super::area_sampler::Sampler;
pub use super::area_specular::Receiver;
use super::bounds::LightBounds;
use super::clustering::{Candidate, divide};
use super::group::{LightGroup, Members, SharedGroup, sphere};
use super::selection::GroupBounds;
use crate::math::luminance;
use crate::scene::light::{Light, LightKind, spot_falloff};
use crate::scene::{Scene, TriangleId};
use glam::Vec3;
use rustc_hash::FxHashMap;
use std::f32::consts::{PI, TAU};

/// Light from one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arrival {
    /// Unit direction towards the light.
    pub direction: Vec3,
    /// Distance to the light, infinite for a directional one.
    pub distance: f32,
    /// Irradiance on a plane facing the light, W·m⁻²; for a sample of an area light, as if all of it were there.
    pub facing: Vec3,
    /// Solid angle that the sample stands for, the inverse of its density; 0 where light has a single direction.
    pub measure: f32,
}

impl Arrival {
    /// Light of one colour all over its source.
    const fn uniform(direction: Vec3, distance: f32, facing: Vec3) -> Self {
        Self { direction, distance, facing, measure: 0.0 }
    }
}

/// All sources of a scene in the order of [`Scene::lights`].
#[derive(Clone, Debug)]
pub struct Lights {
    /// The sources.
    pub sources: Vec<Source>,
    /// The source that each emissive triangle belongs to.
    of_triangle: FxHashMap<TriangleId, u32>,
    /// What the light of each source counts times, by channel: see [`Self::factor`].
    factors: Vec<Vec3>,
    /// What each source emits in all directions as the scene has it, W.
    powers: Vec<Vec3>,
    /// What shares a visible fraction, ordered by the first source.
    groups: Vec<GroupKind>,
    /// The group of each source, with its place among those of the group.
    of_source: Vec<(u32, u32)>,
    /// What each group sends at most.
    pub(super) bounds: GroupBounds,
}

/// The sources of a group.
#[derive(Clone, Debug)]
enum GroupKind {
    Single(u32),
    Shared(SharedGroup),
}

/// Number of light groups above which small lights near each other share one, unless said otherwise.
pub const MAX_LIGHT_GROUPS: usize = 128;

/// What all sources emit at a time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Lighting {
    /// What each source counts times.
    pub factors: Vec<Vec3>,
    /// What they emit together, roughly, W.
    pub power: Vec3,
}

impl Lighting {
    /// How many times as bright the sources are together in `to`; 1 where there is no telling, because all are off in either.
    #[must_use]
    pub fn brightening(&self, to: &Self) -> f32 {
        let ratio = luminance(to.power) / luminance(self.power);
        if ratio.is_finite() && ratio > 0.0 { ratio } else { 1.0 }
    }

    /// What each channel of all light is multiplied by to get from `self` to `to`; `None` if sources change differently, or
    /// if a channel was or is dark.
    #[must_use]
    pub fn common_ratio(&self, to: &Self) -> Option<Vec3> {
        let pairs = || self.factors.iter().zip(&to.factors).filter(|&(&a, &b)| (a, b) != (Vec3::ZERO, Vec3::ZERO));
        let ratio = pairs().next().map(|(&a, &b)| b / a)?;
        let common = pairs().all(|(&a, &b)| (b - a * ratio).abs().cmple(b * 1e-6).all());
        (common && ratio.is_finite() && ratio.min_element() > 0.0).then_some(ratio)
    }
}

/// One source, prepared for sampling.
#[derive(Clone, Debug)]
#[allow(clippy::large_enum_variant, reason = "side by side in one array, which is read where light is sampled")]
pub enum Source {
    /// A single direction at each point.
    Delta(LightKind),
    /// An emissive surface.
    Area(AreaSource),
}

impl Lights {
    /// Prepares the lights of a scene, in at most [`MAX_LIGHT_GROUPS`] groups.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        Self::in_groups(scene, MAX_LIGHT_GROUPS)
    }

    /// Prepares the lights of a scene in at most so many groups, or as many as there are lights that cannot share one:
    /// directional ones, those without a closed form.
    #[must_use]
    pub fn in_groups(scene: &Scene, max_groups: usize) -> Self {
        let members = scene.lights.iter().zip(0..).filter_map(|(light, source)| match &light.kind {
            LightKind::Area { triangles } => Some(triangles.iter().map(move |&t| (t, source))),
            _ => None,
        });
        let sources: Vec<Source> = scene.lights.iter().map(|light| Source::new(scene, light)).collect();
        let powers: Vec<Vec3> = sources.iter().map(|source| power(scene, source)).collect();
        let groups = groups(&sources, &powers, max_groups);
        let mut of_source = vec![(0, 0); sources.len()];
        for (group, at) in (0..).zip(&groups) {
            (0..).zip(at.members()).for_each(|(place, &source)| of_source[source as usize] = (group, place));
        }
        let mut lights = Self {
            of_triangle: members.flatten().collect(),
            factors: vec![Vec3::ONE; sources.len()],
            sources,
            powers,
            groups,
            of_source,
            bounds: GroupBounds::default(),
        };
        lights.bounds = GroupBounds::new(&lights);
        lights
    }

    /// Number of groups; those of single sources where there are not too many.
    #[must_use]
    pub const fn group_count(&self) -> usize {
        self.groups.len()
    }

    /// The sources of a group.
    #[must_use]
    pub fn group(&self, group: usize) -> LightGroup<'_> {
        match &self.groups[group] {
            GroupKind::Single(source) => LightGroup::Single(&self.sources[*source as usize]),
            GroupKind::Shared(group) => LightGroup::Shared(Members { group, sources: &self.sources }),
        }
    }

    /// The sources of all groups.
    pub fn groups(&self) -> impl ExactSizeIterator<Item = LightGroup<'_>> {
        (0..self.groups.len()).map(|group| self.group(group))
    }

    /// The group of a source, and its place there.
    pub(super) fn group_of(&self, source: usize) -> (usize, usize) {
        let (group, place) = self.of_source[source];
        (group as usize, place as usize)
    }

    /// Indices of the sources of a group, ascending. The first is its permanent name, for seeds.
    #[must_use]
    pub fn sources_of_group(&self, group: usize) -> &[u32] {
        self.groups[group].members()
    }

    /// What the light of all sources of a group counts times now: see [`Self::factor`].
    #[must_use]
    pub fn group_factor(&self, group: usize) -> Vec3 {
        match &self.groups[group] {
            GroupKind::Single(source) => self.factors[*source as usize],
            GroupKind::Shared(group) => group.common(),
        }
    }

    /// Whether any source of a group sends any light now.
    #[must_use]
    pub fn group_is_on(&self, group: usize) -> bool {
        self.group_factor(group) != Vec3::ZERO
    }

    /// What the light of a source counts times now, by channel: 1 as loaded, 0 switched off. Sources and all that is sampled
    /// from them stay as loaded, so that a change costs no ray and a change back leaves no trace.
    #[must_use]
    pub fn factor(&self, source: usize) -> Vec3 {
        self.factors[source]
    }

    /// Changes what sources count times, in the order of [`Self::sources`]; those that `factors` lacks count once. Returns the
    /// groups whose sources changed against each other: sums over their points mix them as they were.
    pub fn set_factors(&mut self, factors: &[Vec3]) -> Vec<usize> {
        let given = factors.iter().copied().chain(std::iter::repeat(Vec3::ONE));
        self.factors.iter_mut().zip(given).for_each(|(factor, given)| *factor = given);
        let (sources, factors) = (&self.sources, &self.factors);
        let mixed = |(index, at): (usize, &mut GroupKind)| match at {
            GroupKind::Shared(group) => group.relight(sources, factors).then_some(index),
            GroupKind::Single(_) => None,
        };
        let mixed = self.groups.iter_mut().enumerate().filter_map(mixed).collect();
        self.bounds = GroupBounds::new(self);
        mixed
    }

    /// What the sources emit now.
    #[must_use]
    pub fn lighting(&self) -> Lighting {
        let power = self.powers.iter().zip(&self.factors).map(|(&power, &factor)| power * factor).sum();
        Lighting { factors: self.factors.clone(), power }
    }

    /// The area light that a triangle is part of, as an index into [`Self::sources`].
    #[must_use]
    pub fn of_triangle(&self, triangle: TriangleId) -> Option<usize> {
        self.of_triangle.get(&triangle).map(|&source| source as usize)
    }
}

impl GroupKind {
    fn members(&self) -> &[u32] {
        match self {
            Self::Single(source) => std::slice::from_ref(source),
            Self::Shared(group) => group.members(),
        }
    }
}

/// Which sources share a group.
fn groups(sources: &[Source], powers: &[Vec3], max_groups: usize) -> Vec<GroupKind> {
    let all = 0..sources.len() as u32;
    if sources.len() <= max_groups {
        return all.map(GroupKind::Single).collect();
    }
    let (open, single): (Vec<u32>, Vec<u32>) = all.partition(|&i| may_share(&sources[i as usize]));
    let candidate = |&i: &u32| {
        let (centre, radius) = sphere(&sources[i as usize]).unwrap_or((Vec3::ZERO, 0.0));
        let power = f64::from(luminance(powers[i as usize]));
        let is_delta = matches!(&sources[i as usize], Source::Delta(_));
        Candidate { centre: centre.as_dvec3(), radius: f64::from(radius), power, is_delta }
    };
    let candidates: Vec<Candidate> = open.iter().map(candidate).collect();
    let parts = divide(&candidates, max_groups.saturating_sub(single.len()).max(1));
    let grouped = parts.into_iter().map(|part| match part[..] {
        [one] => GroupKind::Single(open[one]),
        _ => GroupKind::Shared(SharedGroup::new(sources, part.into_iter().map(|i| open[i]).collect())),
    });
    let mut groups: Vec<GroupKind> = single.into_iter().map(GroupKind::Single).chain(grouped).collect();
    groups.sort_unstable_by_key(|group| group.members()[0]);
    groups
}

/// Whether a source has a place, and a closed form for what it sends without occlusion.
fn may_share(source: &Source) -> bool {
    sphere(source).is_some() && !matches!(source, Source::Area(area) if !area.has_closed_form())
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
            Self::Area(area) => area.bounds.bound(x, normal),
        }
    }

    /// What gives the same bound; `None` for light from infinity.
    pub(super) fn bounds(&self) -> Option<LightBounds> {
        match *self {
            Self::Delta(LightKind::Point { position, intensity }) => {
                Some(LightBounds::of_point(position, luminance(intensity)))
            }
            Self::Delta(LightKind::Spot { position, direction, intensity, cos_inner, cos_outer }) => {
                Some(LightBounds::of_spot(position, direction, luminance(intensity), [cos_inner, cos_outer]))
            }
            Self::Delta(_) => None,
            Self::Area(ref area) => Some(area.bounds),
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

/// What a light sends in all directions, W: roughly, for a directional light or a spot.
fn power(scene: &Scene, source: &Source) -> Vec3 {
    let kind = match source {
        Source::Area(area) => return area.mean_radiance() * (area.facets.area as f32 * PI),
        Source::Delta(kind) => kind,
    };
    match kind {
        LightKind::Point { intensity, .. } => *intensity * (2.0 * TAU),
        LightKind::Spot { intensity, cos_inner, cos_outer, .. } => {
            *intensity * (TAU * (1.0 - (cos_inner + cos_outer) * 0.5))
        }
        LightKind::Directional { irradiance, .. } => *irradiance * (PI / 4.0 * scene.diagonal().powi(2)),
        LightKind::Area { .. } => Vec3::ZERO,
    }
}

fn delta_luminance(kind: &LightKind, x: Vec3, normal: Vec3) -> f32 {
    // Half of many lights are behind the surface, which is found without a root.
    if let LightKind::Point { position, .. } | LightKind::Spot { position, .. } = kind
        && (position - x).dot(normal) <= 0.0
    {
        return 0.0;
    }
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
