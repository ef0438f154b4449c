//! `full`: every visible drawn triangle is drawn anew whatever changed. What the other modes are measured against.

use super::{Context, Shape, lacks_nothing};
use crate::pass::mesh::Batch;
use crate::pass::plan::Plan;

pub(super) const SHAPE: Shape = Shape { name: "full", stencil: false, reads_depth: false, lacks: lacks_nothing, draw };

/// The frame plans a full redraw instead of batches.
fn draw(_: &mut Plan, _: &Context<'_>, _: &Batch) {}
