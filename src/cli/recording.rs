//! One refinement recorded for `compare`: what the engine tells the GPU, update by update.

use super::args::{CompareArgs, Tilt, thread_count};
use super::tilts::{Anchor, view};
use super::{interrupt, refinement};
use crate::compare::Recording;
use crate::compare::names::make_distinct;
use crate::error::{Error, Result};
use crate::geom::bvh::Bvh;
use crate::pass::{FrameOptions, Renderer, UpdateMode};
use crate::refine::engine::{Budget, Counted, Engine, Visible};
use crate::refine::update::Update;
use crate::refine::workers::Workers;
use crate::scene::Scene;
use crate::scene::camera::Camera;
use glam::Vec2;
use std::sync::Arc;

/// Rays between two looks at whether a signal came.
const BATCH: u64 = 50_000;

/// What all recordings of a run share.
pub struct Studio<'a> {
    /// What was typed.
    pub args: &'a CompareArgs,
    /// The scene.
    pub scene: Arc<Scene>,
    /// Its hierarchy.
    pub bvh: Arc<Bvh>,
    /// The scene's camera.
    pub camera: Camera,
}

impl Studio<'_> {
    /// The main surface that the scene's camera sees.
    ///
    /// # Errors
    /// [`Error::Usage`] if it sees nothing; the device is lost.
    pub fn anchor(&self, renderer: &mut Renderer) -> Result<Anchor> {
        let view = view(&self.scene, &self.bvh, &self.camera, self.args.size, self.args.what.near);
        renderer.set_view(&view, Vec2::ZERO);
        renderer.visibility()?;
        let face_id = renderer.read_layers()?.face_id;
        Anchor::find(&self.scene, &view, &face_id).ok_or_else(|| {
            Error::Usage("the camera sees nothing that could be lit; choose another by --camera".to_owned())
        })
    }

    /// Refines what a tilted camera sees. Every visible vertex has a first value before it starts, so that what is
    /// recorded are splits and values that get better. A signal ends it early.
    ///
    /// # Errors
    /// The device is lost or memory runs out.
    pub fn record(&self, renderer: &mut Renderer, anchor: &Anchor, tilt: Tilt) -> Result<Recording> {
        let camera = anchor.camera(&self.scene, &self.bvh, &self.camera, tilt);
        let view = view(&self.scene, &self.bvh, &camera, self.args.size, self.args.what.near);
        renderer.set_view(&view, Vec2::ZERO);
        let faces = renderer.visibility()?;
        let threads = thread_count(self.args.recording.threads);
        let workers = Workers::new(threads).map_err(|e| Error::Exhausted(format!("cannot start threads: {e}")))?;
        let options = refinement::options_of_compare(self.args, &self.scene);
        let mut engine = Engine::new(Arc::clone(&self.scene), Arc::clone(&self.bvh), workers, options);
        let seen = |generation| Visible { generation, eye: view.eye, view: Some(view), faces: faces.clone() };
        let mut first = engine.set_visible(&seen(1));
        while !first.stats.complete && !interrupt::requested() {
            let update = engine.step(Budget::Rays(BATCH));
            engine.counted(&Counted { generation: 1, sequence: update.sequence, pixels: None, complete: false });
            first.stats = update.stats;
        }
        let mut updates = vec![engine.set_visible(&seen(2))];
        renderer.reset_drawn();
        self.show(renderer, &mut engine, &updates[0])?;
        for _ in 0..self.args.recording.updates {
            if interrupt::requested() || engine.is_idle() {
                break;
            }
            let update = engine.step(Budget::Rays(self.args.recording.rays));
            self.show(renderer, &mut engine, &update)?;
            updates.push(update);
        }
        make_distinct(&mut updates);
        Ok(Recording { tilt: tilt.name(), degrees: tilt.degrees(), camera, view, updates })
    }

    /// Draws an update and tells the engine how many pixels its triangles have.
    fn show(&self, renderer: &mut Renderer, engine: &mut Engine, update: &Update) -> Result<()> {
        renderer.apply(update)?;
        let update_mode = UpdateMode::Full;
        renderer.frame(&FrameOptions { full_luminance: true, update_mode, ..FrameOptions::default() })?;
        let (sequence, pixels) = (renderer.drawn_sequence(), Some(renderer.drawn_counts()?.drawn_triangles));
        engine.counted(&Counted { generation: update.generation, sequence, pixels, complete: true });
        Ok(())
    }
}
