//! The scene on the device: geometry, materials, and all texels with their mip chains in one buffer.

use super::lit_materials::LitMaterials;
use super::shared::{GpuDrawnTriangle, GpuMaterial, GpuTriangle};
use super::texture_maps::TextureMaps;
use crate::error::Result;
use crate::scene::texture::Texture;
use crate::scene::{EmissionSide, Scene, TriangleId};
use crate::vk::buffer::BufferUse;
use crate::vk::{Buffer, Commands, Device};
use bytemuck::NoUninit;
use glam::Vec3;

/// Largest values that half floats (up to 2^16, full precision from 2^-14) hold well as they are.
const COMFORTABLE: std::ops::RangeInclusive<f32> = 0.003_906_25..=16384.0;
/// Where the largest value is brought otherwise: 2^5 of head-room for values that grow, 2^24 for dark ones.
const TARGET_EXPONENT: f32 = 10.0;

/// Everything that the passes read of the scene.
pub(super) struct SceneBuffers {
    pub positions: Buffer,
    pub triangles: Buffer,
    pub drawn: Buffer,
    pub materials: Buffer,
    lit: LitMaterials,
    maps: TextureMaps,
    pub textures: Buffer,
    pub texels: Buffer,
    /// Vertex colours, where the scene has any.
    pub colours: Option<Buffer>,
    /// Triangles without mask, drawn first.
    pub opaque_count: u32,
    /// Triangles with one, after them.
    pub masked_count: u32,
    /// Whether each triangle has a mask.
    pub masked: Vec<bool>,
    /// What stored L_e is multiplied by to fit half range.
    pub emission_scale: f32,
    pub emits_back: bool,
}

impl SceneBuffers {
    pub(super) fn new(device: &Device, commands: &mut Commands, scene: &Scene) -> Result<Self> {
        let masked: Vec<bool> =
            (0..scene.triangles.len() as u32).map(|t| scene.material(TriangleId(t)).map_d.is_some()).collect();
        let drawn = drawing_order(scene, &masked);
        let masked_count = masked.iter().filter(|&&m| m).count() as u32;
        let maps = TextureMaps::new(scene)?;
        let (lit, of_triangle) = LitMaterials::new(scene, &maps);
        let materials = lit.lit(&[]);
        let mut fill = |name, data: &[u8]| filled(device, commands, name, data);
        let colours = bytemuck::cast_slice(&scene.colours);
        let colours = if colours.is_empty() { None } else { Some(fill("vertex colours", colours)?) };
        let buffers = Self {
            positions: fill("positions", bytemuck::cast_slice(&scene.positions))?,
            triangles: fill("triangles", bytemuck::cast_slice(&by_id(scene, &of_triangle)))?,
            colours,
            drawn: fill("drawn triangles", bytemuck::cast_slice(&drawn))?,
            materials: fill("materials", bytemuck::cast_slice(&materials))?,
            textures: fill("textures", bytemuck::cast_slice(&maps.headers))?,
            texels: Buffer::new(device, "texels", 4 * maps.texels, BufferUse::Static)?,
            opaque_count: drawn.len() as u32 - masked_count,
            masked_count,
            masked,
            lit,
            emission_scale: emission_scale(&materials, &maps),
            maps,
            emits_back: scene.emission_side == EmissionSide::Both,
        };
        buffers.with_texels(device, commands, &scene.textures)
    }

    /// Changes what the area lights emit to `factors` times what the scene says, in the order of its lights.
    pub(super) fn relight(&mut self, device: &Device, commands: &mut Commands, factors: &[Vec3]) -> Result<()> {
        let materials = self.lit.lit(factors);
        self.emission_scale = emission_scale(&materials, &self.maps);
        commands.upload(device, &mut self.materials, 0, &materials)
    }

    /// Writes the mip chains.
    fn with_texels(mut self, device: &Device, commands: &mut Commands, textures: &[Texture]) -> Result<Self> {
        for (texture, first) in textures.iter().zip(&self.maps.first) {
            commands.upload(device, &mut self.texels, 4 * first, texture.texels())?;
        }
        Ok(self)
    }
}

/// The power of two that brings `max` to half range, 1 if it is there already. A power of two rounds nothing.
pub(super) fn fitting_scale(max: f32) -> f32 {
    if max == 0.0 || !max.is_finite() || COMFORTABLE.contains(&max) {
        return 1.0;
    }
    (TARGET_EXPONENT - max.log2().floor()).clamp(-100.0, 100.0).exp2()
}

fn emission_scale(materials: &[GpuMaterial], maps: &TextureMaps) -> f32 {
    let peak = |m: &GpuMaterial| Vec3::from(m.ke).max_element() * maps.peak(m.map_ke);
    fitting_scale(materials.iter().map(peak).fold(0.0, f32::max))
}

fn filled<T: NoUninit>(device: &Device, commands: &mut Commands, name: &str, data: &[T]) -> Result<Buffer> {
    let mut buffer = Buffer::new(device, name, size_of_val(data) as u64, BufferUse::Static)?;
    commands.upload(device, &mut buffer, 0, data)?;
    Ok(buffer)
}

fn by_id(scene: &Scene, materials: &[u32]) -> Vec<GpuTriangle> {
    let triangles = scene.triangles.iter().zip(&scene.uvs).zip(materials);
    triangles
        .map(|((&corners, uv), &material)| GpuTriangle { corners, material, uv: uv.map(|v| v.to_array()) })
        .collect()
}

/// All triangles, those without mask first: only the others need the shader that discards.
fn drawing_order(scene: &Scene, masked: &[bool]) -> Vec<GpuDrawnTriangle> {
    let triangles = || (0..).zip(&scene.triangles).zip(masked);
    let pick = |wanted: bool| {
        triangles()
            .filter(move |&(_, &is_masked)| is_masked == wanted)
            .map(|((id, &corners), _)| GpuDrawnTriangle { corners, id })
    };
    pick(false).chain(pick(true)).collect()
}
