//! `depth-less-equal`: new triangles where they are not farther than what was drawn last, and their depth written. The
//! planes of a triangle and of its parts differ in their last bits, so that about half of the pixels stay as they were.

use super::shape::{Context, Shape, lacks_nothing};
use crate::pass::mesh::Batch;
use crate::pass::plan::{DepthTest, Plan};

pub(super) const SHAPE: Shape =
    Shape { name: "depth-less-equal", stencil: false, reads_depth: true, lacks: lacks_nothing, draw };

fn draw(plan: &mut Plan, context: &Context<'_>, batch: &Batch) {
    plan.draw_by_depth(context.mesh, context.visible, batch, DepthTest::NotFarther);
}
