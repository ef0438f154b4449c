//! Another scene in a session that goes on: what was edited, loaded again.

use super::Session;
use super::counting::Counting;
use super::light_engine::LightEngine;
use super::setup::{engine_thread, owned_engine};
use crate::error::Result;
use crate::geom::bvh::Bvh;
use crate::refine::replay::Levels;
use crate::refine::update::EngineStats;
use crate::scene::Scene;
use crate::scene::extent::Clearance;
use std::sync::Arc;

impl Session {
    /// Takes a scene with its hierarchy in place of the present one; light is found anew. How pictures are displayed goes by the new
    /// scene if it went by the old. [Look](Self::look) next.
    ///
    /// # Errors
    /// [`crate::error::Error::Exhausted`] when memory or threads run out, [`crate::error::Error::DeviceLost`].
    pub fn replace_scene(&mut self, scene: &Arc<Scene>, bvh: Arc<Bvh>) -> Result<()> {
        self.renderer.load(scene)?;
        self.engine = match &self.engine {
            LightEngine::Thread(_) => {
                LightEngine::Thread(engine_thread(scene, move |_| bvh, &self.options, self.frames_come)?)
            }
            LightEngine::Owned(_) => owned_engine(scene, &bvh, &self.options)?,
        };
        if self.display == self.scene.display {
            self.set_display(scene.display);
        }
        (self.scene, self.clearance) = (Arc::clone(scene), Clearance::new(scene));
        self.counting = Counting::new(&self.options, self.renderer.device());
        self.levels = Levels::default();
        self.stats = EngineStats::default();
        (self.shot, self.generation, self.rests) = (None, None, false);
        Ok(())
    }
}
