//! Device memory: `gpu-allocator` behind one mutex, and a refusal that names the figure.

use super::error;
use super::instance::Instance;
use crate::error::{Error, Result};
use ash::vk;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme, Allocator, AllocatorCreateDesc};
use gpu_allocator::{AllocationError, AllocationSizes, MemoryLocation};
use std::sync::{Arc, Mutex, PoisonError};

/// The memory of one device.
pub(super) struct Memory {
    /// `None` once closed. Shared with what allocates by itself (the overlay), which goes before the device does.
    allocator: Option<Arc<Mutex<Allocator>>>,
    max_allocation: u64,
}

impl Memory {
    pub(super) fn new(
        instance: &Instance,
        device: &ash::Device,
        physical: vk::PhysicalDevice,
        max_allocation: u64,
    ) -> Result<Self> {
        const MIB: u64 = 1 << 20;
        // Small first blocks: a start-up that touches 8 MiB must not wait for 256.
        let sizes = AllocationSizes::new(8 * MIB, 8 * MIB)
            .with_max_device_memblock_size(256 * MIB)
            .with_max_host_memblock_size(64 * MIB);
        let allocator = Allocator::new(&AllocatorCreateDesc {
            instance: instance.raw.clone(),
            device: device.clone(),
            physical_device: physical,
            debug_settings: gpu_allocator::AllocatorDebugSettings::default(),
            buffer_device_address: true,
            allocation_sizes: sizes,
        })
        .map_err(|e| Error::Internal(format!("cannot manage device memory: {e}")))?;
        Ok(Self { allocator: Some(Arc::new(Mutex::new(allocator))), max_allocation })
    }

    /// The allocator, for what allocates by itself.
    pub(super) fn shared(&self) -> Result<Arc<Mutex<Allocator>>> {
        self.allocator.clone().ok_or_else(|| Error::Internal("device memory was closed".to_owned()))
    }

    /// Memory for a resource; `linear` for buffers.
    pub(super) fn allocate(
        &self,
        name: &str,
        requirements: vk::MemoryRequirements,
        location: MemoryLocation,
        linear: bool,
    ) -> Result<Allocation> {
        let mib = requirements.size.div_ceil(1 << 20);
        if requirements.size > self.max_allocation {
            return Err(Error::Exhausted(format!(
                "`{name}` needs {mib} MiB of device memory; this device allows {} MiB an allocation",
                self.max_allocation >> 20
            )));
        }
        let shared = self.shared()?;
        let mut allocator = shared.lock().unwrap_or_else(PoisonError::into_inner);
        let scheme = AllocationScheme::GpuAllocatorManaged;
        allocator
            .allocate(&AllocationCreateDesc { name, requirements, location, linear, allocation_scheme: scheme })
            .map_err(|e| match e {
                AllocationError::OutOfMemory | AllocationError::Internal(_) => {
                    Error::Exhausted(format!("out of device memory: `{name}` needs {mib} MiB ({e})"))
                }
                other => Error::Internal(format!("cannot allocate `{name}`: {other}")),
            })
    }

    pub(super) fn free(&self, allocation: Allocation) {
        if let Some(allocator) = &self.allocator
            && let Err(e) = allocator.lock().unwrap_or_else(PoisonError::into_inner).free(allocation)
        {
            eprintln!("vulkan: device memory could not be freed: {e}");
        }
    }

    pub(super) fn reserved_bytes(&self) -> u64 {
        self.allocator.as_ref().map_or(0, |a| a.lock().unwrap_or_else(PoisonError::into_inner).capacity())
    }

    /// Gives all memory back; must come before the device goes.
    pub(super) fn close(&mut self) {
        self.allocator = None;
    }
}

/// The error of a failed `vkBind…Memory`.
pub(super) fn bind_error(result: vk::Result, name: &str) -> Error {
    error(result, &format!("binding memory to `{name}`"))
}
