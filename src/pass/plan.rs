//! What the luminance pass draws in a frame: lists of drawn triangles, triangles to mark, and the draws over them in order.

use super::colouring::Projector;
use super::frustum::{Frustum, Place};
use super::mesh::{Batch, LuminanceMesh};
use glam::Vec3;

/// One draw, or a clear between draws. Ranges are (first triangle, triangles).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Step {
    /// Drawn triangles by depth, nearest wins; `on_face`: only where the id image shows the drawn triangle's face.
    Full { drawn_triangles: (u32, u32), on_face: bool },
    /// Depth to the background, where there is none.
    Background,
    /// Drawn triangles that are on the images, with other values: depth EQUAL.
    Values { drawn_triangles: (u32, u32), on_face: bool },
    /// Drawn triangles where the id image shows their face; `depth`: written too.
    OnFace { drawn_triangles: (u32, u32), depth: bool },
    /// All stencil to zero.
    ClearStencil,
    /// Triangles of `marks` set the stencil to a reference where depth is EQUAL.
    Mark { triangles: (u32, u32), reference: u32 },
    /// Drawn triangles where the stencil holds the reference, zeroing it, over any depth.
    Marked { drawn_triangles: (u32, u32), reference: u32 },
    /// As `Mark`, each triangle with its reference of `mark_references`.
    MarkExported { triangles: (u32, u32) },
    /// As `Marked`, each drawn triangle with its reference of `list_references`.
    MarkedExported { drawn_triangles: (u32, u32) },
    /// Drawn triangles against the depth that is there; `on_face`: and only where the id image shows the drawn triangle's face.
    ByDepth { drawn_triangles: (u32, u32), on_face: bool, test: DepthTest },
    /// Pixels of changed drawn triangles (of all where the images were cleared) find them by descending from their
    /// face. `drawn_triangles` lists them.
    Lookup { drawn_triangles: (u32, u32) },
}

impl Step {
    /// The drawn triangles whose pixels can be counted as they are drawn, since no test rejects what their shader lets pass.
    pub(super) const fn counts_pixels(self) -> Option<(u32, u32)> {
        match self {
            Self::Values { drawn_triangles, on_face: false }
            | Self::ByDepth { drawn_triangles, on_face: false, .. }
            | Self::OnFace { drawn_triangles, .. }
            | Self::Marked { drawn_triangles, .. }
            | Self::Lookup { drawn_triangles } => Some(drawn_triangles),
            _ => None,
        }
    }
}

/// How drawn triangles of patches compare with the depth that is there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum DepthTest {
    /// Not farther; their depth is written.
    NotFarther,
    /// Exactly as far; their depth is written.
    Equal,
    /// Not farther when brought nearer by what planes of one triangle may differ; no depth is written.
    Biased,
}

/// Has the pixels of those new drawn triangles counted that cover most of the image, whole patches of `budget` drawn triangles together: where
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
            let drawn_triangles = &batch.new[patch.new.clone()];
            if drawn_triangles.iter().any(|&id| visible.shows(mesh, id)) {
                let area: f32 = drawn_triangles.iter().map(|&id| projector.area(mesh.corners(id))).sum();
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
    /// Ids of drawn triangles that the draws index.
    pub list: Vec<u32>,
    /// Corners that the marking draws index.
    pub marks: Vec<Vec3>,
    /// Stencil references of listed drawn triangles (0 beyond its end), where draws export them.
    pub list_references: Vec<u32>,
    /// Stencil references of marking triangles likewise.
    pub mark_references: Vec<u32>,
    /// The draws.
    pub steps: Vec<Step>,
    /// Drawn triangles whose pixels are counted by queries, in the order of the queries, each with the number of its step.
    pub queried: Vec<(u32, usize)>,
    /// Whether the images are cleared first.
    pub clear: bool,
    /// Triangles drawn, all steps together.
    pub triangles_drawn: u32,
}

