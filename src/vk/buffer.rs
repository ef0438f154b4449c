//! Buffers, addressed from shaders by device address, or read as texels.

use super::device::{Device, Tracked};
use super::{error, memory};
use crate::error::{Error, Result};
use ash::vk;
use bytemuck::{NoUninit, Pod};
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::Allocation;

/// What shaders read buffers as, where not by address.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Texel {
    /// A 32-bit word.
    Word,
    /// Four of them.
    Quad,
}

impl Texel {
    const ALL: [Self; 2] = [Self::Word, Self::Quad];

    /// Formats that all devices read buffers in.
    const fn format(self) -> vk::Format {
        match self {
            Self::Word => vk::Format::R32_UINT,
            Self::Quad => vk::Format::R32G32B32A32_UINT,
        }
    }

    const fn bytes(self) -> u64 {
        match self {
            Self::Word => 4,
            Self::Quad => 16,
        }
    }
}

/// Who writes and who reads a buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BufferUse {
    /// Written once (through [`super::Commands::upload`]), read by the device.
    Static,
    /// Written by the host every frame, read by the device.
    Stream,
    /// Written by the device, read by the host.
    ReadBack,
}

/// A buffer with its memory.
pub struct Buffer {
    pub(super) raw: vk::Buffer,
    /// It as whole texels of each sort, as far as a view may reach.
    views: [vk::BufferView; 2],
    allocation: Option<Allocation>,
    size: u64,
    address: vk::DeviceAddress,
    tracked: Tracked,
}

impl Buffer {
    /// A buffer of at least `size` bytes (16 if that is less), contents undefined.
    ///
    /// # Errors
    /// [`Error::Exhausted`] when memory runs out or `size` exceeds what the device allows.
    pub fn new(device: &Device, name: &str, size: u64, usage: BufferUse) -> Result<Self> {
        let size = size.max(16);
        let flags = vk::BufferUsageFlags::STORAGE_BUFFER
            | vk::BufferUsageFlags::UNIFORM_BUFFER
            | vk::BufferUsageFlags::UNIFORM_TEXEL_BUFFER
            | vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS
            | vk::BufferUsageFlags::TRANSFER_SRC
            | vk::BufferUsageFlags::TRANSFER_DST;
        let info = vk::BufferCreateInfo::default().size(size).usage(flags);
        let core = &device.core;
        // SAFETY: see the module's contract; the buffer's owner below frees it on every later failure.
        let raw =
            unsafe { core.raw.create_buffer(&info, None) }.map_err(|e| error(e, &format!("creating `{name}`")))?;
        let tracked = Tracked::new(core, raw, name);
        let mut buffer = Self { raw, views: [vk::BufferView::null(); 2], allocation: None, size, address: 0, tracked };
        // SAFETY: `raw` was just created.
        let requirements = unsafe { core.raw.get_buffer_memory_requirements(raw) };
        let location = match usage {
            BufferUse::Static => MemoryLocation::GpuOnly,
            BufferUse::Stream => MemoryLocation::CpuToGpu,
            BufferUse::ReadBack => MemoryLocation::GpuToCpu,
        };
        let allocation = core.memory.allocate(name, requirements, location, true)?;
        // SAFETY: the allocation fits the requirements and is bound once.
        let bound = unsafe { core.raw.bind_buffer_memory(raw, allocation.memory(), allocation.offset()) };
        buffer.allocation = Some(allocation);
        bound.map_err(|e| memory::bind_error(e, name))?;
        // SAFETY: the buffer has memory and was created with SHADER_DEVICE_ADDRESS.
        buffer.address =
            unsafe { core.raw.get_buffer_device_address(&vk::BufferDeviceAddressInfo::default().buffer(raw)) };
        for texel in Texel::ALL {
            buffer.views[texel as usize] = buffer.view_as(texel, name)?;
        }
        Ok(buffer)
    }

