//! Combine: L = L_e + k_d D + k_s S, shown (exposure, tone mapping, sRGB) or kept linear for files.

use super::depth::Depth;
use super::needs::{Constants, Needs};
use super::options::RendererOptions;
use super::targets::Targets;
use crate::error::Result;
use crate::scene::ToneMapping;
use crate::vk::commands::Load;
use crate::vk::pipeline::{ColourWrites, DepthStencil, PipelineDesc};
use crate::vk::report::{COLOUR_FORMAT, DISPLAY_FORMAT, LINEAR_FORMAT};
use crate::vk::{Bindings, Device, Pass, Pipeline, shaders};

/// The pass of that name.
pub(super) struct Combine {
    shown: Shown,
    linear: Pipeline,
    depth: Depth,
    constants: Constants,
}

/// Pipelines of one tone-mapping operator: chosen when they are made, since a rasteriser on the CPU runs all branches of a shader.
struct Shown {
    tone_mapping: ToneMapping,
    display: Pipeline,
    /// Over it, where neighbours stand in for pixels that no drawn triangle covers.
    uncovered: Pipeline,
}

impl Shown {
    fn new(
        device: &Device,
        bindings: &Bindings,
        (depth, mut constants): (Depth, Constants),
        tone_mapping: ToneMapping,
    ) -> Result<Self> {
        constants[1] = tone_mapping as u32;
        let display = PipelineDesc {
            vertex: shaders::FULLSCREEN_VERT,
            fragment: Some(shaders::COMBINE_FRAG),
            colour: &[DISPLAY_FORMAT],
            depth_stencil: Some(depth.format),
            colour_writes: ColourWrites::Replace,
            constants: &constants,
        };
        let uncovered = PipelineDesc { fragment: Some(shaders::COMBINE_UNCOVERED_FRAG), ..display };
        Ok(Self {
            tone_mapping,
            display: Pipeline::new(device, "combine", bindings, &display)?,
            uncovered: Pipeline::new(device, "combine uncovered", bindings, &uncovered)?,
        })
    }
}

impl Combine {
    /// One that shows pictures with an operator.
    pub(super) fn new(
        device: &Device,
        bindings: &Bindings,
        options: &RendererOptions,
        (needs, tone_mapping): (Needs, ToneMapping),
    ) -> Result<Self> {
        let (depth, constants) = (options.depth, needs.constants(options));
        let linear = PipelineDesc {
            vertex: shaders::FULLSCREEN_VERT,
            fragment: Some(shaders::COMBINE_LINEAR_FRAG),
            colour: &[LINEAR_FORMAT, COLOUR_FORMAT, COLOUR_FORMAT],
            depth_stencil: None,
            colour_writes: ColourWrites::Replace,
            constants: &constants,
        };
        Ok(Self {
            shown: Shown::new(device, bindings, (depth, constants), tone_mapping)?,
            linear: Pipeline::new(device, "combine linear", bindings, &linear)?,
            depth,
            constants,
        })
    }

    /// The operator that pictures are shown with.
    pub(super) const fn tone_mapping(&self) -> ToneMapping {
        self.shown.tone_mapping
    }

    /// Has pictures shown with an operator.
    pub(super) fn show_with(&mut self, operator: ToneMapping, device: &Device, bindings: &Bindings) -> Result<()> {
        if operator != self.shown.tone_mapping {
            self.shown = Shown::new(device, bindings, (self.depth, self.constants), operator)?;
        }
        Ok(())
    }

    /// The picture as displayed.
    pub(super) fn record<'a>(&'a self, pass: &Pass<'a>, bindings: &'a Bindings, targets: &'a Targets) {
        pass.render(&[&targets.display], Some(&targets.luminance_depth), Load::Keep, |draws| {
            draws.bind(&self.shown.display, bindings);
            draws.triangles(0, 1);
            draws.bind(&self.shown.uncovered, bindings);
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
