//! What lies over a picture: panels drawn by egui.
//!
//! Both are put together in an image of their own, so that a window and a file get the same.

use super::buffer::{Buffer, BufferUse};
use super::commands::{Commands, Pass};
use super::device::{Device, Tracked};
use super::error;
use super::image::Image;
use super::report::DISPLAY_FORMAT;
use crate::error::{Error, Result};
use ash::vk;
use egui::{ClippedPrimitive, TextureId, TexturesDelta};
use egui_ash_renderer::allocator::GpuAllocator;
use egui_ash_renderer::{DynamicRendering, Options, RenderMode, Renderer, RendererError};
use std::sync::{Arc, PoisonError};

/// Pictures in flight at most: each has buffers of its own for the panels.
pub const IN_FLIGHT: usize = 2;

/// Panels as they are to be drawn.
#[derive(Default)]
pub struct Gui {
    /// Their triangles, in points.
    pub primitives: Vec<ClippedPrimitive>,
    /// What changed of their textures.
    pub textures: TexturesDelta,
    /// Pixels of a point.
    pub pixels_per_point: f32,
}

/// Draws panels over a picture.
pub struct Overlay {
    renderer: Renderer<GpuAllocator>,
    /// The picture with what lies over it, as displayed.
    picture: Arc<Image>,
    commands: Commands,
    /// For textures.
    pool: vk::CommandPool,
    /// Textures that are free once the next panels come.
    unused: Vec<TextureId>,
    tracked: Tracked,
}

impl Overlay {
    /// An overlay of pictures of a size.
    ///
    /// # Errors
    /// [`Error::Exhausted`] when memory runs out.
    pub fn new(device: &Device, size: vk::Extent2D) -> Result<Self> {
        let core = &device.core;
        let mode = RenderMode::DynamicRendering(DynamicRendering {
            color_attachment_format: DISPLAY_FORMAT,
            depth_attachment_format: None,
            stencil_attachment_format: None,
        });
        let options = Options { in_flight_frames: IN_FLIGHT, ..Options::default() };
        let renderer = Renderer::with_gpu_allocator(core.memory.shared()?, core.raw.clone(), mode, options)
            .map_err(|e| failed(&e))?;
        let info = vk::CommandPoolCreateInfo::default()
            .queue_family_index(core.queue_family)
            .flags(vk::CommandPoolCreateFlags::TRANSIENT);
        // SAFETY: see the module's contract.
        let pool =
            unsafe { core.raw.create_command_pool(&info, None) }.map_err(|e| error(e, "creating a command pool"))?;
        let tracked = Tracked::new(core, pool, "overlay textures");
        let mut commands = Commands::new(device, "overlay")?;
        let picture = picture(device, &mut commands, size)?;
        Ok(Self { renderer, picture, commands, pool, unused: Vec::new(), tracked })
    }

    /// The picture with what lies over it, after `record` or [`Self::compose`].
    #[must_use]
    pub const fn picture(&self) -> &Arc<Image> {
        &self.picture
    }

    /// Makes the picture of another size; what it showed is gone.
    ///
    /// # Errors
    /// [`Error::Exhausted`] when memory runs out.
    pub fn resize(&mut self, device: &Device, size: vk::Extent2D) -> Result<()> {
        if self.picture.size() != size {
            self.picture = picture(device, &mut self.commands, size)?;
        }
        Ok(())
    }

    /// Takes in what changed of the textures. Comes before the panels that use it are recorded.
    ///
    /// # Errors
    /// [`Error::Exhausted`] when memory runs out.
    pub(super) fn update(&mut self, gui: &mut Gui) -> Result<()> {
        let core = &self.tracked.core;
        if !self.unused.is_empty() {
            core.wait_idle()?;
        }
        for id in self.unused.drain(..) {
            self.renderer.free_texture(id).map_err(|e| failed(&e))?;
        }
        let queue = core.queue.lock().unwrap_or_else(PoisonError::into_inner);
        for (id, deltas) in gui.textures.set.drain() {
            for delta in &deltas {
                self.renderer.set_texture(*queue, self.pool, id, delta).map_err(|e| failed(&e))?;
            }
        }
        // These panels may still show them.
        self.unused.extend(gui.textures.free.drain());
        Ok(())
    }

    /// Records the picture, and the panels over it.
    pub(super) fn record(&mut self, pass: &Pass<'_>, from: &Image, gui: &Gui) -> Result<()> {
        let size = self.picture.size();
        pass.copy_to_image(from, &self.picture);
        pass.barrier();
        pass.draw_over(&self.picture, |buffer| {
            let drawn = self.renderer.cmd_draw(buffer, size, gui.pixels_per_point, &gui.primitives);
            drawn.map_err(|e| failed(&e))
        })
    }

    /// Puts picture and panels together, and waits for it.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::Exhausted`] when memory runs out.
    pub fn compose(&mut self, from: &Image, gui: &mut Gui) -> Result<()> {
        self.update(gui)?;
        let Self { renderer, picture, commands, .. } = self;
        let size = picture.size();
        let mut drawn = Ok(());
        let mut recording = commands.begin()?;
        recording.pass("picture", |pass| pass.copy_to_image(from, picture));
        recording.pass("overlay", |pass| {
            drawn = pass.draw_over(picture, |buffer| {
                let drawn = renderer.cmd_draw(buffer, size, gui.pixels_per_point, &gui.primitives);
                drawn.map_err(|e| failed(&e))
            });
        });
        recording.submit()?;
        drawn
    }

    /// What [`Self::picture`] shows, row by row from the top left: sRGB, A is the coverage.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::Exhausted`] when memory runs out.
    pub fn read(&mut self, device: &Device) -> Result<Vec<[u8; 4]>> {
        let vk::Extent2D { width, height } = self.picture.size();
        let pixels = width as usize * height as usize;
        let buffer = Buffer::new(device, "window picture", 4 * pixels as u64, BufferUse::ReadBack)?;
        let mut recording = self.commands.begin()?;
        recording.pass("readback", |pass| pass.copy_image(&self.picture, &buffer, 0));
        recording.submit()?;
        buffer.read(0, pixels)
    }
}

impl Drop for Overlay {
    fn drop(&mut self) {
        let core = &self.tracked.core;
        // Pictures in flight read the panels' buffers. A lost device counts as done.
        let _ = core.wait_idle();
        // SAFETY: nothing uses the pool any more.
        unsafe { core.raw.destroy_command_pool(self.pool, None) };
    }
}

fn picture(device: &Device, commands: &mut Commands, size: vk::Extent2D) -> Result<Arc<Image>> {
    let picture = Image::picture(device, "window picture", size, DISPLAY_FORMAT)?;
    let mut recording = commands.begin()?;
    recording.pass("new images", |pass| pass.first_use([&picture]));
    recording.submit()?;
    Ok(Arc::new(picture))
}

fn failed(fault: &RendererError) -> Error {
    match fault {
        RendererError::Vulkan(result) => error(*result, "drawing panels"),
        other => Error::Internal(format!("panels cannot be drawn: {other}")),
    }
}
