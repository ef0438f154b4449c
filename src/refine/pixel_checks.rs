//! Pixel checks: a leaf whose corners agree is taken at their word until each of its pixels has been checked. What
//! corners and middles do not show, shadows of a pixel or two, is found here; in the end every pixel has been looked
//! at.

use super::error_model::ErrorModel;
use super::miss_rate::MissRate;
use super::options::{Piece, Priority};
use super::view::ViewState;
use crate::cache::ids::NodeId;
use crate::cache::pixels::weights_inside;
use crate::cache::store::Cache;
use crate::cache::topology::Children;
use crate::cache::visibility_probe::{self, Mismatch};
use crate::light::context::SceneContext;
use glam::Vec3;
use rustc_hash::FxHashMap;
use smallvec::SmallVec;

/// Rays that checking a pixel costs, roughly: those to the lights, and what goes with them.
const RAYS_A_PIXEL: f32 = 6.0;
/// Square error of a leaf, relative to what it shows, before any was checked, and how many leaves that counts for: so
/// much and so few that some are checked early to find out.
const PRIOR: [f64; 2] = [1e-2, 8.0];
/// What checks find is mostly shadow: dark pixels shown bright, whose error is this many times as large on a display,
/// where dark tones lie apart, as its square beside what a leaf shows.
const SHADOWS_SHOW: f32 = 10.0;
/// One ray in so many goes to pixel checks, whatever they seem to be worth.
const SHARE: u64 = 12;
/// Leaves of more pixels are split rather than checked.
const MOST_PIXELS: f32 = 1024.0;

/// A pixel that shows something else than the corners of its leaf say.
#[derive(Clone, Copy, Debug)]
struct PixelMismatch {
    /// Direction from the eye through it.
    ray: Vec3,
    /// Luminance of D by which it differs, W·sr⁻¹·m⁻².
    luminance: f32,
}

type PixelMismatches = SmallVec<[PixelMismatch; 2]>;

/// What pixel checks have found in the present view.
#[derive(Debug)]
pub struct PixelChecks {
    /// Mismatches of leaves, until those are split.
    mismatches: FxHashMap<NodeId, PixelMismatches>,
    /// How likely a small leaf is to hide something.
    miss_rate: MissRate,
    /// Whether that is learnt.
    learns: bool,
    /// Rays traced, and about as many more as leaves that were taken will cost.
    rays: u64,
    promised: u64,
}

/// What the check of one leaf found.
#[derive(Debug, Default)]
pub struct Found {
    mismatches: PixelMismatches,
    pixels: u32,
    /// Light groups of which the corners do not know the same, if any was left out for that.
    open: u32,
    /// Whether to check again would tell more.
    more: bool,
}

/// What a leaf shows that was checked: what is found is measured against it.
#[derive(Clone, Copy, Debug)]
pub struct Reference {
    /// Luminance, W·sr⁻¹·m⁻².
    pub luminance: f32,
    /// Share of D that the leaf shows.
    pub reflectance: f32,
}

impl PixelChecks {
    /// Nothing is checked yet; whether checks tell how likely the next are to find something, or that stays what it is at first.
    #[must_use]
    pub fn new(learns: bool) -> Self {
        let miss_rate = MissRate::new(PRIOR[0], PRIOR[1]);
        Self { mismatches: FxHashMap::default(), miss_rate, learns, rays: 0, promised: 0 }
    }

    /// Forgets the mismatches, not how likely they were.
    pub fn forget(&mut self) {
        self.mismatches.clear();
    }

    /// Forgets the mismatches of a node that is gone.
    pub fn forget_node(&mut self, node: NodeId) {
        self.mismatches.remove(&node);
    }

    /// Expected square error of a leaf that was not checked, relative to the square of its reference luminance.
    #[must_use]
    pub fn miss_rate(&self) -> f32 {
        self.miss_rate.expected()
    }

    /// Whether the next check, of key `next`, is worth more than the task of key `other`, or it is time for it anyway
    /// after `rays` rays in all: what is not known to be there is not weighed right.
    #[must_use]
    pub fn are_due(&self, next: f32, other: Option<f32>, rays: u64) -> bool {
        let worth = next * SHADOWS_SHOW * self.miss_rate();
        other.is_none_or(|other| worth > other) || (self.rays + self.promised) * SHARE < rays
    }

    /// Notes that a leaf of so many pixels was taken to be checked.
    pub fn promise(&mut self, pixels: f32) {
        self.promised += (RAYS_A_PIXEL * pixels) as u64;
    }

