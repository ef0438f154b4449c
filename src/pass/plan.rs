//! What the luminance pass draws in a frame: lists of leaves, triangles to mark, and the draws over them in order.

use super::colouring::Projector;
use super::mesh::{Batch, LuminanceMesh};
use super::update::{Context, UpdateMode};
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
    /// As `Mark`, each triangle with its reference of `mark_references`.
    MarkExported { triangles: (u32, u32) },
    /// As `Marked`, each leaf with its reference of `list_references`.
    MarkedExported { leaves: (u32, u32) },
    /// Leaves against the depth that is there; `on_face`: and only where the id image shows the leaf's face.
    ByDepth { leaves: (u32, u32), on_face: bool, test: DepthTest },
    /// Pixels of changed leaves (of all where the images were cleared) find them by descending from their face.
    /// `leaves` lists them.
    Lookup { leaves: (u32, u32) },
}

impl Step {
    /// The leaves whose pixels can be counted as they are drawn, since no test rejects what their shader lets pass.
    pub(super) const fn counts_pixels(self) -> Option<(u32, u32)> {
        match self {
            Self::Values { leaves, on_face: false }
            | Self::ByDepth { leaves, on_face: false, .. }
            | Self::OnFace { leaves, .. }
            | Self::Marked { leaves, .. }
            | Self::Lookup { leaves } => Some(leaves),
            _ => None,
        }
    }
}

/// How leaves of patches compare with the depth that is there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum DepthTest {
    /// Not farther; their depth is written.
    NotFarther,
    /// Exactly as far; their depth is written.
    Equal,
    /// Not farther when brought nearer by what planes of one triangle may differ; no depth is written.
    Biased,
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
    /// Stencil references of listed leaves (0 beyond its end), where draws export them.
    pub list_references: Vec<u32>,
    /// Stencil references of marking triangles likewise.
    pub mark_references: Vec<u32>,
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
    /// Whether the image of face ids, not depth, tells where each triangle shows: those with a mask, those in one plane.
    pub by_id: &'a [bool],
}

impl Visible<'_> {
    pub(super) fn shows(&self, mesh: &LuminanceMesh, leaf: u32) -> bool {
        self.faces.get(mesh.leaves.get(leaf).face as usize).copied().unwrap_or(false)
    }

    /// Whether every visible face has a leaf among these.
    fn all_have_leaves(&self, mesh: &LuminanceMesh, leaves: &[u32]) -> bool {
        let mut missing = self.faces.to_vec();
        leaves.iter().for_each(|&l| missing[mesh.leaves.get(l).face as usize] = false);
        !missing.contains(&true)
    }

    pub(super) fn goes_by_id(&self, mesh: &LuminanceMesh, leaf: u32) -> bool {
        self.by_id.get(mesh.leaves.get(leaf).triangle().0 as usize).copied().unwrap_or(false)
    }
}

impl Plan {
    /// Every drawn leaf of a visible face.
    pub(super) fn full(mesh: &LuminanceMesh, visible: &Visible<'_>) -> Self {
        let mut plan = Self { clear: true, ..Self::default() };
        // By id, so that equal depths resolve alike however the set came about.
        let leaves: Vec<u32> = mesh.drawn().filter(|&l| visible.shows(mesh, l)).collect();
        if visible.all_have_leaves(mesh, &leaves) {
            plan.split_by_id(mesh, visible, leaves, |leaves, on_face| Step::Full { leaves, on_face });
        } else {
            // A face without leaves yet hides nothing: what lies behind it must not show through.
            let leaves = plan.extend(leaves);
            plan.draw(leaves, Step::Full { leaves, on_face: true });
        }
        plan.steps.push(Step::Background);
        plan
    }

    /// All that changed, in order, the way of the mode.
    pub(super) fn patches(mode: UpdateMode, context: &Context<'_>, batches: &[Batch]) -> Self {
        let mut plan = Self::default();
        batches.iter().for_each(|batch| mode.draw(&mut plan, context, batch));
        plan
    }

    /// Every pixel of a visible face with leaves, looked up.
    pub(super) fn full_lookup() -> Self {
        Self { clear: true, steps: vec![Step::Lookup { leaves: (0, 0) }, Step::Background], ..Self::default() }
    }

