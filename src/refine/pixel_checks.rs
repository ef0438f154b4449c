//! PixelChecks: a leaf whose corners agree is taken at their word until each of its pixels has been asked. What corners and middles
//! do not show, shadows of a pixel or two, is found here; in the end every pixel has been looked at.

use super::engine::Engine;
use super::error_model::ErrorModel;
use super::image_error::LeafError;
use super::miss_rate::MissRate;
use super::options::Priority;
use super::queue::Queue;
use crate::cache::dynamic::Cache;
use crate::cache::pixels::{pixels_of, weights_inside};
use crate::cache::topology::NodeId;
use crate::cache::visibility_probe::{self, Mismatch};
use crate::light::context::SceneContext;
use crate::scene::camera::View;
use glam::Vec3;
use rustc_hash::FxHashMap;
use smallvec::SmallVec;

/// Rays that asking a pixel costs, roughly: those to the lights, and what goes with them.
const RAYS_A_PIXEL: f32 = 6.0;
/// Square error of a leaf, relative to what it shows, before any was checked, and how many leaves that counts for: so much and so
/// few that some are checked early to find out.
const PRIOR: [f64; 2] = [1e-2, 8.0];
/// What checks find is mostly shadow: dark pixels shown bright, whose error is this many times as large on a display, where dark
/// tones lie apart, as its square beside what a leaf shows.
const SHADOWS_SHOW: f32 = 10.0;
/// One ray in so many goes to checks, whatever they seem to be worth.
const SHARE: u64 = 12;
/// Leaves of more pixels are split rather than asked.
const MOST_PIXELS: f32 = 1024.0;

/// A pixel that shows something else than the corners of its leaf say.
#[derive(Clone, Copy, Debug)]
struct PixelMismatch {
    /// Direction from the eye through it.
    ray: Vec3,
    /// Luminance of D by which it differs.
    mismatch: f32,
}

type PixelMismatches = SmallVec<[PixelMismatch; 2]>;

/// What checks have found in the present view.
#[derive(Debug)]
pub struct PixelChecks {
    /// PixelMismatch pixels of leaves, until those are split.
    mismatches: FxHashMap<NodeId, PixelMismatches>,
    /// How likely a small leaf is to hide something.
    odds: MissRate,
    /// Leaves that wait.
    queue: Queue<NodeId>,
    /// Rays traced, and about as many more as leaves that were taken will cost.
    rays: u64,
    promised: u64,
}

/// What the audit of one leaf found.
#[derive(Default)]
struct Found {
    mismatches: PixelMismatches,
    pixels: u32,
    /// Lights of which the corners do not know the same, if any was left out for that.
    open: u32,
    /// Whether to ask again would tell more.
    more: bool,
}

impl Default for PixelChecks {
    fn default() -> Self {
        Self {
            mismatches: FxHashMap::default(),
            odds: MissRate::new(PRIOR[0], PRIOR[1]),
            queue: Queue::default(),
            rays: 0,
            promised: 0,
        }
    }
}

impl PixelChecks {
    /// Forgets the pixels, not how likely they were to be odd.
    pub fn forget(&mut self) {
        self.mismatches.clear();
        self.queue.clear();
    }

    /// Whether no leaf waits.
    #[must_use]
    pub fn are_done(&self) -> bool {
        self.queue.is_empty()
    }

    /// Expected square error of a leaf that was not checked, relative to what it is judged by.
    #[must_use]
    pub fn expected(&self) -> f32 {
        self.odds.expected()
    }

    /// Whether the next leaf is worth more than the task of key `other`, or it is time for it anyway after `rays` rays in all: what
    /// is not known to be there is not weighed right.
    fn are_due(&self, other: Option<f32>, rays: u64) -> bool {
        let next = self.queue.peek().map_or(0.0, |key| key * SHADOWS_SHOW * self.expected());
        other.is_none_or(|other| next > other) || (self.rays + self.promised) * SHARE < rays
    }
}

