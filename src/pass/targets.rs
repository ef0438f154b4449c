//! The images that the passes draw into.

use super::depth::Depth;
use crate::error::Result;
use crate::scene::camera::ImageSize;
use crate::vk::report::{COLOUR_FORMAT, DISPLAY_FORMAT, ID_FORMAT, LINEAR_FORMAT};
use crate::vk::{Commands, Device, Image};
use ash::vk::Extent2D;
use std::sync::Arc;

/// All images of a frame, of one size.
pub(super) struct Targets {
    pub size: ImageSize,
    /// Face id + 1, 0 without geometry.
    pub ids: Image,
    pub visibility_depth: Image,
    /// k_d, linear; A is the coverage.
    pub kd: Image,
    /// k_s, linear.
    pub ks: Image,
    /// L_e, W·sr⁻¹·m⁻², times the emission scale.
    pub emission: Image,
    /// D, W·sr⁻¹·m⁻², times the luminance scale; A is 1 where a drawn triangle was drawn, 0 elsewhere.
    pub diffuse: Image,
    /// S likewise.
    pub specular: Image,
    /// Id of the drawn triangle + 1, 0 where none was drawn.
    pub drawn_ids: Image,
    /// The luminance pass's own: it holds the depth of drawn triangles, not of the scene's triangles.
    pub luminance_depth: Image,
    /// The picture as displayed; a window may still be reading it when these targets go.
    pub display: Arc<Image>,
    /// The picture in linear light, radiance in W·sr⁻¹·m⁻²; A is the coverage.
    pub linear: Image,
    /// D and S, W·sr⁻¹·m⁻², times the luminance scale, with values where no drawn triangle was drawn but a face shows.
    pub filled_diffuse: Image,
    pub filled_specular: Image,
}

impl Targets {
    pub(super) fn new(device: &Device, commands: &mut Commands, size: ImageSize, depth: Depth) -> Result<Self> {
        let extent = Extent2D { width: size.width, height: size.height };
        // Not elsewhere: hardware may then keep it in a slower form.
        let copied = device.report().is_cpu();
        let colour = |name| Image::colour(device, name, extent, COLOUR_FORMAT);
        let targets = Self {
            size,
            ids: Image::colour(device, "face ids", extent, ID_FORMAT)?,
            visibility_depth: Image::depth_stencil(device, "visibility depth", extent, depth.format, copied)?,
            kd: colour("k_d")?,
            ks: colour("k_s")?,
            emission: colour("L_e")?,
            diffuse: colour("D")?,
            specular: colour("S")?,
            drawn_ids: Image::colour(device, "drawn ids", extent, ID_FORMAT)?,
            luminance_depth: Image::depth_stencil(device, "luminance depth", extent, depth.format, false)?,
            display: Arc::new(Image::colour(device, "display", extent, DISPLAY_FORMAT)?),
            linear: Image::colour(device, "linear", extent, LINEAR_FORMAT)?,
            filled_diffuse: colour("D filled")?,
            filled_specular: colour("S filled")?,
        };
        let mut recording = commands.begin()?;
        recording.pass("new images", |pass| pass.first_use(targets.all()));
        recording.submit()?;
        Ok(targets)
    }

    /// The images that shaders read, in the order of `glsl/include/images.glsl`.
    pub(super) fn sampled(&self) -> [&Image; 6] {
        [&self.ids, &self.kd, &self.ks, &self.emission, &self.diffuse, &self.specular]
    }

    fn all(&self) -> [&Image; 13] {
        let [ids, kd, ks, emission, diffuse, specular] = self.sampled();
        let (depth, own) = (&self.visibility_depth, &self.luminance_depth);
        let pictures = (&self.display, &self.linear, &self.filled_diffuse, &self.filled_specular);
        let (display, linear, filled_diffuse, filled_specular) = pictures;
        let drawn_triangles = &self.drawn_ids;
        [
            ids,
            depth,
            kd,
            ks,
            emission,
            diffuse,
            specular,
            drawn_triangles,
            own,
            display,
            linear,
            filled_diffuse,
            filled_specular,
        ]
    }
}
