//! Pictures on their way to a window, two at a time.
//!
//! The one place where the device works on while the program goes on: what a picture in flight reads is held by a share of it
//! until its fence has been waited for. Pictures follow each other on one queue, and each ends with a full barrier, so that the frame
//! drawn next waits on the device for what still reads its images.

use super::commands::Pass;
use super::device::{Device, DeviceCore, Tracked};
use super::image::Image;
use super::overlay::{Gui, IN_FLIGHT, Overlay};
use super::surface::Surface;
use super::swapchain::{Fault, Swapchain, Vsync};
use super::{barrier, error};
use crate::error::Result;
use crate::trace;
use ash::vk;
use std::sync::{Arc, PoisonError};

/// How long the window may keep all its images, nanoseconds: hidden ones may never give one back.
const PATIENCE_NS: u64 = 100_000_000;

/// Surfaces and swapchains made for one picture, at most.
const ATTEMPTS: usize = 3;

/// What became of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Presented {
    /// It is shown next.
    Shown,
    /// The window has no area.
    Hidden,
    /// The window has no image to give at the moment.
    Busy,
}

/// Shows pictures in a window.
pub struct Presenter {
    slots: Vec<Slot>,
    /// Number of the slot that is next.
    next: usize,
    /// `None` before the first picture, and while the window has no area.
    swapchain: Option<Swapchain>,
    surface: Arc<Surface>,
    vsync: Vsync,
    /// Whether the swapchain fits the window no more.
    stale: bool,
    core: Arc<DeviceCore>,
}

/// What a picture in flight takes.
struct Slot {
    pool: vk::CommandPool,
    buffer: vk::CommandBuffer,
    /// Signalled when the picture is done; unsignalled and not awaited before the first.
    fence: vk::Fence,
    /// The window has given an image.
    acquired: vk::Semaphore,
    /// What it reads; none if it is done.
    reads: Vec<Arc<Image>>,
    tracked: Tracked,
}

impl Presenter {
    /// A presenter for a surface of the device's.
    ///
    /// # Errors
    /// [`crate::error::Error::Exhausted`] when memory runs out.
    pub fn new(device: &Device, surface: Arc<Surface>, vsync: Vsync) -> Result<Self> {
        let core = Arc::clone(&device.core);
        let slots = (0..IN_FLIGHT).map(|_| Slot::new(&core)).collect::<Result<_>>()?;
        Ok(Self { slots, next: 0, swapchain: None, surface, vsync, stale: true, core })
    }

    /// Has the next picture ask the window for its size.
    pub const fn window_changed(&mut self) {
        self.stale = true;
    }

    /// Shows a picture with what is laid over it, in a window that is to be of a size (it has the last word).
    ///
    /// # Errors
    /// [`crate::error::Error::DeviceLost`], [`crate::error::Error::Exhausted`] when memory runs out,
    /// [`crate::error::Error::NoWindow`] when the window
    /// is gone.
    pub fn present(
        &mut self,
        picture: &Arc<Image>,
        overlay: &mut Overlay,
        gui: &mut Gui,
        window: vk::Extent2D,
    ) -> Result<Presented> {
        let _present = trace::span("present");
        overlay.update(gui)?;
        trace::within("wait for a picture", || self.slots[self.next].wait())?;
        for _ in 0..ATTEMPTS {
            match self.attempt(picture, overlay, gui, window) {
                Ok(Some(presented)) => return Ok(presented),
                Ok(None) => self.stale = true,
                Err(Fault::SurfaceLost) => self.replace_surface()?,
                Err(Fault::Fatal(error)) => return Err(error),
            }
        }
        Ok(Presented::Busy)
    }

