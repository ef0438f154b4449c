//! `id`: new triangles where the face-id image shows their face. One draw for all patches; depth is neither read nor
//! written.

use super::{Context, Shape, lacks_nothing};
use crate::pass::mesh::Batch;
use crate::pass::plan::{Plan, Step};

pub(super) const SHAPE: Shape = Shape { name: "id", stencil: false, reads_depth: false, lacks: lacks_nothing, draw };

/// Drawn triangles that wait for a query are drawn alone; the others follow the batch before in one draw.
fn draw(plan: &mut Plan, context: &Context<'_>, batch: &Batch) {
    let Context { mesh, visible, .. } = context;
    let of = |counted: bool| {
        let patches = batch.patches.iter().filter(move |p| p.counted == counted);
        patches.flat_map(|p| &batch.new[p.new.clone()]).copied().filter(|&l| visible.shows(mesh, l))
    };
    let values = batch.values.iter().copied().filter(|&l| visible.shows(mesh, l));
    let drawn_triangles = plan.extend(values.chain(of(false)));
    plan.draw_on_face(drawn_triangles);
    plan.draw_counted(of(true), |drawn_triangles| Step::OnFace { drawn_triangles, depth: false });
}
