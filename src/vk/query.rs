//! Occlusion queries: how many samples pass the tests of a draw.

use super::device::{Device, Tracked};
use super::error;
use crate::error::Result;
use ash::vk;

/// A pool of precise occlusion queries.
pub struct OcclusionQueries {
    pub(super) raw: vk::QueryPool,
    capacity: u32,
    tracked: Tracked,
}

impl OcclusionQueries {
    /// A pool of `capacity` queries; `None` where the device does not count exactly.
    ///
    /// # Errors
    /// [`crate::error::Error::Exhausted`] when memory runs out.
    pub fn new(device: &Device, name: &str, capacity: u32) -> Result<Option<Self>> {
        if !device.report().precise_queries {
            return Ok(None);
        }
        let info = vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::OCCLUSION).query_count(capacity);
        // SAFETY: see the module's contract.
        let raw = unsafe { device.core.raw.create_query_pool(&info, None) }
            .map_err(|e| error(e, "creating the pool of occlusion queries"))?;
        Ok(Some(Self { raw, capacity, tracked: Tracked::new(&device.core, raw, name) }))
    }

    /// Queries that it holds.
    #[must_use]
    pub const fn capacity(&self) -> u32 {
        self.capacity
    }

    /// Samples counted by the first `count` queries of a submission that has finished, so that nothing waits here.
    ///
    /// # Errors
    /// [`crate::error::Error::DeviceLost`].
    pub fn read(&self, count: u32) -> Result<Vec<u32>> {
        let mut samples = vec![0; count.min(self.capacity) as usize];
        if !samples.is_empty() {
            // SAFETY: `&self` outlives the recordings that wrote the queries, and each was waited for.
            unsafe {
                self.tracked.core.raw.get_query_pool_results(self.raw, 0, &mut samples, vk::QueryResultFlags::WAIT)
            }
            .map_err(|e| error(e, "reading occlusion queries"))?;
        }
        Ok(samples)
    }
}

impl Drop for OcclusionQueries {
    fn drop(&mut self) {
        // SAFETY: every recording that used the pool was waited for.
        unsafe { self.tracked.core.raw.destroy_query_pool(self.raw, None) };
    }
}
