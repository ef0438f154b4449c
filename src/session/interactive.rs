//! What an interactive run changes on the way: the size of its pictures and how they are displayed.

use super::{Options, Session};
use crate::error::Result;
use crate::geom::bvh::Bvh;
use crate::pass::UpdateMode;
use crate::scene::camera::{Camera, ImageSize, View};
use crate::scene::light::LightState;
use crate::scene::{Display, Scene};
use glam::Vec4;
use std::sync::Arc;

impl Session {
    /// Makes the pictures of a size; light that was found stays. [Look](Self::look) again next.
    ///
    /// # Errors
    /// As [`crate::pass::Renderer::resize`]; the size stays as it was.
    pub fn resize(&mut self, size: ImageSize) -> Result<()> {
        self.renderer.resize(size)?;
        self.options.size = size;
        Ok(())
    }

    /// Changes how pictures are displayed; the next frame makes one.
    pub fn set_display(&mut self, display: Display) {
        self.redisplay |= display != self.display;
        self.display = display;
    }

    /// How pictures are displayed.
    #[must_use]
    pub const fn display(&self) -> Display {
        self.display
    }

    /// Changes how changed lighting is redrawn.
    ///
    /// # Errors
    /// [`crate::error::Error::NoDevice`] naming what the device lacks for it; the mode stays as it was.
    pub fn set_update_mode(&mut self, mode: UpdateMode) -> Result<()> {
        let levels = &self.levels;
        self.renderer.add_mode(mode, &self.scene, |drawn| levels.of(drawn))?;
        self.renderer.draw_all_next();
        self.options.update = mode;
        Ok(())
    }

    /// How changed lighting is redrawn.
    #[must_use]
    pub const fn update_mode(&self) -> UpdateMode {
        self.options.update
    }

    /// Size of the pictures, pixels.
    #[must_use]
    pub const fn size(&self) -> ImageSize {
        self.options.size
    }

    /// How it runs, at its present size.
    #[must_use]
    pub const fn options(&self) -> &Options {
        &self.options
    }

    /// The scene.
    #[must_use]
    pub const fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// Its size, scene units ([`Scene::scale`]).
    #[must_use]
    pub const fn scale(&self) -> f32 {
        self.clearance.scale()
    }

    /// Its hierarchy, once that is made.
    #[must_use]
    pub fn hierarchy(&self) -> Option<&Arc<Bvh>> {
        self.engine.hierarchy()
    }

    /// Has the engine do nothing but answer, for others to have the cores, or work on.
    pub fn rest(&mut self, rests: bool) {
        if std::mem::replace(&mut self.rests, rests) != rests {
            self.engine.rest(rests);
        }
    }

    /// Takes what [`super::DebugView::Reference`] and [`super::DebugView::Beside`] show: radiance, W·sr⁻¹·m⁻², and coverage of each pixel,
    /// row by row.
    ///
    /// # Errors
    /// [`crate::error::Error::Exhausted`] when memory runs out.
    pub fn set_reference(&mut self, radiance: &[Vec4]) -> Result<()> {
        self.redisplay = true;
        self.renderer.set_reference(radiance)
    }

    /// What is looked at.
    #[must_use]
    pub fn view(&self) -> Option<&View> {
        self.shot.as_ref().map(|shot| &shot.view)
    }

    /// Points a camera at the scene, as [`Self::look`] does; written images tell of the camera.
    ///
    /// # Errors
    /// [`crate::error::Error::DeviceLost`], [`crate::error::Error::Exhausted`] when memory runs out.
    pub fn look_through(&mut self, camera: &Camera, lights: &[LightState]) -> Result<()> {
        let view = self.clearance.view(&self.scene, camera, self.options.size);
        let lights = lights.to_vec();
        self.aim(super::Shot { view, camera: Some(*camera), lights, of_path: None, glossy: false })
    }
}
