//! Faces that stay in view when the camera moves: their leaves keep the pixels of the view before until they come up in
//! the queue, or it is their turn; a few come up to date in each batch, those first whose pixels have changed most.

use super::choose::leaf_of;
use super::engine::Engine;
use super::scheduler::Task;
use super::visible_faces::VisibleFace;
use crate::cache::ids::NodeId;

/// Pixels of the faces that are brought up to date in a batch, about, and faces that are taken out of the view: some milliseconds.
const PIXELS_A_BATCH: u32 = 2048;
const LEAVING_A_BATCH: usize = 4096;

impl Engine {
    /// Gives the leaves of faces their pixels; returns the leaves.
    pub(super) fn give_pixels(&mut self, indices: &[usize]) -> Vec<NodeId> {
        let mut leaves = Vec::new();
        for &index in indices {
            let VisibleFace { root, pixels, span, .. } = self.view.faces.all()[index];
            if let Some((span, image)) = span.zip(self.view.image) {
                self.view.lists.weigh(span, &image, self.cache.corner_positions(root));
            }
            self.view.show_below(&self.cache, root, (span, pixels as f32), &mut leaves);
            self.view.faces.note_given(index);
        }
        for &leaf in &leaves {
            self.forget_inside(leaf);
            self.publisher.note_outdated(&self.cache, leaf);
        }
        leaves
    }

    /// Brings faces up to date, after all first visits.
    pub(super) fn bring_up_to_date(&mut self, indices: &[usize]) {
        if indices.is_empty() {
            return;
        }
        let leaves = self.give_pixels(indices);
        self.look_for_highlights(&leaves);
        let roots: Vec<NodeId> = indices.iter().map(|&index| self.view.faces.all()[index].root).collect();
        self.queue(&roots, &leaves);
    }

    /// Brings a few faces up to date, and takes a few that left the view out of it.
    pub(super) fn bring_some_up_to_date(&mut self) {
        self.hide_leaving(LEAVING_A_BATCH);
        let (mut indices, mut pixels) = (Vec::new(), 0);
        while pixels < PIXELS_A_BATCH
            && let Some(index) = self.view.faces.next_outdated()
        {
            pixels += 1 + self.view.faces.all()[index].pixels;
            indices.push(index);
        }
        self.bring_up_to_date(&indices);
    }

    /// Brings all faces up to date; whether any was not.
    pub(super) fn bring_all_up_to_date(&mut self) -> bool {
        self.hide_leaving(usize::MAX);
        let indices: Vec<usize> = std::iter::from_fn(|| self.view.faces.next_outdated()).collect();
        self.bring_up_to_date(&indices);
        !indices.is_empty()
    }

    /// Whether every leaf in view has its pixels, and none other has any.
    pub(super) fn is_up_to_date(&self) -> bool {
        self.leaving.is_empty() && self.view.faces.all_are_current()
    }

    /// Brings the face of a task up to date; whether it was not, so that the task is queued anew if it is worth it.
    pub(super) fn catch_up(&mut self, task: Task) -> bool {
        let Some(leaf) = leaf_of(task) else { return false };
        let face = self.cache.topology.nodes[leaf].face;
        let outdated = self.view.faces.outdated_index(face);
        outdated.into_iter().for_each(|index| self.bring_up_to_date(&[index]));
        let gone = self.cache.root_of(face).filter(|&root| !self.is_face_in_view(root));
        if outdated.is_some() || gone.is_some() {
            self.scheduler.stop_judging();
        }
        let is_shown = self.view.sees(leaf) || self.view.indirect[leaf].pixels > 0.0;
        gone.into_iter().filter(|_| is_shown).for_each(|root| self.hide(&[root]));
        outdated.is_some() || gone.is_some()
    }

    /// Queues what faces that came into view leave to do, once every vertex in view has been visited.
    pub(super) fn queue_waiting(&mut self) {
        if !self.is_complete() {
            return;
        }
        let mut roots = self.waiting.take(usize::MAX);
        roots.retain(|&root| self.is_face_in_view(root));
        roots.sort_unstable();
        roots.dedup();
        let mut leaves = Vec::new();
        roots.iter().for_each(|&root| self.cache.topology.leaves(root, &mut leaves));
        self.queue(&roots, &leaves);
    }

    /// Queues what faces leave to do, direct and indirect.
    fn queue(&mut self, roots: &[NodeId], leaves: &[NodeId]) {
        self.look_inside(leaves);
        self.enqueue_leaves(leaves);
        if roots.len() == self.view.faces.all().len() {
            self.survey_indirect();
        } else {
            self.survey(roots, leaves);
        }
    }
}
