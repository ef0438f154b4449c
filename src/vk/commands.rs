//! Recording and submitting work.
//!
//! Opening a pass from one name sets its debug label and timestamp; closing it ends both and places the barrier, so
//! no pass can forget one. A recording borrows what it records, and submitting waits for the device.

use super::barrier;
use super::buffer::{Buffer, BufferUse};
use super::descriptor::Bindings;
use super::device::{Device, Tracked};
use super::error;
use super::image::Image;
use super::pipeline::{DepthBias, DepthStencil, Pipeline};
use super::query::OcclusionQueries;
use super::timestamp::{PassTimes, Timestamps};
use crate::error::Result;
use crate::trace;
use ash::vk;
use bytemuck::NoUninit;
use std::cell::Cell;
use std::ffi::CString;

/// Staging memory used at a time.
const STAGING_BYTES: usize = 64 << 20;

/// A command buffer with its fence and clock.
pub struct Commands {
    pool: vk::CommandPool,
    buffer: vk::CommandBuffer,
    fence: vk::Fence,
    timestamps: Option<Timestamps>,
    tracked: Tracked,
}

impl Commands {
    /// A command buffer named `name`.
    ///
    /// # Errors
    /// [`crate::error::Error::Exhausted`] when memory runs out.
    pub fn new(device: &Device, name: &str) -> Result<Self> {
        let core = &device.core;
        let info = vk::CommandPoolCreateInfo::default().queue_family_index(core.queue_family);
        // SAFETY: see the module's contract; the owner below undoes it on every later failure.
        let pool =
            unsafe { core.raw.create_command_pool(&info, None) }.map_err(|e| error(e, "creating a command pool"))?;
        let tracked = Tracked::new(core, pool, name);
        let (buffer, fence) = (vk::CommandBuffer::null(), vk::Fence::null());
        let mut commands = Self { pool, buffer, fence, timestamps: None, tracked };
        let allocate = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(1);
        // SAFETY: as above.
        unsafe {
            let buffers = core.raw.allocate_command_buffers(&allocate).map_err(|e| error(e, "allocating commands"))?;
            commands.buffer = buffers.first().copied().unwrap_or_default();
            let fence = core.raw.create_fence(&vk::FenceCreateInfo::default(), None);
            commands.fence = fence.map_err(|e| error(e, "creating a fence"))?;
        }
        core.set_name(commands.buffer, name);
        core.set_name(commands.fence, name);
        commands.timestamps = Timestamps::new(device, name)?;
        Ok(commands)
    }

    /// Starts a recording; one that was dropped without submitting is forgotten.
    ///
    /// # Errors
    /// [`crate::error::Error::Exhausted`] when memory runs out.
    pub fn begin(&mut self) -> Result<Recording<'_>> {
        let info = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        let raw = &self.tracked.core.raw;
        // SAFETY: the last submission was waited for, so the pool is idle; `&mut self` makes access exclusive.
        unsafe {
            raw.reset_command_pool(self.pool, vk::CommandPoolResetFlags::empty())
                .map_err(|e| error(e, "resetting commands"))?;
            raw.begin_command_buffer(self.buffer, &info).map_err(|e| error(e, "recording commands"))?;
        }
        if let Some(timestamps) = &self.timestamps {
            timestamps.reset(self.buffer);
        }
        Ok(Recording { commands: self, passes: Vec::new() })
    }

    /// Writes `data` at `offset` bytes of a buffer, directly where the host can, else through staging memory.
    ///
    /// # Errors
    /// [`crate::error::Error::DeviceLost`], [`crate::error::Error::Exhausted`] when memory runs out.
    pub fn upload<T: NoUninit>(&mut self, device: &Device, to: &mut Buffer, offset: u64, data: &[T]) -> Result<()> {
        if to.is_mapped() {
            return to.write(offset, data);
        }
        let bytes: &[u8] = bytemuck::cast_slice(data);
        let mut staging = Buffer::new(device, "staging", bytes.len().min(STAGING_BYTES) as u64, BufferUse::Stream)?;
        for (i, chunk) in bytes.chunks(STAGING_BYTES).enumerate() {
            staging.write(0, chunk)?;
            let mut recording = self.begin()?;
            let start = offset + (i * STAGING_BYTES) as u64;
            recording.pass("upload", |pass| pass.copy_buffer(&staging, to, start, chunk.len() as u64));
            recording.submit()?;
        }
        Ok(())
    }

    fn wait(&self) -> Result<()> {
        let raw = &self.tracked.core.raw;
        // SAFETY: the fence was just submitted; after the wait nothing uses it.
        unsafe {
            raw.wait_for_fences(&[self.fence], true, u64::MAX).map_err(|e| error(e, "waiting for the device"))?;
            raw.reset_fences(&[self.fence]).map_err(|e| error(e, "resetting a fence"))
        }
    }
}

