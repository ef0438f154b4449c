//! A refinement recorded: what the engine tells the renderer, update by update.

use super::Session;
use super::observer::Observer;
use super::visible::visible_faces;
use crate::error::Result;
use crate::refine::engine::Counted;
use crate::refine::replay::HostMesh;
use crate::refine::update::{EngineStats, Update};
use crate::scene::camera::View;

/// Rays between two looks at whether the recording is broken off.
const BATCH: u64 = 50_000;

impl Session {
    /// Refines a view for so many updates, and returns them: the first shows all of it. Every visible vertex has a first value before it
    /// starts, so that what is recorded are splits and values that get better. For a session that has looked at nothing yet. Ends
    /// early when nothing is left to do, or the
    /// observer interrupts. For an engine that is owned, or works at a fixed pace.
    ///
    /// # Errors
    /// As [`Self::step`].
    pub fn record(&mut self, view: &View, updates: u32, observer: &mut dyn Observer) -> Result<Vec<Update>> {
        let mut mesh = self.light_vertices(view, observer)?;
        self.look(view, &[])?;
        let before = self.step(observer)?.updates;
        before.iter().try_for_each(|update| mesh.apply(update))?;
        let mut recorded: Vec<Update> = before.last().map(|last| mesh.whole(last)).into_iter().collect();
        for _ in 0..updates {
            if observer.interrupted() || self.is_idle() {
                break;
            }
            recorded.extend(self.step(observer)?.updates);
        }
        Ok(recorded)
    }

    /// Gives every vertex that a view shows a first value, without drawing; returns the mesh that is there then.
    fn light_vertices(&mut self, view: &View, observer: &dyn Observer) -> Result<HostMesh> {
        let (faces, image) = visible_faces(&mut self.renderer, view, self.options.redraws)?;
        self.send_view(faces, image, &[]);
        let mut mesh = HostMesh::default();
        loop {
            let update = self.engine.wait()?;
            mesh.apply(&update)?;
            let EngineStats { complete, .. } = update.stats;
            let Update { generation, sequence, .. } = update;
            self.apply(&[update])?;
            if complete || observer.interrupted() {
                return Ok(mesh);
            }
            self.engine.counted(Counted { generation, sequence, pixels: Vec::new() });
            self.engine.step(BATCH);
        }
    }
}
