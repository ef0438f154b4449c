//! Update modes that are asked for while a renderer is at work.

use super::lookup::Lookup;
use super::luminance::Luminance;
use super::options::RendererOptions;
use super::renderer::Renderer;
use super::update::UpdateMode;
use crate::error::Result;
use crate::refine::update::DrawnId;
use crate::scene::Scene;

impl Renderer {
    /// Lets frames ask for a mode; `level` tells the splits above a drawn triangle of the scene that is loaded.
    ///
    /// # Errors
    /// As [`RendererOptions::check`]: nothing changes. [`crate::error::Error::Exhausted`] when memory runs out.
    pub fn add_mode(&mut self, mode: UpdateMode, scene: &Scene, level: impl Fn(DrawnId) -> u8) -> Result<()> {
        if self.options.modes.contains(&mode) {
            return Ok(());
        }
        let options = self.with_mode(mode);
        options.check(&self.device)?;
        if mode.needs_pipelines() {
            self.passes.luminance = Luminance::new(&self.device, &self.bindings, &options, self.needs)?;
        }
        if mode == UpdateMode::Lookup {
            self.lookup = Some(Lookup::of_mesh(&self.device, scene, &self.mesh, level)?);
        }
        self.options = options;
        Ok(())
    }

    /// Whether frames can ask for a mode, once it is [added](Self::add_mode), and get it.
    #[must_use]
    pub fn allows(&self, mode: UpdateMode) -> bool {
        let works = self.stencil_works() || !mode.needs_stencil();
        works && self.with_mode(mode).check(&self.device).is_ok()
    }

    fn with_mode(&self, mode: UpdateMode) -> RendererOptions {
        let modes = self.options.modes.iter().copied().chain([mode]).collect();
        RendererOptions { modes, ..self.options.clone() }
    }
}