impl Drop for Commands {
    fn drop(&mut self) {
        let raw = &self.tracked.core.raw;
        // SAFETY: every submission was waited for (a lost device counts as done); null handles are ignored.
        unsafe {
            raw.destroy_fence(self.fence, None);
            raw.destroy_command_pool(self.pool, None);
        }
    }
}

/// Commands being recorded; `'a` is how long what they use must live, at least until they are submitted.
pub struct Recording<'a> {
    commands: &'a Commands,
    passes: Vec<&'static str>,
}

impl<'a> Recording<'a> {
    /// Records a pass: label, timestamps, and the barrier that ends it.
    pub fn pass(&mut self, name: &'static str, record: impl FnOnce(&Pass<'a>)) {
        let (core, buffer) = (&self.commands.tracked.core, self.commands.buffer);
        let label = CString::new(name).unwrap_or_default();
        if let Some(debug) = &core.debug {
            // SAFETY: the buffer is being recorded; the label lives through the call.
            unsafe { debug.cmd_begin_debug_utils_label(buffer, &vk::DebugUtilsLabelEXT::default().label_name(&label)) };
        }
        let number = self.passes.len();
        if let Some(timestamps) = &self.commands.timestamps {
            timestamps.write(buffer, number, false);
        }
        record(&Pass::recorded_to(&core.raw, buffer));
        barrier::full(&core.raw, buffer);
        if let Some(timestamps) = &self.commands.timestamps {
            timestamps.write(buffer, number, true);
        }
        if let Some(debug) = &core.debug {
            // SAFETY: ends the label begun above.
            unsafe { debug.cmd_end_debug_utils_label(buffer) };
        }
        self.passes.push(name);
    }

    /// Submits, waits for the device, and returns the time of each pass.
    ///
    /// # Errors
    /// [`crate::error::Error::DeviceLost`], [`crate::error::Error::Exhausted`] when memory runs out.
    pub fn submit(self) -> Result<PassTimes> {
        let core = &self.commands.tracked.core;
        let submitting = trace::span("submit");
        let buffers = [self.commands.buffer];
        let submit = vk::SubmitInfo::default().command_buffers(&buffers);
        let submitted = if trace::is_on() { trace::now() } else { 0 };
        // SAFETY: the buffer was recorded by this struct alone.
        unsafe {
            core.raw.end_command_buffer(self.commands.buffer).map_err(|e| error(e, "recording commands"))?;
            core.submit(&submit, self.commands.fence, "submitting commands")?;
        }
        drop(submitting);
        trace::within("wait", || self.commands.wait())?;
        match &self.commands.timestamps {
            Some(timestamps) => timestamps.read(&self.passes, submitted),
            None => Ok(PassTimes::default()),
        }
    }
}

/// What an attachment holds when rendering begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Load {
    /// Colour and stencil zero, depth this.
    Clear(f32),
    /// What is there.
    Keep,
}

fn attachment(image: &Image, load: Load) -> vk::RenderingAttachmentInfo<'static> {
    let info = vk::RenderingAttachmentInfo::default()
        .image_view(image.view)
        .image_layout(image.layout())
        .store_op(vk::AttachmentStoreOp::STORE);
    match load {
        Load::Keep => info.load_op(vk::AttachmentLoadOp::LOAD),
        Load::Clear(depth) if image.is_depth() => {
            let value = vk::ClearDepthStencilValue { depth, stencil: 0 };
            info.load_op(vk::AttachmentLoadOp::CLEAR).clear_value(vk::ClearValue { depth_stencil: value })
        }
        Load::Clear(_) => info.load_op(vk::AttachmentLoadOp::CLEAR),
    }
}

/// An open pass.
pub struct Pass<'a> {
    raw: &'a ash::Device,
    buffer: vk::CommandBuffer,
    depth_stencil: Cell<Option<DepthStencil>>,
    scope: std::marker::PhantomData<&'a ()>,
}

impl<'a> Pass<'a> {
    /// A pass of commands that their owner submits and waits for.
    pub(super) const fn recorded_to(raw: &'a ash::Device, buffer: vk::CommandBuffer) -> Self {
        Self { raw, buffer, depth_stencil: Cell::new(None), scope: std::marker::PhantomData }
    }

    /// Makes what was recorded so far visible to what follows.
    pub(super) fn barrier(&self) {
        barrier::full(self.raw, self.buffer);
    }

