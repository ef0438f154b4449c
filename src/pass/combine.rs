//! Combine: L = L_e + k_d D + k_s S, shown (exposure, tone mapping, sRGB) or kept linear for files.

use super::targets::Targets;
use crate::error::Result;
use crate::vk::commands::Load;
use crate::vk::pipeline::PipelineDesc;
use crate::vk::report::{DISPLAY_FORMAT, LINEAR_FORMAT};
use crate::vk::{Bindings, Device, Pass, Pipeline, shaders};

/// The pass of that name.
pub(super) struct Combine {
    display: Pipeline,
    linear: Pipeline,
}

impl Combine {
    pub(super) fn new(device: &Device, bindings: &Bindings) -> Result<Self> {
        let desc = PipelineDesc {
            vertex: shaders::FULLSCREEN_VERT,
            fragment: Some(shaders::COMBINE_FRAG),
            colour: &[DISPLAY_FORMAT],
            depth_stencil: None,
            writes_colour: true,
        };
        let linear = PipelineDesc { fragment: Some(shaders::COMBINE_LINEAR_FRAG), colour: &[LINEAR_FORMAT], ..desc };
        Ok(Self {
            display: Pipeline::new(device, "combine", bindings, &desc)?,
            linear: Pipeline::new(device, "combine linear", bindings, &linear)?,
        })
    }

    /// The picture as displayed.
    pub(super) fn record<'a>(&'a self, pass: &Pass<'a>, bindings: &'a Bindings, targets: &'a Targets) {
        pass.render(&[&targets.display], None, Load::Keep, |draws| {
            draws.bind(&self.display, bindings);
            draws.triangles(0, 1);
        });
    }

    /// The picture in linear light.
    pub(super) fn record_linear<'a>(&'a self, pass: &Pass<'a>, bindings: &'a Bindings, targets: &'a Targets) {
        pass.render(&[&targets.linear], None, Load::Keep, |draws| {
            draws.bind(&self.linear, bindings);
            draws.triangles(0, 1);
        });
    }
}
