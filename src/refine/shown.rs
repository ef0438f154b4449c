//! What slots show: light, or for a debug view another quantity in its place; and what such a view asks of drawn triangles. No ray is
//! traced here, and nothing that the engine goes by changes.

use super::engine::Engine;
use super::publisher::value;
use super::update::{Answer, DrawnId, Question, Shown, Slot, Update};
use crate::cache::ids::{NodeId, SlotId};
use crate::cache::luminance::direct_of;
use crate::estimate::visibility::Origin;
use glam::Vec3;

impl Engine {
    /// Has slots show something else from now on; the update has all of them.
    pub fn show(&mut self, shown: Shown) -> Update {
        self.shown = shown;
        let mut update = self.publish();
        let all: Vec<SlotId> = self.cache.slots.ids().collect();
        self.publish_values(&mut update, &all);
        update
    }

    /// Asks something of each drawn triangle in view; the update has the answer.
    pub fn ask(&mut self, question: Question) -> Update {
        let mut update = self.publish();
        let leaves = self.view.visible_leaves(&self.cache);
        let of: Vec<(DrawnId, u32)> = match question {
            Question::Error => self.of_triangles(&leaves, |leaf| self.relative_error(leaf).to_bits()),
            Question::LightMesh(light) => {
                let groups = self.groups_named_as(light);
                self.of_triangles(&leaves, |leaf| self.node_of_lights(&groups, leaf).0)
            }
        };
        update.answer = Some(Answer { question, of });
        update
    }

    /// What a slot shows.
    pub(super) fn value_to_show(&self, groups: &[usize], slot: SlotId) -> Slot {
        let light = value(&self.cache, &self.view, slot);
        let record = &self.cache.slots[slot];
        match self.shown {
            Shown::Light => light,
            Shown::Direct(_) => {
                let of = |&group: &usize| direct_of(&self.context(), &self.cache, slot, group);
                Slot { diffuse: groups.iter().map(of).sum(), specular: Vec3::ZERO, ..light }
            }
            Shown::Indirect => Slot {
                diffuse: (light.diffuse - record.direct().diffuse).max(Vec3::ZERO),
                specular: self.view.specular.get(slot).indirect,
                ..light
            },
            Shown::Knowledge => {
                let is_guess = record.direct().stale || record.indirect().stale;
                let known = [light.weight == 0.0, is_guess, self.cache.is_covered(slot)];
                let diffuse = Vec3::from_array(known.map(|is| f32::from(u8::from(is))));
                Slot { diffuse, specular: Vec3::ZERO, weight: 1.0, ..light }
            }
        }
    }

    /// The light groups of what is shown, if that is of single lights.
    pub(super) fn groups_shown(&self) -> Vec<usize> {
        if let Shown::Direct(light) = self.shown { self.groups_named_as(light) } else { Vec::new() }
    }

    /// The groups of all lights that have the name of one, ascending.
    fn groups_named_as(&self, light: u32) -> Vec<usize> {
        let lights = &self.scene.lights;
        let name = lights.get(light as usize).map(|light| &light.name);
        let is_named = |&source: &u32| lights.get(source as usize).map(|light| &light.name) == name;
        let groups = 0..self.lights.group_count();
        groups.filter(|&group| self.lights.sources_of_group(group).iter().any(is_named)).collect()
    }

    fn of_triangles(&self, leaves: &[NodeId], answer: impl Fn(NodeId) -> u32) -> Vec<(DrawnId, u32)> {
        let of_leaf = |&leaf: &NodeId| {
            let answer = answer(leaf);
            self.cache.drawn.of_node(leaf).into_iter().map(move |drawn| (drawn, answer))
        };
        leaves.iter().flat_map(of_leaf).collect()
    }

    /// Root of the square error that the sums over the image hold of a pixel of a leaf, over the image's mean: the mean of its squares
    /// over all pixels is the square of the estimated error.
    fn relative_error(&self, leaf: NodeId) -> f32 {
        let a_pixel = |sum: f32, pixels: f32| if pixels > 0.0 { sum.max(0.0) / pixels } else { 0.0 };
        let direct = self.view.leaves[leaf].accounted;
        let indirect = self.view.indirect[self.cache.topology.indirect_leaf(leaf)];
        let unseen = self.unseen_rate() * a_pixel(direct.unseen, direct.pixels);
        let square = a_pixel(direct.error, direct.pixels) + a_pixel(indirect.accounted, indirect.pixels) + unseen;
        let mean = self.image.mean();
        if mean > 0.0 { square.sqrt() / mean } else { 0.0 }
    }

    /// The largest node above a leaf below which light groups were nowhere sampled.
    fn node_of_lights(&self, groups: &[usize], leaf: NodeId) -> NodeId {
        let topology = &self.cache.topology;
        let is_sampled = |slot: &SlotId| {
            let vertex = self.cache.slots[*slot].vertex;
            groups.iter().any(|&group| self.cache.layers[group].visibility.get(vertex).origin == Origin::Sampled)
        };
        let taken_over = |id: &NodeId| topology.middles(*id).is_some_and(|middles| !middles.iter().any(is_sampled));
        let up = |id: &NodeId| topology.nodes[*id].parent.get().filter(taken_over);
        std::iter::successors(Some(leaf), up).last().unwrap_or(leaf)
    }
}