impl ErrorModel<'_> {
    /// Key of asking the pixels of a leaf, if all that it shows were wrong.
    fn check_key(&self, id: NodeId) -> f32 {
        let light = self.leaf(id);
        let work = &self.cache.topology.nodes[id.0].work;
        // What the first points of a light have not shown is a small part of it.
        let part = if work.checked == self.generation { (1.0 + work.checks as f32).powi(-2) } else { 1.0 };
        let error = part * self.judged_by(&light) * self.display_gain(light.least);
        work.pixels * error / (1.0 + RAYS_A_PIXEL * work.pixels)
    }

    /// Whether a leaf is trusted though its pixels were not asked.
    fn wants_check(&self, id: NodeId) -> bool {
        let node = &self.cache.topology.nodes[id.0];
        self.options.priority == Priority::Error
            && self.checks
            && node.child.is_none()
            && node.work.generation == self.generation
            && (node.work.checked != self.generation || node.work.checks > 0)
            && node.work.pixels > 0.0
            && node.work.pixels <= self.options.shadow_pixels.min(MOST_PIXELS)
            && self.settled(id).is_none()
            && node.corners.iter().all(|slot| self.cache.slots[slot.0].direct.known)
            && !self.is_hard(id, &self.leaf(id))
    }

    /// What a leaf adds to the image's error.
    pub(super) fn leaf_error(&self, id: NodeId) -> LeafError {
        let light = self.leaf(id);
        let known = self.settled(id).is_some() || self.cache.topology.nodes[id.0].work.checked == self.generation;
        let unseen = if known { 0.0 } else { self.judged_by(&light) };
        LeafError { light: light.mean, error: light.interpolation + light.noise, unseen }
    }
}

impl Engine {
    /// Queues a leaf whose corners agree.
    pub(super) fn enqueue_check(&mut self, id: NodeId) {
        let queued = self.cache.topology.nodes[id.0].work.check_queued == self.generation;
        if !queued && self.error_model().wants_check(id) {
            let key = self.error_model().check_key(id);
            self.cache.topology.nodes[id.0].work.check_queued = if key > 0.0 { self.generation } else { 0 };
            self.checks.queue.push(key, id, 0);
        }
    }

    /// Queues those of the visible leaves anew whose corners have come to agree about lights that an audit left out.
    pub(super) fn reopen_checks(&mut self) {
        let knows_more = |id: &NodeId| {
            let work = &self.cache.topology.nodes[id.0].work;
            let is_open = work.checked == self.generation && work.check_open > 0;
            is_open && visibility_probe::open_lights(&self.cache, *id) < work.check_open
        };
        let leaves: Vec<NodeId> = self.all_visible_leaves().into_iter().filter(knows_more).collect();
        for leaf in leaves {
            self.cache.topology.nodes[leaf.0].work.checked = 0;
            self.enqueue_check(leaf);
            let work = &mut self.cache.topology.nodes[leaf.0].work;
            if work.check_queued == self.generation {
                work.check_open = 0;
            } else {
                work.checked = self.generation;
            }
        }
    }

    /// Takes a leaf to be checked, if one is worth more than the next task or it is time for one.
    pub(super) fn next_check(&mut self) -> Option<NodeId> {
        while self.checks.are_due(self.queue.peek(), self.stats.rays) {
            let Some(id) = self.checks.queue.pop().map(|entry| entry.task) else { break };
            self.cache.topology.nodes[id.0].work.check_queued = 0;
            if self.error_model().wants_check(id) {
                self.checks.promised += (RAYS_A_PIXEL * self.cache.topology.nodes[id.0].work.pixels) as u64;
                return Some(id);
            }
        }
        None
    }

