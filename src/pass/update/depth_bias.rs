//! `depth-bias`: new triangles, brought nearer by as much as the planes of a triangle and of its parts may differ, where they are
//! not farther than what was drawn first: depth is not written, so that the bias does not add up from level to level.

use super::shape::{Context, Shape, lacks_nothing};
use crate::pass::mesh::Batch;
use crate::pass::plan::{DepthTest, Plan};

pub(super) const SHAPE: Shape =
    Shape { name: "depth-bias", stencil: false, reads_depth: true, lacks: lacks_nothing, draw };

fn draw(plan: &mut Plan, context: &Context<'_>, batch: &Batch) {
    plan.draw_by_depth(context.mesh, context.visible, batch, DepthTest::Biased);
}
