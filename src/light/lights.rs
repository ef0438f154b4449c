//! All sources of a scene, in light groups.

use super::clustering::{Candidate, divide};
use super::group::{LightGroup, Members, SharedGroup};
use super::group_bounds::GroupBounds;
use super::lighting::Lighting;
use super::source::Source;
use crate::math::luminance;
use crate::scene::light::{LightKind, LightState};
use crate::scene::{Scene, TriangleId};
use glam::Vec3;
use rustc_hash::FxHashMap;

/// All sources of a scene in the order of [`Scene::lights`].
#[derive(Clone, Debug)]
pub struct Lights {
    /// The sources.
    pub sources: Vec<Source>,
    /// The source that each emissive triangle belongs to.
    of_triangle: FxHashMap<TriangleId, u32>,
    /// Sources that a ray meets which hits nothing.
    at_infinity: Vec<u32>,
    /// What the light of each source counts times, by channel: see [`Self::factor`].
    factors: Vec<Vec3>,
    /// Where the scene has each source, if it can be moved.
    loaded: Vec<Option<Vec3>>,
    /// What each source emits in all directions as the scene has it, W.
    powers: Vec<Vec3>,
    /// What shares a visible fraction, ordered by the first source.
    groups: Vec<StoredGroup>,
    /// The group of each source, with its place among those of the group.
    of_source: Vec<(u32, u32)>,
    /// What each group sends at most.
    pub(super) bounds: GroupBounds,
}

/// A light group as it is kept: by indices of its sources.
#[derive(Clone, Debug)]
enum StoredGroup {
    Single(u32),
    Shared(SharedGroup),
}

/// Number of light groups above which small lights near each other share one, unless said otherwise.
pub const MAX_LIGHT_GROUPS: usize = 128;

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
        let powers: Vec<Vec3> = sources.iter().map(|source| source.power(scene)).collect();
        let groups = groups(&sources, &powers, max_groups);
        let mut of_source = vec![(0, 0); sources.len()];
        for (group, at) in (0..).zip(&groups) {
            (0..).zip(at.members()).for_each(|(place, &source)| of_source[source as usize] = (group, place));
        }
        let mut lights = Self {
            of_triangle: members.flatten().collect(),
            at_infinity: (0..).zip(&sources).filter(|(_, source)| source.is_around()).map(|(at, _)| at).collect(),
            factors: vec![Vec3::ONE; sources.len()],
            loaded: sources.iter().map(Source::position).collect(),
            sources,
            powers,
            groups,
            of_source,
            bounds: GroupBounds::default(),
        };
        lights.update_bounds();
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
            StoredGroup::Single(source) => LightGroup::Single(&self.sources[*source as usize]),
            StoredGroup::Shared(group) => LightGroup::Shared(Members { group, sources: &self.sources }),
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
            StoredGroup::Single(source) => self.factors[*source as usize],
            StoredGroup::Shared(group) => group.common(),
        }
    }

    /// Whether any source of a group sends any light now.
    #[must_use]
    pub fn group_is_on(&self, group: usize) -> bool {
        self.group_factor(group) != Vec3::ZERO
    }

    /// What the light of a source counts times now, by channel: 1 as loaded, 0 switched off. What sources emit and all that is
    /// sampled from them stay as loaded, so that a change costs no ray and a change back leaves no trace.
    #[must_use]
    pub fn factor(&self, source: usize) -> Vec3 {
        self.factors[source]
    }

    /// Whether sources are in these states, as in [`Self::set`].
    #[must_use]
    pub fn are(&self, states: &[LightState]) -> bool {
        let factors_are = self.factors.iter().zip(all(states)).all(|(factor, state)| *factor == state.factor);
        factors_are && self.moved_by(states).next().is_none()
    }

    /// Groups with sources that [`Self::set`] would move, ascending.
    #[must_use]
    pub fn groups_moved_by(&self, states: &[LightState]) -> Vec<usize> {
        let mut groups: Vec<usize> = self.moved_by(states).map(|(source, _)| self.group_of(source).0).collect();
        groups.sort_unstable();
        groups.dedup();
        groups
    }

    /// Sources that states have elsewhere than they are, and where.
    fn moved_by(&self, states: &[LightState]) -> impl Iterator<Item = (usize, Vec3)> {
        let places = self.sources.iter().zip(&self.loaded).zip(all(states)).enumerate();
        places.filter_map(|(source, ((at, loaded), state))| {
            let to = state.position.or(*loaded)?;
            (at.position()? != to).then_some((source, to))
        })
    }

    /// Changes what sources count times, and where they are, in the order of [`Self::sources`]; those that `states` lacks are as
    /// loaded. Returns the groups whose sources changed against each other: sums over their points mix them as they were.
    pub fn set(&mut self, states: &[LightState]) -> Vec<usize> {
        let moved: Vec<(usize, Vec3)> = self.moved_by(states).collect();
        moved.iter().for_each(|&(source, to)| self.sources[source].move_to(to));
        self.factors.iter_mut().zip(all(states)).for_each(|(factor, state)| *factor = state.factor);
        let (sources, factors) = (&self.sources, &self.factors);
        for &(source, _) in &moved {
            if let StoredGroup::Shared(group) = &mut self.groups[self.of_source[source].0 as usize] {
                group.enclose(sources);
            }
        }
        let mixed = |(index, at): (usize, &mut StoredGroup)| match at {
            StoredGroup::Shared(group) => group.relight(sources, factors).then_some(index),
            StoredGroup::Single(_) => None,
        };
        let mixed = self.groups.iter_mut().enumerate().filter_map(mixed).collect();
        self.update_bounds();
        mixed
    }

    /// Bounds of what all groups send with what they count times now.
    fn update_bounds(&mut self) {
        let factor = |group: usize| self.group_factor(group).max_element();
        let groups: Vec<(LightGroup<'_>, f32)> =
            self.groups().enumerate().map(|(i, group)| (group, factor(i))).collect();
        self.bounds = GroupBounds::new(&groups);
    }

    /// What the sources emit now.
    #[must_use]
    pub fn lighting(&self) -> Lighting {
        let power = self.powers.iter().zip(&self.factors).map(|(&power, &factor)| power * factor).sum();
        let positions = self.sources.iter().map(Source::position).collect();
        Lighting { factors: self.factors.clone(), positions, power }
    }

    /// Sources that a ray meets which hits nothing, as indices into [`Self::sources`].
    pub fn at_infinity(&self) -> impl Iterator<Item = usize> + '_ {
        self.at_infinity.iter().map(|&source| source as usize)
    }

    /// The area light that a triangle is part of, as an index into [`Self::sources`].
    #[must_use]
    pub fn of_triangle(&self, triangle: TriangleId) -> Option<usize> {
        self.of_triangle.get(&triangle).map(|&source| source as usize)
    }
}

