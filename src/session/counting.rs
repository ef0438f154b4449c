//! Pixels of the drawn triangles, on their way from the renderer to the engine.

use super::light_engine::{LightEngine, Pace};
use super::options::{Options, PixelCounts};
use crate::error::Result;
use crate::pass::Renderer;
use crate::refine::engine::Counted;
use crate::vk::Device;
use std::collections::VecDeque;

/// How pixels are counted, and counts that the engine has not heard of yet.
pub(super) struct Counting {
    /// As the device can.
    pub how: PixelCounts,
    /// Whether all frames are counted, not those alone that make a picture.
    every_frame: bool,
    /// Frames between a count and the engine hearing of it.
    lag: usize,
    waiting: VecDeque<Counted>,
    /// Whether anything was drawn since all drawn triangles were last counted.
    uncounted: bool,
}

impl Counting {
    pub(super) fn new(options: &Options, device: &Device) -> Self {
        let (every_frame, lag) = match options.pace {
            Pace::Free => (false, 0),
            Pace::Fixed(batches) => (true, batches.counts_lag),
        };
        let how = options.pixel_counts.on(device);
        Self { how, every_frame, lag, waiting: VecDeque::new(), uncounted: false }
    }

    pub(super) const fn note_drawn(&mut self, anything: bool) {
        self.uncounted |= anything;
    }

    /// Tells the engine what was drawn, with the pixels of the drawn triangles: all of them with each picture, or those that queries
    /// or counters counted.
    ///
    /// # Errors
    /// The device is lost or memory runs out.
    pub(super) fn count(
        &mut self,
        renderer: &mut Renderer,
        engine: &mut LightEngine,
        generation: u32,
        combined: bool,
    ) -> Result<()> {
        let pixels = match self.how {
            PixelCounts::Histogram if self.uncounted && (combined || self.every_frame) => {
                self.uncounted = false;
                Some(renderer.drawn_counts()?.drawn_triangles)
            }
            PixelCounts::Query => Some(renderer.query_counts().to_vec()),
            PixelCounts::Atomic => Some(renderer.atomic_counts().to_vec()),
            PixelCounts::Histogram | PixelCounts::Off => None,
        };
        let complete = self.how == PixelCounts::Histogram;
        self.waiting.push_back(Counted { generation, sequence: renderer.drawn_sequence(), pixels, complete });
        let heard = self.waiting.len().saturating_sub(self.lag);
        self.waiting.drain(..heard).for_each(|counted| engine.counted(counted));
        Ok(())
    }
}
