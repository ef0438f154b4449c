//! What a task is worth: expected drop of the image's square error a ray (docs/method/what-to-trace-next.md).

use super::image_error::LeafError;
use super::memory::Room;
use super::options::{Options, Piece, Priority};
use super::reflectances::Reflectances;
use super::view::ViewState;
use crate::cache::ids::{NodeId, SlotId, VertexId};
use crate::cache::store::Cache;
use crate::cache::topology::{Node, SAFE_LEVEL};
use crate::math::{combine, luminance};
use crate::scene::{FaceId, Scene};

/// Everything that keys are computed from.
#[derive(Clone, Copy)]
pub struct ErrorModel<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// The cache.
    pub cache: &'a Cache,
    /// The view.
    pub view: &'a ViewState,
    /// Reflectances.
    pub reflectances: &'a Reflectances,
    /// Options of the run.
    pub options: &'a Options,
    /// Error of a pixel, relative to the image's mean, that is left for later.
    pub tolerance: f32,
    /// Mean luminance of the image, W·sr⁻¹·m⁻², below a share of which nothing shows.
    pub mean: f32,
    /// Square error expected where nothing has been seen, relative to what a leaf shows.
    pub miss_rate: f32,
    /// What there is memory for.
    pub room: Room,
}

/// Weight of an edge's contrast against measured surplus: discontinuities not seen yet.
pub(super) const CONTRAST_WEIGHT: f32 = 0.02;
/// Mean square error of linear interpolation for a unit sum of squared surpluses and their products
/// (docs/method/derivations.md).
pub(super) const SURPLUS_TO_MSE: f32 = 8.0 / 45.0;
/// The same of a hard edge across a face that was never split, against the square of contrast times mean, and pixels
/// of a face up to which that is assumed.
const UNMEASURED_EDGE: f32 = 0.05;
const SMALL_FACE: f32 = 16.0;
/// A child's square error against its parent's, where light is smooth.
pub(super) const CHILD: f32 = 1.0 / 16.0;
/// Contrast, of indirect light or with what lies between corners, that takes a leaf for one across a hard shadow's.
pub(super) const HARD_CONTRAST: f32 = 0.4;
/// The same for direct light: an edge where a quarter of it is missing looks sharp.
const SHADOW_CONTRAST: f32 = 0.15;
/// Pixels of the smallest leaf across a hard edge, against other leaves.
pub(super) const HARD_PIXELS: f32 = 0.02;
/// Least light that a leaf is measured against, relative to the image's mean.
const LEAST_SHOWN: f32 = 0.1;
/// Power of luminance by which a square error counts for less: 0 would be none, sRGB's curve by itself 1.1. This much
/// lowers relMSE by a tenth to a fifth (Cornell box, Crytek Sponza, hall, living room) at an RMSE higher by up to a
/// tenth.
const DARKS: f32 = 0.35;
/// Luminance against the image's mean below which that does not rise further.
const LEAST_DARK: f32 = 0.05;
/// Rays that a new vertex costs, evaluation included.
pub(super) const VERTEX_COST: f32 = 16.0;

/// A leaf's light at a glance.
#[derive(Clone, Copy, Debug)]
pub struct LeafEstimate {
    /// Mean shown luminance of the corners, W·sr⁻¹·m⁻².
    pub mean: f32,
    /// Least shown luminance of the corners, W·sr⁻¹·m⁻².
    pub least: f32,
    /// Largest Michelson contrast along an edge; an edge with a covered end counts as one.
    pub contrast: f32,
    /// Whether some of the corners are covered by other geometry, and some are not.
    pub covered: bool,
    /// Mean square error expected from interpolation, (W·sr⁻¹·m⁻²)².
    pub interpolation: f32,
    /// Mean variance of noise over the leaf, (W·sr⁻¹·m⁻²)².
    pub noise: f32,
}

