//! From texture references to how textures are looked up here, with v up.

use super::document::{Document, Image};
use crate::scene::texel_source::Recipe;
use crate::scene::texture::Wrap;
use crate::scene::textures::{ImageAt, Placing, Request};
use ::gltf::json::extensions::texture::TextureTransform;
use ::gltf::json::material::NormalTexture;
use ::gltf::json::texture::{Info, WrappingMode};
use ::gltf::json::validation::Checked;
use glam::{DMat2, DVec2};

/// A material's reference to a texture.
#[derive(Clone, Copy)]
pub(super) struct TextureRef<'d> {
    /// Number of the texture.
    index: usize,
    /// Which texture coordinates it is looked up by.
    pub set: u32,
    transform: Option<&'d TextureTransform>,
}

impl<'d> TextureRef<'d> {
    /// That of a colour.
    pub(super) fn of(info: &'d Info) -> Self {
        let transform = info.extensions.as_ref().and_then(|extensions| extensions.texture_transform.as_ref());
        Self::new(info.index.value(), info.tex_coord, transform)
    }

    /// That of a normal map.
    pub(super) fn of_normals(normals: &NormalTexture, transform: Option<&'d TextureTransform>) -> Self {
        Self::new(normals.index.value(), normals.tex_coord, transform)
    }

    fn new(index: usize, tex_coord: u32, transform: Option<&'d TextureTransform>) -> Self {
        let set = transform.and_then(|transform| transform.tex_coord).unwrap_or(tex_coord);
        Self { index, set, transform }
    }
}

/// A texture that a material looks up.
#[derive(Clone, Debug)]
pub(super) struct Map {
    image: usize,
    recipe: Recipe,
    placing: Placing,
}

impl Map {
    /// The texture of a reference, made by `recipe`, or why it cannot be used.
    pub(super) fn new(document: &Document, texture: TextureRef<'_>, recipe: Recipe) -> Result<Self, String> {
        let number = texture.index;
        let found = document.root.textures.get(number).ok_or(format!("there is no texture {number}"))?;
        let image = found.source.value();
        if image == u32::MAX as usize {
            let names: Vec<&str> = document.names.textures.get(number).iter().flat_map(|t| t.names()).collect();
            return Err(match names.as_slice() {
                [] => format!("texture {number} names no image"),
                names => format!("texture {number} has its image by {} only, which is not supported", names.join(", ")),
            });
        }
        document.image(image).map_err(|why| format!("texture {number}: {why}"))?;
        let mut wrap = [Wrap::Repeat; 2];
        if let Some(sampler) = found.sampler {
            let number = sampler.value();
            let sampler = document.root.samplers.get(number).ok_or(format!("there is no sampler {number}"))?;
            wrap = [sampler.wrap_s, sampler.wrap_t].map(wrap_of);
        }
        Ok(Self { image, recipe, placing: Placing { wrap, ..placing(texture.transform)? } })
    }

    /// What is asked of the loader of textures.
    pub(super) fn request<'d>(&self, document: &'d Document) -> Request<'d> {
        let name = || {
            let image = document.root.images.get(self.image);
            let name = image.and_then(|image| image.name.as_deref()).filter(|name| !name.is_empty());
            let file = document.path.display();
            name.map_or_else(
                || format!("{file}: image {}", self.image),
                |n| format!("{file}: image {} ({n})", self.image),
            )
        };
        let image = match document.image(self.image) {
            Ok(Image::File(uri)) => ImageAt::Named(vec![uri.to_owned()]),
            Ok(Image::Bytes(bytes)) => ImageAt::Within(name(), bytes),
            Err(_) => ImageAt::Within(name(), &[]),
        };
        Request { image, file: document.path.clone(), line: None, recipe: self.recipe, placing: self.placing }
    }
}

fn wrap_of(mode: Checked<WrappingMode>) -> Wrap {
    match mode {
        Checked::Valid(WrappingMode::ClampToEdge) => Wrap::Clamp,
        Checked::Valid(WrappingMode::MirroredRepeat) => Wrap::Mirror,
        Checked::Valid(WrappingMode::Repeat) | Checked::Invalid => Wrap::Repeat,
    }
}

/// How a texture is looked up with v up, from its transform, which is with v down.
fn placing(transform: Option<&TextureTransform>) -> Result<Placing, String> {
    let (mut matrix, mut offset) = (DMat2::IDENTITY, DVec2::ZERO);
    if let Some(transform) = transform {
        let (s, c) = f64::from(transform.rotation.0).sin_cos();
        // Counter-clockwise as it is seen, and so clockwise in coordinates of which v points down.
        let turn = DMat2::from_cols(DVec2::new(c, -s), DVec2::new(s, c));
        matrix = turn * DMat2::from_diagonal(DVec2::from(transform.scale.0.map(f64::from)));
        offset = DVec2::from(transform.offset.0.map(f64::from));
    }
    let (flip, top) = (DMat2::from_diagonal(DVec2::new(1.0, -1.0)), DVec2::Y);
    let offset = (flip * (matrix * top + offset) + top).as_vec2();
    let matrix = (flip * matrix * flip).as_mat2();
    if !matrix.is_finite() || !offset.is_finite() {
        return Err("its KHR_texture_transform is not made of finite numbers".into());
    }
    Ok(Placing { matrix, offset, wrap: [Wrap::Repeat; 2] })
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::gltf::json::extensions::texture::{TextureTransformOffset, TextureTransformRotation, TextureTransformScale};
    use glam::Vec2;

    /// A point with v down as the transform of the extension has it: `rotation` turns by that much counter-clockwise as it is seen.
    fn by_hand(uv: [f32; 2], [x, y]: [f32; 2], angle: f32, [sx, sy]: [f32; 2]) -> [f32; 2] {
        let (u, v, s, c) = (uv[0] * sx, uv[1] * sy, angle.sin(), angle.cos());
        [c * u + s * v + x, c * v - s * u + y]
    }

    #[test]
    fn transforms_hold_with_v_up() {
        let (offset, angle, scale) = ([0.3, -0.2], 0.7, [1.5, -2.0]);
        let transform = TextureTransform {
            offset: TextureTransformOffset(offset),
            rotation: TextureTransformRotation(angle),
            scale: TextureTransformScale(scale),
            ..TextureTransform::default()
        };
        let found = placing(Some(&transform)).expect("finite");
        for uv in [[0.0, 0.0], [1.0, 0.0], [0.25, 0.75], [-3.0, 2.0]] {
            let up = |[u, v]: [f32; 2]| Vec2::new(u, 1.0 - v);
            let expected = up(by_hand(uv, offset, angle, scale));
            assert!((found.matrix * up(uv) + found.offset - expected).length() < 1e-5, "{uv:?}");
        }
        let none = placing(None).expect("finite");
        assert_eq!((none.matrix, none.offset), (glam::Mat2::IDENTITY, Vec2::ZERO));
        let endless = TextureTransform { scale: TextureTransformScale([f32::INFINITY, 1.0]), ..transform };
        assert!(placing(Some(&endless)).is_err());
    }
}
