//! What work on indirect light is worth: keys in the same currency as those of direct light ([`super::error_model`]).

use super::error_model::{
    CHILD, CONTRAST_WEIGHT, ErrorModel, HARD_CONTRAST, HARD_PIXELS, SURPLUS_TO_MSE, VERTEX_COST, sum_of_products,
};
use crate::cache::ids::{DrawnId, NodeId, SlotId, VertexId};
use crate::cache::slot::Luminance;
use crate::cache::topology::Node;
use crate::math::luminance;
use glam::Vec3;

/// Rays of a vertex's first round.
pub const FIRST_RAYS: u32 = 16;
/// What the variance of a sample comes to if it is spread over its rays, against the square of the value, where
/// nothing was sampled.
const NOISE_OF_ONE_RAY: f32 = 1.0;
/// Rays that found no light at all, which prove that a vertex is enclosed.
pub const PROOF_OF_DARKNESS: u32 = 128;
/// A vertex is not sampled beyond this many rays (whose noise is about 0.05 %).
const MAX_RAYS: u32 = 1 << 17;
/// Most rays of the first round of a vertex of a finer level.
const MOST_FIRST_RAYS: u32 = 1 << 16;
/// Rays traced for one gathered: itself and the shadow ray at its hit.
const RAYS_A_SAMPLE: f32 = 2.0;
/// Guess of the standard deviation of interpolation where nothing has been measured: a share of the value.
const UNMEASURED: f32 = 0.05;
/// The same where corners are covered by other geometry, whose light is not the surface's.
const COVERED: f32 = 0.25;
/// The same for what no vertex of a large leaf has seen, against what is typical of the image.
const UNSEEN: f32 = 0.02;
/// Pixels of a leaf that may hide something.
const LARGE: f32 = 64.0;
/// Least reflectance that light is measured by.
const LEAST_REFLECTANCE: f32 = 0.05;
/// Standard deviation of a vertex that was never sampled against the mean of the image; at least that of one that
/// coarser vertices predict: what they see may be darker than what is typical, but it may be wrong, too.
const UNSAMPLED: f32 = 0.3;
/// How many times its expected noise a squared surplus must exceed for it to be believed: two standard deviations.
const SIGNIFICANCE: f32 = 2.6;
/// Least relative standard deviation of a sample: that the first few agree does not say that all would.
const LEAST_DEVIATION: f32 = 0.1;

