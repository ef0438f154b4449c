//! Luminance: D and S of the leaves, all of them or those that changed (method.md 7).

use super::plan::{Plan, Step};
use super::targets::Targets;
use super::visibility::NEARER;
use crate::error::Result;
use crate::vk::commands::{Draws, Load};
use crate::vk::pipeline::{DepthStencil, PipelineDesc};
use crate::vk::report::{COLOUR_FORMAT, ID_FORMAT};
use crate::vk::{Bindings, Device, OcclusionQueries, Pass, Pipeline, shaders};
use ash::vk::{CompareOp, StencilOp};

/// The pass of that name. Depth and stencil state are dynamic: four pipelines serve all update modes.
pub(super) struct Luminance {
    /// All fragments that pass the tests.
    plain: Pipeline,
    /// Only fragments where the id image shows the leaf's face.
    on_face: Pipeline,
    /// Depth and stencil only.
    mark: Pipeline,
    /// Depth only, where the id image shows nothing.
    background: Pipeline,
}

impl Luminance {
    pub(super) fn new(device: &Device, bindings: &Bindings) -> Result<Self> {
        let plain = PipelineDesc {
            vertex: shaders::LUMINANCE_VERT,
            fragment: Some(shaders::LUMINANCE_FRAG),
            colour: &[COLOUR_FORMAT, COLOUR_FORMAT, ID_FORMAT],
            depth_stencil: Some(device.depth_stencil_format()),
            writes_colour: true,
        };
        let on_face = PipelineDesc { fragment: Some(shaders::LUMINANCE_ON_FACE_FRAG), ..plain };
        let mark = PipelineDesc { vertex: shaders::MARK_VERT, fragment: None, writes_colour: false, ..plain };
        let background =
            PipelineDesc { vertex: shaders::FULLSCREEN_VERT, fragment: Some(shaders::BACKGROUND_FRAG), ..mark };
        Ok(Self {
            plain: Pipeline::new(device, "luminance", bindings, &plain)?,
            on_face: Pipeline::new(device, "luminance on face", bindings, &on_face)?,
            mark: Pipeline::new(device, "luminance mark", bindings, &mark)?,
            background: Pipeline::new(device, "background", bindings, &background)?,
        })
    }

    /// Records the draws of a plan.
    pub(super) fn record<'a>(
        &'a self,
        pass: &Pass<'a>,
        bindings: &'a Bindings,
        targets: &'a Targets,
        plan: &Plan,
        queries: Option<&'a OcclusionQueries>,
    ) {
        if let Some(queries) = queries.filter(|_| !plan.queried.is_empty()) {
            pass.reset_queries(queries);
        }
        let load = if plan.clear { Load::Clear } else { Load::Keep };
        let images = [&targets.diffuse, &targets.specular, &targets.leaf_ids];
        pass.render(&images, Some(&targets.luminance_depth), load, |draws| {
            let mut queried = (0..).zip(&plan.queried).peekable();
            for (number, &step) in plan.steps.iter().enumerate() {
                match (queries, queried.next_if(|(_, (_, counted))| *counted == number)) {
                    (Some(queries), Some((query, _))) => {
                        draws.counted(queries, query, || self.step(draws, bindings, step));
                    }
                    _ => self.step(draws, bindings, step),
                }
            }
        });
    }

    fn step<'a>(&'a self, draws: &Draws<'_, 'a>, bindings: &'a Bindings, step: Step) {
        let unless_masked = |on_face| if on_face { &self.on_face } else { &self.plain };
        let depth = |compare, write, stencil| DepthStencil { compare, write, stencil };
        let (pipeline, state, (first, count)) = match step {
            Step::ClearStencil => return draws.clear_stencil(),
            Step::Full { leaves, on_face } => (unless_masked(on_face), NEARER, leaves),
            Step::Background => (&self.background, NEARER, (0, 1)),
            Step::Values { leaves, on_face } => (unless_masked(on_face), depth(CompareOp::EQUAL, false, None), leaves),
            Step::OnFace { leaves, depth: write } => (&self.on_face, depth(CompareOp::ALWAYS, write, None), leaves),
            Step::Mark { triangles, reference } => {
                let stencil = Some((CompareOp::ALWAYS, StencilOp::REPLACE, reference));
                (&self.mark, depth(CompareOp::EQUAL, false, stencil), triangles)
            }
            Step::Marked { leaves, reference } => {
                // Depth must be written, or the next level's marks find the plane of the level before.
                let stencil = Some((CompareOp::EQUAL, StencilOp::ZERO, reference));
                (&self.plain, depth(CompareOp::ALWAYS, true, stencil), leaves)
            }
        };
        draws.bind(pipeline, bindings);
        draws.depth_stencil(state);
        draws.triangles(first, count);
    }
}