    /// `None` if the swapchain turned out not to fit.
    fn attempt(
        &mut self,
        picture: &Arc<Image>,
        overlay: &mut Overlay,
        gui: &Gui,
        window: vk::Extent2D,
    ) -> Result<Option<Presented>, Fault> {
        if self.stale {
            self.replace_swapchain(window)?;
        }
        let Some(swapchain) = &self.swapchain else { return Ok(Some(Presented::Hidden)) };
        let slot = &mut self.slots[self.next];
        // SAFETY: the slot's picture was waited for, so that nothing waits on the semaphore.
        let acquired = unsafe {
            swapchain.loader.acquire_next_image(swapchain.raw, PATIENCE_NS, slot.acquired, vk::Fence::null())
        };
        let (number, suboptimal) = match acquired {
            Ok(acquired) => acquired,
            Err(vk::Result::ERROR_OUT_OF_DATE_KHR) => return Ok(None),
            Err(vk::Result::TIMEOUT | vk::Result::NOT_READY) => return Ok(Some(Presented::Busy)),
            Err(other) => return Err(Fault::new(other, "asking the window for an image")),
        };
        self.stale = suboptimal;
        let number_of = number as usize;
        let target =
            Target { image: swapchain.images[number_of], extent: swapchain.extent, drawn: swapchain.drawn[number_of] };
        slot.submit(&self.core, &target, picture, (overlay, gui)).map_err(Fault::Fatal)?;
        self.next = (self.next + 1) % IN_FLIGHT;
        self.show(number)
    }

    fn show(&mut self, number: u32) -> Result<Option<Presented>, Fault> {
        let Some(swapchain) = &self.swapchain else { return Ok(None) };
        let (swapchains, numbers) = ([swapchain.raw], [number]);
        let waits = [swapchain.drawn[number as usize]];
        let info =
            vk::PresentInfoKHR::default().wait_semaphores(&waits).swapchains(&swapchains).image_indices(&numbers);
        let queue = self.core.queue.lock().unwrap_or_else(PoisonError::into_inner);
        // SAFETY: the image was acquired and its commands are submitted; the mutex guards the queue.
        match unsafe { swapchain.loader.queue_present(*queue, &info) } {
            Ok(suboptimal) => self.stale |= suboptimal,
            Err(vk::Result::ERROR_OUT_OF_DATE_KHR) => self.stale = true,
            Err(other) => return Err(Fault::new(other, "showing a picture")),
        }
        Ok(Some(Presented::Shown))
    }

    /// Makes a swapchain of the size that the window has now.
    fn replace_swapchain(&mut self, window: vk::Extent2D) -> Result<(), Fault> {
        self.wait().map_err(Fault::Fatal)?;
        let old = self.swapchain.take();
        self.swapchain = Swapchain::new(&self.core, &self.surface, window, self.vsync, old.as_ref())?;
        self.stale = self.swapchain.is_none();
        Ok(())
    }

    /// Makes another surface of the window.
    fn replace_surface(&mut self) -> Result<()> {
        self.wait()?;
        self.swapchain = None;
        self.stale = true;
        self.surface = self.surface.again()?;
        Ok(())
    }

    /// Waits until no picture is in flight, and the window has taken those that are done.
    ///
    /// # Errors
    /// [`crate::error::Error::DeviceLost`].
    pub fn wait(&mut self) -> Result<()> {
        for slot in &mut self.slots {
            slot.wait()?;
        }
        self.core.wait_idle()
    }
}

impl Drop for Presenter {
    fn drop(&mut self) {
        // A lost device counts as done.
        let _ = self.wait();
        self.swapchain = None;
    }
}

/// Where a picture goes.
struct Target {
    image: vk::Image,
    extent: vk::Extent2D,
    drawn: vk::Semaphore,
}

impl Slot {
    fn new(core: &Arc<DeviceCore>) -> Result<Self> {
        let name = "picture in flight";
        let info = vk::CommandPoolCreateInfo::default().queue_family_index(core.queue_family);
        // SAFETY: see the module's contract; the owner below undoes it on every later failure.
        let pool =
            unsafe { core.raw.create_command_pool(&info, None) }.map_err(|e| error(e, "creating a command pool"))?;
        let tracked = Tracked::new(core, pool, name);
        let (buffer, fence, acquired) = (vk::CommandBuffer::null(), vk::Fence::null(), vk::Semaphore::null());
        let mut slot = Self { pool, buffer, fence, acquired, reads: Vec::new(), tracked };
        let allocate = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(1);
        // SAFETY: as above.
        unsafe {
            let buffers = core.raw.allocate_command_buffers(&allocate).map_err(|e| error(e, "allocating commands"))?;
            slot.buffer = buffers.first().copied().unwrap_or_default();
            slot.fence = core
                .raw
                .create_fence(&vk::FenceCreateInfo::default(), None)
                .map_err(|e| error(e, "creating a fence"))?;
            slot.acquired = core
                .raw
                .create_semaphore(&vk::SemaphoreCreateInfo::default(), None)
                .map_err(|e| error(e, "creating a semaphore"))?;
        }
        core.set_name(slot.buffer, name);
        core.set_name(slot.fence, name);
        core.set_name(slot.acquired, name);
        Ok(slot)
    }

