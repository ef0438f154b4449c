//! The scene: flat arrays addressed by typed ids, built once by the loader and immutable afterwards.
//!
//! Geometry is kept as it is in the file, with positions welded by their bits; everything that depends on where
//! light goes (sides, normal groups, hierarchy) belongs to `cache`.

pub mod camera;
pub mod camera_path;
mod commas;
pub mod content;
mod content_changes;
mod content_lights;
pub mod coplanar;
mod coplanar_search;
mod dark_emission;
mod emitters;
pub mod environment;
mod environment_file;
pub mod exr_header;
pub mod extent;
mod find_file;
pub mod footprint;
pub mod framing;
pub mod geometry;
mod gltf;
pub mod horizon;
mod ids;
mod input;
mod lamp_file;
pub mod light;
pub mod load;
mod main_file;
mod map_options;
mod map_statement;
pub mod material;
mod material_library;
mod materials;
mod memory;
mod mipmap;
mod mtl;
mod normal_maps;
mod normals;
mod obj;
mod obj_files;
mod obj_text;
mod origin;
mod overlap;
mod parts;
pub mod photometry;
mod polygon;
pub mod report;
mod scene_file;
mod sky_file;
mod sky_model;
mod soup;
mod source;
mod subject;
mod texel;
mod texel_source;
mod text;
pub mod texture;
mod textures;
mod toml_walk;
mod transparency;
pub mod union;
pub mod up_axis;
mod vertex_colours;

pub use ids::{FaceId, TriangleId};

use crate::math::triangle::unit_normal;
use camera::NamedCamera;
use coplanar::Coplanar;
use footprint::Footprint;
use glam::{DVec3, Vec2, Vec3};
use light::Light;
use material::{Material, MaterialId, MetallicRoughness, TextureMap};
use texture::Texture;

/// What a scene displays when nothing on the command line says otherwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Display {
    /// Exposure in stops: radiance is multiplied by 2^exposure before tone mapping.
    pub exposure: f32,
    /// The tone-mapping operator.
    pub tone_mapping: ToneMapping,
}

impl Default for Display {
    fn default() -> Self {
        Self { exposure: 0.0, tone_mapping: ToneMapping::Aces }
    }
}

/// Tone-mapping operators of the combine pass. The discriminant is the constant that the shader is made with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u32)]
pub enum ToneMapping {
    /// Clamp to [0, 1].
    Clamp = 0,
    /// Reinhard on luminance, L / (1 + L).
    Reinhard = 1,
    /// ACES filmic, Narkowicz's fit.
    Aces = 2,
    /// `AgX`, base look.
    Agx = 3,
    /// Khronos PBR Neutral.
    PbrNeutral = 4,
}

impl ToneMapping {
    /// All operators with the names that scene files and options use.
    pub const NAMES: [(&'static str, Self); 5] = [
        ("clamp", Self::Clamp),
        ("reinhard", Self::Reinhard),
        ("aces", Self::Aces),
        ("agx", Self::Agx),
        ("pbr-neutral", Self::PbrNeutral),
    ];
}

/// Which side of an emissive triangle (`Ke` > 0) emits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum EmissionSide {
    /// The counter-clockwise side only (the default).
    #[default]
    Front,
    /// Both sides.
    Both,
}

/// A scene ready to be lit: geometry, materials, lights, cameras.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// Vertex positions, welded by bits (−0 counts as 0), scene units.
    pub positions: Vec<Vec3>,
    /// Position indices of every drawable triangle, counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// Unit shading normals at the corners, on the front side. Equal to the triangle's normal when flat.
    pub normals: Vec<[Vec3; 3]>,
    /// Texture coordinates at the corners, OBJ convention (v up); zero where the file has none.
    pub uvs: Vec<[Vec2; 3]>,
    /// Vertex colours at the corners, linear, at most 1: what the material's k_d counts times. Empty where no file has any.
    pub colours: Vec<[Vec3; 3]>,
    /// The material of every triangle.
    pub triangle_materials: Vec<MaterialId>,
    /// Materials.
    pub materials: Vec<Material>,
    /// Textures, each decoded once however many materials use it.
    pub textures: Vec<Texture>,
    /// Which side of emissive triangles emits.
    pub emission_side: EmissionSide,
    /// Lights: those of the scene file, those of glTF files, then one area light a connected emissive component.
    pub lights: Vec<Light>,
    /// Cameras; never empty after loading, the first is the default.
    pub cameras: Vec<NamedCamera>,
    /// Display settings.
    pub display: Display,
    /// The point of the files' coordinates that is the origin here: zero unless they lie far away, where f32 is too coarse.
    pub origin: DVec3,
    /// Faces that overlap in one plane, and which of them are seen: [`Coplanar::find`].
    pub coplanar: Coplanar,
}

impl Scene {
    /// Corner positions of a triangle.
    #[must_use]
    #[inline]
    pub fn corners(&self, triangle: TriangleId) -> [Vec3; 3] {
        // Not by `map`, which stays a call of its own; every hit asks for corners several times.
        let [a, b, c] = self.triangles[triangle.0 as usize];
        [self.positions[a as usize], self.positions[b as usize], self.positions[c as usize]]
    }

    /// Twice the area times the unit normal of the front side, (b − a) × (c − a).
    #[must_use]
    pub fn area_vector(&self, triangle: TriangleId) -> Vec3 {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(c - a)
    }

    /// Unit geometric normal of the front side (zero for a degenerate triangle).
    #[must_use]
    pub fn geometric_normal(&self, triangle: TriangleId) -> Vec3 {
        unit_normal(self.corners(triangle))
    }

