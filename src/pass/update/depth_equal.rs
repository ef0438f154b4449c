//! `depth-equal`: new triangles where they are exactly as far as what was drawn last, and their depth written. It misses what
//! `depth-less-equal` misses on one side of the old plane, and the same again on the other.

use super::shape::{Context, Shape, lacks_nothing};
use crate::pass::mesh::Batch;
use crate::pass::plan::{DepthTest, Plan};

pub(super) const SHAPE: Shape =
    Shape { name: "depth-equal", stencil: false, reads_depth: true, lacks: lacks_nothing, draw };

fn draw(plan: &mut Plan, context: &Context<'_>, batch: &Batch) {
    plan.draw_by_depth(context.mesh, context.visible, batch, DepthTest::Equal);
}