impl StoredGroup {
    fn members(&self) -> &[u32] {
        match self {
            Self::Single(source) => std::slice::from_ref(source),
            Self::Shared(group) => group.members(),
        }
    }
}

/// States of all sources: those that are not given are as loaded.
fn all(states: &[LightState]) -> impl Iterator<Item = LightState> {
    states.iter().copied().chain(std::iter::repeat(LightState::default()))
}

/// Which sources share a group.
fn groups(sources: &[Source], powers: &[Vec3], max_groups: usize) -> Vec<StoredGroup> {
    let all = 0..sources.len() as u32;
    if sources.len() <= max_groups {
        return all.map(StoredGroup::Single).collect();
    }
    let (open, single): (Vec<u32>, Vec<u32>) = all.partition(|&i| may_share(&sources[i as usize]));
    let candidate = |&i: &u32| {
        let (centre, radius) = sources[i as usize].sphere().unwrap_or((Vec3::ZERO, 0.0));
        let power = f64::from(luminance(powers[i as usize]));
        let is_delta = sources[i as usize].is_delta();
        Candidate { centre: centre.as_dvec3(), radius: f64::from(radius), power, is_delta }
    };
    let candidates: Vec<Candidate> = open.iter().map(candidate).collect();
    let parts = divide(&candidates, max_groups.saturating_sub(single.len()).max(1));
    let grouped = parts.into_iter().map(|part| match part[..] {
        [one] => StoredGroup::Single(open[one]),
        _ => StoredGroup::Shared(SharedGroup::new(sources, part.into_iter().map(|i| open[i]).collect())),
    });
    let mut groups: Vec<StoredGroup> = single.into_iter().map(StoredGroup::Single).chain(grouped).collect();
    groups.sort_unstable_by_key(|group| group.members()[0]);
    groups
}

/// Whether a source has a place, and a closed form for what it sends without occlusion.
fn may_share(source: &Source) -> bool {
    source.sphere().is_some() && source.has_closed_form()
}
