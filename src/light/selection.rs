//! One light drawn in proportion to the bound of what it can send to a place: a group first, then one of its sources, so that the
//! cost of many lights is that of their groups.

use super::bounds::{Bounds8, LANES, LightBounds};
use super::group::LightGroup;
use super::lights::Lights;
use glam::{Vec3, Vec4};
use smallvec::SmallVec;

/// What gives the bounds of all groups at a place.
#[derive(Clone, Debug, Default)]
pub(super) struct GroupBounds {
    packs: Vec<Bounds8>,
    /// Meshes whose bounds the packs do not tell everywhere.
    others: Vec<u32>,
}

impl GroupBounds {
    /// With what the groups count times now.
    pub fn new(lights: &Lights) -> Self {
        let factor = |group: usize| lights.group_factor(group).max_element();
        let bounds = |group: usize| (lights.group(group).bounds().unwrap_or_default(), factor(group));
        let reaches: Vec<(LightBounds, f32)> = (0..lights.group_count()).map(bounds).collect();
        let is_other = |&(_, of): &(u32, LightGroup<'_>)| matches!(of, LightGroup::Shared(_)) || of.bounds().is_none();
        Self {
            packs: reaches.chunks(LANES).map(Bounds8::new).collect(),
            others: (0..).zip(lights.groups()).filter(is_other).map(|(group, _)| group).collect(),
        }
    }
}

/// The bounds of all groups at one place.
#[derive(Clone, Debug, Default)]
pub struct LightChoice {
    x: Vec3,
    normal: Vec3,
    /// Eight groups at a time.
    bounds: SmallVec<[[f32; LANES]; 16]>,
    /// Sum of each eight.
    sums: SmallVec<[f32; 16]>,
    total: f32,
}

/// A light that was drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drawn {
    /// Index of the source.
    pub light: usize,
    /// One over the probability with which it was drawn.
    pub inverse_chance: f32,
}

impl LightChoice {
    /// Bounds what the lights can send to `x` on a surface of unit `normal`.
    pub fn prepare(&mut self, lights: &Lights, x: Vec3, normal: Vec3) {
        (self.x, self.normal) = (x, normal);
        self.bounds.clear();
        self.bounds.extend(lights.bounds.packs.iter().map(|pack| pack.bounds(x, normal)));
        for group in lights.bounds.others.iter().map(|&group| group as usize) {
            let emitter = lights.group(group);
            if emitter.is_near(x) {
                let factor = lights.group_factor(group).max_element();
                self.bounds[group / LANES][group % LANES] = emitter.bound(x, normal) * factor;
            }
        }
        self.sums.clear();
        self.sums.extend(self.bounds.iter().map(sum));
        self.total = self.sums.iter().sum();
    }

    /// Draws a light by `pick` ∈ [0, 1); `None` where none can send any, or the one that was to be drawn cannot.
    #[must_use]
    pub fn draw(&self, lights: &Lights, pick: f32) -> Option<Drawn> {
        let (pack, left) = proportionally(&self.sums, pick * self.total)?;
        let (lane, left) = proportionally(&self.bounds[pack], left)?;
        let (group, bound) = (pack * LANES + lane, self.bounds[pack][lane]);
        let inverse_chance = self.total / bound;
        match lights.group(group) {
            LightGroup::Single(_) => Some(Drawn { light: lights.sources_of_group(group)[0] as usize, inverse_chance }),
            LightGroup::Shared(members) => {
                let bounds: SmallVec<[f32; 32]> = members.bounds(self.x, self.normal).collect();
                let total: f32 = bounds.iter().sum();
                let within = (left / bound).clamp(0.0, 1.0);
                let (at, _) = proportionally(&bounds, within * total)?;
                Some(Drawn { light: members.source(at), inverse_chance: inverse_chance * (total / bounds[at]) })
            }
        }
    }

    /// Sum of the bounds: all that [`Self::chance_of`] needs to know of them later.
    #[must_use]
    pub const fn total(&self) -> f32 {
        self.total
    }

    /// Probability with which [`Self::draw`] takes a light.
    #[must_use]
    pub fn chance(&self, lights: &Lights, light: usize) -> f32 {
        Self::chance_of(lights, (self.x, self.normal), self.total, light)
    }

    /// The same for a choice that was prepared for `x` and `normal` and whose bounds had the sum `total`.
    #[must_use]
    pub fn chance_of(lights: &Lights, (x, normal): (Vec3, Vec3), total: f32, light: usize) -> f32 {
        let (group, place) = lights.group_of(light);
        let emitter = lights.group(group);
        let bound = emitter.bound(x, normal) * lights.group_factor(group).max_element();
        let chance = if bound > 0.0 { bound / total } else { 0.0 };
        match emitter {
            LightGroup::Single(_) => chance,
            LightGroup::Shared(members) => {
                let bounds: SmallVec<[f32; 32]> = members.bounds(x, normal).collect();
                if bounds[place] > 0.0 { chance * (bounds[place] / bounds.iter().sum::<f32>()) } else { 0.0 }
            }
        }
    }
}

fn sum(bounds: &[f32; LANES]) -> f32 {
    let [low, high] = [0, 4].map(|first| Vec4::from_slice(&bounds[first..]));
    (low + high).element_sum()
}

/// The first of `bounds` whose running sum exceeds `target`, and what of it is left there. Rounding may run past the end; the last
/// that is not 0 stands in.
fn proportionally(bounds: &[f32], mut target: f32) -> Option<(usize, f32)> {
    for (at, &bound) in bounds.iter().enumerate() {
        if bound > 0.0 && target < bound {
            return Some((at, target));
        }
        target -= bound;
    }
    let last = bounds.iter().rposition(|&b| b > 0.0)?;
    Some((last, bounds[last]))
}
