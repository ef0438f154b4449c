//! What a renderer shows in place of the picture.

use super::debug_view::DebugImage;
use super::renderer::Renderer;
use crate::error::Result;
use crate::refine::update::DrawnId;
use glam::Vec4;

impl Renderer {
    /// Has the next pictures show something else in their place; `None` the picture itself.
    pub fn set_debug_image(&mut self, image: Option<DebugImage>) {
        self.debug.image = image;
    }

    /// What is shown in place of the picture.
    #[must_use]
    pub const fn debug_image(&self) -> Option<DebugImage> {
        self.debug.image
    }

    /// Takes the reference that debug views show: radiance, W·sr⁻¹·m⁻², and coverage of each pixel, row by row.
    ///
    /// # Errors
    /// [`crate::error::Error::Exhausted`] when memory runs out.
    pub fn set_reference(&mut self, radiance: &[Vec4]) -> Result<()> {
        let Self { debug, device, uniform, .. } = self;
        debug.reference(device, uniform)?.replace(radiance.to_vec());
        Ok(())
    }

    /// Takes the numbers of drawn triangles that debug views show; those of others stay.
    ///
    /// # Errors
    /// [`crate::error::Error::Exhausted`] when memory runs out.
    pub fn set_debug_values(&mut self, values: impl IntoIterator<Item = (DrawnId, u32)>) -> Result<()> {
        let Self { debug, device, uniform, .. } = self;
        let numbers = debug.values(device, uniform)?;
        values.into_iter().for_each(|(drawn, value)| numbers.set(drawn.0, value));
        Ok(())
    }
}
