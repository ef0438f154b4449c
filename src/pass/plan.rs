//! What the luminance pass draws in a frame: lists of leaves, triangles to mark, and the draws over them in order.

use super::colouring::{COLOURS, Colouring, Projector};
use super::mesh::{Batch, LuminanceMesh, PendingPatch};
use crate::scene::camera::ImageSize;
use glam::Vec3;

/// One draw, or a clear between draws. Ranges are (first triangle, triangles).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Step {
    /// Leaves by depth, nearest wins; `on_face`: only where the id image shows the leaf's face.
    Full { leaves: (u32, u32), on_face: bool },
    /// Depth to the background, where there is none.
    Background,
    /// Leaves drawn before, with other values: depth EQUAL.
    Values { leaves: (u32, u32), on_face: bool },
    /// Leaves where the id image shows their face; `depth`: written too.
    OnFace { leaves: (u32, u32), depth: bool },
    /// All stencil to zero.
    ClearStencil,
    /// Triangles of `marks` set the stencil to a reference where depth is EQUAL.
    Mark { triangles: (u32, u32), reference: u32 },
    /// Leaves where the stencil holds the reference, zeroing it, over any depth.
    Marked { leaves: (u32, u32), reference: u32 },
}

/// Has the pixels of those new leaves counted that cover most of the image, whole patches of `budget` leaves together: where
/// much is at stake it pays to know how much of it is seen.
pub(super) fn choose_counted(
    batches: &mut [Batch],
    mesh: &LuminanceMesh,
    visible: &Visible<'_>,
    projector: &Projector,
    budget: usize,
) {
    let mut candidates = Vec::new();
    for (b, batch) in batches.iter().enumerate().filter(|_| budget > 0) {
        for (p, patch) in batch.patches.iter().enumerate().filter(|(_, patch)| !patch.old.is_empty()) {
            let leaves = &batch.new[patch.new.clone()];
            if leaves.iter().any(|&l| visible.shows(mesh, l)) {
                let area: f32 = leaves.iter().map(|&l| projector.area(mesh.corners(l))).sum();
                candidates.push((area, b, p));
            }
        }
    }
    candidates.sort_by(|a, b| b.0.total_cmp(&a.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let mut left = budget;
    for (_, b, p) in candidates {
        let patch = &mut batches[b].patches[p];
        let Some(rest) = left.checked_sub(patch.new.len()) else { return };
        patch.counted = true;
        left = rest;
    }
}

/// The draws of a frame.
#[derive(Clone, Debug, Default)]
pub(super) struct Plan {
    /// Leaf ids that the draws of leaves index.
    pub list: Vec<u32>,
    /// Corners that the marking draws index.
    pub marks: Vec<Vec3>,
    /// The draws.
    pub steps: Vec<Step>,
    /// Leaves whose pixels are counted by queries, in the order of the queries, each with the number of its step.
    pub queried: Vec<(u32, usize)>,
    /// Whether the images are cleared first.
    pub clear: bool,
    /// Leaves drawn, all steps together.
    pub leaves_drawn: u32,
}

/// What a plan reads besides the mesh.
pub(super) struct Visible<'a> {
    /// Whether each face has pixels.
    pub faces: &'a [bool],
    /// Whether each triangle has a mask.
    pub masked: &'a [bool],
}

impl Visible<'_> {
    fn shows(&self, mesh: &LuminanceMesh, leaf: u32) -> bool {
        self.faces.get(mesh.leaves.get(leaf).face as usize).copied().unwrap_or(false)
    }

    /// Whether every visible face has a leaf among these.
    fn all_have_leaves(&self, mesh: &LuminanceMesh, leaves: &[u32]) -> bool {
        let mut missing = self.faces.to_vec();
        leaves.iter().for_each(|&l| missing[mesh.leaves.get(l).face as usize] = false);
        !missing.contains(&true)
    }

    fn has_mask(&self, mesh: &LuminanceMesh, leaf: u32) -> bool {
        self.masked.get(mesh.leaves.get(leaf).triangle().0 as usize).copied().unwrap_or(false)
    }
}

impl Plan {
    /// Every drawn leaf of a visible face.
    pub(super) fn full(mesh: &LuminanceMesh, visible: &Visible<'_>) -> Self {
        let mut plan = Self { clear: true, ..Self::default() };
        // By id, so that equal depths resolve alike however the set came about.
        let leaves: Vec<u32> = mesh.drawn().filter(|&l| visible.shows(mesh, l)).collect();
        if visible.all_have_leaves(mesh, &leaves) {
            plan.split_by_mask(mesh, visible, leaves, |leaves, on_face| Step::Full { leaves, on_face });
        } else {
            // A face without leaves yet hides nothing: what lies behind it must not show through.
            let leaves = plan.extend(leaves);
            plan.draw(leaves, Step::Full { leaves, on_face: true });
        }
        plan.steps.push(Step::Background);
        plan
    }