impl ErrorModel<'_> {
    /// Share of the square error of D over a leaf that the image shows.
    #[must_use]
    pub fn gain(&self, id: NodeId) -> f32 {
        self.gain_of(id, &self.cache.topology.nodes[id].corners)
    }

    /// The same where a leaf shows the light of these slots.
    #[must_use]
    pub fn gain_of(&self, id: NodeId, slots: &[SlotId]) -> f32 {
        let face = self.cache.topology.nodes[id].face;
        let total = slots.iter().map(|&slot| self.shown(face, slot).iter().sum::<f32>());
        let least = total.fold(f32::INFINITY, f32::min);
        self.reflectances.noise_gain(self.scene, face) * self.display_gain(least)
    }

    /// Square of how far the indirect light inside a leaf may be from what its corners make of it, if other geometry
    /// covers any of them: those do not know it at all.
    #[must_use]
    pub fn doubt_inside(&self, id: NodeId) -> Option<f32> {
        let covered = self.cache.topology.nodes[id].corners.into_iter().any(|slot| self.is_covered(slot));
        covered.then(|| self.brightest(id).powi(2))
    }

    /// Expected square error of indirect D over a leaf of the indirect layer, (W·sr⁻¹·m⁻²)²: interpolation and noise.
    #[must_use]
    pub fn indirect_error(&self, id: NodeId) -> [f32; 2] {
        let node = &self.cache.topology.nodes[id];
        let lights = node.corners.map(|slot| self.cache.slots[slot].indirect());
        let covered = node.corners.map(|slot| self.is_covered(slot));
        let valid = || (0..3).filter(|&i| !covered[i]).map(|i| &lights[i]);
        let count = valid().count();
        if count == 0 {
            // Whatever its corners know is not its own light.
            return [(COVERED * self.typical(id)).powi(2), 0.0];
        }
        let y = || valid().map(|light| luminance(light.diffuse));
        let (least, most) = (y().fold(f32::INFINITY, f32::min), y().fold(0.0, f32::max));
        // The mean square of what linear weights leave of the corners' independent noise: a half, two thirds or all
        // of it. What was never sampled is missing from the picture.
        let unknown = (UNSAMPLED * self.typical(id)).powi(2);
        let variance = |l: &Luminance| if l.known { l.variance } else { unknown };
        let noise =
            valid().map(variance).sum::<f32>() * [1.0, 1.0 / 3.0, 1.0 / 6.0][count - 1] + self.hanging_noise(node);
        let contrast = CONTRAST_WEIGHT * (most - least).powi(2);
        let interpolation = if node.indirect.surplus.is_finite() {
            node.indirect.surplus + SURPLUS_TO_MSE * CHILD * contrast
        } else {
            (UNMEASURED * most.max(self.typical(id))).powi(2) + contrast
        };
        [interpolation, noise]
    }

    /// Variance that sampled midpoints on a leaf's edges, which neighbours have refined, add to what it shows.
    fn hanging_noise(&self, node: &Node) -> f32 {
        let middles = node.edges.into_iter().filter_map(|edge| self.cache.topology.midpoint(edge));
        let slots =
            middles.filter_map(|middle| self.cache.slots_of(middle).find(|&slot| self.cache.indirect.is_sampled(slot)));
        slots.map(|slot| self.cache.slots[slot].indirect().variance).sum::<f32>() / 6.0
    }

    /// Whether a leaf lies across a line where its surface runs into another: some of its corners are covered, or see
    /// hardly any of the light that others see.
    fn crosses_contact(&self, id: NodeId) -> bool {
        let corners = self.cache.topology.nodes[id].corners;
        let covered = corners.map(|slot| self.is_covered(slot));
        let y = corners.map(|slot| luminance(self.cache.slots[slot].indirect().diffuse));
        let (least, most) = (y.into_iter().fold(f32::INFINITY, f32::min), y.into_iter().fold(0.0, f32::max));
        let mixed = covered.contains(&true) && covered.contains(&false);
        mixed || most - least > HARD_CONTRAST * (most + least)
    }

    /// Square of how far a middle may deviate where nothing has been measured.
    pub fn unmeasured(&self, id: NodeId) -> f32 {
        (COVERED * self.brightest(id).max(self.typical(id))).powi(2)
    }

    /// Greatest luminance of indirect D at a node's corners, W·sr⁻¹·m⁻².
    fn brightest(&self, id: NodeId) -> f32 {
        let corners = self.cache.topology.nodes[id].corners;
        corners.map(|slot| luminance(self.cache.slots[slot].indirect().diffuse)).into_iter().fold(0.0, f32::max)
    }

    /// D that would make a node's face as bright as the image is in the mean.
    fn typical(&self, id: NodeId) -> f32 {
        let reflectance = self.reflectances.noise_gain(self.scene, self.cache.topology.nodes[id].face).sqrt();
        self.mean / reflectance.max(LEAST_REFLECTANCE)
    }

    fn is_covered(&self, slot: SlotId) -> bool {
        self.cache.is_covered(slot)
    }

    /// Square error of interpolating indirect light over a node, from its middles: as far as noise does not explain
    /// it, and what it may be at most. `None` while middles are not sampled.
    #[must_use]
    pub fn indirect_surplus(&self, id: NodeId, middles: [SlotId; 3]) -> Option<[f32; 2]> {
        let corners = self.cache.topology.nodes[id].corners;
        let light = |slot: SlotId| self.cache.slots[slot].indirect();
        let mut noise = 0.0;
        let mut measured = false;
        let d = [0, 1, 2].map(|i| {
            let (a, b) = (light(corners[i]), light(corners[(i + 1) % 3]));
            let hidden = [corners[i], corners[(i + 1) % 3], middles[i]].into_iter().any(|s| self.is_covered(s));
            if hidden || a.stale || b.stale || !self.cache.indirect.is_sampled(middles[i]) {
                return 0.0;
            }
            measured = true;
            // Its own: what it is shown with leans towards what the ends predict.
            let middle = self.cache.gathered(middles[i], Vec3::ZERO);
            noise += middle.variance + (a.variance + b.variance) * 0.25;
            luminance(middle.diffuse - (a.diffuse + b.diffuse) * 0.5)
        });
        let (found, noise) = (sum_of_products(d), noise * SIGNIFICANCE);
        measured.then(|| [(found - noise).max(0.0), found + noise].map(|d| SURPLUS_TO_MSE * d))
    }

    /// Key of sampling the middles of a leaf of the indirect layer; 0 if it is not worth it or not allowed.
    #[must_use]
    pub fn refine_key(&self, id: NodeId) -> f32 {
        let node = &self.cache.topology.nodes[id];
        let light = |slot: &SlotId| self.cache.slots[*slot].indirect();
        // A covered corner may never gather; what it would find is not this surface's light anyway.
        let is_known = |slot: &SlotId| self.is_covered(*slot) || light(slot).known && !light(slot).stale;
        let known = node.corners.iter().all(is_known);
        let crosses = self.crosses_contact(id);
        let least = self.options.min_pixels * if crosses { HARD_PIXELS } else { 1.0 };
        if !self.room.for_vertices || self.view.indirect[id].pixels <= least || !known || self.is_finest(id) {
            return 0.0;
        }
        let mut error = self.indirect_error(id)[0];
        if self.view.indirect[id].pixels > LARGE {
            error += (UNSEEN * self.typical(id)).powi(2);
        }
        if crosses {
            error += (COVERED * self.brightest(id)).powi(2) * CHILD;
        }
        let error = error * self.gain(id);
        let (mut samples, mut vertices) = (0, 0);
        for edge in node.edges {
            match self.cache.topology.midpoint(edge) {
                None => (samples, vertices) = (samples + 1, vertices + 1),
                Some(v) => samples += u32::from(self.cache.indirect.rays(v) == 0),
            }
        }
        let rays = samples as f32 * self.first_rays(id) as f32 * RAYS_A_SAMPLE;
        self.view.indirect[id].pixels * error / (1.0 + rays + VERTEX_COST * vertices as f32)
    }

    /// Rays of the first round at the middles of a node: about as many as its corners have, or finer vertices would
    /// show more noise than coarse ones.
    #[must_use]
    pub fn first_rays(&self, id: NodeId) -> u32 {
        let rays = self.cache.corner_vertices(id).map(|v| self.cache.indirect.rays(v));
        let least = rays.into_iter().filter(|&r| r > 0).min().unwrap_or(FIRST_RAYS);
        (least / 2).clamp(FIRST_RAYS, MOST_FIRST_RAYS)
    }

    /// Key of a vertex's next round, which doubles its rays.
    #[must_use]
    pub fn gather_key(&self, id: VertexId) -> f32 {
        let (vertex, view) = (&self.cache.vertices[id], &self.view.vertices[id]);
        let rays = self.cache.indirect.rays(id);
        // A covered midpoint takes over what is known around; of a base vertex something must be known.
        let is_done = vertex.progress.covered && !vertex.progress.enclosed && (rays > 0 || !self.is_base(id));
        // The few vertices that predict all others sample at any rate.
        let predicts = || self.cache.slots_of(id).any(|slot| self.cache.slots[slot].is_coarse());
        let has_room = rays > 0 || self.room.for_samples || predicts();
        if rays >= self.room.most_rays(MAX_RAYS) || is_done || !has_room {
            return 0.0;
        }
        if rays == 0 {
            let rays = self.first_rays_at(id) as f32;
            return (view.importance + view.importance_below) * self.first_gain(id, rays) / (rays * RAYS_A_SAMPLE);
        }
        let likely = |slot: SlotId| {
            let light = &self.cache.slots[slot].indirect();
            light.variance.max((LEAST_DEVIATION * luminance(light.diffuse)).powi(2) / rays as f32)
        };
        let mut variance = self.cache.slots_of(id).map(likely).fold(0.0, f32::max);
        if variance == 0.0 && rays < PROOF_OF_DARKNESS {
            // It may lie inside something, or its few rays missed what light there is.
            // That does not become less likely with the rays until there is proof.
            variance = (UNSAMPLED * self.mean).powi(2) / FIRST_RAYS as f32;
        }
        let importance = view.importance + view.importance_below + self.hanging_importance(id);
        importance * variance * 0.5 / (rays as f32 * RAYS_A_SAMPLE)
    }

    /// Whether a vertex is a corner of the scene's triangles.
    fn is_base(&self, id: VertexId) -> bool {
        self.cache.vertices[id].first_slot.get().is_none_or(|slot| self.cache.slots[slot].is_base())
    }

    /// What shows of a sampled vertex in leaves of the indirect layer that it is no corner of: it lies on an edge of
    /// theirs, which neighbours have refined, and they are drawn through it.
    fn hanging_importance(&self, id: VertexId) -> f32 {
        // Base vertices are corners wherever they are drawn.
        if self.is_base(id) || self.cache.pixel_slot(id).is_some() {
            return 0.0;
        }
        let leaves = self.cache.slots_of(id).flat_map(|slot| self.cache.drawn.with_slot(slot));
        let share = |drawn: DrawnId| {
            let node = self.cache.drawn.triangles[drawn].node;
            let holder = self.cache.topology.indirect_leaf(node);
            if self.cache.corner_vertices(holder).contains(&id) {
                return 0.0;
            }
            let triangles = self.cache.drawn.of_node(node).len();
            if self.view.sees(node) {
                self.view.leaves[node].pixels * self.gain(holder) / (6 * triangles) as f32
            } else {
                0.0
            }
        };
        leaves.map(share).sum()
    }

    /// Drop of the square error at a vertex that its first round of so many rays would buy.
    fn first_gain(&self, id: VertexId, rays: f32) -> f32 {
        let light = |slot: SlotId| self.cache.slots[slot].indirect();
        if let Some(slot) = self.cache.pixel_slot(id) {
            let noise = NOISE_OF_ONE_RAY * luminance(light(slot).diffuse).powi(2) / rays;
            return (self.cache.indirect.expected(id) - noise).max(0.0);
        }
        // The coarsest do show what others predict, but many rest on them.
        let rests_on_others = |slot: &SlotId| self.cache.slots[*slot].rank > 0;
        let predicted = self.cache.slots_of(id).filter(rests_on_others).map(light).filter(|light| light.coarse);
        let Some(doubt) = predicted.map(|light| light.variance).reduce(f32::max) else {
            return (UNSAMPLED * self.mean).powi(2);
        };
        let doubt = doubt.max((UNSAMPLED * self.mean).powi(2));
        // A sample of its own brings noise of its own: about as much a ray as those that predict it have.
        let parents = self.cache.parents_of(id).filter(|(parent, _)| self.cache.indirect.is_sampled(*parent));
        let a_ray = parents.map(|(parent, _)| light(parent).variance * self.rays_at(parent) as f32);
        let (sum, count) = a_ray.fold((0.0, 0), |(sum, count), noise| (sum + noise, count + 1));
        if count == 0 { doubt } else { (doubt - sum / (count as f32 * rays)).max(0.0) }
    }

    /// Rays of the first round at a base vertex: about as many as those that predict it have, or finer vertices would
    /// show more noise than coarse ones.
    #[must_use]
    pub fn first_rays_at(&self, id: VertexId) -> u32 {
        if self.cache.pixel_slot(id).is_some() {
            return FIRST_RAYS;
        }
        let rays = self.cache.parents_of(id).map(|(parent, _)| self.rays_at(parent)).filter(|&rays| rays > 0);
        (rays.min().unwrap_or(FIRST_RAYS) / 2).clamp(FIRST_RAYS, MOST_FIRST_RAYS)
    }

    fn rays_at(&self, slot: SlotId) -> u32 {
        self.cache.indirect.rays(self.cache.slots[slot].vertex)
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::judged;
    use super::*;
    use crate::cache::testing::known;

    #[test]
    fn first_rounds_are_as_long_as_what_is_around_asks_for() {
        let mut square = judged(100.0);
        let root = square.roots[0];
        assert_eq!(square.model().first_rays(root), FIRST_RAYS);
        for (slot, rays) in square.corners(root).into_iter().zip([256, 64, 0]) {
            square.gather(slot, &vec![1.0; rays]);
        }
        assert_eq!(square.model().first_rays(root), 32, "half of the least, of those that have any");
    }

    /// A round doubles the rays and so halves the variance: what that takes off the image's square error, a ray traced.
    #[test]
    fn the_key_of_a_round_is_the_drop_of_variance_a_ray() {
        let mut square = judged(100.0);
        let root = square.roots[0];
        let slot = square.corners(root)[1];
        let vertex = square.cache.slots[slot].vertex;
        square.gather(slot, &[1.0; 32]);
        square.cache.slots[slot].set_indirect(known(1.0, 1.0 / 64.0));
        square.view.vertices[vertex].importance = 50.0;
        let key = square.model().gather_key(vertex);
        let (rays, drop) = (32.0 * RAYS_A_SAMPLE, 1.0 / 64.0 / 2.0);
        assert!((key * rays / (50.0 * drop) - 1.0).abs() < 1e-5, "{key}");
        // Twice as many with half the variance: a quarter of the key.
        square.gather(slot, &[1.0; 32]);
        square.cache.slots[slot].set_indirect(known(1.0, 1.0 / 128.0));
        assert!((key / square.model().gather_key(vertex) - 4.0).abs() < 1e-4);
        square.cache.vertices[vertex].progress.covered = true;
        assert_eq!(square.model().gather_key(vertex), 0.0, "covered, and something is known");
    }

    #[test]
    fn a_few_rays_that_agree_do_not_prove_that_there_is_no_noise() {
        let mut square = judged(100.0);
        let root = square.roots[0];
        let slot = square.corners(root)[1];
        let vertex = square.cache.slots[slot].vertex;
        square.view.vertices[vertex].importance = 1.0;
        square.gather(slot, &[1.0; 16]);
        square.cache.slots[slot].set_indirect(known(1.0, 0.0));
        let key = square.model().gather_key(vertex);
        assert!((key / (LEAST_DEVIATION.powi(2) / 16.0 * 0.5 / (16.0 * RAYS_A_SAMPLE)) - 1.0).abs() < 1e-4, "{key}");
        square.cache.slots[slot].set_indirect(known(0.0, 0.0));
        assert!(square.model().gather_key(vertex) > key, "darkness wants a proof");
        square.gather(slot, &[0.0; PROOF_OF_DARKNESS as usize]);
        assert_eq!(square.model().gather_key(vertex), 0.0);
    }

    #[test]
    fn noise_of_corners_is_in_the_error_by_their_number() {
        let mut square = judged(100.0);
        let root = square.roots[0];
        let corners = square.corners(root);
        corners.into_iter().for_each(|slot| square.cache.slots[slot].set_indirect(known(1.0, 0.0625)));
        square.cache.topology.nodes[root].indirect.surplus = 0.01;
        let error = |square: &super::super::testing::Judged| square.model().indirect_error(root);
        let [interpolation, noise] = error(&square);
        // ∫ (Σ bᵢ eᵢ)² over a triangle: Σ ⟨bᵢ²⟩ σ² = 3 · σ² / 6.
        assert!((noise - 0.031_25).abs() < 1e-6 && (interpolation - 0.01).abs() < 1e-6, "{interpolation} {noise}");
        let covered = square.cache.corner_vertices(root)[0];
        square.cache.vertices[covered].progress.covered = true;
        assert!((error(&square)[1] - 0.125 / 3.0).abs() < 1e-6, "two corners");
    }

    #[test]
    fn surplus_within_the_noise_is_only_doubted() {
        let mut square = judged(100.0);
        let root = square.roots[0];
        let middles = square.split(root).middles;
        assert!(square.model().indirect_surplus(root, middles).is_none(), "nothing was sampled");
        square.corners(root).into_iter().for_each(|slot| square.cache.slots[slot].set_indirect(known(1.0, 0.0)));
        square.gather(middles[0], &[1.5; 64]);
        let [surplus, doubt] = square.model().indirect_surplus(root, middles).expect("measured");
        assert!((surplus / (SURPLUS_TO_MSE * 0.25) - 1.0).abs() < 1e-3 && doubt == surplus, "{surplus} {doubt}");
        square.gather(middles[1], &[0.0, 2.0].repeat(2));
        let [with_noise, doubt] = square.model().indirect_surplus(root, middles).expect("measured");
        assert!(with_noise == 0.0 && doubt > surplus, "{with_noise} {doubt}");
    }
}
