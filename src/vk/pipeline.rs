//! Graphics pipelines. Fixed-function state that varies within a pass is dynamic, so that few pipelines do.

use super::descriptor::Bindings;
use super::device::{Device, DeviceCore, Tracked};
use super::error;
use super::image::has_stencil;
use crate::error::Result;
use ash::vk;
use std::sync::Arc;

/// What a pipeline is made of.
#[derive(Clone, Copy)]
pub struct PipelineDesc<'a> {
    /// SPIR-V of the vertex stage.
    pub vertex: &'a [u32],
    /// SPIR-V of the fragment stage; `None` writes depth and stencil only.
    pub fragment: Option<&'a [u32]>,
    /// Formats of the colour attachments.
    pub colour: &'a [vk::Format],
    /// Format of the depth (and stencil) attachment, if there is one.
    pub depth_stencil: Option<vk::Format>,
    /// How colour is written.
    pub colour_writes: ColourWrites,
    /// Values of the shaders' specialisation constants 0, 1, …
    pub constants: &'a [u32],
}

/// How a pipeline writes colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ColourWrites {
    /// Not at all.
    Off,
    /// In place of what is there.
    Replace,
    /// In place of what is there, but for the first attachment's alpha, to which it adds: with an alpha of 1 it counts how
    /// often each pixel was written. Needs the feature independentBlend.
    AddFirstAlpha,
}

impl ColourWrites {
    /// The blend state of attachment number `index`.
    fn state(self, index: usize) -> vk::PipelineColorBlendAttachmentState {
        let mask = if self == Self::Off { vk::ColorComponentFlags::empty() } else { vk::ColorComponentFlags::RGBA };
        let state = vk::PipelineColorBlendAttachmentState::default().color_write_mask(mask);
        if self != Self::AddFirstAlpha || index > 0 {
            return state;
        }
        state
            .blend_enable(true)
            .src_color_blend_factor(vk::BlendFactor::ONE)
            .dst_color_blend_factor(vk::BlendFactor::ZERO)
            .src_alpha_blend_factor(vk::BlendFactor::ONE)
            .dst_alpha_blend_factor(vk::BlendFactor::ONE)
    }
}

/// Depth and stencil state, set while recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthStencil {
    /// How a fragment's depth compares with the image's for the fragment to pass.
    pub compare: vk::CompareOp,
    /// Whether passing fragments write their depth.
    pub write: bool,
    /// Stencil: compare operation, what passing does, reference; `None` turns it off.
    pub stencil: Option<(vk::CompareOp, vk::StencilOp, u32)>,
    /// What is added to a fragment's depth; `None` for nothing.
    pub bias: Option<DepthBias>,
}

/// What is added to the depth of fragments, away from 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthBias {
    /// In least differences that the format resolves.
    pub constant: f32,
    /// In the triangle's larger change of depth from a pixel to the next.
    pub slope: f32,
}

/// A graphics pipeline: triangle lists, vertices pulled by index, no culling (sides are told apart in the shader).
pub struct Pipeline {
    pub(super) raw: vk::Pipeline,
    pub(super) has_depth_stencil: bool,
    tracked: Tracked,
}

impl Pipeline {
    /// Compiles a pipeline over the bindings' layout.
    ///
    /// # Errors
    /// [`crate::error::Error::Exhausted`] when memory runs out.
    pub fn new(device: &Device, name: &str, bindings: &Bindings, desc: &PipelineDesc<'_>) -> Result<Self> {
        let core = &device.core;
        let vertex = Module::new(core, desc.vertex)?;
        let fragment = desc.fragment.map(|code| Module::new(core, code)).transpose()?;
        let entries: Vec<_> = (0..desc.constants.len() as u32).map(constant).collect();
        let constants =
            vk::SpecializationInfo::default().map_entries(&entries).data(bytemuck::cast_slice(desc.constants));
        let stages: Vec<_> = std::iter::once(vertex.stage(vk::ShaderStageFlags::VERTEX))
            .chain(fragment.as_ref().map(|f| f.stage(vk::ShaderStageFlags::FRAGMENT)))
            .map(|stage| stage.specialization_info(&constants))
            .collect();
        let raw = create(core, &stages, bindings.pipeline_layout, desc, name)?;
        let has_depth_stencil = desc.depth_stencil.is_some();
        Ok(Self { raw, has_depth_stencil, tracked: Tracked::new(core, raw, name) })
    }
}

impl Drop for Pipeline {
    fn drop(&mut self) {
        // SAFETY: no recording uses it any more.
        unsafe { self.tracked.core.raw.destroy_pipeline(self.raw, None) };
    }
}

