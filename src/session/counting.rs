//! What the renderer has drawn, on its way to the engine: which update, and pixels that queries or counters counted.

use super::light_engine::{LightEngine, Pace};
use super::options::{Options, PixelCounts};
use crate::pass::Renderer;
use crate::refine::engine::Counted;
use crate::vk::Device;
use std::collections::VecDeque;

/// How pixels are counted, and what the engine has not heard of yet.
pub(super) struct Counting {
    /// As the device can.
    pub how: PixelCounts,
    /// Frames between a count and the engine hearing of it.
    lag: usize,
    waiting: VecDeque<Counted>,
}

impl Counting {
    pub(super) fn new(options: &Options, device: &Device) -> Self {
        let lag = match options.pace {
            Pace::Free => 0,
            Pace::Fixed(batches) => batches.counts_lag,
        };
        Self { how: options.pixel_counts.on(device), lag, waiting: VecDeque::new() }
    }

    /// Tells the engine what was drawn, with the pixels that queries or counters counted.
    pub(super) fn tell(&mut self, renderer: &Renderer, engine: &mut LightEngine, generation: u32) {
        let pixels = match self.how {
            PixelCounts::Query => renderer.query_counts().to_vec(),
            PixelCounts::Atomic => renderer.atomic_counts().to_vec(),
            PixelCounts::Image | PixelCounts::Off => Vec::new(),
        };
        self.waiting.push_back(Counted { generation, sequence: renderer.drawn_sequence(), pixels });
        let heard = self.waiting.len().saturating_sub(self.lag);
        self.waiting.drain(..heard).for_each(|counted| engine.counted(counted));
    }
}