    fn view_as(&self, texel: Texel, name: &str) -> Result<vk::BufferView> {
        let core = &self.tracked.core;
        let range = texel.bytes() * (self.size / texel.bytes()).min(u64::from(core.max_texels));
        let info = vk::BufferViewCreateInfo::default().buffer(self.raw).format(texel.format()).range(range);
        // SAFETY: the buffer has memory and allows such views; the format is one that all devices read so.
        unsafe { core.raw.create_buffer_view(&info, None) }.map_err(|e| error(e, &format!("viewing `{name}`")))
    }

    /// Whether all of it can be read as such texels.
    #[must_use]
    pub fn fits(&self, texel: Texel) -> bool {
        self.size <= texel.bytes() * u64::from(self.tracked.core.max_texels)
    }

    pub(super) const fn texels(&self, texel: Texel) -> vk::BufferView {
        self.views[texel as usize]
    }

    /// Size in bytes.
    #[must_use]
    pub const fn size(&self) -> u64 {
        self.size
    }

    /// What a shader's buffer reference holds.
    #[must_use]
    pub const fn address(&self) -> u64 {
        self.address
    }

    /// Whether the host can write it directly, with no flush to follow.
    #[must_use]
    pub fn is_mapped(&self) -> bool {
        let coherent = |a: &Allocation| a.memory_properties().contains(vk::MemoryPropertyFlags::HOST_COHERENT);
        self.allocation.as_ref().is_some_and(|a| a.mapped_ptr().is_some() && coherent(a))
    }

    /// Writes `data` at `offset` bytes. `&mut self`: no recording borrows the buffer, so the device is not reading it.
    ///
    /// # Errors
    /// [`Error::Internal`] if the range is outside or the memory cannot be mapped.
    pub fn write<T: NoUninit>(&mut self, offset: u64, data: &[T]) -> Result<()> {
        let bytes: &[u8] = bytemuck::cast_slice(data);
        let range = offset as usize..offset as usize + bytes.len();
        let slab = self.allocation.as_mut().and_then(Allocation::mapped_slice_mut);
        let target = slab.and_then(|s| s.get_mut(range)).ok_or_else(|| outside("written"))?;
        target.copy_from_slice(bytes);
        Ok(())
    }

    /// Reads `count` elements at `offset` bytes.
    ///
    /// # Errors
    /// [`Error::Internal`] if the range is outside or the memory cannot be mapped.
    pub fn read<T: Pod>(&self, offset: u64, count: usize) -> Result<Vec<T>> {
        Ok(bytemuck::pod_collect_to_vec(self.bytes(offset, count * size_of::<T>())?))
    }

    /// The `count` elements at `offset` bytes where they lie. `&self`: nothing writes them meanwhile, since whoever
    /// records a copy into the buffer waits for it.
    ///
    /// # Errors
    /// [`Error::Internal`] if the range is outside or unaligned, or the memory cannot be mapped.
    pub fn view<T: Pod>(&self, offset: u64, count: usize) -> Result<&[T]> {
        bytemuck::try_cast_slice(self.bytes(offset, count * size_of::<T>())?).map_err(|_| outside("viewed"))
    }

    fn bytes(&self, offset: u64, length: usize) -> Result<&[u8]> {
        let slab = self.allocation.as_ref().and_then(Allocation::mapped_slice);
        slab.and_then(|s| s.get(offset as usize..offset as usize + length)).ok_or_else(|| outside("read"))
    }
}

fn outside(doing: &str) -> Error {
    Error::Internal(format!("a range outside a mapped buffer was {doing}"))
}

impl Drop for Buffer {
    fn drop(&mut self) {
        let core = &self.tracked.core;
        // SAFETY: no recording borrows the buffer any more, and each is waited for; null views are ignored.
        unsafe {
            for view in self.views {
                core.raw.destroy_buffer_view(view, None);
            }
            core.raw.destroy_buffer(self.raw, None);
        }
        if let Some(allocation) = self.allocation.take() {
            core.memory.free(allocation);
        }
    }
}
