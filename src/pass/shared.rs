//! The structs that host and shaders share; `glsl/include/frame.glsl` is the other side, checked when compiling.

use crate::refine::update::{DrawnTriangle, Slot};
use crate::scene::TriangleId;
use crate::vk::shaders::host_matches_shader;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Buffers that `glsl/include/scene.glsl` reads as texels.
pub(super) const TEXEL_BUFFERS: usize = 9;
/// "No texture".
pub(super) const NONE: u32 = u32::MAX;
pub(super) use crate::scene::texture::MAX_LEVELS;

/// The uniform block of every stage.
#[derive(Clone, Copy, Default, Pod, Zeroable)]
#[repr(C)]
pub(super) struct FrameUniform {
    pub clip_from_world: [f32; 16],
    pub positions: u64,
    pub triangles: u64,
    pub visibility_triangles: u64,
    pub coplanar: u64,
    pub materials: u64,
    pub textures: u64,
    pub texels: u64,
    /// Address of three vertex colours a triangle; 0 without any.
    pub colours: u64,
    /// Address of a light vector a slot, over the luminance of D times π; only where there are normal maps.
    pub light_vectors: u64,
    /// Address of three shading normals a triangle; 0 where none is needed.
    pub normals: u64,
    pub slots: u64,
    pub drawn_triangles: u64,
    pub drawn_list: u64,
    pub marks: u64,
    pub lookup_nodes: u64,
    pub lookup_roots: u64,
    pub list_references: u64,
    pub mark_references: u64,
    /// Address of a counter a drawn triangle.
    pub drawn_pixels: u64,
    pub eye: [f32; 3],
    pub forward: [f32; 3],
    pub right: [f32; 3],
    pub down: [f32; 3],
    pub pixel: [f32; 2],
    pub jitter: [f32; 2],
    /// What D and S, W·sr⁻¹·m⁻², are multiplied by in images.
    pub luminance_scale: f32,
    /// What L_e, W·sr⁻¹·m⁻², is multiplied by in images.
    pub emission_scale: f32,
    /// What radiance is multiplied by before tone mapping.
    pub exposure: f32,
    pub emits_back: u32,
    /// Width of the square that textures are filtered over, pixels.
    pub filter_width: f32,
    /// Depth is this by the inverse of the distance along the view, plus the second.
    pub depth_of_inverse: [f32; 2],
    /// Farther than any drawn triangle, nearer than nothing.
    pub background_depth: f32,
    /// Of the drawn triangles to look up; 0 for all.
    pub lookup_stamp: u32,
    /// Texture entry of the environment's picture, or [`NONE`].
    pub sky: u32,
    /// What its radiance counts times, the emission scale included.
    pub sky_factor: [f32; 3],
    pub sky_axes: [[f32; 3]; 3],
    pub sun_direction: [f32; 3],
    pub sun_reach: f32,
    /// Times the emission scale.
    pub sun_radiance: [f32; 3],
    /// To a multiple of an address.
    pub padding: u32,
}

/// A triangle by its id.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(super) struct GpuTriangle {
    pub corners: [u32; 3],
    pub material: u32,
    pub uv: [[f32; 2]; 3],
    /// To whole texels.
    pub padding: [u32; 2],
}

/// A triangle in drawing order.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(super) struct GpuVisibilityTriangle {
    pub corners: [u32; 3],
    pub id: u32,
}

/// A face whose distance is that of a plane.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(super) struct GpuCoplanarFace {
    pub normal: [f32; 3],
    pub offset: f32,
    pub face: u32,
    pub towards: f32,
}

/// A material; entries of [`super::texture_maps::TextureMaps`] or [`NONE`].
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(super) struct GpuMaterial {
    pub kd: [f32; 3],
    pub map_kd: u32,
    pub ks: [f32; 3],
    pub map_d: u32,
    /// Emitted radiance, W·sr⁻¹·m⁻².
    pub ke: [f32; 3],
    pub map_ke: u32,
    /// F₀ that slots are lit with, of the metallic-roughness model.
    pub f0: [f32; 3],
    pub map_metallic: u32,
    /// Negative for Phong.
    pub metallic: f32,
    pub roughness: f32,
    pub map_roughness: u32,
    pub map_normal: u32,
    pub normal_scale: f32,
    /// To whole texels.
    pub padding: [u32; 3],
}

/// A texture's mip chain, and how it is looked up.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(super) struct GpuTexture {
    pub extent: [u32; 2],
    pub levels: u32,
    /// See [`super::texture_maps`].
    pub flags: u32,
    /// Column by column.
    pub matrix: [f32; 4],
    pub offset: [f32; 2],
    /// Index of each level's first texel.
    pub first: [u32; MAX_LEVELS],
    /// To whole texels.
    pub padding: [u32; 3],
}

