//! The scene and the light as texels of a word each, beside their device addresses.
//!
//! A software rasteriser loads by address in a loop over the pixels that it works on, and gathers texels of all at once (docs/lavapipe.md).

use super::renderer::{Passes, Renderer};
use crate::error::Result;

/// Buffers that `glsl/include/scene.glsl` reads so.
pub(super) const COUNT: u32 = 9;

impl Renderer {
    /// Has shaders read the buffers as they are now; by address for good once a buffer is too large to be read as texels.
    pub(super) fn bind_texel_buffers(&mut self) -> Result<()> {
        let Self { scene, mesh, drawn_list, bindings, .. } = self;
        let buffers = [
            &scene.positions,
            &scene.triangles,
            &scene.visibility_triangles,
            &scene.materials,
            &scene.textures,
            &scene.texels,
            mesh.slots.buffer(),
            mesh.drawn_triangles.buffer(),
            drawn_list.buffer(),
        ];
        bindings.bind_texel_buffers(&buffers);
        if self.options.texel_buffers && !buffers.iter().all(|buffer| buffer.fits_texels()) {
            self.options.texel_buffers = false;
            self.passes = Passes::new(&self.device, &self.bindings, &self.options)?;
        }
        Ok(())
    }
}
