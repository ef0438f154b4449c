//! What is shown: the session's picture with the panels over it, in a window or only in memory.

use crate::error::Result;
use crate::scene::camera::ImageSize;
use crate::vk::overlay::Gui;
use crate::vk::presenter::Presented;
use crate::vk::{Device, Image, Overlay, Presenter};
use ash::vk::Extent2D;
use egui::epaint::ImageDelta;
use egui::{Context, PlatformOutput, RawInput, TextureId, TextureOptions};
use std::sync::Arc;
use std::time::Duration;

/// The picture with the panels over it.
pub struct Screen {
    context: Context,
    gui: Gui,
    presenter: Option<Presenter>,
    overlay: Overlay,
    device: Arc<Device>,
}

/// What the panels ask of the window.
pub struct Asked {
    /// The form of the cursor and the like.
    pub platform: PlatformOutput,
    /// When they want to be laid out again, from now.
    pub again: Duration,
}

impl Screen {
    /// A screen of a size on a device, shown by a presenter if there is one.
    ///
    /// # Errors
    /// [`crate::error::Error::Exhausted`] when memory runs out.
    pub fn new(device: &Arc<Device>, size: ImageSize, presenter: Option<Presenter>, context: Context) -> Result<Self> {
        let overlay = Overlay::new(device, extent(size))?;
        Ok(Self { context, gui: Gui::default(), presenter, overlay, device: Arc::clone(device) })
    }

    /// The state of the panels.
    #[must_use]
    pub const fn context(&self) -> &Context {
        &self.context
    }

    /// Makes it of another size.
    ///
    /// # Errors
    /// [`crate::error::Error::Exhausted`] when memory runs out.
    pub fn resize(&mut self, size: ImageSize) -> Result<()> {
        if let Some(presenter) = &mut self.presenter {
            presenter.window_changed();
        }
        self.overlay.resize(&self.device, extent(size))
    }

    /// Gives up what shows pictures in the window.
    pub fn close(&mut self) {
        self.presenter = None;
    }

    /// Makes it anew on another device.
    ///
    /// # Errors
    /// [`crate::error::Error::Exhausted`] when memory runs out.
    pub fn replace(&mut self, device: &Arc<Device>, size: ImageSize, presenter: Option<Presenter>) -> Result<()> {
        (self.presenter, self.overlay) = (presenter, Overlay::new(device, extent(size))?);
        self.device = Arc::clone(device);
        // The only texture of the panels; it is there once they were laid out.
        if self.context.cumulative_pass_nr() > 0 {
            let letters = ImageDelta::full(self.context.fonts(|fonts| fonts.image()), TextureOptions::LINEAR);
            self.gui.textures.set.insert(TextureId::default(), vec![letters].into());
        }
        Ok(())
    }

    /// Lays the panels out.
    pub fn lay_out(&mut self, input: RawInput, mut build: impl FnMut(&Context)) -> Asked {
        let output = self.context.run_ui(input, |ui| build(ui.ctx()));
        // What was laid out before and not shown may have brought textures.
        self.gui.textures.append(output.textures_delta);
        self.gui.primitives = self.context.tessellate(output.shapes, output.pixels_per_point);
        self.gui.pixels_per_point = output.pixels_per_point;
        let again = output.viewport_output.values().map(|viewport| viewport.repaint_delay).min();
        Asked { platform: output.platform_output, again: again.unwrap_or(Duration::MAX) }
    }

    /// Shows a picture under the panels, in a window that is to be of a size; without a window it is there to be read.
    ///
    /// # Errors
    /// [`crate::error::Error::DeviceLost`], [`crate::error::Error::Exhausted`] when memory runs out.
    pub fn show(&mut self, picture: &Arc<Image>, window: ImageSize) -> Result<Presented> {
        let Some(presenter) = &mut self.presenter else {
            return self.overlay.compose(picture, &mut self.gui).map(|()| Presented::Shown);
        };
        presenter.present(picture, &mut self.overlay, &mut self.gui, extent(window))
    }

    /// What it shows, row by row from the top left: sRGB, A is the coverage.
    ///
    /// # Errors
    /// [`crate::error::Error::DeviceLost`], [`crate::error::Error::Exhausted`] when memory runs out.
    pub fn read(&mut self) -> Result<Vec<[u8; 4]>> {
        self.overlay.read(&self.device)
    }
}

const fn extent(size: ImageSize) -> Extent2D {
    Extent2D { width: size.width, height: size.height }
}