    /// Notes that what was promised has been traced, with so many rays.
    pub fn note_rays(&mut self, rays: u64) {
        (self.rays, self.promised) = (self.rays + rays, 0);
    }

    /// Notes what the check of a leaf found.
    pub fn note(&mut self, node: NodeId, found: Found, of: Reference, view: &mut ViewState) {
        let again = std::mem::replace(&mut view.leaves[node].checked, true);
        view.hidden.update(node, |hidden| {
            hidden.checks = match (found.more, again) {
                (false, _) => 0,
                (true, false) => 1,
                (true, true) => hidden.checks + 1,
            };
        });
        let square = of.luminance.powi(2);
        if self.learns && square > 0.0 && found.pixels > 0 && !again {
            let error = |m: &PixelMismatch| ((of.reflectance * m.luminance).powi(2) / square).min(1.0);
            let sum: f32 = found.mismatches.iter().map(error).sum();
            self.miss_rate.note(sum / found.pixels as f32);
        }
        self.add(node, found.mismatches, found.open, view);
    }

    /// Adds mismatches to a leaf's. One of which `open` light groups were left out tells its children nothing, and is
    /// checked anew.
    fn add(&mut self, node: NodeId, mut found: PixelMismatches, open: u32, view: &mut ViewState) {
        found.extend(self.mismatches.remove(&node).into_iter().flatten());
        let most = found.iter().map(|m| m.luminance).fold(0.0, f32::max);
        let share = (found.len() as f32 / view.leaves[node].pixels.max(1.0)).min(1.0);
        view.hidden.update(node, |hidden| {
            (hidden.check_open, hidden.mismatch, hidden.mismatch_share) = (open, most, share);
        });
        if !found.is_empty() {
            self.mismatches.insert(node, found);
        }
    }

    /// Tells the children of a leaf that was split what its check has found.
    pub fn hand_down(&mut self, parent: NodeId, children: Children, cache: &Cache, view: &mut ViewState) {
        let found = self.mismatches.remove(&parent).unwrap_or_default();
        let (checked, of_parent) = (view.is_checked(parent), view.hidden.get(parent));
        if !checked || of_parent.check_open > 0 {
            return;
        }
        for child in children.all() {
            let corners = cache.corner_positions(child);
            let inside = found.iter().filter(|m| weights_inside(corners, view.eye, m.ray).is_some()).copied();
            view.leaves[child].checked = true;
            view.hidden.update(child, |hidden| hidden.checks = of_parent.checks);
            self.add(child, inside.collect(), 0, view);
        }
    }
}

impl ErrorModel<'_> {
    /// Key of checking the pixels of a leaf, if all that it shows were wrong.
    pub(super) fn check_key(&self, id: NodeId) -> f32 {
        let (light, leaf) = (self.leaf(id), &self.view.leaves[id]);
        // What the first points of a light have not shown is a small part of it.
        let part = if leaf.checked { (1.0 + self.view.hidden.get(id).checks as f32).powi(-2) } else { 1.0 };
        let error = part * self.reference_luminance(&light).powi(2) * self.display_gain(light.least);
        leaf.pixels * error / (1.0 + RAYS_A_PIXEL * leaf.pixels)
    }

    /// Whether a leaf is trusted though its pixels were not checked.
    pub(super) fn wants_check(&self, id: NodeId) -> bool {
        let (node, leaf) = (&self.cache.topology.nodes[id], &self.view.leaves[id]);
        self.options.priority == Priority::Error
            && !self.lacks(Piece::Checks)
            && node.is_leaf()
            && leaf.visible
            && (!leaf.checked || self.view.hidden.get(id).checks > 0)
            && self.view.span(id).is_some_and(|span| !span.is_empty())
            && leaf.pixels <= self.options.shadow_pixels.min(MOST_PIXELS)
            && self.settled(id).is_none()
            && node.corners.iter().all(|&slot| self.cache.slots[slot].direct().known)
            && !self.is_hard(id, &self.leaf(id))
    }
}

/// Checks the pixels of a leaf by the `turn`-th point of each light.
pub fn check(
    context: &SceneContext<'_>,
    cache: &Cache,
    (view, node): (&ViewState, NodeId),
    turn: u32,
    rays: &mut u64,
) -> Found {
    let (mut found, mut is_open) = (Found::default(), false);
    let Some((image, span)) = view.image.zip(view.span(node)) else { return found };
    for pixel in view.lists.of(span) {
        let Mismatch { luminance, open, more } =
            visibility_probe::mismatch(context, cache, (node, pixel.weights()), turn, rays);
        found.pixels += 1;
        is_open |= open;
        found.more |= more;
        if luminance > 0.0 {
            let ray = image.direction(image.size.centre_of(pixel.pixel as usize));
            found.mismatches.push(PixelMismatch { ray, luminance });
        }
    }
    if is_open {
        found.open = visibility_probe::open_lights(cache, node);
    }
    found
}

