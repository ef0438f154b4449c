//! `stencil`, the paper's way [FP03 §4.1.3]: the old triangles of a patch mark its pixels by depth EQUAL, the new ones are
//! drawn where they did, over any depth, and leave their own.
//!
//! Patches that may overlap on the screen need references of their own: their faces are coloured, and two draws a colour
//! serve all patches (lavapipe.md 2).

use super::{Context, Shape, lacks_nothing};
use crate::pass::colouring::{COLOURS, Cells, Colouring};
use crate::pass::mesh::{Batch, PendingPatch};
use crate::pass::plan::{Plan, Step};

pub(super) const SHAPE: Shape = Shape { name: "stencil", stencil: true, reads_depth: true, lacks: lacks_nothing, draw };

fn draw(plan: &mut Plan, context: &Context<'_>, batch: &Batch) {
    values_and_fresh(plan, context, batch);
    for by_colour in coloured(context, batch) {
        mark_and_draw(plan, batch, &by_colour);
    }
}

/// What needs no marks: drawn triangles with other values, whose depth is there to be found, and those where nothing was drawn yet.
pub(super) fn values_and_fresh(plan: &mut Plan, context: &Context<'_>, batch: &Batch) {
    let Context { mesh, visible, .. } = context;
    let values = batch.values.iter().copied().filter(|&l| visible.shows(mesh, l));
    plan.split_by_id(mesh, visible, values, |drawn_triangles, on_face| Step::Values { drawn_triangles, on_face });
    plan.draw_fresh(mesh, visible, batch);
}

/// The patches with old triangles by colour, in groups of as many as there are colours for. Those of one face share a colour:
/// they meet at edges at most, where what one of them draws of another's is the same surface.
pub(super) fn coloured<'b>(context: &Context<'_>, batch: &'b Batch) -> Vec<Vec<Vec<&'b PendingPatch>>> {
    let Context { mesh, visible, projector, size } = context;
    let shown = |p: &&PendingPatch| batch.new[p.new.clone()].iter().any(|&l| visible.shows(mesh, l));
    let face = |p: &PendingPatch| mesh.drawn_triangles.get(batch.new[p.new.start]).face;
    let mut patches: Vec<_> = batch.patches.iter().filter(|p| !p.old.is_empty()).filter(shown).collect();
    patches.sort_by_key(|p| face(p));
    let mut waiting: Vec<&[&PendingPatch]> = patches.chunk_by(|p, q| face(p) == face(q)).collect();
    let cells = |patch: &&PendingPatch| {
        let new = batch.new[patch.new.clone()].iter().flat_map(|&l| mesh.corners(l));
        projector.cells(patch.old.iter().flatten().copied().chain(new))
    };
    let mut groups = Vec::new();
    while !waiting.is_empty() {
        let mut colouring = Colouring::new(*size);
        let mut by_colour = vec![Vec::new(); COLOURS as usize];
        waiting.retain(|patches| {
            let cells: Vec<Cells> = patches.iter().map(cells).collect();
            let colour = colouring.take(&cells);
            colour.inspect(|&colour| by_colour[colour as usize].extend_from_slice(patches)).is_none()
        });
        groups.push(by_colour);
    }
    groups
}

/// All marks first, then all new triangles.
fn mark_and_draw(plan: &mut Plan, batch: &Batch, by_colour: &[Vec<&PendingPatch>]) {
    plan.steps.push(Step::ClearStencil);
    for (reference, patches) in (1..).zip(by_colour) {
        let first = plan.marks.len() as u32 / 3;
        plan.marks.extend(patches.iter().flat_map(|p| p.old.iter().flatten()));
        let triangles = (first, plan.marks.len() as u32 / 3 - first);
        plan.draw(triangles, Step::Mark { triangles, reference });
    }
    for (reference, patches) in (1..).zip(by_colour) {
        let of = |counted: bool| {
            let patches = patches.iter().filter(move |p| p.counted == counted);
            patches.flat_map(|p| batch.new[p.new.clone()].iter().copied())
        };
        let drawn_triangles = plan.extend(of(false));
        plan.draw(drawn_triangles, Step::Marked { drawn_triangles, reference });
        plan.draw_counted(of(true), |drawn_triangles| Step::Marked { drawn_triangles, reference });
    }
}
