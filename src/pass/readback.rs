//! Read-back: images to the host.

use super::targets::Targets;
use crate::error::Result;
use crate::vk::buffer::BufferUse;
use crate::vk::{Buffer, Device, Pass};
use half::f16;

/// The layers of a frame, a value a pixel, row by row from the top left; radiometric units, linear Rec.709.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Layers {
    /// L = L_e + k_d D + k_s S, W·sr⁻¹·m⁻²; A is the coverage.
    pub combined: Vec<[f32; 4]>,
    /// Emitted radiance L_e, W·sr⁻¹·m⁻².
    pub le: Vec<[f32; 3]>,
    /// Diffuse reflectance k_d.
    pub kd: Vec<[f32; 3]>,
    /// Specular reflectance k_s.
    pub ks: Vec<[f32; 3]>,
    /// Diffuse luminance D, W·sr⁻¹·m⁻².
    pub d: Vec<[f32; 3]>,
    /// Specular luminance S, W·sr⁻¹·m⁻².
    pub s: Vec<[f32; 3]>,
    /// Face id + 1; 0 without geometry.
    pub face_id: Vec<u32>,
    /// Id of the drawn triangle + 1; 0 where none was drawn.
    pub drawn_id: Vec<u32>,
}

/// The luminance images, a value a pixel, row by row from the top left.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LuminanceLayers {
    /// Diffuse luminance D as drawn, W·sr⁻¹·m⁻²: 0 where no drawn triangle was.
    pub d: Vec<[f32; 3]>,
    /// Specular luminance S, W·sr⁻¹·m⁻².
    pub s: Vec<[f32; 3]>,
    /// Times that each pixel was written since all drawn triangles were drawn, that time included, where the renderer was made to count
    /// them; else 1 where a drawn triangle was drawn. Exact up to 2048.
    pub writes: Vec<u16>,
    /// Id of the drawn triangle + 1; 0 where none was drawn.
    pub drawn_id: Vec<u32>,
}

/// Bytes a pixel of each copied image: linear, L_e, k_d, k_s, D, S, ids of faces and of drawn triangles.
const LAYER_BYTES: [u64; 8] = [16, 8, 8, 8, 8, 8, 4, 4];

/// A host-visible buffer that holds all layers of a frame at once.
pub(super) struct ReadBack {
    buffer: Buffer,
    pixels: usize,
}

impl ReadBack {
    pub(super) fn new(device: &Device, pixels: usize) -> Result<Self> {
        let bytes = LAYER_BYTES.iter().sum::<u64>() * pixels as u64;
        Ok(Self { buffer: Buffer::new(device, "read-back", bytes, BufferUse::ReadBack)?, pixels })
    }

    pub(super) fn record_ids<'a>(&'a self, pass: &Pass<'a>, targets: &'a Targets) {
        pass.copy_image(&targets.ids, &self.buffer, 0);
    }

    pub(super) fn record_depth<'a>(&'a self, pass: &Pass<'a>, targets: &'a Targets) {
        pass.copy_depth(&targets.visibility_depth, &self.buffer, 0);
    }

    pub(super) fn record_drawn_ids<'a>(&'a self, pass: &Pass<'a>, targets: &'a Targets) {
        pass.copy_image(&targets.drawn_ids, &self.buffer, 0);
    }

    pub(super) fn record_display<'a>(&'a self, pass: &Pass<'a>, targets: &'a Targets) {
        pass.copy_image(&targets.display, &self.buffer, 0);
    }

    pub(super) fn record_layers<'a>(&'a self, pass: &Pass<'a>, targets: &'a Targets) {
        let (emission, kd, ks, ids) = (&targets.emission, &targets.kd, &targets.ks, &targets.ids);
        let drawn_triangles = &targets.drawn_ids;
        let images = [
            &targets.linear,
            emission,
            kd,
            ks,
            &targets.filled_diffuse,
            &targets.filled_specular,
            ids,
            drawn_triangles,
        ];
        for (number, image) in images.into_iter().enumerate() {
            pass.copy_image(image, &self.buffer, self.offset(number));
        }
    }

    pub(super) fn record_luminance<'a>(&'a self, pass: &Pass<'a>, targets: &'a Targets) {
        let images = [(4, &targets.diffuse), (5, &targets.specular), (7, &targets.drawn_ids)];
        for (number, image) in images {
            pass.copy_image(image, &self.buffer, self.offset(number));
        }
    }

    /// What [`Self::record_luminance`] copied, its scale undone.
    pub(super) fn luminance(&self, scale: f32) -> Result<LuminanceLayers> {
        let diffuse: &[[f16; 4]] = self.buffer.view(self.offset(4), self.pixels)?;
        Ok(LuminanceLayers {
            d: self.colour(4, scale)?,
            s: self.colour(5, scale)?,
            writes: diffuse.iter().map(|h| h[3].to_f32() as u16).collect(),
            drawn_id: self.buffer.read(self.offset(7), self.pixels)?,
        })
    }

    fn offset(&self, layer: usize) -> u64 {
        LAYER_BYTES[..layer].iter().sum::<u64>() * self.pixels as u64
    }

    /// What [`Self::record_ids`] or [`Self::record_drawn_ids`] copied.
    pub(super) fn ids(&self) -> Result<&[u32]> {
        self.buffer.view(0, self.pixels)
    }

    /// What [`Self::record_depth`] copied.
    pub(super) fn depth(&self) -> Result<&[f32]> {
        self.buffer.view(0, self.pixels)
    }

    pub(super) fn display(&self) -> Result<Vec<[u8; 4]>> {
        self.buffer.read(0, self.pixels)
    }

    /// The layers, their scales undone.
    pub(super) fn layers(&self, emission_scale: f32, luminance_scale: f32) -> Result<Layers> {
        Ok(Layers {
            combined: self.buffer.read(0, self.pixels)?,
            le: self.colour(1, emission_scale)?,
            kd: self.colour(2, 1.0)?,
            ks: self.colour(3, 1.0)?,
            d: self.colour(4, luminance_scale)?,
            s: self.colour(5, luminance_scale)?,
            face_id: self.buffer.read(self.offset(6), self.pixels)?,
            drawn_id: self.buffer.read(self.offset(7), self.pixels)?,
        })
    }

    fn colour(&self, layer: usize, scale: f32) -> Result<Vec<[f32; 3]>> {
        let halves: Vec<[f16; 4]> = self.buffer.read(self.offset(layer), self.pixels)?;
        Ok(halves.iter().map(|h| [h[0], h[1], h[2]].map(|c| c.to_f32() / scale)).collect())
    }
}
