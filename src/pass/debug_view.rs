//! Debug views: an image of the frame, or a number of each drawn triangle, shown in place of the picture. Nothing is made before one
//! is asked for.

use super::device_array::DeviceArray;
use super::targets::Targets;
use crate::error::Result;
use crate::scene::{Display, ToneMapping};
use crate::vk::buffer::Texel;
use crate::vk::commands::Load;
use crate::vk::pipeline::{ColourWrites, PipelineDesc};
use crate::vk::report::DISPLAY_FORMAT;
use crate::vk::{Bindings, Buffer, Device, Image, Pass, Pipeline, shaders};
use glam::Vec4;
use std::sync::Arc;

/// What is shown in place of the picture; the numbers are those of `glsl/debug_view.frag`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DebugImage {
    /// k_d as it is, 1 white.
    Kd = 0,
    /// k_s likewise.
    Ks = 1,
    /// L_e, displayed as the picture is.
    Emission = 2,
    /// What stands for D, displayed as the picture is.
    Diffuse = 3,
    /// What stands for S, displayed as the picture is.
    Specular = 4,
    /// A colour for each face.
    Faces = 5,
    /// The number of each drawn triangle as a level of refinement.
    Level = 6,
    /// The bits of a float for each drawn triangle, an error relative to the image's mean.
    Error = 7,
    /// What stands for D as [`crate::refine::update::Shown::Knowledge`].
    Knowledge = 8,
    /// The picture with the lines of the drawn triangles.
    Mesh = 9,
    /// The picture with lines where the numbers of drawn triangles change.
    LightMesh = 10,
    /// The reference, displayed as the picture is.
    Reference = 11,
    /// The left half of the picture and the right half of the reference.
    Beside = 12,
}

/// The debug view, if there is one.
#[derive(Default)]
pub(super) struct Debug {
    /// What is shown in place of the picture.
    pub image: Option<DebugImage>,
    made: Option<Made>,
}

/// What a debug view needs on the device.
struct Made {
    bindings: Bindings,
    /// A number for each drawn triangle.
    values: DeviceArray<u32>,
    /// Radiance and coverage of each pixel.
    reference: DeviceArray<Vec4>,
    /// The images that are bound, by one that goes with them.
    bound: Option<Arc<Image>>,
    /// What it shows, and with which operator.
    pipeline: Option<(DebugImage, ToneMapping, Pipeline)>,
}

impl Made {
    fn new(device: &Device, uniform: &Buffer) -> Result<Self> {
        let mut bindings = Bindings::new(device, "debug view", 7, 2)?;
        bindings.bind_uniform(uniform);
        let (values, reference) = (DeviceArray::new(device, "debug values")?, DeviceArray::new(device, "reference")?);
        Ok(Self { bindings, values, reference, bound: None, pipeline: None })
    }

    fn prepare(&mut self, device: &Device, targets: &Targets, image: DebugImage, operator: ToneMapping) -> Result<()> {
        self.values.flush(device)?;
        self.reference.flush(device)?;
        let buffers = [(self.values.buffer(), Texel::Word), (self.reference.buffer(), Texel::Quad)];
        self.bindings.bind_texel_buffers(&buffers);
        if self.bound.as_ref().is_none_or(|bound| !Arc::ptr_eq(bound, &targets.display)) {
            let [ids, kd, ks, emission, diffuse, specular] = targets.sampled();
            self.bindings.bind_images(&[ids, kd, ks, emission, diffuse, specular, &targets.drawn_ids]);
            self.bound = Some(Arc::clone(&targets.display));
        }
        if self.pipeline.as_ref().is_none_or(|(shown, with, _)| (*shown, *with) != (image, operator)) {
            let desc = PipelineDesc {
                vertex: shaders::FULLSCREEN_VERT,
                fragment: Some(shaders::DEBUG_VIEW_FRAG),
                colour: &[DISPLAY_FORMAT],
                depth_stencil: None,
                colour_writes: ColourWrites::Replace,
                constants: &[0, operator as u32, image as u32],
            };
            self.pipeline = Some((image, operator, Pipeline::new(device, "debug view", &self.bindings, &desc)?));
        }
        Ok(())
    }
}

impl Debug {
    /// Makes what is needed to show a view with these settings, if there is one.
    pub(super) fn prepare(
        &mut self,
        device: &Device,
        uniform: &Buffer,
        targets: &Targets,
        display: Display,
    ) -> Result<()> {
        let Some(image) = self.image else { return Ok(()) };
        self.made(device, uniform)?.prepare(device, targets, image, display.tone_mapping)
    }

    /// The numbers of drawn triangles.
    pub(super) fn values(&mut self, device: &Device, uniform: &Buffer) -> Result<&mut DeviceArray<u32>> {
        Ok(&mut self.made(device, uniform)?.values)
    }

    /// Radiance and coverage of each pixel of the reference.
    pub(super) fn reference(&mut self, device: &Device, uniform: &Buffer) -> Result<&mut DeviceArray<Vec4>> {
        Ok(&mut self.made(device, uniform)?.reference)
    }

    fn made(&mut self, device: &Device, uniform: &Buffer) -> Result<&mut Made> {
        let made = match self.made.take() {
            Some(made) => made,
            None => Made::new(device, uniform)?,
        };
        Ok(self.made.insert(made))
    }

    /// Records the view in place of the picture; whether there is one.
    pub(super) fn record<'a>(&'a self, pass: &Pass<'a>, targets: &'a Targets) -> bool {
        let made = self.made.as_ref().filter(|_| self.image.is_some());
        let Some((made, (.., pipeline))) = made.and_then(|made| Some((made, made.pipeline.as_ref()?))) else {
            return false;
        };
        pass.render(&[&targets.display], None, Load::Keep, |draws| {
            draws.bind(pipeline, &made.bindings);
            draws.triangles(0, 1);
        });
        true
    }
}
