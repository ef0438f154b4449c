//! Pipelines made for the scene that is loaded.

use super::colour::Colour;
use super::combine::Combine;
use super::luminance::Luminance;
use super::needs::Needs;
use super::renderer::Renderer;
use crate::error::Result;
use crate::scene::Scene;
use crate::vk::commands::Load;

impl Renderer {
    /// Makes the pipelines anew if they leave out what a scene needs, or what it does not need is to be left out.
    pub(super) fn tailor(&mut self, scene: &Scene) -> Result<()> {
        let needs = if self.options.tailored { Needs::of(scene) } else { Needs::at_least(scene) };
        // The empty one that stands for none leaves all as it is.
        if scene.triangles.is_empty() || needs == self.needs {
            return Ok(());
        }
        self.needs = needs;
        let Self { device, bindings, options, passes, .. } = self;
        passes.colour = Colour::new(device, bindings, options, needs)?;
        passes.luminance = Luminance::new(device, bindings, options, needs)?;
        passes.combine = Combine::new(device, bindings, options, (needs, passes.combine.tone_mapping()))?;
        self.clear_undrawn_specular()
    }

    /// Makes S zero everywhere if no frame draws it.
    pub(super) fn clear_undrawn_specular(&mut self) -> Result<()> {
        if self.needs.draws_specular(&self.options) {
            return Ok(());
        }
        let targets = &self.targets;
        let mut recording = self.commands.begin()?;
        recording.pass("no highlights", |pass| pass.render(&[&targets.specular], None, Load::Clear(0.0), |_| {}));
        recording.submit().map(|_| ())
    }
}
