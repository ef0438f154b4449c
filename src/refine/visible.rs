//! A new view. What was never in view before is created, drawn, and queued to be visited; S is evaluated for the eye. All else
//! is brought up to date a little at a time ([`super::bring_up_to_date`]).

use super::engine::{Engine, Visible};
use super::update::Update;
use super::view::{LeafView, VertexView};
use super::visible_faces::FaceChanges;
use crate::cache::ids::{NodeId, SlotId, VertexId};

/// Share of the pixels whose faces came into view from which a view counts as another place: what was learnt of how
/// far to go belongs to the one before.
const ELSEWHERE: f64 = 0.5;

impl Engine {
    /// Takes a new view; the returned update shows what came into it, and the specular luminance for its eye. What was
    /// drawn before stays drawn, in view or not.
    pub fn set_visible(&mut self, visible: &Visible) -> Update {
        self.view.generation = visible.generation;
        let image = visible.image.as_ref().map(|image| image.view);
        let stays = self.view.eye == visible.eye && self.view.image == image && self.view.faces.are(&visible.faces);
        if !stays {
            self.move_to(visible);
        }
        self.publish()
    }

    /// Creates the faces of a view that is to come: what of it needs no ray, and no other face.
    pub fn create_faces(&mut self, visible: &Visible) {
        self.memory.see(visible.faces.iter().map(|(face, _)| *face));
        self.page_in(&visible.faces);
        self.take_kept(&visible.faces);
        let (cache, scene, weld) = (&mut self.cache, &self.scene, &mut self.weld);
        for &(face, _) in &visible.faces {
            cache.root(scene, weld, face);
        }
    }

    fn move_to(&mut self, visible: &Visible) {
        self.checks.forget();
        self.smoothing.start_anew(self.stats.rays);
        let turns = self.view.eye == visible.eye;
        (self.view.eye, self.view.image) = (visible.eye, visible.image.as_ref().map(|image| image.view));
        self.memory.see(visible.faces.iter().map(|(face, _)| *face));
        self.make_room_for_faces(visible);
        self.page_in(&visible.faces);
        self.take_kept(&visible.faces);
        let (cache, scene, weld) = (&mut self.cache, &self.scene, &mut self.weld);
        let FaceChanges { hidden, mut revealed } =
            self.view.faces.replace(&visible.faces, |face| cache.root(scene, weld, face));
        self.list_pixels(visible);
        self.leaving.add(hidden);
        self.list_glossy();
        // S of what stays in view is right as long as the eye only turns; of what comes into view it is for another eye.
        let mut glossy = if turns { revealed.clone() } else { (0..self.view.faces.all().len()).collect() };
        if self.view.faces.share_of(&revealed) > ELSEWHERE {
            self.view.began = self.stats.rays;
            self.reset_tolerance();
            self.hide_leaving(usize::MAX);
        } else {
            revealed.retain(|&index| self.is_new(self.view.faces.all()[index].root));
        }
        match self.view_time {
            Some(time) => {
                self.reveal_in_turn(revealed, time);
                self.outdate_specular(time);
            }
            None => {
                glossy.retain(|index| revealed.binary_search(index).is_err());
                self.evaluate_glossy(&glossy);
                let slots = self.reveal(&revealed);
                self.queue_first_visits(&slots);
            }
        }
        self.queue_waiting();
    }

    /// Takes faces that left the view out of it: a number of them, those that left first.
    pub(super) fn hide_leaving(&mut self, most: usize) {
        let roots = self.leaving.take(most);
        self.hide(&roots);
    }

    /// Takes the leaves of faces out of the view, with what they add to the image's error, but for those that have come back.
    pub(super) fn hide(&mut self, roots: &[NodeId]) {
        let (mut leaves, mut indirect) = (Vec::new(), Vec::new());
        for &root in roots.iter().filter(|&&root| !self.is_face_in_view(root)) {
            self.cache.topology.leaves(root, &mut leaves);
            self.cache.topology.indirect_leaves(root, &mut indirect);
        }
        for leaf in leaves {
            self.image.replace(&mut self.view.leaves[leaf].accounted, None);
            self.view.leaves[leaf] = LeafView::default();
            self.view.hidden.reset(leaf);
            self.forget_inside(leaf);
        }
        indirect.into_iter().for_each(|leaf| self.hide_indirect(leaf));
    }

    /// Whether the face of a node is in view.
    pub(super) fn is_face_in_view(&self, node: NodeId) -> bool {
        self.view.faces.index_of(self.cache.topology.nodes[node].face).is_some()
    }

    /// Makes the vertex inside a leaf worth nothing: it lies where another view saw it.
    pub(super) fn forget_inside(&mut self, leaf: NodeId) {
        if let Some(slot) = self.cache.topology.nodes[leaf].pixel_vertex.get() {
            self.view.vertices[self.cache.slots[slot].vertex] = VertexView::default();
        }
    }

    /// Lists the pixels of the image by face.
    fn list_pixels(&mut self, visible: &Visible) {
        let view = &mut self.view;
        match &visible.image {
            // Empty for faces that only redraws with sub-pixel offsets see: their vertices are visited, not refined.
            Some(image) => {
                let spans = view.lists.list(image, visible.faces.len(), |face| view.faces.index_of(face));
                view.faces.set_spans(spans);
            }
            None => view.lists.clear(),
        }
    }

    /// Queues the vertices of slots that were never visited, or not since a light moved, largest on screen first, with those
    /// in view that waited for that before.
    pub(super) fn queue_first_visits(&mut self, slots: &[SlotId]) {
        let waiting =
            self.scheduler.take_first_visits(usize::MAX).into_iter().filter(|&vertex| self.is_in_view(vertex));
        let mut vertices: Vec<VertexId> = slots.iter().map(|&slot| self.cache.slots[slot].vertex).collect();
        vertices.extend(waiting);
        vertices.sort_unstable();
        vertices.dedup();
        vertices.retain(|&vertex| self.cache.vertices[vertex].is_due());
        let pixels = self.workers.map(&vertices, |vertex| self.pixels_around(vertex));
        // Among equals in no order of place: what the first find of the lights is to speak for the rest.
        let key = |vertex: VertexId| self.cache.vertices[vertex].key;
        let mut order: Vec<(f32, u64, VertexId)> =
            vertices.into_iter().zip(pixels).map(|(vertex, pixels)| (pixels, key(vertex), vertex)).collect();
        order.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        self.stats.visible = order.len() as u64;
        self.scheduler.push_first_visits(order.into_iter().map(|(.., vertex)| vertex));
    }

    /// Leaves of faces in view that are drawn with a vertex.
    fn leaves_of(&self, vertex: VertexId) -> impl Iterator<Item = NodeId> + '_ {
        let drawn = self.cache.slots_of(vertex).flat_map(|slot| self.cache.drawn.with_slot(slot));
        let leaves = drawn.map(|drawn| self.cache.drawn.triangles[drawn].node);
        leaves.filter(|&leaf| self.is_face_in_view(leaf))
    }

    fn is_in_view(&self, vertex: VertexId) -> bool {
        self.leaves_of(vertex).next().is_some()
    }

    /// Pixels of the leaves that are drawn with a vertex.
    fn pixels_around(&self, vertex: VertexId) -> f32 {
        self.leaves_of(vertex).map(|leaf| self.view.leaves[leaf].pixels).sum()
    }
}
