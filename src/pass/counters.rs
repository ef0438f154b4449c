//! Pixels of drawn triangles, counted by the draws themselves: a counter a drawn triangle, to which its fragments add.

use super::plan::Plan;
use crate::error::Result;
use crate::refine::update::{DrawnId, DrawnPixels};
use crate::vk::buffer::BufferUse;
use crate::vk::{Buffer, Device};

/// Counters that there are at first.
const CAPACITY: u64 = 4096;

/// The counters, zero between frames, and what the last frame counted.
pub(super) struct Counters {
    buffer: Buffer,
    last: Vec<DrawnPixels>,
}

impl Counters {
    pub(super) fn new(device: &Device) -> Result<Self> {
        Ok(Self { buffer: Self::zero(device, CAPACITY)?, last: Vec::new() })
    }

    fn zero(device: &Device, counters: u64) -> Result<Buffer> {
        let mut buffer = Buffer::new(device, "drawn pixels", counters * 4, BufferUse::ReadBack)?;
        buffer.write(0, &vec![0u32; counters as usize])?;
        Ok(buffer)
    }

    /// Makes room for drawn triangles below `end`. The device must be idle.
    pub(super) fn reserve(&mut self, device: &Device, end: u64) -> Result<()> {
        if end * 4 > self.buffer.size() {
            self.buffer = Self::zero(device, end + end / 2)?;
        }
        Ok(())
    }

    /// Takes in what the draws of a plan counted.
    pub(super) fn read(&mut self, plan: &Plan) -> Result<()> {
        self.last.clear();
        let mut drawn_triangles: Vec<u32> = if plan.clear { Vec::new() } else { plan.counted().collect() };
        drawn_triangles.sort_unstable();
        drawn_triangles.dedup();
        for id in drawn_triangles {
            let offset = u64::from(id) * 4;
            let pixels = self.buffer.view::<u32>(offset, 1)?[0];
            self.last.push(DrawnPixels { drawn: DrawnId(id), pixels });
            self.buffer.write(offset, &[0u32])?;
        }
        Ok(())
    }

    pub(super) fn last(&self) -> &[DrawnPixels] {
        &self.last
    }

    pub(super) const fn address(&self) -> u64 {
        self.buffer.address()
    }
}