/// What a plan reads besides the mesh.
pub(super) struct Visible<'a> {
    /// Whether each face has pixels.
    pub faces: &'a [bool],
    /// Whether the image of face ids, not depth, tells where each triangle shows: those with a mask, those in one plane.
    pub by_id: &'a [bool],
}

impl Visible<'_> {
    pub(super) fn shows(&self, mesh: &LuminanceMesh, drawn_id: u32) -> bool {
        self.faces.get(mesh.drawn_triangles.get(drawn_id).face as usize).copied().unwrap_or(false)
    }

    /// Whether every visible face has a drawn triangle among these.
    fn all_are_covered(&self, mesh: &LuminanceMesh, drawn_triangles: &[u32]) -> bool {
        let mut missing = self.faces.to_vec();
        drawn_triangles.iter().for_each(|&id| missing[mesh.drawn_triangles.get(id).face as usize] = false);
        !missing.contains(&true)
    }

    pub(super) fn goes_by_id(&self, mesh: &LuminanceMesh, drawn_id: u32) -> bool {
        self.by_id.get(mesh.drawn_triangles.get(drawn_id).triangle().0 as usize).copied().unwrap_or(false)
    }
}

/// Which drawn triangles the view frustum clips.
pub(super) struct Clipping<'a> {
    pub frustum: &'a Frustum,
    /// Where each triangle of the scene lies, as far as is known.
    pub places: &'a [Place],
}

impl Clipping<'_> {
    fn place(&self, mesh: &LuminanceMesh, drawn_id: u32) -> Place {
        let triangle = mesh.drawn_triangles.get(drawn_id).triangle();
        match self.places.get(triangle.0 as usize) {
            Some(&place) if place != Place::Crossing => place,
            _ => self.frustum.place_triangle(mesh.corners(drawn_id)),
        }
    }

    /// Without those that lie outside; what has to be clipped comes last, since it slows its neighbours down (docs/lavapipe.md).
    fn clipped_last(&self, mesh: &LuminanceMesh, drawn_triangles: &[u32]) -> Vec<u32> {
        let mut ordered = Vec::with_capacity(drawn_triangles.len());
        let mut clipped = Vec::new();
        for &id in drawn_triangles {
            match self.place(mesh, id) {
                Place::Inside => ordered.push(id),
                Place::Crossing => clipped.push(id),
                Place::Outside => {}
            }
        }
        ordered.append(&mut clipped);
        ordered
    }
}

impl Plan {
    /// Every drawn triangle of a visible face that is part of the mesh and of which the frustum holds a part.
    pub(super) fn full(mesh: &LuminanceMesh, visible: &Visible<'_>, clipping: &Clipping<'_>) -> Self {
        let mut plan = Self { clear: true, ..Self::default() };
        // By id, so that equal depths resolve alike however the set came about.
        let shown: Vec<u32> = mesh.drawn().filter(|&id| visible.shows(mesh, id)).collect();
        let drawn_triangles = clipping.clipped_last(mesh, &shown);
        if visible.all_are_covered(mesh, &shown) {
            plan.split_by_id(mesh, visible, drawn_triangles, |drawn_triangles, on_face| Step::Full {
                drawn_triangles,
                on_face,
            });
        } else {
            // A face without drawn triangles yet hides nothing: what lies behind it must not show through.
            let drawn_triangles = plan.extend(drawn_triangles);
            plan.draw(drawn_triangles, Step::Full { drawn_triangles, on_face: true });
        }
        plan.steps.push(Step::Background);
        plan
    }

    /// Every pixel of a visible face with drawn triangles, looked up.
    pub(super) fn full_lookup() -> Self {
        Self { clear: true, steps: vec![Step::Lookup { drawn_triangles: (0, 0) }, Step::Background], ..Self::default() }
    }

