//! The one descriptor set that all passes share: a uniform buffer, the sampled images, and buffers that are read as texels.
//!
//! Everything else is reached by device address from the uniform buffer, so no pass needs a set of its own.

use super::buffer::{Buffer, Texel};
use super::device::{Device, Tracked};
use super::error;
use super::image::Image;
use crate::error::Result;
use ash::vk;

/// Set 0: binding 0 is the uniform buffer, 1, 2, … are the images, then come the texel buffers; and the pipeline layout made of it.
pub struct Bindings {
    set_layout: vk::DescriptorSetLayout,
    images: u32,
    pool: vk::DescriptorPool,
    pub(super) set: vk::DescriptorSet,
    pub(super) pipeline_layout: vk::PipelineLayout,
    tracked: Tracked,
}

impl Bindings {
    /// A set of one uniform buffer, `images` images and `texel_buffers` texel buffers, still to be written.
    ///
    /// # Errors
    /// [`crate::error::Error::Exhausted`] when memory runs out.
    pub fn new(device: &Device, name: &str, images: u32, texel_buffers: u32) -> Result<Self> {
        let core = &device.core;
        let stages = vk::ShaderStageFlags::VERTEX | vk::ShaderStageFlags::FRAGMENT;
        let binding = |number, kind| {
            let base = vk::DescriptorSetLayoutBinding::default().binding(number).descriptor_type(kind);
            base.descriptor_count(1).stage_flags(stages)
        };
        let bindings: Vec<_> = std::iter::once(binding(0, vk::DescriptorType::UNIFORM_BUFFER))
            .chain((1..=images).map(|i| binding(i, vk::DescriptorType::SAMPLED_IMAGE)))
            .chain((0..texel_buffers).map(|i| binding(1 + images + i, vk::DescriptorType::UNIFORM_TEXEL_BUFFER)))
            .collect();
        let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
        // SAFETY: see the module's contract; the owner below undoes it on every later failure.
        let set_layout = unsafe { core.raw.create_descriptor_set_layout(&info, None) }
            .map_err(|e| error(e, "creating the descriptor set layout"))?;
        let tracked = Tracked::new(core, set_layout, name);
        let mut this = Self {
            set_layout,
            images,
            pool: vk::DescriptorPool::null(),
            set: vk::DescriptorSet::null(),
            pipeline_layout: vk::PipelineLayout::null(),
            tracked,
        };
        this.allocate(name, texel_buffers)?;
        Ok(this)
    }

    fn allocate(&mut self, name: &str, texel_buffers: u32) -> Result<()> {
        let core = &self.tracked.core;
        let size = |kind, count| vk::DescriptorPoolSize::default().ty(kind).descriptor_count(count);
        let sizes = [
            size(vk::DescriptorType::UNIFORM_BUFFER, 1),
            size(vk::DescriptorType::SAMPLED_IMAGE, self.images.max(1)),
            size(vk::DescriptorType::UNIFORM_TEXEL_BUFFER, texel_buffers.max(1)),
        ];
        let pool = vk::DescriptorPoolCreateInfo::default().max_sets(1).pool_sizes(&sizes);
        let layouts = [self.set_layout];
        // SAFETY: see the module's contract.
        unsafe {
            self.pool = core.raw.create_descriptor_pool(&pool, None).map_err(|e| error(e, "creating descriptors"))?;
            let set = vk::DescriptorSetAllocateInfo::default().descriptor_pool(self.pool).set_layouts(&layouts);
            let sets = core.raw.allocate_descriptor_sets(&set).map_err(|e| error(e, "allocating descriptors"))?;
            self.set = sets.first().copied().unwrap_or_default();
            let layout = vk::PipelineLayoutCreateInfo::default().set_layouts(&layouts);
            self.pipeline_layout =
                core.raw.create_pipeline_layout(&layout, None).map_err(|e| error(e, "creating the pipeline layout"))?;
        }
        core.set_name(self.pool, name);
        core.set_name(self.set, name);
        core.set_name(self.pipeline_layout, name);
        Ok(())
    }

    /// Points binding 0 at a uniform buffer. `&mut self`: no recording uses the set.
    pub fn bind_uniform(&mut self, buffer: &Buffer) {
        let info = [vk::DescriptorBufferInfo::default().buffer(buffer.raw).range(vk::WHOLE_SIZE)];
        let write = vk::WriteDescriptorSet::default()
            .dst_set(self.set)
            .descriptor_type(vk::DescriptorType::UNIFORM_BUFFER)
            .buffer_info(&info);
        // SAFETY: the set is not in use, the buffer is alive.
        unsafe { self.tracked.core.raw.update_descriptor_sets(&[write], &[]) };
    }

    /// Points bindings 1, 2, … at images. `&mut self`: no recording uses the set.
    pub fn bind_images(&mut self, images: &[&Image]) {
        for (image, binding) in images.iter().zip(1..) {
            let info = [vk::DescriptorImageInfo::default().image_view(image.view).image_layout(image.layout())];
            let write = vk::WriteDescriptorSet::default()
                .dst_set(self.set)
                .dst_binding(binding)
                .descriptor_type(vk::DescriptorType::SAMPLED_IMAGE)
                .image_info(&info);
            // SAFETY: the set is not in use, the view is alive.
            unsafe { self.tracked.core.raw.update_descriptor_sets(&[write], &[]) };
        }
    }

    /// Points the bindings behind the images at buffers, read as such texels. `&mut self`: no recording uses the set.
    pub fn bind_texel_buffers(&mut self, buffers: &[(&Buffer, Texel)]) {
        for (&(buffer, texel), binding) in buffers.iter().zip(1 + self.images..) {
            let view = [buffer.texels(texel)];
            let write = vk::WriteDescriptorSet::default()
                .dst_set(self.set)
                .dst_binding(binding)
                .descriptor_type(vk::DescriptorType::UNIFORM_TEXEL_BUFFER)
                .texel_buffer_view(&view);
            // SAFETY: the set is not in use, the view is alive.
            unsafe { self.tracked.core.raw.update_descriptor_sets(&[write], &[]) };
        }
    }
}

impl Drop for Bindings {
    fn drop(&mut self) {
        let raw = &self.tracked.core.raw;
        // SAFETY: no recording uses them any more; null handles are ignored. The set goes with its pool.
        unsafe {
            raw.destroy_pipeline_layout(self.pipeline_layout, None);
            raw.destroy_descriptor_pool(self.pool, None);
            raw.destroy_descriptor_set_layout(self.set_layout, None);
        }
    }
}
