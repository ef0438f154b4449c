//! What a material's k_d is multiplied by, as one picture: colour, cut-outs, and of metals the share that reflects diffusely.

use crate::image::tone_mapping::encode_srgb;
use crate::scene::Scene;
use crate::scene::material::{Material, Model, TextureMap};
use crate::scene::texture::Encoding;
use glam::{Mat2, Vec2, Vec3};
use rayon::prelude::*;
use std::io;

/// A picture in sRGB with alpha, top row first.
pub struct BaseTexture {
    /// Width and height.
    pub extent: [u32; 2],
    /// Texels.
    pub texels: Vec<[u8; 4]>,
}

/// The maps that a base texture is put together of.
struct Maps<'a> {
    kd: Option<&'a TextureMap>,
    cut_out: Option<&'a TextureMap>,
    /// With what it is multiplied by.
    metallic: Option<(&'a TextureMap, f32)>,
}

impl<'a> Maps<'a> {
    fn of(material: &'a Material) -> Self {
        let metallic = match &material.model {
            Model::MetallicRoughness(model) => model.map_metallic.as_ref().map(|map| (map, model.metallic)),
            Model::Phong(_) => None,
        };
        Self { kd: material.map_kd.as_ref(), cut_out: material.map_d.as_ref(), metallic }
    }

    fn all(&self) -> impl Iterator<Item = &'a TextureMap> {
        self.kd.into_iter().chain(self.cut_out).chain(self.metallic.map(|(map, _)| map))
    }
}

/// The map whose coordinates a material's base texture is looked up by.
#[must_use]
pub fn placed_by(material: &Material) -> Option<&TextureMap> {
    Maps::of(material).all().next()
}

impl BaseTexture {
    /// That of a material; `None` if nothing of it is textured. All maps are looked up where the first is.
    #[must_use]
    pub fn of(scene: &Scene, material: &Material) -> Option<Self> {
        let maps = Maps::of(material);
        let first = maps.all().next()?;
        if let (Some(kd), None, None) = (maps.kd, maps.cut_out, maps.metallic)
            && scene.texture(kd).encoding() == Encoding::Srgb
        {
            let texture = scene.texture(kd);
            let extent = texture.extents()[0];
            let count = extent[0] as usize * extent[1] as usize;
            let texels = texture.texels()[..count].iter().map(|&[r, g, b, _]| [r, g, b, 255]).collect();
            return Some(Self { extent, texels });
        }
        let extents = maps.all().map(|map| scene.texture(map).extents()[0]);
        let extent = extents.reduce(|a, b| [a[0].max(b[0]), a[1].max(b[1])])?;
        let [width, height] = extent;
        let size = Vec2::new(width as f32, height as f32);
        let back = if first.matrix.determinant() == 0.0 { Mat2::IDENTITY } else { first.matrix.inverse() };
        let texel = |i: usize| {
            let [x, y] = [i % width as usize, i / width as usize].map(|c| c as f32 + 0.5);
            let at = Vec2::new(x, size.y - y) / size;
            maps.look_up(scene, back * (at - first.offset))
        };
        let texels = (0..width as usize * height as usize).into_par_iter().map(texel).collect();
        Some(Self { extent, texels })
    }

    /// The bytes of a PNG file.
    ///
    /// # Errors
    /// What the encoder says.
    pub fn png(&self) -> io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        let mut encoder = ::png::Encoder::new(&mut bytes, self.extent[0], self.extent[1]);
        let is_opaque = self.texels.iter().all(|texel| texel[3] == 255);
        encoder.set_color(if is_opaque { ::png::ColorType::Rgb } else { ::png::ColorType::Rgba });
        encoder.set_depth(::png::BitDepth::Eight);
        encoder.set_compression(::png::Compression::Fast);
        encoder.set_source_srgb(::png::SrgbRenderingIntent::Perceptual);
        let mut writer = encoder.write_header().map_err(io::Error::other)?;
        if is_opaque {
            let rgb: Vec<[u8; 3]> = self.texels.iter().map(|&[r, g, b, _]| [r, g, b]).collect();
            writer.write_image_data(rgb.as_flattened()).map_err(io::Error::other)?;
        } else {
            writer.write_image_data(self.texels.as_flattened()).map_err(io::Error::other)?;
        }
        writer.finish().map_err(io::Error::other)?;
        Ok(bytes)
    }
}

impl Maps<'_> {
    fn look_up(&self, scene: &Scene, uv: Vec2) -> [u8; 4] {
        let rgb = |map: &TextureMap| scene.texture(map).rgb(map.place(uv), map.wrap);
        let kd = self.kd.map_or(Vec3::ONE, rgb) * self.metallic.map_or(1.0, |(map, share)| 1.0 - share * rgb(map).z);
        let alpha = self.cut_out.map_or(1.0, |map| scene.texture(map).alpha(map.place(uv), map.wrap));
        let [r, g, b] = kd.to_array().map(encode_srgb);
        [r, g, b, alpha].map(|c| (c * 255.0 + 0.5) as u8)
    }
}
