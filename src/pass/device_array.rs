//! An array that lives on the host and is mirrored on the device: it can be sent again whole at any time.

use crate::error::Result;
use crate::vk::buffer::BufferUse;
use crate::vk::{Buffer, Device};
use bytemuck::{Pod, Zeroable};

/// Elements a chunk, the unit of what is sent: 2.5 KiB of slots. Changes are scattered, so larger chunks send mostly what
/// has not changed.
const CHUNK: usize = 64;
/// Elements that the first buffer holds.
const CAPACITY: usize = 4096;

/// A growing array with its copy on the device.
pub(super) struct DeviceArray<T> {
    name: &'static str,
    items: Vec<T>,
    /// Whether each chunk differs from the device's.
    dirty: Vec<bool>,
    buffer: Buffer,
}

impl<T: Pod + PartialEq> DeviceArray<T> {
    pub(super) fn new(device: &Device, name: &'static str) -> Result<Self> {
        let buffer = Buffer::new(device, name, (CAPACITY * size_of::<T>()) as u64, BufferUse::Stream)?;
        Ok(Self { name, items: Vec::new(), dirty: Vec::new(), buffer })
    }

    /// The element, zero if it was never set.
    pub(super) fn get(&self, index: u32) -> T {
        self.items.get(index as usize).copied().unwrap_or_else(Zeroable::zeroed)
    }

    pub(super) fn set(&mut self, index: u32, value: T) {
        let index = index as usize;
        if index >= self.items.len() {
            self.items.resize(index + 1, T::zeroed());
            self.dirty.resize(self.items.len().div_ceil(CHUNK), true);
        }
        if self.items[index] != value {
            self.items[index] = value;
            self.dirty[index / CHUNK] = true;
        }
    }

    /// Replaces all elements.
    pub(super) fn replace(&mut self, items: Vec<T>) {
        self.dirty.clear();
        self.dirty.resize(items.len().div_ceil(CHUNK), true);
        self.items = items;
    }

    /// Forgets all elements from a number on.
    pub(super) fn truncate(&mut self, len: u64) {
        self.items.truncate(len as usize);
        self.dirty.truncate(self.items.len().div_ceil(CHUNK));
        // The device still holds what was forgotten of the last chunk: what is set there next may be no change here.
        if let Some(last) = self.dirty.last_mut() {
            *last = true;
        }
    }

    /// Sends what changed, into a larger buffer when the present one is too small. The device must be idle, which it
    /// is between submissions: each is waited for.
    pub(super) fn flush(&mut self, device: &Device) -> Result<()> {
        let bytes = size_of_val(self.items.as_slice()) as u64;
        if bytes > self.buffer.size() {
            self.buffer = Buffer::new(device, self.name, bytes + bytes / 2, BufferUse::Stream)?;
            self.dirty.fill(true);
        }
        for (i, (chunk, dirty)) in self.items.chunks(CHUNK).zip(&mut self.dirty).enumerate() {
            if std::mem::take(dirty) {
                self.buffer.write((i * CHUNK * size_of::<T>()) as u64, chunk)?;
            }
        }
        Ok(())
    }

    /// Elements, set or not.
    pub(super) const fn len(&self) -> u64 {
        self.items.len() as u64
    }

    pub(super) const fn address(&self) -> u64 {
        self.buffer.address()
    }

    pub(super) const fn buffer(&self) -> &Buffer {
        &self.buffer
    }
}