/// A vertex slot.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct GpuSlot {
    pub position: Vec3,
    pub weight: f32,
    /// Diffuse luminance D, W·sr⁻¹·m⁻².
    pub diffuse: Vec3,
    /// Specular luminance S, W·sr⁻¹·m⁻².
    pub specular: Vec3,
}

/// A drawn triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct GpuDrawnTriangle {
    pub slots: [u32; 3],
    pub face: u32,
    /// The slot whose value it shows all over, or [`NONE`].
    pub flat_slot: u32,
}

/// A node of a face's tree; `NONE` for no child and no drawn triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct GpuLookupNode {
    pub child: u32,
    pub stamp: u32,
    pub codes: u32,
    pub drawn_triangles: [u32; 4],
}

/// The tree of a face; `NONE` for no node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct GpuLookupRoot {
    pub node: u32,
    pub stamp: u32,
}

host_matches_shader!(FrameUniform, frame, {
    clip_from_world: CLIP_FROM_WORLD, positions: POSITIONS, triangles: TRIANGLES, visibility_triangles: VISIBILITY_TRIANGLES, coplanar: COPLANAR,
    materials: MATERIALS, textures: TEXTURES, texels: TEXELS, colours: COLOURS, light_vectors: LIGHT_VECTORS, normals: NORMALS, slots: SLOTS, drawn_triangles: DRAWN_TRIANGLES,
    drawn_list: DRAWN_LIST, marks: MARKS, lookup_nodes: LOOKUP_NODES, lookup_roots: LOOKUP_ROOTS,
    list_references: LIST_REFERENCES, mark_references: MARK_REFERENCES, drawn_pixels: DRAWN_PIXELS, eye: EYE, forward: FORWARD, right: RIGHT, down: DOWN,
    pixel: PIXEL, jitter: JITTER, luminance_scale: LUMINANCE_SCALE, emission_scale: EMISSION_SCALE,
    exposure: EXPOSURE, emits_back: EMITS_BACK, depth_of_inverse: DEPTH_OF_INVERSE, background_depth: BACKGROUND_DEPTH, lookup_stamp: LOOKUP_STAMP,
    sky: SKY, sky_factor: SKY_FACTOR, sky_axes: SKY_AXES, sun_direction: SUN_DIRECTION, sun_reach: SUN_REACH, sun_radiance: SUN_RADIANCE,
});
host_matches_shader!(GpuTriangle, triangle, { corners: CORNERS, material: MATERIAL, uv: UV });
host_matches_shader!(GpuVisibilityTriangle, visibility_triangle, { corners: CORNERS, id: ID });
host_matches_shader!(GpuCoplanarFace, coplanar_face, { normal: NORMAL, offset: OFFSET, face: FACE, towards: TOWARDS });
host_matches_shader!(GpuMaterial, material, {
    kd: KD, map_kd: MAP_KD, ks: KS, map_d: MAP_D, ke: KE, map_ke: MAP_KE, f0: F0, map_metallic: MAP_METALLIC, metallic: METALLIC,
    roughness: ROUGHNESS, map_roughness: MAP_ROUGHNESS, map_normal: MAP_NORMAL, normal_scale: NORMAL_SCALE,
});
host_matches_shader!(GpuTexture, texture, {
    extent: EXTENT, levels: LEVELS, flags: FLAGS, matrix: MATRIX, offset: OFFSET, first: FIRST,
});
host_matches_shader!(GpuSlot, slot, { position: POSITION, weight: WEIGHT, diffuse: DIFFUSE, specular: SPECULAR });
host_matches_shader!(GpuLookupNode, lookup_node, { child: CHILD, stamp: STAMP, codes: CODES, drawn_triangles: DRAWN_TRIANGLES });
host_matches_shader!(GpuLookupRoot, lookup_root, { node: NODE, stamp: STAMP });
host_matches_shader!(GpuDrawnTriangle, drawn_triangle, { slots: SLOTS, face: FACE, flat_slot: FLAT_SLOT });

impl From<&Slot> for GpuSlot {
    fn from(slot: &Slot) -> Self {
        Self { position: slot.position, weight: slot.weight, diffuse: slot.diffuse, specular: slot.specular }
    }
}

impl From<&DrawnTriangle> for GpuDrawnTriangle {
    fn from(drawn: &DrawnTriangle) -> Self {
        Self { slots: drawn.slots.map(|s| s.0), face: drawn.face.0, flat_slot: drawn.flat.map_or(NONE, |s| s.0) }
    }
}

impl GpuDrawnTriangle {
    /// The triangle that the drawn triangle lies on.
    pub(super) const fn triangle(self) -> TriangleId {
        TriangleId(self.face >> 1)
    }
}
