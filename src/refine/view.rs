//! What belongs to one view: the pixels of its leaves, what they add to the image's error, and S for its eye. Tables
//! by id beside the cache, which holds what is true in any view.

use super::pixel_lists::{PixelLists, Span};
use super::visible_faces::VisibleFaces;
use crate::cache::bytes::Places;
use crate::cache::ids::{NodeId, SlotId, VertexId};
use crate::cache::indirect::SpecularTable;
use crate::cache::pool::Table;
use crate::cache::slot::Specular;
use crate::cache::sparse::Sparse;
use crate::cache::store::Cache;
use crate::cache::topology::Children;
use crate::scene::camera::View;
use glam::{Vec3, Vec4};

/// Pixels of leaves at most that are sampled where a pixel sees them.
const FEW_PIXELS: u32 = 3;

/// What a view makes of a leaf.
#[derive(Clone, Copy, Debug, Default)]
pub struct LeafView {
    /// Whether the view shows it.
    pub visible: bool,
    /// Pixels it covers on screen: those of its span, or a share of its parent's until the GPU has counted them.
    pub pixels: f32,
    /// Its pixels; see [`ViewState::span`].
    span: Span,
    /// Its share of the pixels of its face, by area.
    pub share: f32,
    /// Whether its pixel vertex lies under one of the view's pixels.
    pub sampled: bool,
    /// Whether each of its pixels was checked for mismatches.
    pub checked: bool,
    /// What the sums over the image hold of it.
    pub accounted: Accounted,
}

/// What a leaf hides between its corners: of most, nothing is known.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Hidden {
    /// How much brighter than it is drawn a highlight between its corners is: specular luminance S, W·sr⁻¹·m⁻².
    pub highlight: f32,
    /// The share of it that the highlight covers.
    pub highlight_share: f32,
    /// Luminance of D in one of its pixels, W·sr⁻¹·m⁻², that a check found other than its corners say; the greatest.
    pub mismatch: f32,
    /// Share of its pixels for which that stands.
    pub mismatch_share: f32,
    /// How often its pixels were checked; 0 if there is no point in checking again.
    pub checks: u32,
    /// Lights of which its corners did not know the same when its pixels were checked, if that is worth checking
    /// again once they do: until then its children cannot rest on it.
    pub check_open: u32,
}

impl Hidden {
    /// Forgets what checks have found.
    pub fn forget_checks(&mut self) {
        let Self { highlight, highlight_share, .. } = *self;
        *self = Self { highlight, highlight_share, ..Self::default() };
    }
}

/// A leaf's part of the sums over the image.
#[derive(Clone, Copy, Debug, Default)]
pub struct Accounted {
    /// Pixels.
    pub pixels: f32,
    /// Pixels × luminance, W·sr⁻¹·m⁻².
    pub light: f32,
    /// Pixels × square error, (W·sr⁻¹·m⁻²)².
    pub error: f32,
    /// Pixels × square of the reference luminance, (W·sr⁻¹·m⁻²)², while what it hides is unknown.
    pub unseen: f32,
}

/// What a view makes of a leaf of the indirect layer.
#[derive(Clone, Copy, Debug, Default)]
pub struct IndirectLeafView {
    /// Pixels that it covers.
    pub pixels: f32,
    /// What it adds to the importance of each of its corners.
    pub importance: f32,
    /// Pixels × square error that the sum over the image holds of it.
    pub accounted: f32,
}

/// What a view makes of a vertex.
#[derive(Clone, Copy, Debug, Default)]
pub struct VertexView {
    /// Σ pixels × gain / 6 over the leaves of the indirect layer around it: what a unit of variance there costs the
    /// image.
    pub importance: f32,
    /// The same over the leaves around vertices that take its prediction for want of their own samples, by their
    /// weights.
    pub importance_below: f32,
}