/// Where the value of a constant lies in [`PipelineDesc::constants`].
const fn constant(id: u32) -> vk::SpecializationMapEntry {
    vk::SpecializationMapEntry { constant_id: id, offset: 4 * id, size: 4 }
}

/// A shader module, needed only while pipelines are made.
struct Module {
    raw: vk::ShaderModule,
    core: Arc<DeviceCore>,
}

impl Module {
    fn new(core: &Arc<DeviceCore>, code: &[u32]) -> Result<Self> {
        #[cfg(feature = "shader-reload")]
        let edited = super::edited_shaders::in_place_of(code);
        #[cfg(feature = "shader-reload")]
        let code = edited.as_deref().unwrap_or(code);
        let info = vk::ShaderModuleCreateInfo::default().code(code);
        // SAFETY: `code` is SPIR-V that glslang made and checked.
        let raw =
            unsafe { core.raw.create_shader_module(&info, None) }.map_err(|e| error(e, "creating a shader module"))?;
        Ok(Self { raw, core: Arc::clone(core) })
    }

    fn stage(&self, stage: vk::ShaderStageFlags) -> vk::PipelineShaderStageCreateInfo<'_> {
        vk::PipelineShaderStageCreateInfo::default().stage(stage).module(self.raw).name(c"main")
    }
}

impl Drop for Module {
    fn drop(&mut self) {
        // SAFETY: pipelines keep what they need of their modules.
        unsafe { self.core.raw.destroy_shader_module(self.raw, None) };
    }
}

fn create(
    core: &DeviceCore,
    stages: &[vk::PipelineShaderStageCreateInfo<'_>],
    layout: vk::PipelineLayout,
    desc: &PipelineDesc<'_>,
    name: &str,
) -> Result<vk::Pipeline> {
    let vertex_input = vk::PipelineVertexInputStateCreateInfo::default();
    let assembly = vk::PipelineInputAssemblyStateCreateInfo::default().topology(vk::PrimitiveTopology::TRIANGLE_LIST);
    let viewport = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
    let raster = vk::PipelineRasterizationStateCreateInfo::default()
        .polygon_mode(vk::PolygonMode::FILL)
        .cull_mode(vk::CullModeFlags::NONE)
        .front_face(vk::FrontFace::COUNTER_CLOCKWISE)
        .line_width(1.0);
    let samples = vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(vk::SampleCountFlags::TYPE_1);
    let stencil = vk::StencilOpState::default().compare_mask(0xff).write_mask(0xff);
    let depth = vk::PipelineDepthStencilStateCreateInfo::default()
        .depth_test_enable(desc.depth_stencil.is_some())
        .front(stencil)
        .back(stencil);
    let attachments: Vec<_> = (0..desc.colour.len()).map(|i| desc.colour_writes.state(i)).collect();
    let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&attachments);
    let mut states = vec![vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
    if desc.depth_stencil.is_some() {
        states.extend([
            vk::DynamicState::DEPTH_COMPARE_OP,
            vk::DynamicState::DEPTH_WRITE_ENABLE,
            vk::DynamicState::STENCIL_TEST_ENABLE,
            vk::DynamicState::STENCIL_OP,
            vk::DynamicState::STENCIL_REFERENCE,
            vk::DynamicState::DEPTH_BIAS_ENABLE,
            vk::DynamicState::DEPTH_BIAS,
        ]);
    }
    let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&states);
    let depth_format = desc.depth_stencil.unwrap_or_default();
    let stencil_format = if has_stencil(depth_format) { depth_format } else { vk::Format::UNDEFINED };
    let mut rendering = vk::PipelineRenderingCreateInfo::default()
        .color_attachment_formats(desc.colour)
        .depth_attachment_format(depth_format)
        .stencil_attachment_format(stencil_format);
    let info = vk::GraphicsPipelineCreateInfo::default()
        .stages(stages)
        .vertex_input_state(&vertex_input)
        .input_assembly_state(&assembly)
        .viewport_state(&viewport)
        .rasterization_state(&raster)
        .multisample_state(&samples)
        .depth_stencil_state(&depth)
        .color_blend_state(&blend)
        .dynamic_state(&dynamic)
        .layout(layout)
        .push_next(&mut rendering);
    // SAFETY: modules and layout are alive; everything `info` points to lives in this function.
    let made = unsafe { core.raw.create_graphics_pipelines(vk::PipelineCache::null(), &[info], None) };
    made.map_err(|(_, e)| error(e, &format!("creating the pipeline `{name}`")))?
        .first()
        .copied()
        .ok_or_else(|| error(vk::Result::ERROR_UNKNOWN, &format!("creating the pipeline `{name}`")))
}
