//! Changes of the lights: direct light is shaded anew from the visibility that is kept, indirect light is scaled,
//! brought back or solved again (docs/method/updates.md). No ray is traced here.

use super::engine::{Engine, Visible};
use super::update::Update;

use crate::cache::ids::{NodeId, SlotId};
use crate::cache::reweight::reweight;
use crate::light::context::SceneContext;
use crate::trace;
use glam::Vec3;
use std::sync::Arc;

impl Engine {
    /// Changes what the lights emit to `factors` times what the scene says, in the order of its lights, and takes a
    /// view, of a new generation: the returned update shows everything visible in the new light.
    ///
    /// Direct light is exact at once as far as it was known, but for lights that share a group and change against
    /// each other: where much has been traced in their penumbra, the fraction that was visible stands in until it is
    /// traced again. Indirect light is, too, if all lights change by the same factor or go back to what they were
    /// before the last change; otherwise it is a guess until it is gathered again, which vertices do in order of what
    /// that is worth to the image.
    pub fn relight(&mut self, factors: &[Vec3], visible: &Visible) -> Update {
        let _view = trace::span("take view");
        let spent = self.current_stats().cpu_seconds;
        let before = self.lights.lighting();
        let mixed = self.set_factors(factors);
        let now = self.lights.lighting();
        if before != now {
            self.reveal_all();
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
            self.start_over();
        }
        let mut update = self.set_visible(visible);
        self.stats.view_cpu_seconds = update.stats.cpu_seconds - spent;
        update.stats = self.stats;
        update
    }

    /// Sets what sources count times, if that changes; returns the light groups whose sources changed against each other.
    fn set_factors(&mut self, factors: &[Vec3]) -> Vec<usize> {
        if self.lights.have_factors(factors) {
            return Vec::new();
        }
        // What is on its way was gathered in the light before.
        self.finish_gathering();
        Arc::make_mut(&mut self.lights).set_factors(factors)
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