/// A view and what it makes of the cache.
#[derive(Default)]
pub struct ViewState {
    /// Camera generation, rising.
    pub generation: u32,
    /// Rays that were traced before the camera came to this place.
    pub began: u64,
    /// Position of the eye, scene units.
    pub eye: Vec3,
    /// The image, if it is known.
    pub image: Option<View>,
    /// The pixels of its leaves.
    pub lists: PixelLists,
    /// The faces that it shows.
    pub faces: VisibleFaces,
    /// Whether leaves cover the pixels that their spans hold.
    pub listed: bool,
    /// By leaf of the hierarchy; those of faces in view may have the pixels of an earlier view
    /// ([`VisibleFaces::outdated_index`]), those of others have none.
    pub leaves: Table<NodeId, LeafView>,
    /// What leaves hide.
    pub hidden: Sparse<NodeId, Hidden>,
    /// By leaf of the indirect layer, likewise.
    pub indirect: Table<NodeId, IndirectLeafView>,
    /// By vertex.
    pub vertices: Table<VertexId, VertexView>,
    /// S for the eye. That of slots out of view is for the last eye that saw them.
    pub specular: SpecularTable,
    /// Light vectors of direct light over π by slot, and fluence, by luminance, W·sr⁻¹·m⁻², where normal maps turn light.
    pub light_vectors: Sparse<SlotId, Vec4>,
}

// There are 4/3 of each a leaf.
const _: () = assert!(size_of::<LeafView>() <= 40);
const _: () = assert!(size_of::<IndirectLeafView>() <= 12);

