//! Predictions from coarse levels in a view: what rests on the base vertices that predict others, and when
//! predictions are brought up to date.

use super::view::ViewState;
use super::workers::Workers;
use crate::cache::coarse_levels::Placed;
use crate::cache::ids::{SlotId, VertexId};
use crate::cache::pool::Table;
use crate::cache::store::Cache;
use std::cmp::Reverse;

/// Rays that are traced for each prediction brought up to date in the long run, and refreshes after which it is one more:
/// oftener costs more than it tells (docs/notebook/pieces.md).
const RAYS_A_PREDICTION: u64 = 16;
const ALIKE: u64 = 2;
/// Rays that a prediction costs as much as, with what has to be judged anew after it, about.
const COST: u64 = 2;

/// Base vertices that are taken into the order together: few, since each is compared with those before.
const AT_ONCE: usize = 256;
/// Those whose surroundings take some ten microseconds to look at.
const FEW: usize = 8;

/// Base vertices of a view and what they predict.
#[derive(Debug, Default)]
pub struct Predictions {
    /// Visible base vertices and those that predict them, each after all that it may predict, by falling rank. Those that
    /// went out of view stay until all is surveyed anew.
    base: Vec<Reverse<(u8, VertexId)>>,
    /// Which vertices are among them.
    is_base: Table<VertexId, bool>,
    /// How many there were when importance was last spread.
    spread_over: usize,
    /// Base vertices that predict others in this view.
    predicting: Vec<VertexId>,
    /// Rays traced when the predictions were last brought up to date.
    refreshed_at: u64,
    /// How often since indirect light was surveyed.
    refreshes: u64,
}

impl Predictions {
    /// Forgets which vertices are in view.
    pub fn start_anew(&mut self) {
        (self.base, self.is_base, self.spread_over) = (Vec::new(), Table::default(), 0);
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let lists = self.base.capacity() * size_of::<Reverse<(u8, VertexId)>>() + self.predicting.capacity() * 4;
        lists + self.is_base.bytes()
    }

    /// Forgets vertices that are gone.
    pub fn retain(&mut self, is_there: impl Fn(VertexId) -> bool) {
        let is_base = &mut self.is_base;
        self.base.retain(|Reverse((_, vertex))| {
            let stays = is_there(*vertex);
            is_base[*vertex] = stays;
            stays
        });
        self.predicting.retain(|&vertex| is_there(vertex));
        self.spread_over = self.spread_over.min(self.base.len());
    }

    /// Takes base vertices of a view in, and those that are not yet in the order of coarse levels into it; returns
    /// the slots of these.
    pub fn place(&mut self, cache: &mut Cache, base: &[VertexId], workers: &Workers) -> Vec<SlotId> {
        let is_new = |vertex: &VertexId| !std::mem::replace(&mut self.is_base[*vertex], true);
        let mut added: Vec<VertexId> = base.iter().copied().filter(is_new).collect();
        let is_unplaced = |vertex: &VertexId| cache.slots_of(*vertex).any(|slot| cache.slots[slot].is_unplaced());
        let unplaced: Vec<VertexId> = added.iter().copied().filter(is_unplaced).collect();
        unplaced.chunks(AT_ONCE).for_each(|run| place_run(cache, run, workers));
        let slots = unplaced.iter().flat_map(|&vertex| cache.slots_of(vertex)).collect();
        self.add_ancestors(cache, &mut added);
        if !added.is_empty() {
            let rank =
                |vertex: VertexId| cache.vertices[vertex].first_slot.get().map_or(0, |slot| cache.slots[slot].rank);
            self.base.extend(added.into_iter().map(|vertex| Reverse((rank(vertex), vertex))));
            self.base.sort();
        }
        slots
    }