    /// All that changed, in order, each leaf where the id image shows its face.
    pub(super) fn on_face(mesh: &LuminanceMesh, visible: &Visible<'_>, batches: &[Batch]) -> Self {
        let mut plan = Self::default();
        let mut first = 0;
        for batch in batches {
            let of = |counted: bool| {
                let patches = batch.patches.iter().filter(move |p| p.counted == counted);
                patches.flat_map(|p| &batch.new[p.new.clone()]).copied().filter(|&l| visible.shows(mesh, l))
            };
            let values = batch.values.iter().copied().filter(|&l| visible.shows(mesh, l));
            plan.extend(values.chain(of(false)));
            if of(true).next().is_some() {
                plan.draw_on_face_from(first);
                plan.draw_counted(of(true), |leaves| Step::OnFace { leaves, depth: false });
                first = plan.list.len() as u32;
            }
        }
        plan.draw_on_face_from(first);
        plan
    }

    /// What was listed since `first` is drawn where the id image shows its face.
    fn draw_on_face_from(&mut self, first: u32) {
        let leaves = (first, self.list.len() as u32 - first);
        self.draw(leaves, Step::OnFace { leaves, depth: false });
    }

    /// A draw and a query for each leaf.
    fn draw_counted(&mut self, leaves: impl IntoIterator<Item = u32>, step: impl Fn((u32, u32)) -> Step) {
        for leaf in leaves {
            let range = self.extend([leaf]);
            self.queried.push((leaf, self.steps.len()));
            self.steps.push(step(range));
        }
    }

    /// The paper's way: old triangles mark, new ones draw where they did.
    pub(super) fn stencil(
        mesh: &LuminanceMesh,
        visible: &Visible<'_>,
        batches: &[Batch],
        projector: &Projector,
        size: ImageSize,
    ) -> Self {
        let mut plan = Self::default();
        for batch in batches {
            let values = batch.values.iter().copied().filter(|&l| visible.shows(mesh, l));
            plan.split_by_mask(mesh, visible, values, |leaves, on_face| Step::Values { leaves, on_face });
            // Nothing was drawn yet that could be marked.
            let fresh = batch.patches.iter().filter(|p| p.old.is_empty()).flat_map(|p| &batch.new[p.new.clone()]);
            let leaves = plan.extend(fresh.copied().filter(|&l| visible.shows(mesh, l)));
            plan.draw(leaves, Step::OnFace { leaves, depth: true });
            let shown = |p: &&PendingPatch| batch.new[p.new.clone()].iter().any(|&l| visible.shows(mesh, l));
            let mut waiting: Vec<_> = batch.patches.iter().filter(|p| !p.old.is_empty()).filter(shown).collect();
            while !waiting.is_empty() {
                waiting = plan.mark_and_draw(mesh, batch, &waiting, projector, size);
            }
        }
        plan
    }

    /// As many patches as there are colours for; returns the others.
    fn mark_and_draw<'b>(
        &mut self,
        mesh: &LuminanceMesh,
        batch: &Batch,
        patches: &[&'b PendingPatch],
        projector: &Projector,
        size: ImageSize,
    ) -> Vec<&'b PendingPatch> {
        let mut colouring = Colouring::new(size);
        let mut by_colour: Vec<Vec<&PendingPatch>> = vec![Vec::new(); COLOURS as usize];
        let mut waiting = Vec::new();
        for &patch in patches {
            let new = batch.new[patch.new.clone()].iter().flat_map(|&l| mesh.corners(l));
            let cells = projector.cells(patch.old.iter().flatten().copied().chain(new));
            match colouring.take(cells) {
                Some(colour) => by_colour[colour as usize].push(patch),
                None => waiting.push(patch),
            }
        }
        self.steps.push(Step::ClearStencil);
        for (reference, patches) in (1..).zip(&by_colour) {
            let first = self.marks.len() as u32 / 3;
            self.marks.extend(patches.iter().flat_map(|p| p.old.iter().flatten()));
            let triangles = (first, self.marks.len() as u32 / 3 - first);
            self.draw(triangles, Step::Mark { triangles, reference });
        }
        for (reference, patches) in (1..).zip(&by_colour) {
            let of = |counted: bool| {
                let patches = patches.iter().filter(move |p| p.counted == counted);
                patches.flat_map(|p| batch.new[p.new.clone()].iter().copied())
            };
            let leaves = self.extend(of(false));
            self.draw(leaves, Step::Marked { leaves, reference });
            self.draw_counted(of(true), |leaves| Step::Marked { leaves, reference });
        }
        waiting
    }

    /// Two draws: leaves without mask, and those with, which look at the id image.
    fn split_by_mask(
        &mut self,
        mesh: &LuminanceMesh,
        visible: &Visible<'_>,
        leaves: impl IntoIterator<Item = u32>,
        step: impl Fn((u32, u32), bool) -> Step,
    ) {
        let (masked, opaque): (Vec<u32>, Vec<u32>) = leaves.into_iter().partition(|&l| visible.has_mask(mesh, l));
        for (list, on_face) in [(opaque, false), (masked, true)] {
            let range = self.extend(list);
            self.draw(range, step(range, on_face));
        }
    }

    fn extend(&mut self, leaves: impl IntoIterator<Item = u32>) -> (u32, u32) {
        let first = self.list.len() as u32;
        self.list.extend(leaves);
        let count = self.list.len() as u32 - first;
        self.leaves_drawn += count;
        (first, count)
    }

    fn draw(&mut self, (_, count): (u32, u32), step: Step) {
        if count > 0 {
            self.steps.push(step);
        }
    }
}
