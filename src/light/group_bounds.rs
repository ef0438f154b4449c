//! Upper bounds of what each light group sends, ready for evaluation eight at a time.

use super::bounds::{Bounds8, LANES, LightBounds};
use super::group::LightGroup;

/// What gives the bounds of all groups at a place.
#[derive(Clone, Debug, Default)]
pub(super) struct GroupBounds {
    /// Eight groups at a time, in order.
    pub packs: Vec<Bounds8>,
    /// Groups whose bounds the packs do not tell everywhere.
    pub others: Vec<u32>,
}

impl GroupBounds {
    /// Of all groups in order, each with what its light counts times at most.
    pub fn new(groups: &[(LightGroup<'_>, f32)]) -> Self {
        let of = |&(group, factor): &(LightGroup<'_>, f32)| (group.bounds().unwrap_or_default(), factor);
        let bounds: Vec<(LightBounds, f32)> = groups.iter().map(of).collect();
        let is_other = |(_, (group, _)): &(u32, &(LightGroup<'_>, f32))| {
            matches!(group, LightGroup::Shared(_)) || group.bounds().is_none()
        };
        Self {
            packs: bounds.chunks(LANES).map(Bounds8::new).collect(),
            others: (0..).zip(groups).filter(is_other).map(|(index, _)| index).collect(),
        }
    }
}