    /// Adds the vertices out of view that predict those of the view, or predict what does.
    fn add_ancestors(&mut self, cache: &Cache, added: &mut Vec<VertexId>) {
        let mut next = 0;
        while let Some(&vertex) = added.get(next) {
            let parents = cache.parents_of(vertex).map(|(slot, _)| cache.slots[slot].vertex);
            added.extend(parents.filter(|&parent| !std::mem::replace(&mut self.is_base[parent], true)));
            next += 1;
        }
    }

    /// Whether so many vertices have come into view that importance must be spread anew.
    #[must_use]
    pub const fn have_grown(&self) -> bool {
        /// One in so many of them.
        const MANY: usize = 8;
        (self.base.len() - self.spread_over) * MANY > self.base.len()
    }

    /// Adds up what rests on the vertices that predict others.
    pub fn spread_importance(&mut self, cache: &Cache, view: &mut ViewState) {
        self.spread_over = self.base.len();
        for vertex in std::mem::take(&mut self.predicting) {
            view.vertices[vertex].importance_below = 0.0;
        }
        // Finest first: what rests on a vertex rests on those that predict it.
        let base = self.base.iter().map(|Reverse((_, vertex))| *vertex);
        for vertex in base.filter(|&vertex| cache.indirect.rays(vertex) == 0) {
            let importance = view.vertices[vertex].importance + view.vertices[vertex].importance_below;
            for (slot, weight) in cache.parents_of(vertex) {
                let parent = cache.slots[slot].vertex;
                let below = &mut view.vertices[parent].importance_below;
                if *below == 0.0 {
                    self.predicting.push(parent);
                }
                *below += weight.abs() * importance;
            }
        }
    }

    /// Whether so many rays were traced that to bring predictions up to date costs little beside them.
    /// The first are rough, and soon replaced; later ones change little.
    #[must_use]
    pub fn are_due(&self, rays: u64) -> bool {
        let share = (1 + self.refreshes / ALIKE).min(RAYS_A_PREDICTION);
        rays - self.refreshed_at >= share * COST * self.base.len() as u64
    }

    /// Base vertices of the view.
    pub fn base(&self) -> impl Iterator<Item = VertexId> + '_ {
        self.base.iter().map(|Reverse((_, vertex))| *vertex)
    }

    /// Notes that predictions are brought up to date after so many rays in all.
    pub fn note_refresh(&mut self, rays: u64) {
        (self.refreshed_at, self.refreshes) = (rays, self.refreshes + 1);
    }

    /// Notes that indirect light was surveyed anew, and predictions brought up to date, after so many rays in all.
    pub fn note_survey(&mut self, rays: u64) {
        (self.refreshed_at, self.refreshes) = (rays, 0);
    }

    /// Base vertices that predict others in this view.
    #[must_use]
    pub fn predicting(&self) -> &[VertexId] {
        &self.predicting
    }
}

/// Takes base vertices into the order of coarse levels, one after the other; the workers do what does not hang on those before.
fn place_run(cache: &mut Cache, vertices: &[VertexId], workers: &Workers) {
    let around = |run: &[VertexId]| run.iter().map(|&vertex| cache.around_in_coarse_levels(vertex)).collect::<Vec<_>>();
    let around = workers.map_chunks(vertices, FEW, around).into_iter().flatten().collect();
    let placed = cache.place_in_coarse_levels(vertices, around);
    let predicted_by = |run: &[Placed]| run.iter().flat_map(|placed| cache.predicted_by(placed)).collect::<Vec<_>>();
    let predicted = workers.map_chunks(&placed, FEW, predicted_by);
    predicted.iter().flatten().for_each(|predicted| cache.note_predicted_by(predicted));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn predictions_come_more_seldom_the_more_are_known() {
        let mut predictions = Predictions { base: vec![Reverse((0, VertexId(0))); 50], ..Predictions::default() };
        assert!(!predictions.are_due(99) && predictions.are_due(100));
        (0..40).for_each(|_| predictions.note_refresh(1000));
        assert!(!predictions.are_due(2599) && predictions.are_due(2600));
        predictions.note_survey(5000);
        assert!(!predictions.are_due(5099) && predictions.are_due(5100));
    }
}
