//! Audits: a leaf whose corners agree is taken at their word until each of its pixels has been asked. What corners and middles
//! do not show, shadows of a pixel or two, is found here; in the end every pixel has been looked at.

use super::engine::Engine;
use super::hidden::HiddenShadows;
use super::image_error::LeafError;
use super::options::Priority;
use super::priority::Judge;
use super::queue::Queue;
use crate::cache::dynamic::Cache;
use crate::cache::middle::{self, Surprise};
use crate::cache::pixels::{pixels_of, weights_inside};
use crate::cache::topology::NodeId;
use crate::scene::camera::View;
use crate::shade::world::World;
use glam::Vec3;
use rustc_hash::FxHashMap;
use smallvec::SmallVec;

/// Rays that asking a pixel costs, roughly: those to the lights, and what goes with them.
const RAYS_A_PIXEL: f32 = 6.0;
/// Square error of a leaf, relative to what it shows, before any was audited, and how many leaves that counts for: so much and so
/// few that some are audited early to find out.
const PRIOR: [f64; 2] = [1e-2, 8.0];
/// What audits find is mostly shadow: dark pixels shown bright, whose error is this many times as large on a display, where dark
/// tones lie apart, as its square beside what a leaf shows.
const SHADOWS_SHOW: f32 = 10.0;
/// One ray in so many goes to audits, whatever they seem to be worth.
const SHARE: u64 = 12;
/// Leaves of more pixels are split rather than asked.
const MOST_PIXELS: f32 = 1024.0;

/// A pixel that shows something else than the corners of its leaf say.
#[derive(Clone, Copy, Debug)]
struct Odd {
    /// Direction from the eye through it.
    ray: Vec3,
    /// Luminance of D by which it differs.
    surprise: f32,
}

type OddPixels = SmallVec<[Odd; 2]>;

/// What audits have found in the present view.
#[derive(Debug)]
pub struct Audits {
    /// Odd pixels of leaves, until those are split.
    odd: FxHashMap<NodeId, OddPixels>,
    /// How likely a small leaf is to hide something.
    odds: HiddenShadows,
    /// Leaves that wait.
    queue: Queue<NodeId>,
    /// Rays traced, and about as many more as leaves that were taken will cost.
    rays: u64,
    promised: u64,
}

/// What the audit of one leaf found.
#[derive(Default)]
struct Found {
    odd: OddPixels,
    pixels: u32,
    /// Lights of which the corners do not know the same, if any was left out for that.
    open: u32,
    /// Whether to ask again would tell more.
    more: bool,
}

impl Default for Audits {
    fn default() -> Self {
        Self {
            odd: FxHashMap::default(),
            odds: HiddenShadows::new(PRIOR[0], PRIOR[1]),
            queue: Queue::default(),
            rays: 0,
            promised: 0,
        }
    }
}

impl Audits {
    /// Forgets the pixels, not how likely they were to be odd.
    pub fn forget(&mut self) {
        self.odd.clear();
        self.queue.clear();
    }

    /// Whether no leaf waits.
    #[must_use]
    pub fn are_done(&self) -> bool {
        self.queue.is_empty()
    }

    /// Expected square error of a leaf that was not audited, relative to what it is judged by.
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

impl Judge<'_> {
    /// Key of asking the pixels of a leaf, if all that it shows were wrong.
    fn audit_key(&self, id: NodeId) -> f32 {
        let light = self.leaf(id);
        let work = &self.cache.topology.nodes[id.0].work;
        // What the first points of a light have not shown is a small part of it.
        let part = if work.audited == self.generation { (1.0 + work.audits as f32).powi(-2) } else { 1.0 };
        let error = part * self.judged_by(&light) * self.display_gain(light.least);
        work.pixels * error / (1.0 + RAYS_A_PIXEL * work.pixels)
    }

    /// Whether a leaf is trusted though its pixels were not asked.
    fn wants_audit(&self, id: NodeId) -> bool {
        let node = &self.cache.topology.nodes[id.0];
        self.options.priority == Priority::Error
            && self.audits
            && node.child.is_none()
            && node.work.generation == self.generation
            && (node.work.audited != self.generation || node.work.audits > 0)
            && node.work.pixels > 0.0
            && node.work.pixels <= self.options.shadow_pixels.min(MOST_PIXELS)
            && self.settled(id).is_none()
            && node.corners.iter().all(|slot| self.cache.slots[slot.0].direct.known)
            && !self.is_hard(id, &self.leaf(id))
    }

    /// What a leaf adds to the image's error.
    pub(super) fn leaf_error(&self, id: NodeId) -> LeafError {
        let light = self.leaf(id);
        let known = self.settled(id).is_some() || self.cache.topology.nodes[id.0].work.audited == self.generation;
        let unseen = if known { 0.0 } else { self.judged_by(&light) };
        LeafError { light: light.mean, error: light.interpolation + light.noise, unseen }
    }
}

impl Engine {
    /// Queues a leaf whose corners agree.
    pub(super) fn enqueue_audit(&mut self, id: NodeId) {
        let queued = self.cache.topology.nodes[id.0].work.audit_queued == self.generation;
        if !queued && self.judge().wants_audit(id) {
            let key = self.judge().audit_key(id);
            self.cache.topology.nodes[id.0].work.audit_queued = if key > 0.0 { self.generation } else { 0 };
            self.audits.queue.push(key, id, 0);
        }
    }

