//! Colour: k_d, k_s and L_e of every pixel, looked up from the id image.
//!
//! Full-screen, not by drawing the geometry again: 2 to 11 times cheaper (docs/lavapipe.md). L_e is looked up here
//! rather than in combine, since it changes with the camera alone.

use super::needs::Needs;
use super::options::RendererOptions;
use super::targets::Targets;
use crate::error::Result;
use crate::vk::commands::Load;
use crate::vk::pipeline::{ColourWrites, PipelineDesc};
use crate::vk::report::COLOUR_FORMAT;
use crate::vk::{Bindings, Device, Pass, Pipeline, shaders};

/// The pass of that name.
pub(super) struct Colour {
    pipeline: Pipeline,
}

impl Colour {
    pub(super) fn new(device: &Device, bindings: &Bindings, options: &RendererOptions, needs: Needs) -> Result<Self> {
        let desc = PipelineDesc {
            vertex: shaders::FULLSCREEN_VERT,
            fragment: Some(shaders::COLOUR_FRAG),
            colour: &[COLOUR_FORMAT; 3],
            depth_stencil: None,
            colour_writes: ColourWrites::Replace,
            constants: &needs.constants(options),
        };
        Ok(Self { pipeline: Pipeline::new(device, "colour", bindings, &desc)? })
    }

    pub(super) fn record<'a>(&'a self, pass: &Pass<'a>, bindings: &'a Bindings, targets: &'a Targets) {
        let images = [&targets.kd, &targets.ks, &targets.emission];
        pass.render(&images, None, Load::Keep, |draws| {
            draws.bind(&self.pipeline, bindings);
            draws.triangles(0, 1);
        });
    }
}
