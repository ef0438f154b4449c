//! The scene and the light as texels, beside their device addresses.
//!
//! A software rasteriser loads by address in a loop over the pixels that it works on, and gathers texels of all at once (docs/lavapipe.md).

use super::renderer::{Passes, Renderer};
use super::shared::TEXEL_BUFFERS;
use crate::error::Result;
use crate::vk::Buffer;
use crate::vk::buffer::Texel;

impl Renderer {
    /// Has shaders read the buffers as they are now; by address for good once a buffer is too large to be read as texels.
    pub(super) fn bind_texel_buffers(&mut self) -> Result<()> {
        let Self { scene, mesh, drawn_list, bindings, .. } = self;
        let buffers: [(&Buffer, Texel); TEXEL_BUFFERS] = [
            (&scene.positions, Texel::Quad),
            (&scene.triangles, Texel::Quad),
            (&scene.visibility_triangles, Texel::Quad),
            (&scene.materials, Texel::Quad),
            (&scene.textures, Texel::Quad),
            (&scene.texels, Texel::Word),
            (mesh.slots.buffer(), Texel::Word),
            (mesh.drawn_triangles.buffer(), Texel::Word),
            (drawn_list.buffer(), Texel::Word),
        ];
        bindings.bind_texel_buffers(&buffers);
        if self.options.texel_buffers && !buffers.iter().all(|(buffer, texel)| buffer.fits(*texel)) {
            self.options.texel_buffers = false;
            self.passes = Passes::new(&self.device, &self.bindings, &self.options, self.needs)?;
        }
        Ok(())
    }
}