impl ViewState {
    /// Bytes held.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let Self { lists, faces, leaves, hidden, indirect, vertices, specular, light_vectors, .. } = self;
        let tables = leaves.bytes()
            + hidden.bytes()
            + indirect.bytes()
            + vertices.bytes()
            + specular.bytes()
            + light_vectors.bytes();
        tables + lists.bytes() + faces.bytes()
    }

    /// Bytes that so many more places take in its tables.
    #[must_use]
    pub const fn bytes_of(added: &Places) -> usize {
        added.nodes * (size_of::<LeafView>() + size_of::<IndirectLeafView>())
            + added.vertices * size_of::<VertexView>()
            + added.slots * size_of::<Specular>()
    }

    /// Whether the view shows a leaf.
    #[must_use]
    pub fn sees(&self, leaf: NodeId) -> bool {
        self.leaves[leaf].visible
    }

    /// Whether each pixel of a leaf was checked for mismatches in this view.
    #[must_use]
    pub fn is_checked(&self, leaf: NodeId) -> bool {
        self.leaves[leaf].checked
    }

    /// Forgets what checks have found, in another light.
    pub fn forget_checks(&mut self) {
        self.leaves.iter_mut().for_each(|leaf| leaf.checked = false);
        self.hidden.for_each_mut(|_, hidden| hidden.forget_checks());
    }

    /// The pixels of a leaf; `None` if they are not known of this view.
    #[must_use]
    pub fn span(&self, leaf: NodeId) -> Option<Span> {
        Some(self.leaves[leaf].span).filter(|span| self.lists.holds(*span))
    }

    /// Direction from the eye through the centre of one of a leaf's pixels, any length, if it has few.
    #[must_use]
    pub fn ray(&self, leaf: NodeId) -> Option<Vec3> {
        let span = self.span(leaf).filter(|span| (1..=FEW_PIXELS).contains(&span.len()))?;
        let (view, pixel) = (self.image?, self.lists.of(span).first()?.pixel);
        Some(view.direction(view.size.centre_of(pixel as usize)))
    }

    /// Whether a leaf is known to show in exactly one pixel, and in which.
    #[must_use]
    pub fn is_one_pixel(&self, leaf: NodeId) -> bool {
        self.leaves[leaf].pixels == 1.0 && self.span(leaf).is_some_and(|span| span.len() == 1)
    }

    /// The slot of the pixel vertex of a leaf, if that is what the leaf's one pixel shows.
    #[must_use]
    pub fn pixel_slot(&self, cache: &Cache, leaf: NodeId) -> Option<SlotId> {
        let is_there = self.leaves[leaf].sampled && self.is_one_pixel(leaf);
        cache.topology.nodes[leaf].pixel_vertex.get().filter(|_| is_there)
    }

    /// The leaves of the faces in view.
    #[must_use]
    pub fn visible_leaves(&self, cache: &Cache) -> Vec<NodeId> {
        let mut leaves = Vec::new();
        self.faces.roots().for_each(|root| cache.topology.leaves(root, &mut leaves));
        leaves
    }

    /// Pixels of the leaves of a node.
    #[must_use]
    pub fn pixels_below(&self, cache: &Cache, id: NodeId) -> f32 {
        match cache.topology.nodes[id].children() {
            None => self.leaves[id].pixels,
            Some(children) => children.all().into_iter().map(|child| self.pixels_below(cache, child)).sum(),
        }
    }

    /// Takes a leaf into the view, with its share of the face's pixels, or with those that it is known to have. What was
    /// found in its pixels of an earlier view is forgotten.
    pub fn show(&mut self, id: NodeId, span: Option<Span>, share: f32) {
        let accounted = self.leaves[id].accounted;
        self.leaves[id] = LeafView { visible: true, accounted, ..LeafView::default() };
        self.hidden.reset(id);
        self.set_pixels(id, span, share, share);
    }

    /// Takes the leaves of a root into the view, which has so many pixels, and those of its span if that is known.
    pub fn show_below(
        &mut self,
        cache: &Cache,
        id: NodeId,
        (span, share): (Option<Span>, f32),
        leaves: &mut Vec<NodeId>,
    ) {
        let Some(children) = cache.topology.nodes[id].children() else {
            self.show(id, span, share);
            return leaves.push(id);
        };
        let spans = span.map_or([None; 4], |span| self.lists.divide(span).map(Some));
        for (child, span) in children.all().into_iter().zip(spans) {
            self.show_below(cache, child, (span, share * 0.25), leaves);
        }
    }

    /// Hands the pixels of a leaf that was split over to its children.
    pub fn hand_pixels_down(&mut self, parent: NodeId, children: Children) {
        let spans = self.span(parent).map_or([None; 4], |span| self.lists.divide(span).map(Some));
        let LeafView { pixels, share, visible, .. } = self.leaves[parent];
        for (child, span) in children.all().into_iter().zip(spans) {
            self.set_pixels(child, span, pixels * 0.25, share * 0.25);
            self.leaves[child].visible = visible;
        }
    }

    /// Gives a leaf its pixels: those of its span, or so many if that does not tell.
    fn set_pixels(&mut self, id: NodeId, span: Option<Span>, pixels: f32, share: f32) {
        let listed = span.filter(|_| self.listed).map(|span| span.len() as f32);
        let leaf = &mut self.leaves[id];
        (leaf.span, leaf.pixels, leaf.share) = (span.unwrap_or_default(), listed.unwrap_or(pixels), share);
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::judged;
    use super::*;

    #[test]
    fn a_leaf_that_is_shown_anew_forgets_what_its_pixels_showed() {
        let mut square = judged(100.0);
        let root = square.roots[0];
        let leaf = &mut square.view.leaves[root];
        (leaf.checked, leaf.sampled, leaf.accounted.error) = (true, true, 3.0);
        square.view.hidden.entry(root).mismatch = 0.5;
        square.view.show(root, None, 50.0);
        let leaf = square.view.leaves[root];
        assert_eq!((leaf.pixels, leaf.visible, leaf.checked, leaf.sampled), (50.0, true, false, false));
        assert_eq!(square.view.hidden.get(root), Hidden::default());
        assert_eq!(leaf.accounted.error, 3.0, "what the sums over the image hold is replaced, not lost");
    }

    #[test]
    fn pixels_of_a_node_are_those_of_its_leaves() {
        let mut square = judged(100.0);
        let root = square.roots[0];
        square.split(root);
        let children: Vec<NodeId> = square.cache.topology.children(root).collect();
        children.iter().zip([1.0, 2.0, 4.0, 8.0]).for_each(|(&child, pixels)| square.see(child, pixels));
        assert_eq!(square.view.pixels_below(&square.rooted.cache, root), 15.0);
        assert_eq!(square.view.visible_leaves(&square.rooted.cache).len(), 5);
    }
}
