//! A new view: what became visible is created, the specular luminance is evaluated anew without a ray, and everything
//! visible is published with the values known so far.

use super::engine::{Engine, Visible};
use super::image_error::ImageError;
use super::pixel_lists::PixelLists;
use super::update::Update;
use crate::cache::ids::{DrawnId, NodeId, SlotId, VertexId};
use crate::scene::FaceId;
use rustc_hash::FxHashSet;

impl Engine {
    /// Takes a new view; the returned update shows all of it.
    pub fn set_visible(&mut self, visible: &Visible) -> Update {
        let view = &self.view;
        let image = visible.image.as_ref().map(|image| image.view);
        let stays = view.eye == visible.eye && view.image == image && view.faces == visible.faces;
        if !stays {
            self.checks.forget();
        }
        self.view.forget(stays);
        (self.view.generation, self.view.eye, self.view.image) = (visible.generation, visible.eye, image);
        self.view.began = self.stats.rays;
        self.view.faces.clone_from(&visible.faces);
        self.view.roots =
            visible.faces.iter().map(|&(face, _)| self.cache.root(&self.scene, &self.weld, face)).collect();
        if !stays {
            self.list_pixels(visible);
        }
        let leaves = self.draw_visible_leaves(&visible.faces, stays);
        self.scheduler.clear();
        self.reset_tolerance();
        self.image = ImageError::default();
        let slots = self.drawn_slots(&leaves);
        self.enqueue_first_visits(&leaves, &slots);
        // D stays where the eye moves.
        let is_due = |&slot: &SlotId| {
            let record = &self.cache.slots[slot];
            !record.direct.known || record.shininess().is_some()
        };
        let due: Vec<SlotId> = slots.iter().copied().filter(is_due).collect();
        self.evaluate(&due);
        self.refresh_unseen(&slots);
        self.look_for_highlights(&leaves);
        self.account(&leaves);
        if self.is_complete() {
            self.enqueue_leaves(&leaves);
            self.survey_indirect();
        }
        let mut update = self.publisher.full_update(&self.cache, &self.view, &leaves, &slots);
        update.stats = self.current_stats();
        update
    }

    /// Sorts the pixels of the image by face, for the roots of the visible faces.
    fn list_pixels(&mut self, visible: &Visible) {
        let Some(image) = &visible.image else { return self.view.lists = PixelLists::default() };
        let faces: Vec<FaceId> = visible.faces.iter().map(|(face, _)| *face).collect();
        let corners = |index: usize| self.cache.corner_positions(self.view.roots[index]);
        let (lists, spans) = PixelLists::new(image, &faces, corners);
        self.view.lists = lists;
        for (&root, span) in self.view.roots.iter().zip(spans) {
            // Empty for faces that only redraws with sub-pixel offsets see: their vertices are visited, not refined.
            self.view.leaves[root].span = Some(span);
        }
    }

    /// The leaves of the visible faces, drawn and with their pixels, which they have already if the camera `stays`.
    fn draw_visible_leaves(&mut self, faces: &[(FaceId, u32)], stays: bool) -> Vec<NodeId> {
        let mut all = Vec::new();
        if stays {
            all = self.view.visible_leaves(&self.cache);
            all.iter().for_each(|&leaf| self.view.show(leaf, 0.0, true));
        } else {
            for (i, &(_, pixels)) in faces.iter().enumerate() {
                self.view.show_below(&self.cache, self.view.roots[i], pixels as f32, &mut all);
            }
        }
        for &leaf in &all {
            let is_flat = |&drawn: &DrawnId| self.cache.drawn.triangles[drawn].flat.get().is_some();
            let is_stale = !stays && self.cache.drawn.of_node(leaf).iter().any(is_flat);
            self.publisher.draw_visible(&mut self.cache, &self.view, leaf, is_stale);
        }
        all
    }

    /// Slots that the visible leaves are drawn with.
    fn drawn_slots(&self, leaves: &[NodeId]) -> Vec<SlotId> {
        let drawn = leaves.iter().flat_map(|&leaf| self.cache.drawn.of_node(leaf));
        let slots = drawn.flat_map(|drawn| self.cache.drawn.triangles[drawn].all_slots());
        let mut slots: Vec<SlotId> = slots.collect();
        slots.sort_unstable();
        slots.dedup();
        slots
    }

    /// Queues the visible vertices that were never visited, largest on screen first.
    fn enqueue_first_visits(&mut self, leaves: &[NodeId], slots: &[SlotId]) {
        let vertices: FxHashSet<VertexId> = slots.iter().map(|&slot| self.cache.slots[slot].vertex).collect();
        self.stats.visible = vertices.len() as u64;
        vertices.iter().for_each(|&vertex| self.view.vertices[vertex].pixels = 0.0);
        for &leaf in leaves {
            let share = self.view.leaves[leaf].pixels / 3.0;
            let corners = self.cache.corner_vertices(leaf);
            corners.into_iter().for_each(|vertex| self.view.vertices[vertex].pixels += share);
        }
        let is_new = |&vertex: &VertexId| !self.cache.vertices[vertex].progress.visited;
        let mut order: Vec<VertexId> = vertices.into_iter().filter(is_new).collect();
        let pixels = |&vertex: &VertexId| self.view.vertices[vertex].pixels;
        // Among equals in no order of place: what the first find of the lights is to speak for the rest.
        let key = |&vertex: &VertexId| self.cache.vertices[vertex].key;
        order.sort_by(|a, b| pixels(b).total_cmp(&pixels(a)).then(key(a).cmp(&key(b))));
        self.scheduler.push_first_visits(order.into_iter());
    }
}
