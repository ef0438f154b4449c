//! `stencil-export`: as `stencil`, but each fragment brings its patch's reference (VK_EXT_shader_stencil_export), so that two
//! draws serve the patches of all colours.

use super::stencil::{coloured, values_and_fresh};
use super::{Context, Shape};
use crate::pass::mesh::{Batch, PendingPatch};
use crate::pass::plan::{Plan, Step};
use crate::vk::DeviceReport;

pub(super) const SHAPE: Shape = Shape { name: "stencil-export", stencil: true, reads_depth: true, lacks, draw };

fn lacks(device: &DeviceReport) -> Option<&'static str> {
    (!device.optional.stencil_export).then_some("the extension VK_EXT_shader_stencil_export")
}

fn draw(plan: &mut Plan, context: &Context<'_>, batch: &Batch) {
    values_and_fresh(plan, context, batch);
    for by_colour in coloured(context, batch) {
        mark_and_draw(plan, batch, &by_colour);
    }
}

fn mark_and_draw(plan: &mut Plan, batch: &Batch, by_colour: &[Vec<&PendingPatch>]) {
    plan.steps.push(Step::ClearStencil);
    let first = plan.marks.len() as u32 / 3;
    plan.mark_references.resize(first as usize, 0);
    for (reference, patch) in numbered(by_colour) {
        plan.marks.extend(patch.old.iter().flatten());
        plan.mark_references.extend(patch.old.iter().map(|_| reference));
    }
    let triangles = (first, plan.marks.len() as u32 / 3 - first);
    plan.draw(triangles, Step::MarkExported { triangles });
    let drawn_with = |patch: &PendingPatch| batch.new[patch.new.clone()].iter().copied();
    let (first, before) = (plan.list.len() as u32, plan.triangles_drawn);
    plan.list_references.resize(first as usize, 0);
    for (reference, patch) in numbered(by_colour).filter(|(_, p)| !p.counted) {
        plan.extend(drawn_with(patch));
        plan.list_references.resize(plan.list.len(), reference);
    }
    let drawn_triangles = (first, plan.triangles_drawn - before);
    plan.draw(drawn_triangles, Step::MarkedExported { drawn_triangles });
    for (reference, patch) in numbered(by_colour).filter(|(_, p)| p.counted) {
        plan.draw_counted(drawn_with(patch), |drawn_triangles| Step::MarkedExported { drawn_triangles });
        plan.list_references.resize(plan.list.len(), reference);
    }
}

/// The patches with the references of their colours.
fn numbered<'b>(by_colour: &[Vec<&'b PendingPatch>]) -> impl Iterator<Item = (u32, &'b PendingPatch)> {
    (1..).zip(by_colour).flat_map(|(reference, patches)| patches.iter().map(move |&p| (reference, p)))
}
