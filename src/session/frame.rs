//! What one turn of a session did.

use super::budget::EndedBy;
use crate::log::frame_log::{FrameError, FrameRecord, PassRecord};
use crate::pass::FrameStats;
use crate::refine::update::{EngineStats, Update};
use std::time::Duration;

/// One frame.
#[derive(Clone, Debug)]
pub struct FrameReport {
    /// Its number, from 0.
    pub frame: u64,
    /// When it was complete, since the first frame began.
    pub at: Duration,
    /// Whether it is the first of a new view.
    pub camera_moved: bool,
    /// What the passes did.
    pub passes: FrameStats,
    /// The engine's totals as the frame shows them.
    pub engine: EngineStats,
    /// Whether it made a picture ([`crate::pass::Renderer::read_display`]).
    pub combined: bool,
    /// Why the run, or the picture of a camera path, is to end with this frame; it then shows all that is known.
    pub ended_by: Option<EndedBy>,
    /// Whether it made a picture with specular luminance of an earlier view.
    pub stale_specular: bool,
    /// Faces in it that show light of others near by until their own comes.
    pub filled_faces: u64,
    /// The engine's updates that were taken in before it was drawn.
    pub updates: Vec<Update>,
}

impl FrameReport {
    /// Its row of the frame log, with the memory held by cache and device, bytes, and its error, where that was measured.
    #[must_use]
    pub fn record(&self, memory: u64, error: Option<FrameError>) -> FrameRecord {
        FrameRecord {
            frame: self.frame,
            at: self.at,
            camera_moved: self.camera_moved,
            passes: pass_record(&self.passes),
            engine: self.engine,
            memory_mib: Some(memory as f64 / f64::from(1 << 20)),
            error,
            stale_specular: self.stale_specular,
            filled_faces: self.filled_faces,
        }
    }
}

fn pass_record(passes: &FrameStats) -> PassRecord {
    let time = |ms: Option<f64>| ms.map(|ms| Duration::from_secs_f64(ms.max(0.0) * 1e-3));
    PassRecord {
        visibility: time(passes.visibility_ms),
        colour: time(passes.colour_ms),
        luminance: time(passes.luminance_ms),
        combine: time(passes.combine_ms),
        readback: time(passes.readback_ms),
        dirty_parents: Some(passes.patches.into()),
        children_drawn: Some(passes.triangles_drawn.into()),
        queries: Some(passes.queries.into()),
        query_pixels: Some(passes.query_pixels),
    }
}