    /// Leaves of patches where nothing was drawn yet: there is nothing to compare with.
    pub(super) fn draw_fresh(&mut self, mesh: &LuminanceMesh, visible: &Visible<'_>, batch: &Batch) {
        let fresh = batch.patches.iter().filter(|p| p.old.is_empty()).flat_map(|p| &batch.new[p.new.clone()]);
        let leaves = self.extend(fresh.copied().filter(|&l| visible.shows(mesh, l)));
        self.draw(leaves, Step::OnFace { leaves, depth: true });
    }

    /// Leaves where the id image shows their face, in one draw with what was listed right before them.
    pub(super) fn draw_on_face(&mut self, (first, count): (u32, u32)) {
        let alone = self.queried.last().is_some_and(|&(_, step)| step + 1 == self.steps.len());
        match self.steps.last_mut() {
            Some(Step::OnFace { leaves, depth: false }) if !alone && leaves.0 + leaves.1 == first => leaves.1 += count,
            _ => self.draw((first, count), Step::OnFace { leaves: (first, count), depth: false }),
        }
    }

    /// A batch's leaves, whether of other values or of other triangles, against the depth that is there.
    pub(super) fn draw_by_depth(
        &mut self,
        mesh: &LuminanceMesh,
        visible: &Visible<'_>,
        batch: &Batch,
        test: DepthTest,
    ) {
        self.draw_fresh(mesh, visible, batch);
        let of = |counted: bool| {
            let patches = batch.patches.iter().filter(move |p| p.counted == counted && !p.old.is_empty());
            patches.flat_map(|p| &batch.new[p.new.clone()]).copied().filter(|&l| visible.shows(mesh, l))
        };
        let values = batch.values.iter().copied().filter(|&l| visible.shows(mesh, l));
        self.split_by_id(mesh, visible, values.chain(of(false)), |leaves, on_face| Step::ByDepth {
            leaves,
            on_face,
            test,
        });
        for leaf in of(true) {
            let on_face = visible.goes_by_id(mesh, leaf);
            self.draw_counted([leaf], |leaves| Step::ByDepth { leaves, on_face, test });
        }
    }

    /// A draw and a query for each leaf.
    pub(super) fn draw_counted(&mut self, leaves: impl IntoIterator<Item = u32>, step: impl Fn((u32, u32)) -> Step) {
        for leaf in leaves {
            let range = self.extend([leaf]);
            self.queried.push((leaf, self.steps.len()));
            self.steps.push(step(range));
        }
    }

    /// Leaves whose pixels are counted as they are drawn, each as often as it is drawn.
    pub(super) fn counted(&self) -> impl Iterator<Item = u32> {
        let ranges = self.steps.iter().filter_map(|step| step.counts_pixels());
        ranges.flat_map(|(first, count)| self.list[first as usize..][..count as usize].iter().copied())
    }

    /// Draws that it takes.
    pub(super) fn draws(&self) -> u32 {
        self.steps.iter().filter(|&&step| step != Step::ClearStencil).count() as u32
    }

    /// Two draws: leaves that go by depth, and those that look at the id image.
    pub(super) fn split_by_id(
        &mut self,
        mesh: &LuminanceMesh,
        visible: &Visible<'_>,
        leaves: impl IntoIterator<Item = u32>,
        step: impl Fn((u32, u32), bool) -> Step,
    ) {
        let (by_id, by_depth): (Vec<u32>, Vec<u32>) = leaves.into_iter().partition(|&l| visible.goes_by_id(mesh, l));
        for (list, on_face) in [(by_depth, false), (by_id, true)] {
            let range = self.extend(list);
            self.draw(range, step(range, on_face));
        }
    }

    pub(super) fn extend(&mut self, leaves: impl IntoIterator<Item = u32>) -> (u32, u32) {
        let first = self.list.len() as u32;
        self.list.extend(leaves);
        let count = self.list.len() as u32 - first;
        self.leaves_drawn += count;
        (first, count)
    }

    pub(super) fn draw(&mut self, (_, count): (u32, u32), step: Step) {
        if count > 0 {
            self.steps.push(step);
        }
    }
}
