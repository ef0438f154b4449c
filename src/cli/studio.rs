//! The recordings that `compare` replays: a refinement under each tilt of the camera.

use super::args::{CompareArgs, Tilt};
use super::interrupt::Signals;
use super::tilts::{Anchor, view};
use crate::compare::Recording;
use crate::compare::names::make_distinct;
use crate::error::{Error, Result};
use crate::geom::bvh::Bvh;
use crate::pass::Renderer;
use crate::scene::Scene;
use crate::scene::camera::Camera;
use crate::session::{Session, owned_engine};
use glam::Vec2;
use std::sync::Arc;

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

    /// Refines what a tilted camera sees. A signal ends it early.
    ///
    /// # Errors
    /// The device is lost or memory runs out.
    pub fn record(&self, mut renderer: Renderer, anchor: &Anchor, tilt: Tilt) -> Result<(Renderer, Recording)> {
        let camera = anchor.camera(&self.scene, &self.bvh, &self.camera, tilt);
        let view = view(&self.scene, &self.bvh, &camera, self.args.size, self.args.what.near);
        let options = self.args.options();
        let engine = owned_engine(&self.scene, &self.bvh, &options)?;
        renderer.reset_drawn();
        let mut session = Session::new(renderer, engine, &self.scene, &options);
        let mut updates = session.record(&view, self.args.recording.updates, &mut Signals)?;
        make_distinct(&mut updates);
        let recording = Recording { tilt: tilt.name(), degrees: tilt.degrees(), camera, view, updates };
        Ok((session.into_renderer(), recording))
    }
}
