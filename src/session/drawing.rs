//! Drawing a frame of a session, and what it shows that is older than its view.

use super::Session;
use super::light_engine::LightEngine;
use super::options::PixelCounts;
use crate::error::Result;
use crate::pass::{FrameOptions, FrameStats};
use crate::refine::right_of_way::Drawing;

/// Occlusion queries of a frame: 13 to 30 µs each on a software rasteriser.
const QUERIES_A_FRAME: u32 = 128;

impl Session {
    /// Has the light stand aside while a frame of a move is drawn, where both take the same cores.
    pub(super) fn go_first(&self) -> Option<Drawing> {
        match &self.engine {
            LightEngine::Thread(thread) if self.draws_at_once() && self.renderer.device().report().is_cpu() => {
                Some(thread.right_of_way().draw())
            }
            _ => None,
        }
    }

    /// Draws a frame: colours of a view that it is the first of, all luminance or what changed, the picture if it is to be shown.
    pub(super) fn draw(&mut self, moved: bool, whole: bool, combined: bool) -> Result<FrameStats> {
        if whole || self.renderer.must_draw_all(self.options.update) {
            let shows_all = self.is_answered() && !self.draws_at_once();
            self.filled_faces = if shows_all { 0 } else { self.renderer.fill_faces(&self.scene) as u64 };
        }
        self.lose_device_if_asked();
        let _first = moved.then(|| self.go_first());
        self.renderer.frame(&FrameOptions {
            colour: moved,
            full_luminance: whole,
            combine: combined.then_some(self.display),
            update_mode: self.options.update,
            queries: if self.counting.how == PixelCounts::Query { QUERIES_A_FRAME } else { 0 },
        })
    }

    /// Counts a picture; whether it has S of an earlier view.
    pub(super) fn count_picture(&mut self) -> bool {
        let is_stale = self.stale_specular().is_some();
        self.specular_age.picture(self.drawn);
        self.ahead.stale_specular += u64::from(is_stale);
        self.ahead.filled += u64::from(self.filled_faces > 0);
        is_stale
    }

    /// The earlier view that S of what is in view is for, by its generation; `None` if S is right.
    pub(super) fn stale_specular(&self) -> Option<u32> {
        let is_glossy = self.shot.as_ref().is_some_and(|shot| shot.glossy);
        let is_right = self.is_answered() && self.stats.outdated_specular == 0;
        self.generation.filter(|_| is_glossy && !is_right)
    }
}
