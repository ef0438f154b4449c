//! Highlights that lie between vertices unseen, since S is known at vertices alone.

use super::engine::Engine;
use super::options::Piece;
use crate::cache::ids::NodeId;
use crate::light::highlight::GlossyTriangle;
use crate::math::luminance;
use glam::Vec3;

/// Luminance against the image's mean, or what the leaf shows, below which a highlight is not looked for.
const FLOOR: f32 = 0.02;
/// Leaves that are looked at in some ten microseconds.
const FEW: usize = 8;

/// A highlight that a leaf's corners do not show.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Highlight {
    /// How much brighter the leaf is there than it is drawn: specular luminance S, W·sr⁻¹·m⁻².
    pub surplus: f32,
    /// Share of the leaf that it covers.
    pub share: f32,
}

impl Engine {
    /// Looks for highlights hidden in leaves. No ray is traced: lights are as visible as they are at the corners.
    pub(super) fn look_for_highlights(&mut self, nodes: &[NodeId]) {
        nodes.iter().for_each(|&node| self.note_highlight(node, Highlight::default()));
        let glossy: Vec<NodeId> = nodes.iter().copied().filter(|&node| self.shows_highlights(node)).collect();
        let engine = &*self;
        let found = self.workers.map_chunks(&glossy, FEW, |chunk| {
            chunk.iter().map(|&node| engine.hidden_highlight(node)).collect::<Vec<_>>()
        });
        for (node, hidden) in glossy.into_iter().zip(found.into_iter().flatten()) {
            self.note_highlight(node, hidden);
        }
    }

    fn note_highlight(&mut self, node: NodeId, Highlight { surplus, share }: Highlight) {
        self.view.hidden.update(node, |hidden| (hidden.highlight, hidden.highlight_share) = (surplus, share));
    }

    /// Whether a leaf is seen, glossy, and its corners are known.
    fn shows_highlights(&self, id: NodeId) -> bool {
        let node = &self.cache.topology.nodes[id];
        let slots = node.corners.map(|slot| &self.cache.slots[slot]);
        !self.options.without.has(Piece::Highlights)
            && self.view.leaves[id].pixels > 0.0
            && self.view.sees(id)
            && slots.iter().all(|slot| slot.direct().known && slot.gloss().is_some())
    }

    fn hidden_highlight(&self, id: NodeId) -> Highlight {
        let slots = self.cache.topology.nodes[id].corners;
        let corners = slots.map(|slot| &self.cache.slots[slot]);
        let vertices = corners.map(|slot| slot.vertex);
        let shown = slots.map(|slot| luminance(self.view.specular.get(slot).direct));
        let Some(gloss) = self.cache.gloss(slots[0]) else { return Highlight::default() };
        let positions = self.cache.corner_positions(id);
        let triangle = GlossyTriangle::new(positions, corners.map(|slot| slot.normal()), gloss, self.view.eye);
        let floor = FLOOR * self.image.mean() + shown.iter().fold(f32::INFINITY, |m, &s| m.min(s));
        let mut hidden = Highlight::default();
        for (light, (emitter, layer)) in self.lights.groups().zip(&self.cache.layers).enumerate() {
            let factor = self.lights.group_factor(light);
            let visible = vertices.map(|v| layer.visibility.get(v).fraction()).iter().sum::<f32>() / 3.0;
            if visible == 0.0 || factor == Vec3::ZERO {
                continue;
            }
            for (source, beside) in emitter.sources().filter(|(_, beside)| *beside != Vec3::ZERO) {
                let factor = factor * beside;
                let least = (floor + hidden.surplus) / (visible * factor.max_element());
                let Some(peak) = triangle.peak(source, least) else { continue };
                let drawn = Vec3::from(shown).dot(Vec3::from(peak.at));
                let surplus = luminance(peak.specular * factor) * visible - drawn;
                if surplus > hidden.surplus {
                    hidden = Highlight { surplus, share: peak.share };
                }
            }
        }
        hidden
    }
}