#[cfg(test)]
mod tests {
    use super::super::testing::{Judged, judged};
    use super::*;

    #[test]
    fn checks_get_their_share_of_the_rays_whatever_they_are_worth() {
        let mut checks = PixelChecks::new(true);
        assert!(checks.are_due(0.0, Some(1.0), 1));
        checks.promise(10.0);
        assert!(!checks.are_due(0.0, Some(1.0), 719) && checks.are_due(0.0, Some(1.0), 721));
        checks.note_rays(30);
        assert!(!checks.are_due(0.0, Some(1.0), 360) && checks.are_due(0.0, Some(1.0), 361));
    }

    #[test]
    fn checks_compete_by_the_miss_rate() {
        let mut checks = PixelChecks::new(true);
        checks.note_rays(1_000_000);
        // A hundredth times ten.
        assert!(checks.are_due(1.0, Some(0.09), 10) && !checks.are_due(1.0, Some(0.11), 10));
        assert!(checks.are_due(0.0, None, 10), "nothing else is left");
    }

    /// Two pixels of a triangle of ten, which a ray from above finds 0.5 and 0.2 off.
    fn found(at: [Vec3; 2]) -> Found {
        let mismatch = |(at, luminance)| PixelMismatch { ray: at - Vec3::Y, luminance };
        let mismatches = at.into_iter().zip([0.5, 0.2]).map(mismatch).collect();
        Found { mismatches, pixels: 10, ..Found::default() }
    }

    #[test]
    fn mismatches_are_handed_down_to_the_children_that_they_lie_in() {
        let (mut square, mut checks) = (judged(10.0), PixelChecks::new(true));
        let root = square.roots[0];
        let split = square.split(root);
        let inside = |node: NodeId| square.cache.corner_positions(node).iter().sum::<Vec3>() / 3.0;
        let [first, .., middle] = split.children.all();
        let found = found([inside(first), inside(middle)]);
        let Judged { rooted, view, .. } = &mut square;
        let of = Reference { luminance: 1.0, reflectance: 0.8 };
        checks.note(root, found, of, view);
        let hidden = view.hidden.get(root);
        assert_eq!((hidden.mismatch, hidden.mismatch_share), (0.5, 0.2));
        checks.hand_down(root, split.children, &rooted.cache, view);
        assert_eq!(split.children.all().map(|child| view.hidden.get(child).mismatch), [0.5, 0.0, 0.0, 0.2]);
        assert!(split.children.all().into_iter().all(|child| view.is_checked(child)));
        assert!(checks.mismatches.len() == 2 && !checks.mismatches.contains_key(&root));
    }

    #[test]
    fn what_was_checked_with_lights_left_out_is_checked_anew_below() {
        let (mut square, mut checks) = (judged(10.0), PixelChecks::new(true));
        let root = square.roots[0];
        let split = square.split(root);
        let Judged { rooted, view, .. } = &mut square;
        let found = Found { open: 1, more: true, ..found([Vec3::new(0.2, 0.0, 0.5); 2]) };
        checks.note(root, found, Reference { luminance: 1.0, reflectance: 0.8 }, view);
        checks.hand_down(root, split.children, &rooted.cache, view);
        assert!(split.children.all().into_iter().all(|child| !view.is_checked(child)));
        assert!(checks.mismatches.is_empty());
    }

    #[test]
    fn checks_tell_how_much_leaves_hide() {
        let (mut square, mut checks) = (judged(10.0), PixelChecks::new(true));
        let Judged { rooted, view, .. } = &mut square;
        let (root, of) = (rooted.roots[0], Reference { luminance: 1.0, reflectance: 0.8 });
        for _ in 0..100 {
            view.leaves[root].checked = false;
            checks.note(root, found([Vec3::new(0.2, 0.0, 0.5); 2]), of, view);
        }
        // Errors of 0.4 and 0.16 of what is shown, in two pixels of ten.
        let expected = 0.8_f32.powi(2) * (0.25 + 0.04) / 10.0;
        let found = (checks.miss_rate() - PRIOR[0] as f32 * 8.0 / 108.0) * 108.0 / 100.0;
        assert!((found / expected - 1.0).abs() < 1e-3, "{found} {expected}");
    }
}