    /// Waits for the picture that it last had.
    fn wait(&mut self) -> Result<()> {
        if self.reads.is_empty() {
            return Ok(());
        }
        let raw = &self.tracked.core.raw;
        // SAFETY: the fence was submitted with that picture; after the wait nothing uses it.
        unsafe {
            raw.wait_for_fences(&[self.fence], true, u64::MAX).map_err(|e| error(e, "waiting for a picture"))?;
            raw.reset_fences(&[self.fence]).map_err(|e| error(e, "resetting a fence"))?;
        }
        self.reads.clear();
        Ok(())
    }

    fn submit(
        &mut self,
        core: &DeviceCore,
        target: &Target,
        picture: &Arc<Image>,
        (overlay, gui): (&mut Overlay, &Gui),
    ) -> Result<()> {
        let (raw, buffer) = (&core.raw, self.buffer);
        let begin = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the last submission was waited for, so the pool is idle; `&mut self` makes access exclusive.
        unsafe {
            raw.reset_command_pool(self.pool, vk::CommandPoolResetFlags::empty())
                .map_err(|e| error(e, "resetting commands"))?;
            raw.begin_command_buffer(buffer, &begin).map_err(|e| error(e, "recording commands"))?;
        }
        let shown = Arc::clone(overlay.picture());
        overlay.record(&Pass::recorded_to(raw, buffer), picture, gui)?;
        barrier::full(raw, buffer);
        blit(raw, buffer, &shown, target);
        barrier::full(raw, buffer);
        let (waits, signals, buffers) = ([self.acquired], [target.drawn], [buffer]);
        let stages = [vk::PipelineStageFlags::ALL_COMMANDS];
        let submit = vk::SubmitInfo::default()
            .wait_semaphores(&waits)
            .wait_dst_stage_mask(&stages)
            .signal_semaphores(&signals)
            .command_buffers(&buffers);
        // SAFETY: the buffer was recorded here alone, what it reads is kept below.
        unsafe {
            raw.end_command_buffer(buffer).map_err(|e| error(e, "recording commands"))?;
            core.submit(&submit, self.fence, "submitting a picture")?;
        }
        self.reads = vec![Arc::clone(picture), shown];
        Ok(())
    }
}

impl Drop for Slot {
    fn drop(&mut self) {
        let raw = &self.tracked.core.raw;
        // SAFETY: the presenter has waited for its picture; null handles are ignored.
        unsafe {
            raw.destroy_semaphore(self.acquired, None);
            raw.destroy_fence(self.fence, None);
            raw.destroy_command_pool(self.pool, None);
        }
    }
}

/// Copies a picture to an image of the window, scaled while the two differ in size.
fn blit(raw: &ash::Device, buffer: vk::CommandBuffer, from: &Image, to: &Target) {
    barrier::window_image(raw, buffer, to.image, [vk::ImageLayout::UNDEFINED, vk::ImageLayout::TRANSFER_DST_OPTIMAL]);
    let layers = vk::ImageSubresourceLayers::default().aspect_mask(vk::ImageAspectFlags::COLOR).layer_count(1);
    let corner = |extent: vk::Extent2D| vk::Offset3D { x: extent.width as i32, y: extent.height as i32, z: 1 };
    let region = vk::ImageBlit {
        src_subresource: layers,
        src_offsets: [vk::Offset3D::default(), corner(from.size())],
        dst_subresource: layers,
        dst_offsets: [vk::Offset3D::default(), corner(to.extent)],
    };
    let filter = if from.size() == to.extent { vk::Filter::NEAREST } else { vk::Filter::LINEAR };
    let into = vk::ImageLayout::TRANSFER_DST_OPTIMAL;
    // SAFETY: both images are alive until the slot's fence is waited for, and in these layouts.
    unsafe { raw.cmd_blit_image(buffer, from.raw, from.layout(), to.image, into, &[region], filter) };
    barrier::window_image(raw, buffer, to.image, [into, vk::ImageLayout::PRESENT_SRC_KHR]);
}