    /// Copies a whole colour image to another of its format, as far as both reach.
    pub(super) fn copy_to_image(&self, from: &Image, to: &Image) {
        let layers = vk::ImageSubresourceLayers::default().aspect_mask(vk::ImageAspectFlags::COLOR).layer_count(1);
        let (width, height) = (from.size.width.min(to.size.width), from.size.height.min(to.size.height));
        let region = vk::ImageCopy::default().src_subresource(layers).dst_subresource(layers).extent(vk::Extent3D {
            width,
            height,
            depth: 1,
        });
        let (source, target) = ((from.raw, from.layout()), (to.raw, to.layout()));
        // SAFETY: the caller keeps both until the commands are done; they are in their layouts, outside a rendering scope.
        unsafe { self.raw.cmd_copy_image(self.buffer, source.0, source.1, target.0, target.1, &[region]) };
    }

    /// Lets another recorder draw over an image.
    pub(super) fn draw_over<R>(&self, image: &Image, record: impl FnOnce(vk::CommandBuffer) -> R) -> R {
        let attachments = [attachment(image, Load::Keep)];
        let area = vk::Rect2D { offset: vk::Offset2D::default(), extent: image.size };
        let info = vk::RenderingInfo::default().render_area(area).layer_count(1).color_attachments(&attachments);
        // SAFETY: the buffer is being recorded; the caller keeps the image until the commands are done.
        unsafe { self.raw.cmd_begin_rendering(self.buffer, &info) };
        let recorded = record(self.buffer);
        // SAFETY: ends the scope begun above.
        unsafe { self.raw.cmd_end_rendering(self.buffer) };
        recorded
    }

    /// Moves new images to the layout they keep.
    pub fn first_use(&self, images: impl IntoIterator<Item = &'a Image>) {
        for image in images {
            barrier::first_use(self.raw, self.buffer, image);
        }
    }

