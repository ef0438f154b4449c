//! Combine: L = L_e + k_d D + k_s S, shown (exposure, tone mapping, sRGB) or kept linear for files.

use super::depth::Depth;
use super::targets::Targets;
use crate::error::Result;
use crate::vk::commands::Load;
use crate::vk::pipeline::{ColourWrites, DepthStencil, PipelineDesc};
use crate::vk::report::{COLOUR_FORMAT, DISPLAY_FORMAT, LINEAR_FORMAT};
use crate::vk::{Bindings, Device, Pass, Pipeline, shaders};

/// The pass of that name.
pub(super) struct Combine {
    display: Pipeline,
    /// Over it, where neighbours stand in for pixels that no drawn triangle covers.
    uncovered: Pipeline,
    linear: Pipeline,
    depth: Depth,
}

impl Combine {
    pub(super) fn new(device: &Device, bindings: &Bindings, depth: Depth) -> Result<Self> {
        let display = PipelineDesc {
            vertex: shaders::FULLSCREEN_VERT,
            fragment: Some(shaders::COMBINE_FRAG),
            colour: &[DISPLAY_FORMAT],
            depth_stencil: Some(depth.format),
            colour_writes: ColourWrites::Replace,
        };
        let uncovered = PipelineDesc { fragment: Some(shaders::COMBINE_UNCOVERED_FRAG), ..display };
        let linear = PipelineDesc {
            fragment: Some(shaders::COMBINE_LINEAR_FRAG),
            colour: &[LINEAR_FORMAT, COLOUR_FORMAT, COLOUR_FORMAT],
            depth_stencil: None,
            ..display
        };
        Ok(Self {
            display: Pipeline::new(device, "combine", bindings, &display)?,
            uncovered: Pipeline::new(device, "combine uncovered", bindings, &uncovered)?,
            linear: Pipeline::new(device, "combine linear", bindings, &linear)?,
            depth,
        })
    }

    /// The picture as displayed.
    pub(super) fn record<'a>(&'a self, pass: &Pass<'a>, bindings: &'a Bindings, targets: &'a Targets) {
        pass.render(&[&targets.display], Some(&targets.luminance_depth), Load::Keep, |draws| {
            draws.bind(&self.display, bindings);
            draws.triangles(0, 1);
            draws.bind(&self.uncovered, bindings);
            // Where the luminance pass has left no depth: no drawn triangle covers a face, or was drawn without depth.
            draws.depth_stencil(DepthStencil { write: false, ..self.depth.nearer() });
            draws.triangles(0, 1);
        });
    }

    /// The picture in linear light, and D and S with their holes filled.
    pub(super) fn record_linear<'a>(&'a self, pass: &Pass<'a>, bindings: &'a Bindings, targets: &'a Targets) {
        let images = [&targets.linear, &targets.filled_diffuse, &targets.filled_specular];
        pass.render(&images, None, Load::Keep, |draws| {
            draws.bind(&self.linear, bindings);
            draws.triangles(0, 1);
        });
    }
}
