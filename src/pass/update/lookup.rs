//! `lookup`: no triangles are drawn. Each pixel of a changed drawn triangle finds it by descending from its face, and interpolates by
//! its barycentrics: what is exact needs no test.

use super::{Context, Shape, lacks_nothing};
use crate::pass::mesh::Batch;
use crate::pass::plan::{Plan, Step};

pub(super) const SHAPE: Shape =
    Shape { name: "lookup", stencil: false, reads_depth: false, lacks: lacks_nothing, draw };

/// Which drawn triangles changed stands in their trees: one draw serves all batches of a frame.
fn draw(plan: &mut Plan, context: &Context<'_>, batch: &Batch) {
    let Context { mesh, visible, .. } = context;
    let changed = batch.values.iter().chain(&batch.new).copied().filter(|&l| visible.shows(mesh, l));
    let (first, count) = plan.extend(changed);
    match plan.steps.last_mut() {
        Some(Step::Lookup { drawn_triangles }) => drawn_triangles.1 += count,
        _ => plan.draw((first, count), Step::Lookup { drawn_triangles: (first, count) }),
    }
}