    /// Queues those of the visible leaves anew whose corners have come to agree about lights that an audit left out.
    pub(super) fn reopen_audits(&mut self) {
        let knows_more = |id: &NodeId| {
            let work = &self.cache.topology.nodes[id.0].work;
            let is_open = work.audited == self.generation && work.audit_open > 0;
            is_open && middle::open_lights(&self.cache, *id) < work.audit_open
        };
        let leaves: Vec<NodeId> = self.all_visible_leaves().into_iter().filter(knows_more).collect();
        for leaf in leaves {
            self.cache.topology.nodes[leaf.0].work.audited = 0;
            self.enqueue_audit(leaf);
            let work = &mut self.cache.topology.nodes[leaf.0].work;
            if work.audit_queued == self.generation {
                work.audit_open = 0;
            } else {
                work.audited = self.generation;
            }
        }
    }

    /// Takes a leaf to be audited, if one is worth more than the next task or it is time for one.
    pub(super) fn next_audit(&mut self) -> Option<NodeId> {
        while self.audits.are_due(self.queue.peek(), self.stats.rays) {
            let Some(id) = self.audits.queue.pop().map(|entry| entry.task) else { break };
            self.cache.topology.nodes[id.0].work.audit_queued = 0;
            if self.judge().wants_audit(id) {
                self.audits.promised += (RAYS_A_PIXEL * self.cache.topology.nodes[id.0].work.pixels) as u64;
                return Some(id);
            }
        }
        None
    }

    /// Asks the pixels of leaves whether these are as their corners say.
    pub(super) fn audit(&mut self, nodes: &[NodeId]) {
        let Some(view) = self.view() else { return };
        let (world, cache) = (self.world(), &self.cache);
        let turn = |node: NodeId| {
            let work = &cache.topology.nodes[node.0].work;
            if work.audited == self.generation { work.audits } else { 0 }
        };
        let found = self.workers.map_chunks(nodes, |chunk| {
            let mut rays = 0;
            let found: Vec<Found> =
                chunk.iter().map(|&node| ask(&world, cache, (&view, node), turn(node), &mut rays)).collect();
            (found, rays)
        });
        let rays: u64 = found.iter().map(|(_, rays)| rays).sum();
        self.stats.rays += rays;
        (self.audits.rays, self.audits.promised) = (self.audits.rays + rays, 0);
        for (&node, found) in nodes.iter().zip(found.into_iter().flat_map(|(found, _)| found)) {
            if self.cache.topology.nodes[node.0].child.is_none() {
                self.note_audit(node, found);
            }
        }
    }

    fn note_audit(&mut self, node: NodeId, found: Found) {
        let judge = self.judge();
        let (square, reflectance) = (judge.judged_by(&judge.leaf(node)), judge.diffuse_reflectance(node));
        let work = &mut self.cache.topology.nodes[node.0].work;
        let again = work.audited == self.generation;
        work.audits = match (found.more, again) {
            (false, _) => 0,
            (true, false) => 1,
            (true, true) => work.audits + 1,
        };
        if square > 0.0 && found.pixels > 0 && !again {
            let error = |odd: &Odd| ((reflectance * odd.surprise).powi(2) / square).min(1.0);
            let sum: f32 = found.odd.iter().map(error).sum();
            self.audits.odds.note(sum / found.pixels as f32);
        }
        self.cache.topology.nodes[node.0].work.audited = self.generation;
        self.note_odd(node, found.odd, found.open);
        self.account(node);
        self.enqueue_split(node);
    }

    /// Notes odd pixels at a leaf. One of which `open` lights were left out tells its children nothing, and they are audited anew.
    fn note_odd(&mut self, node: NodeId, odd: OddPixels, open: u32) {
        let mut odd = odd;
        odd.extend(self.audits.odd.remove(&node).into_iter().flatten());
        let work = &mut self.cache.topology.nodes[node.0].work;
        let most = odd.iter().map(|odd| odd.surprise).fold(0.0, f32::max);
        (work.surprise, work.audit_open) = (Some(most), open);
        work.surprise_share = (odd.len() as f32 / work.pixels.max(1.0)).min(1.0);
        if !odd.is_empty() {
            self.audits.odd.insert(node, odd);
        }
    }

    /// Tells the children of a leaf that was split what its audit has found.
    pub(super) fn hand_down_audit(&mut self, parent: NodeId, first: NodeId) {
        let odd = self.audits.odd.remove(&parent).unwrap_or_default();
        let work = self.cache.topology.nodes[parent.0].work;
        if work.audited != self.generation || work.audit_open > 0 {
            return;
        }
        for child in (first.0..first.0 + 4).map(NodeId) {
            let corners = self.cache.corner_positions(child);
            let inside = odd.iter().filter(|odd| weights_inside(corners, self.eye, odd.ray).is_some()).copied();
            let child_work = &mut self.cache.topology.nodes[child.0].work;
            (child_work.audited, child_work.audits) = (self.generation, work.audits);
            self.note_odd(child, inside.collect(), 0);
        }
    }
}

/// Asks the pixels of a leaf.
fn ask(world: &World<'_>, cache: &Cache, (view, node): (&View, NodeId), turn: u32, rays: &mut u64) -> Found {
    let (mut found, mut is_open) = (Found::default(), false);
    for pixel in pixels_of(view, cache.corner_positions(node)).unwrap_or_default() {
        let Surprise { luminance, open, more } = middle::surprise(world, cache, (node, pixel.weights), turn, rays);
        found.pixels += 1;
        is_open |= open;
        found.more |= more;
        if luminance > 0.0 {
            found.odd.push(Odd { ray: pixel.ray, surprise: luminance });
        }
    }
    if is_open {
        found.open = middle::open_lights(cache, node);
    }
    found
}