    /// Drawn triangles of patches where nothing was drawn yet: there is nothing to compare with.
    pub(super) fn draw_fresh(&mut self, mesh: &LuminanceMesh, visible: &Visible<'_>, batch: &Batch) {
        let fresh = batch.patches.iter().filter(|p| p.old.is_empty()).flat_map(|p| &batch.new[p.new.clone()]);
        let drawn_triangles = self.extend(fresh.copied().filter(|&id| visible.shows(mesh, id)));
        self.draw(drawn_triangles, Step::OnFace { drawn_triangles, depth: true });
    }

    /// Drawn triangles where the id image shows their face, in one draw with what was listed right before them.
    pub(super) fn draw_on_face(&mut self, (first, count): (u32, u32)) {
        let alone = self.queried.last().is_some_and(|&(_, step)| step + 1 == self.steps.len());
        match self.steps.last_mut() {
            Some(Step::OnFace { drawn_triangles, depth: false })
                if !alone && drawn_triangles.0 + drawn_triangles.1 == first =>
            {
                drawn_triangles.1 += count
            }
            _ => self.draw((first, count), Step::OnFace { drawn_triangles: (first, count), depth: false }),
        }
    }

    /// A batch's drawn triangles, whether of other values or of other triangles, against the depth that is there.
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
            patches.flat_map(|p| &batch.new[p.new.clone()]).copied().filter(|&id| visible.shows(mesh, id))
        };
        let values = batch.values.iter().copied().filter(|&id| visible.shows(mesh, id));
        self.split_by_id(mesh, visible, values.chain(of(false)), |drawn_triangles, on_face| Step::ByDepth {
            drawn_triangles,
            on_face,
            test,
        });
        for id in of(true) {
            let on_face = visible.goes_by_id(mesh, id);
            self.draw_counted([id], |drawn_triangles| Step::ByDepth { drawn_triangles, on_face, test });
        }
    }

    /// A draw and a query for each drawn triangle.
    pub(super) fn draw_counted(
        &mut self,
        drawn_triangles: impl IntoIterator<Item = u32>,
        step: impl Fn((u32, u32)) -> Step,
    ) {
        for id in drawn_triangles {
            let range = self.extend([id]);
            self.queried.push((id, self.steps.len()));
            self.steps.push(step(range));
        }
    }

    /// Drawn triangles whose pixels are counted as they are drawn, each as often as it is drawn.
    pub(super) fn counted(&self) -> impl Iterator<Item = u32> {
        let ranges = self.steps.iter().filter_map(|step| step.counts_pixels());
        ranges.flat_map(|(first, count)| self.list[first as usize..][..count as usize].iter().copied())
    }

    /// Draws that it takes.
    pub(super) fn draws(&self) -> u32 {
        self.steps.iter().filter(|&&step| step != Step::ClearStencil).count() as u32
    }

    /// Two draws: drawn triangles that go by depth, and those that look at the id image.
    pub(super) fn split_by_id(
        &mut self,
        mesh: &LuminanceMesh,
        visible: &Visible<'_>,
        drawn_triangles: impl IntoIterator<Item = u32>,
        step: impl Fn((u32, u32), bool) -> Step,
    ) {
        let (by_id, by_depth): (Vec<u32>, Vec<u32>) =
            drawn_triangles.into_iter().partition(|&id| visible.goes_by_id(mesh, id));
        for (list, on_face) in [(by_depth, false), (by_id, true)] {
            let range = self.extend(list);
            self.draw(range, step(range, on_face));
        }
    }

    pub(super) fn extend(&mut self, drawn_triangles: impl IntoIterator<Item = u32>) -> (u32, u32) {
        let first = self.list.len() as u32;
        self.list.extend(drawn_triangles);
        let count = self.list.len() as u32 - first;
        self.triangles_drawn += count;
        (first, count)
    }

    pub(super) fn draw(&mut self, (_, count): (u32, u32), step: Step) {
        if count > 0 {
            self.steps.push(step);
        }
    }
}
