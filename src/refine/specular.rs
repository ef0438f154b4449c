//! S of faces that stay in view while the eye moves: it is for one eye, and evaluating it for another costs no ray, but time where lights and glossy
//! surfaces are many. Where somebody looks on, a new view waits for the faces only whose highlights have changed most; the rest
//! follow a few at a time.

use super::engine::Engine;
use crate::bsdf::Microfacets;
use crate::cache::ids::SlotId;
use crate::math::triangle::nearest_to_origin;
use crate::scene::material::{Material, Model};
use crate::scene::{FaceId, Scene};
use glam::Vec3;
use std::time::{Duration, Instant};

/// What is spent in each batch on faces that a view did not wait for.
const A_BATCH: Duration = Duration::from_millis(4);
/// Glossy slots that are evaluated at a time, about: enough for all threads.
const SLOTS: usize = 256;

/// What a highlight of the metallic-roughness model counts about.
const F0: f32 = 0.1;

/// How far highlights on a face have gone from one eye to another, in widths of its lobe, times what S counts there.
fn turn(scene: &Scene, face: FaceId, of: Option<Vec3>, eye: Vec3) -> f32 {
    let Some(of) = of else { return f32::INFINITY };
    let [exponent, reflectance] = match &scene.material(face.triangle()).model {
        Model::Phong(phong) => [phong.shininess, phong.ks.max_element()],
        Model::MetallicRoughness(model) => [Microfacets::dielectric(model.roughness).exponent(), F0],
    };
    let corners @ [a, b, c] = scene.corners(face.triangle()).map(|p| p - eye);
    let [u, v, w] = nearest_to_origin(corners);
    let distance = (a * u + b * v + c * w).length().max(f32::MIN_POSITIVE);
    // cosⁿ falls by a half at some 1/√n.
    of.distance(eye) / distance * (exponent + 2.0).sqrt() * reflectance
}

impl Engine {
    /// Takes in which glossy faces a new view shows, where it does not wait for all of S.
    pub(super) fn list_glossy(&mut self) {
        let Self { scene, view, outdated_specular, .. } = self;
        if self.view_time.is_some() && scene.materials.iter().any(Material::is_glossy) {
            let is_glossy = |face: &FaceId| scene.material(face.triangle()).is_glossy();
            outdated_specular.replace(view.faces.all().iter().map(|seen| seen.face).filter(is_glossy));
        }
    }

    /// Evaluates S for the eye, at the glossy slots of faces by their places in the list of visible ones.
    pub(super) fn evaluate_glossy(&mut self, indices: &[usize]) {
        if !self.scene.materials.iter().any(Material::is_glossy) {
            return;
        }
        let faces: Vec<FaceId> = indices.iter().map(|&index| self.view.faces.all()[index].face).collect();
        let slots = self.glossy_slots(&faces);
        self.evaluate(&slots);
        self.refresh_unseen(&slots);
    }

    /// Orders faces in view whose S is for another eye, and brings as many up to date as a view waits for.
    pub(super) fn outdate_specular(&mut self, time: Duration) {
        let (scene, eye, specular) = (&self.scene, self.view.eye, &mut self.outdated_specular);
        let outdated = specular.known.iter().filter(|(_, of)| *of != Some(eye));
        let mut order: Vec<(f32, FaceId)> = outdated.map(|&(face, of)| (turn(scene, face, of, eye), face)).collect();
        order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)));
        specular.faces = order.into_iter().map(|(_, face)| face).collect();
        self.evaluate_specular_for(time);
    }

    /// Brings a part of S up to date.
    pub(super) fn evaluate_some_specular(&mut self) {
        self.evaluate_specular_for(A_BATCH);
    }

    /// Brings all S up to date; whether any was not.
    pub(super) fn evaluate_all_specular(&mut self) -> bool {
        let any = !self.outdated_specular.is_empty();
        self.evaluate_specular_for(Duration::MAX);
        any
    }

    fn evaluate_specular_for(&mut self, time: Duration) {
        let start = Instant::now();
        while !self.outdated_specular.is_empty() && start.elapsed() < time {
            let (mut slots, mut faces) = (Vec::new(), Vec::new());
            while slots.len() < SLOTS
                && let Some(face) = self.outdated_specular.faces.pop()
            {
                slots.extend(self.glossy_slots(&[face]));
                faces.push(face);
            }
            self.note_specular(&faces);
            slots.sort_unstable();
            slots.dedup();
            self.evaluate(&slots);
            self.show_indirect(&slots);
            self.outdated_specular.slots.append(&mut slots);
            if self.outdated_specular.is_empty() {
                self.agree();
            }
        }
    }

    /// Brings indirect S up to date again where it was evaluated before what predicts it.
    fn agree(&mut self) {
        let mut slots = std::mem::take(&mut self.outdated_specular.slots);
        slots.sort_unstable();
        slots.dedup();
        if slots.len() > SLOTS {
            self.show_indirect(&slots);
        }
    }

    fn show_indirect(&mut self, slots: &[SlotId]) {
        let written = self.refresh_unseen(slots);
        self.publisher.note_changed(&written);
    }

    /// Slots of faces that show S.
    fn glossy_slots(&self, faces: &[FaceId]) -> Vec<SlotId> {
        let is_glossy = |face: &&FaceId| self.scene.material(face.triangle()).is_glossy();
        let mut leaves = Vec::new();
        let roots = faces.iter().filter(is_glossy).filter_map(|&face| self.cache.root_of(face));
        roots.for_each(|root| self.cache.topology.leaves(root, &mut leaves));
        let mut slots = self.drawn_slots(&leaves);
        slots.retain(|&slot| self.cache.slots[slot].gloss().is_some());
        slots
    }

    /// Notes that S of faces is for the present eye.
    pub(super) fn note_specular(&mut self, faces: &[FaceId]) {
        faces.iter().for_each(|&face| self.outdated_specular.note(face, self.view.eye));
    }

    /// Notes that S of all visible faces is for the present eye.
    pub(super) fn note_all_specular(&mut self) {
        let eye = self.view.eye;
        self.outdated_specular.known.iter_mut().for_each(|(_, of)| *of = Some(eye));
        self.outdated_specular.faces.clear();
    }
}
