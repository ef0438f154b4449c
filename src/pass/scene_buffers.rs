//! The scene on the device: geometry, materials, and all texels with their mip chains in one buffer.

use super::clusters::{Clusters, curve};
use super::coplanar;
use super::frustum::{Bounds, Frustum, Place};
use super::lit_materials::LitMaterials;
use super::shared::{GpuMaterial, GpuTriangle, GpuVisibilityTriangle, NONE};
use super::sky::Sky;
use super::survivors::Survivors;
use super::texture_maps::{DIFFUSE_TABLE, TextureMaps, environment};
use crate::bsdf;
use crate::error::Result;
use crate::scene::light::LightState;
use crate::scene::texture::SRGB;
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
    pub visibility_triangles: Buffer,
    pub coplanar: Buffer,
    pub materials: Buffer,
    lit: LitMaterials,
    pub sky: Sky,
    maps: TextureMaps,
    pub textures: Buffer,
    pub texels: Buffer,
    /// Vertex colours, where the scene has any.
    pub colours: Option<Buffer>,
    /// Shading normals, where colours depend on them.
    pub normals: Option<Buffer>,
    /// Triangles that go by their own depth, in drawing order; the device's buffer has room for them twice where the host tells
    /// them apart.
    pub order: Vec<GpuVisibilityTriangle>,
    /// What it needs for that, there alone.
    pub on_host: Option<OnHost>,
    /// Triangles without mask, drawn first.
    opaque: Clusters,
    /// Triangles with one, after them.
    masked: Clusters,
    /// Faces whose distance is that of their plane, drawn last.
    pub coplanar_count: u32,
    /// Whether the image of face ids, not depth, tells where each triangle shows.
    pub by_id: Vec<bool>,
    /// What stored L_e is multiplied by to fit half range.
    pub emission_scale: f32,
    pub emits_back: bool,
}

/// What the host needs to tell triangles apart.
pub(super) struct OnHost {
    /// Positions of the vertices.
    pub positions: Vec<Vec3>,
    /// Their largest coordinates.
    pub reach: Vec3,
    /// Where each triangle without mask is in drawing order, [`NONE`] for others.
    pub place: Vec<u32>,
}

impl OnHost {
    fn new(scene: &Scene, drawn: &[GpuVisibilityTriangle], opaque_count: usize) -> Self {
        let mut place = vec![NONE; scene.triangles.len()];
        (0..).zip(&drawn[..opaque_count]).for_each(|(at, triangle)| place[triangle.id as usize] = at);
        let reach = scene.positions.iter().fold(Vec3::ZERO, |most, p| most.max(p.abs()));
        Self { positions: scene.positions.clone(), reach, place }
    }
}

impl SceneBuffers {
    pub(super) fn new(device: &Device, commands: &mut Commands, scene: &Scene) -> Result<Self> {
        let (drawn, opaque_count) = drawing_order(scene);
        let coplanar = coplanar::faces(scene);
        let maps = TextureMaps::new(scene)?;
        let (lit, of_triangle) = LitMaterials::new(scene, &maps);
        let materials = lit.lit(&[]);
        let sky = Sky::new(scene, maps.sky.map(|(entry, _)| entry));
        let is_cpu = device.report().is_cpu();
        let room = size_of_val(drawn.as_slice()) as u64 * if is_cpu { 2 } else { 1 };
        let mut visibility_triangles = Buffer::new(device, "visibility triangles", room, BufferUse::Static)?;
        commands.upload(device, &mut visibility_triangles, 0, &drawn)?;
        let mut fill = |name, data: &[u8]| filled(device, commands, name, data);
        let colours = bytemuck::cast_slice(&scene.colours);
        let colours = if colours.is_empty() { None } else { Some(fill("vertex colours", colours)?) };
        let needs_normals = scene.materials.iter().any(|m| m.is_metallic_roughness() || m.map_normal.is_some());
        let normals = bytemuck::cast_slice(if needs_normals { &scene.normals } else { &[] });
        let normals = if normals.is_empty() { None } else { Some(fill("shading normals", normals)?) };
        let positions: Vec<[f32; 4]> = scene.positions.iter().map(|p| [p.x, p.y, p.z, 1.0]).collect();
        let buffers = Self {
            positions: fill("positions", bytemuck::cast_slice(&positions))?,
            triangles: fill("triangles", bytemuck::cast_slice(&by_id(scene, &of_triangle)))?,
            colours,
            normals,
            coplanar: fill("coplanar faces", bytemuck::cast_slice(&coplanar))?,
            materials: fill("materials", bytemuck::cast_slice(&materials))?,
            textures: fill("textures", bytemuck::cast_slice(&maps.headers))?,
            texels: Buffer::new(device, "texels", 4 * maps.words, BufferUse::Static)?,
            visibility_triangles,
            on_host: is_cpu.then(|| OnHost::new(scene, &drawn, opaque_count)),
            opaque: Clusters::new(0, &corners(scene, &drawn[..opaque_count])),
            masked: Clusters::new(opaque_count as u32, &corners(scene, &drawn[opaque_count..])),
            order: drawn,
            coplanar_count: coplanar.len() as u32,
            by_id: triangles(scene).map(|t| has_mask(scene, t) || scene.coplanar.member(t).is_some()).collect(),
            lit,
            emission_scale: emission_scale(&materials, &maps, &sky),
            sky,
            maps,
            emits_back: scene.emission_side == EmissionSide::Both,
        };
        buffers.with_texels(device, commands, scene)
    }