/// Midpoints on a leaf's edges against its corners.
#[derive(Clone, Copy, Debug, Default)]
struct Hanging {
    /// Largest Michelson contrast of direct light with a corner.
    contrast: f32,
    /// Square error that a leaf without them would have there, (W·sr⁻¹·m⁻²)².
    surplus: f32,
    /// How much brighter the leaf is for them.
    brighter: f32,
}

/// Σd² + Σdd′ of the surpluses on a triangle's edges, what the mean square error of interpolation is proportional to
/// (docs/method/derivations.md).
pub(super) fn sum_of_products(d: [f32; 3]) -> f32 {
    let squares = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    squares + d[0] * d[1] + d[1] * d[2] + d[2] * d[0]
}

/// Michelson contrast of direct light between two places, each given by its direct and its indirect light.
fn michelson(a: [f32; 2], b: [f32; 2]) -> f32 {
    let sum = a[0] + a[1] + b[0] + b[1];
    if sum > 0.0 { (a[0] - b[0]).abs() / sum } else { 0.0 }
}

/// Keys of a leaf; 0 for what is not worth it or not allowed.
#[derive(Clone, Copy, Debug)]
pub struct LeafKeys {
    /// Of splitting it.
    pub split: f32,
    /// Of sampling it where its one pixel sees it.
    pub sample: f32,
    /// Of checking its pixels, if it is trusted unchecked.
    pub check: Option<f32>,
}

