//! How materials look textures up, as the device reads it: an entry for each texture and way of placing it.

use super::shared::{GpuTexture, MAX_LEVELS, NONE};
use crate::bsdf;
use crate::error::{Error, Result};
use crate::scene::Scene;
use crate::scene::environment::Environment;
use crate::scene::light::LightKind;
use crate::scene::material::{Material, TextureMap};
use crate::scene::texture::{Encoding, Texture, TextureId, Wrap};

/// Words before the first texel: linear values of the 256 sRGB codes, and what GGX highlights leave to the diffuse part.
pub(super) const TABLE: u64 = DIFFUSE_TABLE + (bsdf::TABLE_SIZE * bsdf::TABLE_SIZE) as u64;
/// Where the second begins.
pub(super) const DIFFUSE_TABLE: u64 = 256;
/// Most texels of a scene: shaders take their indices as signed.
const MAX_TEXELS: u64 = 1 << 31;

/// The entries, and where texels lie.
#[derive(Default)]
pub(super) struct TextureMaps {
    maps: Vec<TextureMap>,
    /// As the device has them, in the order of `maps`.
    pub headers: Vec<GpuTexture>,
    /// Index of the first texel of each texture.
    pub first: Vec<u64>,
    /// The entry of the picture of the environment, and the index of its first texel.
    pub sky: Option<(u32, u64)>,
    /// Words before the texels, and texels of all textures.
    pub words: u64,
    /// Largest value of a channel of each entry.
    peaks: Vec<f32>,
}

impl TextureMaps {
    /// The maps of a scene's materials.
    pub(super) fn new(scene: &Scene) -> Result<Self> {
        let mut all = Self { words: TABLE, ..Self::default() };
        for texture in &scene.textures {
            all.first.push(all.words);
            all.words += texture.texels().len() as u64;
        }
        let picture = environment(scene).map(|environment| environment.picture.shown());
        let sky_first = all.words;
        all.words += picture.map_or(0, |picture| picture.texels().len() as u64);
        if all.words > MAX_TEXELS {
            return Err(Error::Exhausted(format!(
                "the textures hold {} million texels together, and 2147 million are the most: make them smaller",
                all.words / 1_000_000
            )));
        }
        let used = scene.materials.iter().flat_map(Material::maps);
        for map in used {
            if all.maps.contains(map) {
                continue;
            }
            let texture = scene.texture(map);
            all.headers.push(header(map, texture, all.first[map.texture.0 as usize]));
            all.peaks.push(texture.peak());
            all.maps.push(*map);
        }
        if let Some(picture) = picture {
            all.sky = Some((all.headers.len() as u32, sky_first));
            all.headers.push(header(&TextureMap::from(TextureId(0)), picture, sky_first));
        }
        Ok(all)
    }

    /// Index of the entry of a map; [`NONE`] without one.
    pub(super) fn index(&self, map: Option<&TextureMap>) -> u32 {
        map.and_then(|map| self.maps.iter().position(|known| known == map)).map_or(NONE, |index| index as u32)
    }

    /// Largest value of a channel of an entry, 1 for [`NONE`].
    pub(super) fn peak(&self, index: u32) -> f32 {
        self.peaks.get(index as usize).copied().unwrap_or(1.0)
    }
}

/// The environment of a scene.
pub(super) fn environment(scene: &Scene) -> Option<&Environment> {
    scene.lights.iter().find_map(|light| match &light.kind {
        LightKind::Environment(environment) => Some(&**environment),
        _ => None,
    })
}

fn header(map: &TextureMap, texture: &Texture, start: u64) -> GpuTexture {
    let extents = texture.extents();
    let mut first = [0; MAX_LEVELS];
    let mut next = start as u32;
    for (first, [w, h]) in first.iter_mut().zip(extents) {
        *first = next;
        next += w * h;
    }
    let wraps = wrap_flags(map.wrap[0]) | wrap_flags(map.wrap[1]) << 1;
    let encoding = match texture.encoding() {
        Encoding::Srgb => 0,
        Encoding::SharedExponent => SHARED_EXPONENT,
        Encoding::Linear => LINEAR,
    };
    GpuTexture {
        extent: extents[0],
        levels: extents.len() as u32,
        flags: wraps | encoding,
        matrix: map.matrix.to_cols_array(),
        offset: map.offset.to_array(),
        first,
        padding: [0; 3],
    }
}

/// Flags along u; those along v are the next bit.
const fn wrap_flags(wrap: Wrap) -> u32 {
    match wrap {
        Wrap::Repeat => 0,
        Wrap::Clamp => HELD,
        Wrap::Mirror => HELD | MIRRORED,
    }
}

/// Flags of `glsl/include/frame.glsl`.
const HELD: u32 = 8;
const MIRRORED: u32 = 32;
const SHARED_EXPONENT: u32 = 2;
const LINEAR: u32 = 4;
