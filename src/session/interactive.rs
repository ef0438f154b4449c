//! What an interactive run changes on the way: the size of its pictures and how they are displayed.

use super::{Options, Session};
use crate::error::Result;
use crate::pass::UpdateMode;
use crate::scene::camera::{Camera, ImageSize, View};
use crate::scene::{Display, Scene};
use glam::Vec3;

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
    pub fn scene(&self) -> &Scene {
        &self.scene
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
    pub fn look_through(&mut self, camera: &Camera, factors: &[Vec3]) -> Result<()> {
        let view = self.clearance.view(&self.scene, camera, self.options.size);
        let factors = factors.to_vec();
        self.aim(super::Shot { view, camera: Some(*camera), factors, of_path: None, glossy: false })
    }
}