    /// Draws into the images, all of one size, within `record`.
    pub fn render(
        &self,
        colour: &[&'a Image],
        depth_stencil: Option<&'a Image>,
        load: Load,
        record: impl FnOnce(&Draws<'_, 'a>),
    ) {
        let Some(extent) = colour.first().copied().or(depth_stencil).map(Image::size) else { return };
        let attachments: Vec<_> = colour.iter().map(|i| attachment(i, load)).collect();
        let depth = depth_stencil.map(|i| attachment(i, load));
        let has_stencil = depth_stencil.is_some_and(Image::has_stencil);
        let area = vk::Rect2D { offset: vk::Offset2D::default(), extent };
        let mut info = vk::RenderingInfo::default().render_area(area).layer_count(1).color_attachments(&attachments);
        if let Some(depth) = &depth {
            info = info.depth_attachment(depth);
            info = if has_stencil { info.stencil_attachment(depth) } else { info };
        }
        let (width, height) = (extent.width as f32, extent.height as f32);
        let viewport = vk::Viewport { x: 0.0, y: 0.0, width, height, min_depth: 0.0, max_depth: 1.0 };
        self.depth_stencil.set(None);
        // SAFETY: the buffer is being recorded; the images outlive the recording by `'a`.
        unsafe {
            self.raw.cmd_begin_rendering(self.buffer, &info);
            self.raw.cmd_set_viewport(self.buffer, 0, &[viewport]);
            self.raw.cmd_set_scissor(self.buffer, 0, &[area]);
        }
        record(&Draws { pass: self, area });
        // SAFETY: ends the scope begun above.
        unsafe { self.raw.cmd_end_rendering(self.buffer) };
    }

    /// Readies all queries of a pool; outside a rendering scope.
    pub fn reset_queries(&self, queries: &'a OcclusionQueries) {
        // SAFETY: the buffer is being recorded; the pool outlives the recording by `'a` and is idle.
        unsafe { self.raw.cmd_reset_query_pool(self.buffer, queries.raw, 0, queries.capacity()) };
    }

    /// Copies a whole colour image to a buffer, rows tightly packed, at `offset` bytes.
    pub fn copy_image(&self, from: &'a Image, to: &'a Buffer, offset: u64) {
        self.copy_aspect(from, vk::ImageAspectFlags::COLOR, from.layout(), (to, offset));
    }

    /// Copies the depth of an image that was made for it likewise.
    pub fn copy_depth(&self, from: &'a Image, to: &'a Buffer, offset: u64) {
        let layout = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
        barrier::change_layout(self.raw, self.buffer, from, [from.layout(), layout]);
        self.copy_aspect(from, vk::ImageAspectFlags::DEPTH, layout, (to, offset));
        barrier::change_layout(self.raw, self.buffer, from, [layout, from.layout()]);
    }

    fn copy_aspect(
        &self,
        from: &'a Image,
        aspect: vk::ImageAspectFlags,
        layout: vk::ImageLayout,
        (to, offset): (&'a Buffer, u64),
    ) {
        let layers = vk::ImageSubresourceLayers::default().aspect_mask(aspect).layer_count(1);
        let extent = vk::Extent3D { width: from.size.width, height: from.size.height, depth: 1 };
        let region =
            vk::BufferImageCopy::default().buffer_offset(offset).image_subresource(layers).image_extent(extent);
        // SAFETY: both outlive the recording by `'a`; the image is in its layout, outside a rendering scope.
        unsafe { self.raw.cmd_copy_image_to_buffer(self.buffer, from.raw, layout, to.raw, &[region]) };
    }

    fn copy_buffer(&self, from: &Buffer, to: &Buffer, offset: u64, size: u64) {
        let region = vk::BufferCopy::default().dst_offset(offset).size(size);
        // SAFETY: the caller submits before either buffer can go.
        unsafe { self.raw.cmd_copy_buffer(self.buffer, from.raw, to.raw, &[region]) };
    }
}

/// An open rendering scope.
pub struct Draws<'p, 'a> {
    pass: &'p Pass<'a>,
    area: vk::Rect2D,
}

impl<'a> Draws<'_, 'a> {
    /// Binds a pipeline and the set it reads.
    pub fn bind(&self, pipeline: &'a Pipeline, bindings: &'a Bindings) {
        let (raw, buffer) = (self.pass.raw, self.pass.buffer);
        // SAFETY: pipeline and set outlive the recording by `'a`, and the pipeline was made over the set's layout.
        unsafe {
            raw.cmd_bind_pipeline(buffer, vk::PipelineBindPoint::GRAPHICS, pipeline.raw);
            raw.cmd_bind_descriptor_sets(
                buffer,
                vk::PipelineBindPoint::GRAPHICS,
                bindings.pipeline_layout,
                0,
                &[bindings.set],
                &[],
            );
        }
        if pipeline.has_depth_stencil && self.pass.depth_stencil.get().is_none() {
            self.depth_stencil(DepthStencil {
                compare: vk::CompareOp::ALWAYS,
                write: false,
                stencil: None,
                bias: None,
            });
        }
    }

    /// Sets depth and stencil state for the draws that follow.
    pub fn depth_stencil(&self, state: DepthStencil) {
        if self.pass.depth_stencil.replace(Some(state)) == Some(state) {
            return;
        }
        let (raw, buffer) = (self.pass.raw, self.pass.buffer);
        let faces = vk::StencilFaceFlags::FRONT_AND_BACK;
        let (compare, on_pass, reference) = state.stencil.unwrap_or((vk::CompareOp::ALWAYS, vk::StencilOp::KEEP, 0));
        let keep = vk::StencilOp::KEEP;
        let bias = state.bias.unwrap_or(DepthBias { constant: 0.0, slope: 0.0 });
        // SAFETY: the buffer is being recorded.
        unsafe {
            raw.cmd_set_depth_compare_op(buffer, state.compare);
            raw.cmd_set_depth_write_enable(buffer, state.write);
            raw.cmd_set_stencil_test_enable(buffer, state.stencil.is_some());
            raw.cmd_set_stencil_op(buffer, faces, keep, on_pass, keep, compare);
            raw.cmd_set_stencil_reference(buffer, faces, reference);
            raw.cmd_set_depth_bias_enable(buffer, state.bias.is_some());
            raw.cmd_set_depth_bias(buffer, bias.constant, 0.0, bias.slope);
        }
    }

    /// Zeroes the stencil of the whole image.
    pub fn clear_stencil(&self) {
        let attachment =
            vk::ClearAttachment { aspect_mask: vk::ImageAspectFlags::STENCIL, ..vk::ClearAttachment::default() };
        let rect = vk::ClearRect { rect: self.area, base_array_layer: 0, layer_count: 1 };
        // SAFETY: within a rendering scope that has a stencil attachment, or the layer reports it.
        unsafe { self.pass.raw.cmd_clear_attachments(self.pass.buffer, &[attachment], &[rect]) };
    }

    /// Counts the samples that the draws of `record` pass, in query number `query` of a pool that this pass has reset. A number
    /// beyond the pool counts nothing.
    pub fn counted(&self, queries: &'a OcclusionQueries, query: u32, record: impl FnOnce()) {
        let (raw, buffer) = (self.pass.raw, self.pass.buffer);
        if query >= queries.capacity() {
            return record();
        }
        // SAFETY: the query exists, is used once a recording, and begins and ends within one rendering scope.
        unsafe { raw.cmd_begin_query(buffer, queries.raw, query, vk::QueryControlFlags::PRECISE) };
        record();
        // SAFETY: as above.
        unsafe { raw.cmd_end_query(buffer, queries.raw, query) };
    }

    /// Draws triangles `first .. first + count`, whose vertices the shader pulls: nothing for none.
    pub fn triangles(&self, first: u32, count: u32) {
        if count > 0 {
            // SAFETY: a pipeline is bound; the buffers it reads by address are held by the caller through `'a`.
            unsafe { self.pass.raw.cmd_draw(self.pass.buffer, 3 * count, 1, 3 * first, 0) };
        }
    }
}
