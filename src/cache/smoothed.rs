//! Indirect light as it is shown: smoothed between the samples of the cache, which stay what they are.
//!
//! Slots that gathered show the mean of theirs and others' samples ([`super::adaptive_mean`]), other base slots what lies between
//! those; how much that changes them is taken on to all inside the faces that they predict. Nothing is decided by it: what vertices
//! still have to do hangs on what they know themselves, since variances of means would have them asked too late.

use super::adaptive_mean::Sample;
use super::ascending::ascending;
use super::ids::{SlotId, VertexId};
use super::pool::Table;
pub use super::sample_tree::Place;
use super::store::Cache;
use crate::math::{luminance, nearest_axis};
use glam::Vec3;
use std::f32::consts::PI;

/// Slots that are smoothed together.
pub struct ToSmooth {
    /// Each after those that predict it.
    slots: Vec<SlotId>,
    /// What those that gathered have found, in their order.
    pub samples: Vec<Sample>,
    /// Positions and normals of base slots that have not, in their order.
    pub places: Vec<Place>,
}

/// Edge of the cells whose places are interpolated together, against the scene's scale: less than most samples are apart.
const CELL: f32 = 1.0 / 128.0;

impl ToSmooth {
    /// Places near each other, by their numbers, in a scene of this scale.
    #[must_use]
    pub fn groups(&self, scale: f32) -> Vec<Vec<u32>> {
        let key =
            |&(position, normal): &Place| ((position / (CELL * scale)).as_ivec3().to_array(), nearest_axis(normal));
        let mut order: Vec<_> = self.places.iter().map(key).zip(0_u32..).collect();
        order.sort_unstable();
        order.chunk_by(|a, b| a.0 == b.0).map(|group| group.iter().map(|(_, number)| *number).collect()).collect()
    }
}

/// D of slots as smoothed, W·sr⁻¹·m⁻².
pub struct Means {
    /// Of samples, in their order.
    pub samples: Vec<Vec3>,
    /// Of places, in their order.
    pub places: Vec<Option<Vec3>>,
}

/// How the light of a slot comes about.
enum Kind {
    /// It has gathered.
    Gathered,
    /// A base vertex's that has not, nor is there a guess from before the lights changed.
    Base,
    /// Predicted by others, or guessed.
    Other,
}

impl Cache {
    /// What the slots of base vertices, each after those that predict it, and of the vertices inside their faces have gathered.
    pub fn to_smooth(&self, base: impl Iterator<Item = VertexId>) -> ToSmooth {
        let mut slots: Vec<SlotId> = base.flat_map(|vertex| self.slots_of(vertex)).collect();
        self.add_inside(&mut slots);
        let (mut samples, mut places) = (Vec::new(), Vec::new());
        for &slot in &slots {
            match self.kind(slot) {
                Kind::Gathered => samples.push(self.sample(slot)),
                Kind::Base => places.push(self.place(slot)),
                Kind::Other => {}
            }
        }
        ToSmooth { slots, samples, places }
    }

    /// Adds the slots that lie inside the faces of base slots, by rank.
    fn add_inside(&self, slots: &mut Vec<SlotId>) {
        let mut begin = 0;
        let mut waves: Vec<Vec<SlotId>> = Vec::new();
        for rank in 0.. {
            let inside = slots[begin..].iter().flat_map(|&slot| self.lying_between(slot));
            let inside: Vec<SlotId> = inside.filter(|&slot| !self.slots[slot].is_base()).collect();
            begin = slots.len();
            self.add_by_rank(&inside, &mut waves);
            let Some(wave) = waves.get_mut(rank) else { break };
            ascending(wave);
            slots.append(wave);
        }
    }

    fn kind(&self, slot: SlotId) -> Kind {
        match self.indirect.sum(slot).samples() > 1 && !self.is_covered(slot) {
            true => Kind::Gathered,
            false if self.is_to_interpolate(slot) => Kind::Base,
            false => Kind::Other,
        }
    }

    fn is_to_interpolate(&self, slot: SlotId) -> bool {
        let record = &self.slots[slot];
        record.is_base() && (record.indirect().coarse || !record.indirect().stale)
    }

    fn place(&self, slot: SlotId) -> Place {
        let record = &self.slots[slot];
        (self.vertices[record.vertex].position, record.normal())
    }

    fn sample(&self, slot: SlotId) -> Sample {
        let ((position, normal), sum) = (self.place(slot), self.indirect.sum(slot));
        let (y, vector, rays) = (luminance(sum.irradiance()), sum.vector(), sum.independent_rays());
        let tangential = vector - normal * normal.dot(vector);
        Sample {
            position,
            normal,
            diffuse: sum.irradiance() / PI,
            gradient: if y > 0.0 { tangential / y } else { Vec3::ZERO },
            rays,
            variance: self.likely_variance(slot) * rays,
        }
    }