    /// Texture coordinates at barycentrics (`u`, `v`) of corners 1 and 2.
    #[must_use]
    pub fn uv_at(&self, triangle: TriangleId, u: f32, v: f32) -> Vec2 {
        let [a, b, c] = self.uvs[triangle.0 as usize];
        a * (1.0 - u - v) + b * u + c * v
    }

    /// Unit shading normal at barycentrics (`u`, `v`), turned to the side `back`.
    #[must_use]
    pub fn shading_normal_at(&self, triangle: TriangleId, u: f32, v: f32, back: bool) -> Vec3 {
        let [a, b, c] = self.normals[triangle.0 as usize];
        // Without a root where it is flat.
        let n = if a == b && a == c { a } else { (a * (1.0 - u - v) + b * u + c * v).normalize_or(a) };
        if back { -n } else { n }
    }

    /// The material of a triangle.
    #[must_use]
    pub fn material(&self, triangle: TriangleId) -> &Material {
        &self.materials[self.triangle_materials[triangle.0 as usize].0 as usize]
    }

    /// The vertex colours at barycentrics (`u`, `v`); 1 without any.
    #[must_use]
    #[inline]
    pub fn colour_at(&self, triangle: TriangleId, u: f32, v: f32) -> Vec3 {
        let colours = self.colours.get(triangle.0 as usize);
        colours.map_or(Vec3::ONE, |&[a, b, c]| a * (1.0 - u - v) + b * u + c * v)
    }

    /// Diffuse reflectance k_d at a point of a triangle (constant × `map_Kd` × vertex colours), linear.
    #[must_use]
    pub fn kd_at(&self, triangle: TriangleId, u: f32, v: f32) -> Vec3 {
        self.kd_over(triangle, u, v, &Footprint::POINT)
    }

    /// Diffuse reflectance k_d, its texture filtered over a footprint about a point.
    #[must_use]
    pub fn kd_over(&self, triangle: TriangleId, u: f32, v: f32, footprint: &Footprint) -> Vec3 {
        let m = self.material(triangle);
        let kd = m.kd * self.colour_at(triangle, u, v);
        kd * m.map_kd.as_ref().map_or(Vec3::ONE, |map| self.filtered(map, triangle, [u, v], footprint))
    }

    /// Metalness and perceptual roughness of a model on a triangle, textures filtered over a footprint about a point.
    #[must_use]
    pub fn metallic_roughness_over(
        &self,
        model: &MetallicRoughness,
        triangle: TriangleId,
        at: [f32; 2],
        footprint: &Footprint,
    ) -> [f32; 2] {
        let looked_up =
            |map: &Option<TextureMap>| map.as_ref().map_or(Vec3::ONE, |m| self.filtered(m, triangle, at, footprint));
        [model.metallic * looked_up(&model.map_metallic).z, model.roughness * looked_up(&model.map_roughness).y]
    }

    fn filtered(&self, map: &TextureMap, triangle: TriangleId, [u, v]: [f32; 2], footprint: &Footprint) -> Vec3 {
        let [a, b, c] = self.uvs[triangle.0 as usize];
        let gradient = |d: Vec2| map.matrix * ((b - a) * d.x + (c - a) * d.y);
        let uv = map.place(self.uv_at(triangle, u, v));
        self.texture(map).sample_filtered(uv, gradient(footprint.d_dx), gradient(footprint.d_dy), map.wrap)
    }

    /// The texture of a map.
    #[must_use]
    pub fn texture(&self, map: &TextureMap) -> &Texture {
        &self.textures[map.texture.0 as usize]
    }

    /// Whether the face emits at all: `Ke` > 0 and the right side.
    #[must_use]
    pub fn face_emits(&self, face: FaceId) -> bool {
        let lit_side = !face.is_back() || self.emission_side == EmissionSide::Both;
        lit_side && self.material(face.triangle()).is_emissive()
    }

    /// Whether what the face emits lights others, too.
    #[must_use]
    pub fn face_lights(&self, face: FaceId) -> bool {
        self.face_emits(face) && !self.material(face.triangle()).unlit
    }

    /// Emitted radiance L_e of a face at barycentrics (`u`, `v`), W·sr⁻¹·m⁻².
    #[must_use]
    pub fn emitted_at(&self, face: FaceId, u: f32, v: f32) -> Vec3 {
        self.emitted_over(face, u, v, &Footprint::POINT)
    }

    /// Emitted radiance L_e, W·sr⁻¹·m⁻², its texture filtered over a footprint about a point.
    #[must_use]
    pub fn emitted_over(&self, face: FaceId, u: f32, v: f32, footprint: &Footprint) -> Vec3 {
        if !self.face_emits(face) {
            return Vec3::ZERO;
        }
        let m = self.material(face.triangle());
        m.ke * m.map_ke.as_ref().map_or(Vec3::ONE, |map| self.filtered(map, face.triangle(), [u, v], footprint))
    }

    /// The most that a material emits at any point, W·sr⁻¹·m⁻².
    #[must_use]
    pub fn peak_emission(&self, material: &Material) -> Vec3 {
        material.ke * material.map_ke.as_ref().map_or(1.0, |map| self.texture(map).peak())
    }

    /// The cut-out rule, the same everywhere: `map_d` level 0, bilinear, opaque at ≥ 0.5.
    #[must_use]
    pub fn is_opaque_at(&self, triangle: TriangleId, u: f32, v: f32) -> bool {
        match &self.material(triangle).map_d {
            Some(map) => self.texture(map).alpha(map.place(self.uv_at(triangle, u, v)), map.wrap) >= 0.5,
            None => true,
        }
    }
}