    /// Changes what the area lights emit by their states, in the order of the scene's lights.
    pub(super) fn relight(&mut self, device: &Device, commands: &mut Commands, lights: &[LightState]) -> Result<()> {
        let materials = self.lit.lit(lights);
        self.sky.relight(lights);
        self.emission_scale = emission_scale(&materials, &self.maps, &self.sky);
        commands.upload(device, &mut self.materials, 0, &materials)
    }

    /// Draws of what the frustum may hold: triangles without mask, then those with one.
    pub(super) fn draws(&self, frustum: &Frustum) -> [Vec<(u32, u32)>; 2] {
        [&self.opaque, &self.masked].map(|all| all.draws(frustum, &[Place::Inside, Place::Crossing]))
    }

    /// The same, triangle by triangle.
    pub(super) fn survivors(&self, survivors: &Survivors<'_>) -> [Vec<GpuVisibilityTriangle>; 2] {
        [&self.opaque, &self.masked].map(|all| survivors.of(all))
    }

    /// Sends triangles that are drawn in place of those before; returns the number of the first.
    pub(super) fn send_survivors(
        &mut self,
        device: &Device,
        commands: &mut Commands,
        survivors: &[GpuVisibilityTriangle],
    ) -> Result<u32> {
        let end = size_of_val(self.order.as_slice()) as u64;
        commands.upload(device, &mut self.visibility_triangles, end, survivors)?;
        Ok(self.order.len() as u32)
    }

    /// Where each triangle lies in a frustum, as far as its cluster tells.
    pub(super) fn places(&self, frustum: &Frustum) -> Vec<Place> {
        let mut places = vec![Place::Crossing; self.by_id.len()];
        for (range, place) in self.opaque.places(frustum).chain(self.masked.places(frustum)) {
            self.order[range].iter().for_each(|triangle| places[triangle.id as usize] = place);
        }
        places
    }

    /// Writes the table of sRGB codes and the mip chains.
    fn with_texels(mut self, device: &Device, commands: &mut Commands, scene: &Scene) -> Result<Self> {
        commands.upload(device, &mut self.texels, 0, SRGB.as_slice())?;
        commands.upload(device, &mut self.texels, 4 * DIFFUSE_TABLE, &bsdf::diffuse_out_table())?;
        for (texture, first) in scene.textures.iter().zip(&self.maps.first) {
            commands.upload(device, &mut self.texels, 4 * first, texture.texels())?;
        }
        if let Some((environment, (_, first))) = environment(scene).zip(self.maps.sky) {
            commands.upload(device, &mut self.texels, 4 * first, environment.picture.shown().texels())?;
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

fn emission_scale(materials: &[GpuMaterial], maps: &TextureMaps, sky: &Sky) -> f32 {
    let peak = |m: &GpuMaterial| Vec3::from(m.ke).max_element() * maps.peak(m.map_ke);
    fitting_scale(materials.iter().map(peak).fold(sky.peak(), f32::max))
}

fn filled<T: NoUninit>(device: &Device, commands: &mut Commands, name: &str, data: &[T]) -> Result<Buffer> {
    let mut buffer = Buffer::new(device, name, size_of_val(data) as u64, BufferUse::Static)?;
    commands.upload(device, &mut buffer, 0, data)?;
    Ok(buffer)
}

fn by_id(scene: &Scene, materials: &[u32]) -> Vec<GpuTriangle> {
    let triangles = scene.triangles.iter().zip(&scene.uvs).zip(materials);
    triangles
        .map(|((&corners, uv), &material)| GpuTriangle {
            corners,
            material,
            uv: uv.map(|v| v.to_array()),
            padding: [0; 2],
        })
        .collect()
}

fn triangles(scene: &Scene) -> impl Iterator<Item = TriangleId> {
    (0..scene.triangles.len() as u32).map(TriangleId)
}

fn has_mask(scene: &Scene, triangle: TriangleId) -> bool {
    scene.material(triangle).map_d.is_some()
}

fn corners(scene: &Scene, drawn: &[GpuVisibilityTriangle]) -> Vec<[Vec3; 3]> {
    drawn.iter().map(|triangle| scene.corners(TriangleId(triangle.id))).collect()
}

/// The triangles that go by their own depth, and the number of those without mask, which come first: only the others need the shader
/// that discards. Neighbours in space are neighbours in the list.
fn drawing_order(scene: &Scene) -> (Vec<GpuVisibilityTriangle>, usize) {
    let bounds = Bounds::of(scene.positions.iter().copied());
    let by_depth = triangles(scene).filter(|&t| scene.coplanar.member(t).is_none());
    let mut keyed: Vec<(bool, u32, u32)> = by_depth
        .map(|t| (has_mask(scene, t), curve(scene.corners(t).iter().sum::<Vec3>() / 3.0, &bounds), t.0))
        .collect();
    keyed.sort_unstable();
    let opaque_count = keyed.partition_point(|&(masked, ..)| !masked);
    let drawn = |&(.., id): &(bool, u32, u32)| GpuVisibilityTriangle { corners: scene.triangles[id as usize], id };
    (keyed.iter().map(drawn).collect(), opaque_count)
}