impl ErrorModel<'_> {
    /// Whether a piece of the engine is taken out.
    pub(super) const fn lacks(&self, piece: Piece) -> bool {
        self.options.without.has(piece)
    }

    /// Luminance, W·sr⁻¹·m⁻², shown at a slot on a face of direct and of indirect light.
    pub(super) fn shown(&self, face: FaceId, slot: SlotId) -> [f32; 2] {
        let (record, specular) = (&self.cache.slots[slot], self.view.specular.get(slot));
        let shown = |diffuse, specular| self.reflectances.shown(self.scene, face, diffuse, specular);
        [shown(record.direct().diffuse, specular.direct), shown(record.indirect().diffuse, specular.indirect)]
    }

    /// Luminance of direct and of indirect light shown at the corners of a node, and which corners are covered.
    fn corners(&self, node: NodeId) -> ([[f32; 2]; 3], [bool; 3]) {
        let node = &self.cache.topology.nodes[node];
        let shown = |slot| self.shown(node.face, slot);
        (node.corners.map(shown), node.corners.map(|slot| self.cache.is_covered(slot)))
    }

    /// Judges a leaf.
    #[must_use]
    pub fn leaf(&self, id: NodeId) -> LeafEstimate {
        if let Some(inner) = self.settled(id) {
            return self.settled_leaf(id, inner);
        }
        let (shown, covered) = self.corners(id);
        let node = &self.cache.topology.nodes[id];
        let total = shown.map(|[direct, indirect]| direct + indirect);
        let hanging = self.hanging(id, shown);
        let mean = total.iter().sum::<f32>() / 3.0 + hanging.brighter;
        let mut contrast = hanging.contrast;
        for i in 0..3 {
            let j = (i + 1) % 3;
            contrast = contrast.max(if covered[i] == covered[j] { michelson(shown[i], shown[j]) } else { 1.0 });
        }
        if let Some(inner) = node.pixel_vertex.get() {
            let inner = self.shown(node.face, inner);
            contrast = shown.iter().fold(contrast, |most, corner| most.max(michelson(*corner, inner)));
        }
        let noise_gain = self.reflectances.noise_gain(self.scene, node.face);
        let variance = node.corners.map(|slot| self.cache.slots[slot].direct().variance).iter().sum::<f32>();
        let unseen = CONTRAST_WEIGHT * (contrast * mean).powi(2);
        let (highlight, mismatch) = (self.highlight(id), self.mismatch(id));
        // Across a hard edge a child is as wrong as its parent was: only fewer of them are.
        let of_parent = if contrast > HARD_CONTRAST { 1.0 } else { CHILD };
        let surplus = (node.direct_surplus / CHILD).max(hanging.surplus) * of_parent;
        let interpolation = surplus
            + SURPLUS_TO_MSE * CHILD * unseen
            + self.unmeasured_edge(id, contrast) * mean.powi(2)
            + highlight * highlight * self.view.hidden.get(id).highlight_share
            + mismatch * mismatch * self.view.hidden.get(id).mismatch_share;
        let covered = covered.contains(&true) && covered.contains(&false);
        let least = total.iter().fold(f32::INFINITY, |m, &v| m.min(v));
        LeafEstimate { mean, least, covered, contrast, interpolation, noise: noise_gain * variance / 6.0 }
    }

    /// Square error of interpolating over a small face across a hard edge, against the square of its mean: nothing
    /// was ever measured between its corners, and of its few pixels each may be on either side. (Large faces are soon
    /// split for their contrast.)
    fn unmeasured_edge(&self, id: NodeId, contrast: f32) -> f32 {
        let node = &self.cache.topology.nodes[id];
        let is_small_face = node.level == 0 && self.view.leaves[id].pixels <= SMALL_FACE;
        if is_small_face && !self.lacks(Piece::UnmeasuredEdge) && contrast > SHADOW_CONTRAST {
            UNMEASURED_EDGE * contrast * contrast
        } else {
            0.0
        }
    }

    /// What the midpoints that finer neighbours put on a leaf's edges say against its corners.
    fn hanging(&self, id: NodeId, corners: [[f32; 2]; 3]) -> Hanging {
        let node = &self.cache.topology.nodes[id];
        let mut found = Hanging::default();
        if self.lacks(Piece::Hanging) || self.cache.drawn.of_node(id).len() < 2 {
            return found;
        }
        for i in 0..3 {
            let Some(middle) = self.cache.hanging_slot(id, i) else { continue };
            let (middle, a, b) = (self.shown(node.face, middle), corners[i], corners[(i + 1) % 3]);
            let surplus = middle[0] - (a[0] + b[0]) * 0.5;
            found.contrast = found.contrast.max(michelson(middle, a)).max(michelson(middle, b));
            found.surplus += SURPLUS_TO_MSE * surplus * surplus;
            found.brighter = found.brighter.max(surplus / 3.0);
        }
        found
    }

    /// The vertex inside a leaf, if that is what the leaf's one pixel shows.
    pub(super) fn settled(&self, id: NodeId) -> Option<SlotId> {
        self.view.pixel_slot(self.cache, id)
    }

    /// A leaf of which nothing but its pixel vertex shows: it has no error but that vertex's noise.
    fn settled_leaf(&self, id: NodeId, inner: SlotId) -> LeafEstimate {
        let face = self.cache.topology.nodes[id].face;
        let shown = self.shown(face, inner).iter().sum();
        let noise = self.reflectances.noise_gain(self.scene, face) * self.cache.slots[inner].direct().variance;
        LeafEstimate { mean: shown, least: shown, contrast: 0.0, covered: false, interpolation: 0.0, noise }
    }

    /// Key of sampling a leaf where its one pixel sees it; 0 if it is not worth it, or not known which pixel that is.
    #[must_use]
    pub fn pixel_sample_key(&self, id: NodeId) -> f32 {
        let leaf = &self.view.leaves[id];
        if !self.room.for_vertices
            || !self.samples_pixels()
            || !self.view.is_one_pixel(id)
            || self.settled(id).is_some()
        {
            return 0.0;
        }
        let light = self.leaf(id);
        let error = light.interpolation * self.display_gain(light.least);
        if error < (self.tolerance * self.mean).powi(2) { 0.0 } else { leaf.pixels * error / (1.0 + VERTEX_COST) }
    }

    /// Whether a leaf is as small as a pixel, so that it is sampled where that pixel sees it rather than split, once
    /// it is known which pixel that is.
    fn belongs_to_a_pixel(&self, id: NodeId) -> bool {
        let leaf = &self.view.leaves[id];
        (self.view.is_one_pixel(id) || (self.view.listed && leaf.pixels <= 1.0)) && self.samples_pixels()
    }

    /// Whether leaves as small as a pixel are sampled where that sees them.
    fn samples_pixels(&self) -> bool {
        self.options.priority == Priority::Error && !self.lacks(Piece::PixelSamples)
    }

    /// Square error of interpolation over a node that has just been split, from the surpluses at its edges' middles,
    /// less what noise alone puts there.
    #[must_use]
    pub fn surplus(&self, id: NodeId, middles: [SlotId; 3]) -> f32 {
        let (shown, covered) = self.corners(id);
        let node = &self.cache.topology.nodes[id];
        let gain = self.reflectances.noise_gain(self.scene, node.face);
        let variance = |slot: SlotId| self.cache.slots[slot].direct().variance;
        let mean = shown.iter().map(|s| s[0]).sum::<f32>() / 3.0;
        let mut noise = 0.0;
        let d = [0, 1, 2].map(|i| {
            let j = (i + 1) % 3;
            let middle = self.shown(node.face, middles[i])[0];
            noise += gain * (variance(middles[i]) + (variance(node.corners[i]) + variance(node.corners[j])) * 0.25);
            let hidden = [covered[i], covered[j], self.cache.is_covered(middles[i])];
            if hidden.iter().any(|h| *h) && !hidden.iter().all(|h| *h) {
                mean * 0.5
            } else {
                middle - (shown[i][0] + shown[j][0]) * 0.5
            }
        });
        SURPLUS_TO_MSE * (sum_of_products(d) - noise).max(0.0)
    }

    /// What a leaf adds to the image's error.
    #[must_use]
    pub fn leaf_error(&self, id: NodeId) -> LeafError {
        let light = self.leaf(id);
        let is_known = self.settled(id).is_some() || self.view.is_checked(id);
        let unseen = if is_known { 0.0 } else { self.reference_luminance(&light).powi(2) };
        let error = light.interpolation + light.noise;
        LeafError { pixels: self.view.leaves[id].pixels, light: light.mean, error, unseen }
    }

    /// The keys of everything that a visible leaf leaves to do.
    #[must_use]
    pub fn leaf_keys(&self, id: NodeId) -> LeafKeys {
        let check = self.wants_check(id).then(|| self.check_key(id));
        LeafKeys { split: self.split_key(id), sample: self.pixel_sample_key(id), check }
    }

    /// Key of splitting a leaf; 0 if it is not worth it or not allowed.
    #[must_use]
    pub fn split_key(&self, id: NodeId) -> f32 {
        if !self.room.for_vertices {
            return 0.0;
        }
        let node = &self.cache.topology.nodes[id];
        let light = self.leaf(id);
        // A hard edge is a line: a leaf across it is refined until the line is a pixel wide.
        let hard = self.is_hard(id, &light);
        // One of the children of a leaf of one pixel has that pixel again: there the leaf's share of its face says how
        // small it is.
        let leaf = &self.view.leaves[id];
        let pixels = if leaf.pixels > 1.0 { leaf.pixels } else { leaf.pixels.min(leaf.share) };
        let least = self.options.min_pixels * if hard { HARD_PIXELS } else { 1.0 };
        if pixels <= least || self.is_finest(id) || self.belongs_to_a_pixel(id) {
            return 0.0;
        }
        if self.options.priority == Priority::Random {
            let wanted = light.contrast > self.options.contrast || !self.is_small(id);
            return if wanted { self.random(u64::from(id.0)) } else { 0.0 };
        }
        // Below the tolerance nothing shows; a leaf that might hide a small shadow stays in the queue all the same.
        let unseen = if self.is_small(id) { 0.0 } else { self.hidden_shadow(&light) };
        let error = (light.interpolation + unseen) * self.display_gain(light.least);
        if error < (self.tolerance * self.mean).powi(2) {
            return 0.0;
        }
        let new = node.edges.iter().filter(|e| self.cache.topology.midpoint(**e).is_none()).count();
        leaf.pixels * error / (1.0 + (VERTEX_COST + self.points_between(node)) * new as f32)
    }

    /// Whether a split node that covers so many pixels would show the same as a leaf: interpolation between its corners is as good as
    /// what is known of its middles, or nobody sees the difference.
    pub(super) fn is_smooth(&self, id: NodeId, pixels: f32) -> bool {
        /// Pixels of which there is none between a node's corners.
        const HARDLY_ANY: f32 = 0.5;
        let nodes = &self.cache.topology.nodes;
        let Some(child) = nodes[id].children().map(|children| &nodes[children.middle()]) else { return false };
        let indirect = if nodes[id].indirect_split { child.indirect.surplus } else { 0.0 };
        let error = (child.direct_surplus + indirect) / CHILD * self.display_gain(self.leaf(id).least);
        pixels < HARDLY_ANY || error < (self.options.tolerance * self.mean).powi(2)
    }

    /// Whether single precision ends here: midpoints of the node's edges would not be apart.
    pub(super) fn is_finest(&self, id: NodeId) -> bool {
        if self.cache.topology.nodes[id].level < SAFE_LEVEL {
            return false;
        }
        let [a, b, c] = self.cache.corner_vertices(id).map(|v| &self.cache.vertices[v]);
        ![(a, b), (b, c), (c, a)].iter().all(|(p, q)| p.is_apart_from(q))
    }

    /// Points of lights' penumbrae that a new vertex between the corners of a node takes: half of what those have.
    pub(super) fn points_between(&self, node: &Node) -> f32 {
        let points = |slot: SlotId| self.cache.vertices[self.cache.slots[slot].vertex].progress.left.partial;
        node.corners.map(points).iter().sum::<u32>() as f32 / (2.0 * 3.0)
    }

    /// Whether a leaf lies across a hard edge, or hides one.
    pub(super) fn is_hard(&self, id: NodeId, light: &LeafEstimate) -> bool {
        light.covered || light.contrast > SHADOW_CONTRAST || self.hides_contrast(id, light.mean)
    }

    /// Share of D that a leaf shows, in the mean.
    pub(super) fn diffuse_reflectance(&self, id: NodeId) -> f32 {
        self.reflectances.of_noise(self.scene, self.cache.topology.nodes[id].face)
    }

    /// Luminance by which a pixel of a leaf is known to differ most from what its corners say.
    fn mismatch(&self, id: NodeId) -> f32 {
        self.diffuse_reflectance(id) * self.view.hidden.get(id).mismatch
    }

    /// Whether something between a leaf's corners is a strong contrast to the mean of what they show.
    fn hides_contrast(&self, id: NodeId, mean: f32) -> bool {
        let (highlight, mismatch) = (self.highlight(id), self.mismatch(id));
        // A mismatch may be a shadow, which is darker than the mean by that much.
        let by_surprise = mismatch > SHADOW_CONTRAST * (2.0 * mean - mismatch).max(mismatch);
        highlight > HARD_CONTRAST * (highlight + 2.0 * mean) || by_surprise
    }

    /// Whether the midpoints of a leaf may take its corners' word for what they see of a light.
    pub(super) fn trusts_corners(&self, id: NodeId) -> bool {
        let mean = || self.corners(id).0.iter().map(|[direct, indirect]| direct + indirect).sum::<f32>() / 3.0;
        !self.lacks(Piece::Agreement)
            && self.is_small(id)
            && self.mismatch(id) == 0.0
            && !self.hides_contrast(id, mean())
    }

    /// How much brighter than it is drawn a leaf is somewhere between its corners.
    fn highlight(&self, id: NodeId) -> f32 {
        let node = &self.cache.topology.nodes[id];
        self.reflectances.of_face(self.scene, node.face)[1] * self.view.hidden.get(id).highlight
    }

    /// Square of the slope of the tone curve at a luminance, with x/(1+x) for the curve: what is shown nearly white
    /// all over can wait (docs/method/what-to-trace-next.md). What is darker than the image's mean counts for more,
    /// since eyes and encodings tell darks apart.
    pub(super) fn display_gain(&self, luminance: f32) -> f32 {
        let against_mean = (luminance / self.mean.max(f32::MIN_POSITIVE)).max(LEAST_DARK);
        let white = if self.lacks(Piece::Display) { f32::INFINITY } else { self.options.white };
        let darks = if self.lacks(Piece::Darks) { 0.0 } else { DARKS };
        (1.0 + luminance / white).powi(-4) * against_mean.powf(-darks)
    }

    /// Square error expected of a shadow too small to have been seen.
    fn hidden_shadow(&self, light: &LeafEstimate) -> f32 {
        (self.tolerance * 2.0 * self.mean).powi(2).max(self.miss_rate * self.reference_luminance(light).powi(2))
    }

    /// Luminance, W·sr⁻¹·m⁻², that what a leaf hides is measured against: what it shows, or a little if it shows none.
    pub(super) fn reference_luminance(&self, light: &LeafEstimate) -> f32 {
        light.mean.max(LEAST_SHOWN * self.mean)
    }

    /// Square of the reference luminance of a leaf whose corners agree, if nothing but the miss rate splits it.
    #[must_use]
    pub fn split_by_miss_rate(&self, id: NodeId) -> Option<f32> {
        let light = self.leaf(id);
        let agrees =
            !self.lacks(Piece::MissRate) && !light.covered && light.interpolation <= self.hidden_shadow(&light);
        (agrees && !self.is_small(id)).then(|| self.reference_luminance(&light).powi(2)).filter(|square| *square > 0.0)
    }

    /// Key of tracing what a vertex has put off, or of doubling its points, from the variance that goes.
    #[must_use]
    pub fn vertex_key(&self, id: VertexId, rays: f32) -> f32 {
        if self.options.priority == Priority::Random {
            return self.random(self.cache.vertices[id].key);
        }
        let mut gain = 0.0;
        for slot in self.cache.slots_of(id) {
            let variance = self.cache.slots[slot].direct().variance;
            for drawn in self.cache.drawn.with_slot(slot) {
                let id = self.cache.drawn.triangles[drawn].node;
                let node = &self.cache.topology.nodes[id];
                let part = if self.settled(id) == Some(slot) { 1.0 } else { 1.0 / 6.0 };
                let share = self.view.leaves[id].pixels * part / self.cache.drawn.of_node(id).len().max(1) as f32;
                let shown = self.shown(node.face, slot).iter().sum();
                let noise = variance * self.reflectances.noise_gain(self.scene, node.face);
                gain += share * noise * self.display_gain(shown);
            }
        }
        let shows = self.cache.slots_of(id).any(|slot| self.noise_shows(slot));
        if shows { gain * 0.5 / rays.max(1.0) } else { 0.0 }
    }

    fn noise_shows(&self, slot: SlotId) -> bool {
        let record = &self.cache.slots[slot];
        let floor = self.tolerance * luminance(record.diffuse()).max(self.mean);
        record.direct().variance > floor * floor
    }

    fn longest_edge(&self, node: NodeId) -> f32 {
        let [a, b, c] = self.cache.corner_positions(node);
        a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a)).sqrt()
    }

    /// Whether corners that agree may speak for what lies between them: no shadow that is wanted fits in there,
    /// neither by its size in the scene nor, near the eye, by its pixels.
    #[must_use]
    pub fn is_small(&self, node: NodeId) -> bool {
        let pixels = self.view.leaves[node].pixels;
        pixels <= self.options.shadow_pixels && self.longest_edge(node) <= self.options.shadow_size
    }

    fn random(&self, what: u64) -> f32 {
        (combine(self.options.seed, what) >> 40) as f32 / (1_u32 << 24) as f32 + f32::MIN_POSITIVE
    }
}

#[cfg(test)]
mod tests;
