//! What slots around one predict of its indirect light: the ends of its edge, the corners of its leaf, coarser base
//! vertices, or the base vertices that it shares faces with.

use super::ids::{NodeId, SlotId};
use super::slot::{Eye, SlotLight};
use super::store::Cache;
use crate::bsdf::Gloss;
use crate::math::luminance;
use glam::Vec3;
use smallvec::SmallVec;

/// Power of the cosine between normals by which base vertices that share a face count.
const NORMAL_POWER: i32 = 8;
/// Least weight in all, against the sum of absolute weights: where weights of both signs cancel, nothing is predicted.
const LEAST_TOTAL: f32 = 0.1;
/// Least relative deviation expected from what coarser vertices predict.
const LEAST_DOUBT: f32 = 0.2;

/// Slots around one.
type Neighbours = SmallVec<[SlotId; 12]>;

/// A prediction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Prediction {
    /// The light, with the variance that comes of noise.
    pub light: SlotLight,
    /// Expected square error beyond noise, (W·sr⁻¹·m⁻²)².
    pub error: f32,
}

impl Prediction {
    /// The mean of what slots show, by weights, and how far they differ beyond noise; `None` if nothing is known.
    fn mean(parts: impl Iterator<Item = (SlotLight, f32)>) -> Option<Self> {
        let parts: SmallVec<[(SlotLight, f32); 12]> = parts.filter(|(light, _)| light.known).collect();
        let total: f32 = parts.iter().map(|(_, weight)| weight).sum();
        let size: f32 = parts.iter().map(|(_, weight)| weight.abs()).sum();
        if total <= LEAST_TOTAL * size {
            return None;
        }
        let mut light = SlotLight { known: true, ..SlotLight::default() };
        for (part, weight) in &parts {
            let share = weight / total;
            light.diffuse += part.diffuse * share;
            light.specular += part.specular * share;
            light.variance += part.variance * share * share;
            light.stale |= part.stale;
        }
        (light.diffuse, light.specular) = (light.diffuse.max(Vec3::ZERO), light.specular.max(Vec3::ZERO));
        let y = luminance(light.diffuse);
        let deviation = |part: &SlotLight| (luminance(part.diffuse) - y).powi(2) - part.variance;
        let spread: f32 = parts.iter().map(|(part, weight)| weight.abs() * deviation(part)).sum();
        Some(Self { light, error: (spread / size).max(0.0) })
    }

    /// The same as the light of a slot that coarser vertices predict: to be shown, not to be computed with.
    fn coarse(self) -> SlotLight {
        let doubt = self.error + (LEAST_DOUBT * luminance(self.light.diffuse)).powi(2);
        SlotLight { variance: self.light.variance + doubt, stale: true, coarse: true, ..self.light }
    }
}

impl Cache {
    /// What the slots that one lies between predict for it. Of a midpoint, the error is what was found at others like
    /// it; of a base vertex, how far those that predict differ.
    pub(super) fn prediction(&self, slot: SlotId, eye: Eye<'_>) -> Option<Prediction> {
        let record = &self.slots[slot];
        let between = self.between(slot)?;
        let light = |other: SlotId| match between.coarse {
            true => self.turned(other, slot, eye),
            false => SlotLight::new(self.slots[other].indirect(), eye.specular.get(other).indirect),
        };
        let parts = between.of.iter().map(|&(other, weight)| (light(other), weight * self.weight(other)));
        let found = Prediction::mean(parts)?;
        Some(match between.coarse {
            // Coarser vertices may be predicted themselves: they are as good as their spread says.
            true => Prediction { light: SlotLight { stale: false, ..found.light }, ..found },
            false => Prediction { error: self.indirect.expected(record.vertex), ..found },
        })
    }

    /// What a slot shows that has not gathered.
    pub(super) fn shown_by_prediction(&self, slot: SlotId, predicted: Prediction) -> SlotLight {
        let is_coarse = self.between(slot).is_some_and(|between| between.coarse);
        if is_coarse { predicted.coarse() } else { predicted.light }
    }

    /// What the base vertices that a base slot shares faces with have gathered, where one ray has so much variance.
    pub(super) fn prediction_by_neighbours(&self, slot: SlotId, variance_of_ray: f32) -> Option<Prediction> {
        let normal = self.slots[slot].normal();
        let part = |other: SlotId| {
            let sum = self.indirect.sum(other);
            let weight = normal.dot(self.slots[other].normal()).max(0.0).powi(NORMAL_POWER) * self.weight(other);
            let own = self.gathered(other, Vec3::ZERO);
            (SlotLight { variance: variance_of_ray / sum.independent_rays(), known: sum.samples() > 1, ..own }, weight)
        };
        Prediction::mean(self.neighbours(slot).into_iter().map(part))
    }

    /// Base slots that share a drawn face with a base slot.
    pub(super) fn neighbours(&self, slot: SlotId) -> Neighbours {
        let mut found = Neighbours::new();
        for drawn in self.drawn.with_slot(slot) {
            let up = |id: &NodeId| self.topology.nodes[*id].parent.get();
            let root = std::iter::successors(Some(self.drawn.triangles[drawn].node), up).last();
            let corners = root.into_iter().flat_map(|root| self.topology.nodes[root].corners);
            found.extend(corners.filter(|&corner| corner != slot));
        }
        found.sort_unstable();
        found.dedup();
        found
    }

    /// The light of a slot as it would be on the surface of another.
    fn turned(&self, slot: SlotId, other: SlotId, eye: Eye<'_>) -> SlotLight {
        let lobe = self.gloss(other).filter(|gloss| matches!(gloss, Gloss::Ggx(_)));
        let (record, gathered, other) = (&self.slots[slot], self.indirect.sum(slot), &self.slots[other]);
        let gain = if gathered.samples() > 0 { gathered.turning(record.normal(), other.normal()) } else { 1.0 };
        let as_glossy = record.gloss() == other.gloss();
        // A lobe of GGX is about the other's own normal: it may be narrow.
        let specular = match lobe {
            Some(gloss) if gathered.samples() > 0 => {
                let to_eye = (eye.position - self.vertices[other.vertex].position).normalize_or(other.normal());
                gathered.specular(&gloss.seen(other.normal(), to_eye))
            }
            _ if as_glossy => eye.specular.get(slot).indirect,
            _ => Vec3::ZERO,
        };
        SlotLight { diffuse: record.indirect().diffuse * gain, ..SlotLight::new(record.indirect(), specular) }
    }
}