    /// Shows smoothed light; returns the slots that show something else now.
    pub fn show_smoothed(&mut self, of: &ToSmooth, means: &Means) -> Vec<SlotId> {
        let (mut samples, mut places) = (means.samples.iter(), means.places.iter());
        let mut changes = Table::<SlotId, Vec3>::default();
        let mut changed = Vec::new();
        for &slot in &of.slots {
            let kept = self.slots[slot].indirect().diffuse;
            let change = match self.kind(slot) {
                Kind::Gathered => samples.next().map(|mean| *mean - kept),
                Kind::Base => places.next().copied().flatten().map(|mean| mean - kept),
                Kind::Other => self.change_of_prediction(slot, &changes),
            };
            if self.indirect.show_smoothed(slot, change.map(|change| (kept + change).max(Vec3::ZERO))) {
                changed.push(slot);
            }
            changes[slot] = change.unwrap_or_default();
        }
        changed
    }

    /// How the prediction of a slot inside a face changes with what predicts it.
    fn change_of_prediction(&self, slot: SlotId, changes: &Table<SlotId, Vec3>) -> Option<Vec3> {
        let known = |other: &&(SlotId, f32)| self.slots[other.0].indirect().known;
        let (mut sum, mut total) = (Vec3::ZERO, 0.0);
        for &(other, weight) in self.between(slot)?.of.iter().filter(known) {
            let weight = weight * self.weight(other);
            sum += changes[other] * weight;
            total += weight;
        }
        (total > 0.0).then(|| sum / total)
    }
}

#[cfg(test)]
mod tests {
    use super::super::adaptive_mean::AdaptiveMeans;
    use super::super::testing::{Rooted, square};
    use super::*;
    use crate::light::lighting::Lighting;

    /// A square split once, and its corners, of which all but the last gathered.
    fn lit() -> (Rooted, [SlotId; 4], SlotId) {
        let mut square = square();
        let [a, b, c] = square.cache.topology.nodes[square.roots[0]].corners;
        let d = square.cache.topology.nodes[square.roots[1]].corners[2];
        let middle = square.split(square.roots[0]).middles[2];
        // Rays that find 0 or 2: means of 0.875, 1 and 1.125, all of them 1 within their noise.
        for (slot, bright) in [(a, 7), (b, 8), (c, 9)] {
            square.gather(slot, &[vec![2.0; bright], vec![0.0; 16 - bright]].concat());
        }
        for slot in [a, b, c] {
            let light = square.cache.gathered(slot, Vec3::Y);
            square.cache.slots[slot].set_indirect(light.kept());
        }
        (square, [a, b, c, d], middle)
    }

    /// Smooths, and returns the slots that changed.
    fn smooth(cache: &mut Cache) -> Vec<SlotId> {
        let base: Vec<VertexId> = cache.vertices.ids().collect();
        let is_base = |v: &VertexId| cache.slots_of(*v).all(|slot| cache.slots[slot].is_base());
        let to_smooth = cache.to_smooth(base.into_iter().filter(is_base));
        let means = AdaptiveMeans::new(&to_smooth.samples, 100.0).expect("samples");
        let samples: Vec<Vec3> = (0..to_smooth.samples.len()).map(|i| means.of(i)).collect();
        let places = means.between(&to_smooth.places, &samples);
        cache.show_smoothed(&to_smooth, &Means { samples, places })
    }

    fn shown(cache: &Cache, slot: SlotId) -> f32 {
        cache.diffuse_to_show(slot).x
    }

    #[test]
    fn what_noise_tells_apart_is_shown_alike_and_known_as_before() {
        let (mut square, [a, b, c, d], middle) = lit();
        let kept = [a, b, c].map(|slot| square.cache.slots[slot].indirect());
        let changed = smooth(&mut square.cache);
        let values = [a, b, c].map(|slot| shown(&square.cache, slot));
        assert!(values.iter().all(|value| (0.93..1.07).contains(value)), "{values:?}");
        assert_eq!([a, b, c].map(|slot| square.cache.slots[slot].indirect()), kept);
        assert!((shown(&square.cache, d) - 1.0).abs() < 0.07, "between the others");
        let ends = (shown(&square.cache, a) + shown(&square.cache, c)) / 2.0;
        let before = square.cache.slots[middle].indirect().diffuse.x + ends - (0.875 + 1.125) / 2.0;
        assert!((shown(&square.cache, middle) - before).abs() < 1e-5, "a midpoint changes with its ends");
        assert!([a, c, d, middle].iter().all(|slot| changed.contains(slot)), "{changed:?}");
        assert!(smooth(&mut square.cache).is_empty(), "nothing new");
    }

    #[test]
    fn nothing_smoothed_outlives_the_light_that_it_was_made_of() {
        let (mut square, [a, ..], _) = lit();
        smooth(&mut square.cache);
        let kept = square.cache.slots[a].indirect().diffuse.x;
        assert!(shown(&square.cache, a) != kept);
        let light = |power: f32| Lighting { power: Vec3::splat(power), ..Lighting::default() };
        square.cache.relight_indirect(light(1.0), &light(3.0));
        assert_eq!(shown(&square.cache, a), kept);
    }
}
