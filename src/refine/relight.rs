//! Changes of the lights: direct light is shaded anew from the visibility that is kept, that of lights that have moved is
//! guessed and queued to be traced; indirect light is scaled, brought back or solved again (docs/method/updates.md). No ray is
//! traced here.

use super::engine::{Engine, Visible};
use super::update::Update;

use crate::cache::ids::{NodeId, SlotId};
use crate::cache::moved_light;
use crate::cache::reweight::reweight;
use crate::light::context::SceneContext;
use crate::scene::light::LightState;
use crate::trace;
use std::sync::Arc;

/// Light groups of which something that is kept has become wrong.
#[derive(Default)]
struct Changed {
    /// Those with sources that changed against each other.
    mixed: Vec<usize>,
    /// Those with sources that moved.
    moved: Vec<usize>,
}

impl Engine {
    /// Changes the lights to these states, in the order of the scene's, and takes a view, of a new generation: the returned
    /// update shows everything visible in the new light.
    ///
    /// Direct light is exact at once as far as it was known, but for lights that share a group and change against
    /// each other: where much has been traced in their penumbra, the fraction that was visible stands in until it is
    /// traced again; and for lights that move, which are taken to be as visible from their new place as they were, until each
    /// vertex in view is visited, before all else is done. Indirect light is, too, if all lights change by the same factor or go back to what they were
    /// before the last change; otherwise it is a guess until it is gathered again, which vertices do in order of what
    /// that is worth to the image.
    pub fn relight(&mut self, states: &[LightState], visible: &Visible) -> Update {
        let _view = trace::span("take view");
        let spent = self.current_stats().cpu_seconds;
        let before = self.lights.lighting();
        let Changed { mixed, moved } = self.set_lights(states);
        let now = self.lights.lighting();
        if before != now {
            self.reveal_all();
            self.memory.relight(mixed.iter().chain(&moved).copied());
            let context = SceneContext::new(&self.scene, &self.bvh, &self.lights, self.options.seed, self.scale);
            mixed.into_iter().for_each(|light| reweight(&context, &mut self.cache, light));
            for vertex in std::mem::take(&mut self.enclosed) {
                let progress = &mut self.cache.vertices[vertex].progress;
                (progress.covered, progress.enclosed) = (false, false);
            }
            self.scale_surpluses(before.brightening(&now).powi(2));
            self.cache.relight_indirect(before, &now);
            let all: Vec<SlotId> = self.cache.slots.ids().collect();
            self.evaluate(&all);
            self.refresh_indirect(&all);
            self.note_all_specular();
            self.measure_surpluses();
            self.checks.forget();
            self.view.forget_checks();
            if !moved.is_empty() {
                self.queue_outdated();
            }
            self.start_over();
        }
        let mut update = self.set_visible(visible);
        self.stats.view_cpu_seconds = update.stats.cpu_seconds - spent;
        update.stats = self.stats;
        update
    }

    /// Sets the lights, if that changes them; returns the light groups of which something kept has become wrong.
    fn set_lights(&mut self, states: &[LightState]) -> Changed {
        if self.lights.are(states) {
            return Changed::default();
        }
        // What is on its way was gathered in the light before.
        self.finish_gathering();
        let moved = self.lights.groups_moved_by(states);
        moved.iter().for_each(|&group| moved_light::forget(&self.lights, &mut self.cache, group));
        let mut mixed = Arc::make_mut(&mut self.lights).set(states);
        mixed.retain(|group| moved.binary_search(group).is_err());
        Changed { mixed, moved }
    }

    /// Queues the vertices of faces in view that lights have moved for, to be visited before all else.
    fn queue_outdated(&mut self) {
        let mut leaves = Vec::new();
        self.view.faces.roots().for_each(|root| self.cache.topology.leaves(root, &mut leaves));
        let slots = self.drawn_slots(&leaves);
        self.queue_first_visits(&slots);
    }

    /// Queues everything in view anew.
    fn start_over(&mut self) {
        let first_visits = self.scheduler.take_first_visits(usize::MAX);
        self.scheduler.clear();
        self.scheduler.push_first_visits(first_visits.into_iter());
        self.reset_tolerance();
        self.view.began = self.stats.rays;
        let leaves = self.view.visible_leaves(&self.cache);
        self.look_for_highlights(&leaves);
        self.account(&leaves);
        self.waiting.add(self.view.faces.roots());
        self.queue_waiting();
    }

    /// Square errors of interpolating indirect light grow with the square of the light, until they are measured again.
    fn scale_surpluses(&mut self, factor: f32) {
        for id in self.cache.topology.nodes.ids() {
            let node = &mut self.cache.topology.nodes[id].indirect;
            node.surplus *= factor;
            node.doubt *= factor;
        }
    }

    /// Measures the surpluses of direct light of all split nodes again.
    fn measure_surpluses(&mut self) {
        let all: Vec<NodeId> = self.cache.topology.nodes.ids().collect();
        self.measure_direct(&all);
    }
}