    /// Asks the pixels of leaves whether these are as their corners say.
    pub(super) fn check_pixels(&mut self, nodes: &[NodeId]) {
        let Some(view) = self.view() else { return };
        let (context, cache) = (self.context(), &self.cache);
        let turn = |node: NodeId| {
            let work = &cache.topology.nodes[node.0].work;
            if work.checked == self.generation { work.checks } else { 0 }
        };
        let found = self.workers.map_chunks(nodes, |chunk| {
            let mut rays = 0;
            let found: Vec<Found> =
                chunk.iter().map(|&node| ask(&context, cache, (&view, node), turn(node), &mut rays)).collect();
            (found, rays)
        });
        let rays: u64 = found.iter().map(|(_, rays)| rays).sum();
        self.stats.rays += rays;
        (self.checks.rays, self.checks.promised) = (self.checks.rays + rays, 0);
        for (&node, found) in nodes.iter().zip(found.into_iter().flat_map(|(found, _)| found)) {
            if self.cache.topology.nodes[node.0].child.is_none() {
                self.note_check(node, found);
            }
        }
    }

    fn note_check(&mut self, node: NodeId, found: Found) {
        let error_model = self.error_model();
        let (square, reflectance) =
            (error_model.judged_by(&error_model.leaf(node)), error_model.diffuse_reflectance(node));
        let work = &mut self.cache.topology.nodes[node.0].work;
        let again = work.checked == self.generation;
        work.checks = match (found.more, again) {
            (false, _) => 0,
            (true, false) => 1,
            (true, true) => work.checks + 1,
        };
        if square > 0.0 && found.pixels > 0 && !again {
            let error = |mismatches: &PixelMismatch| ((reflectance * mismatches.mismatch).powi(2) / square).min(1.0);
            let sum: f32 = found.mismatches.iter().map(error).sum();
            self.checks.odds.note(sum / found.pixels as f32);
        }
        self.cache.topology.nodes[node.0].work.checked = self.generation;
        self.note_mismatches(node, found.mismatches, found.open);
        self.account(node);
        self.enqueue_split(node);
    }

    /// Notes odd pixels at a leaf. One of which `open` lights were left out tells its children nothing, and they are checked anew.
    fn note_mismatches(&mut self, node: NodeId, mismatches: PixelMismatches, open: u32) {
        let mut mismatches = mismatches;
        mismatches.extend(self.checks.mismatches.remove(&node).into_iter().flatten());
        let work = &mut self.cache.topology.nodes[node.0].work;
        let most = mismatches.iter().map(|mismatches| mismatches.mismatch).fold(0.0, f32::max);
        (work.mismatch, work.check_open) = (Some(most), open);
        work.mismatch_share = (mismatches.len() as f32 / work.pixels.max(1.0)).min(1.0);
        if !mismatches.is_empty() {
            self.checks.mismatches.insert(node, mismatches);
        }
    }

    /// Tells the children of a leaf that was split what its audit has found.
    pub(super) fn hand_down_check(&mut self, parent: NodeId, first: NodeId) {
        let mismatches = self.checks.mismatches.remove(&parent).unwrap_or_default();
        let work = self.cache.topology.nodes[parent.0].work;
        if work.checked != self.generation || work.check_open > 0 {
            return;
        }
        for child in (first.0..first.0 + 4).map(NodeId) {
            let corners = self.cache.corner_positions(child);
            let inside = mismatches
                .iter()
                .filter(|mismatches| weights_inside(corners, self.eye, mismatches.ray).is_some())
                .copied();
            let child_work = &mut self.cache.topology.nodes[child.0].work;
            (child_work.checked, child_work.checks) = (self.generation, work.checks);
            self.note_mismatches(child, inside.collect(), 0);
        }
    }
}

/// Asks the pixels of a leaf.
fn ask(context: &SceneContext<'_>, cache: &Cache, (view, node): (&View, NodeId), turn: u32, rays: &mut u64) -> Found {
    let (mut found, mut is_open) = (Found::default(), false);
    for pixel in pixels_of(view, cache.corner_positions(node)).unwrap_or_default() {
        let Mismatch { luminance, open, more } =
            visibility_probe::mismatch(context, cache, (node, pixel.weights), turn, rays);
        found.pixels += 1;
        is_open |= open;
        found.more |= more;
        if luminance > 0.0 {
            found.mismatches.push(PixelMismatch { ray: pixel.ray, mismatch: luminance });
        }
    }
    if is_open {
        found.open = visibility_probe::open_lights(cache, node);
    }
    found
}
