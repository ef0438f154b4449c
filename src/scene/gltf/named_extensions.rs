//! Which extensions the parts of a file name, whether they are read or not.

use ::gltf::json::extensions::texture::TextureTransform;
use serde::Deserialize;
use serde::de::IgnoredAny;
use std::collections::BTreeMap;

/// Names of the extensions of a file's parts.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct NamedExtensions {
    /// Of each material.
    pub materials: Vec<Material>,
    /// Of each mesh.
    pub meshes: Vec<Mesh>,
    /// Of each node.
    pub nodes: Vec<Holder>,
    /// Of each texture.
    pub textures: Vec<Holder>,
    /// Of each buffer view.
    #[serde(rename = "bufferViews")]
    pub buffer_views: Vec<Holder>,
}

/// A material.
#[derive(Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Material {
    extensions: Option<BTreeMap<String, IgnoredAny>>,
    normal_texture: Option<NormalTexture>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
struct NormalTexture {
    extensions: Option<OfNormalTexture>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
struct OfNormalTexture {
    #[serde(rename = "KHR_texture_transform")]
    transform: Option<TextureTransform>,
}

impl Material {
    /// The names.
    pub(super) fn names(&self) -> impl Iterator<Item = &str> {
        self.extensions.iter().flatten().map(|(name, _)| name.as_str())
    }

    /// How its normal map is placed, which the crate `gltf` does not read.
    pub(super) fn normal_transform(&self) -> Option<&TextureTransform> {
        self.normal_texture.as_ref()?.extensions.as_ref()?.transform.as_ref()
    }
}

/// A mesh.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Mesh {
    /// Of each primitive.
    pub primitives: Vec<Holder>,
}

/// What may have extensions.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Holder {
    extensions: Option<BTreeMap<String, IgnoredAny>>,
}

impl Holder {
    /// The names.
    pub(super) fn names(&self) -> impl Iterator<Item = &str> {
        self.extensions.iter().flatten().map(|(name, _)| name.as_str())
    }

    /// Whether it has the one of a name.
    pub(super) fn has(&self, name: &str) -> bool {
        self.extensions.as_ref().is_some_and(|extensions| extensions.contains_key(name))
    }
}

/// Extensions that a file may require: those that are read, and those that only add to what is drawn.
const HONOURED: [&str; 8] = [
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
    "KHR_animation_pointer",
    "KHR_xmp_json_ld",
];

/// Why a file that requires an extension is refused, and what to do; `None` where it need not be.
pub(super) fn refusal(required: &str) -> Option<String> {
    let what = match required {
        "KHR_draco_mesh_compression" => "geometry compressed by Draco: export it without compression",
        "EXT_meshopt_compression" | "KHR_meshopt_compression" => {
            "geometry compressed by meshopt: export it without compression"
        }
        "KHR_texture_basisu" => "KTX2 (Basis Universal) textures: export it with PNG or JPEG textures",
        "EXT_texture_webp" => "WebP textures: export it with PNG or JPEG textures",
        "EXT_texture_avif" => "AVIF textures: export it with PNG or JPEG textures",
        "MSFT_texture_dds" => "DDS textures: export it with PNG or JPEG textures",
        "EXT_mesh_gpu_instancing" => "instances in buffers: export each instance as a node",
        name if HONOURED.contains(&name) || name.starts_with("KHR_materials_") => return None,
        _ => "which is not supported: export it without that extension",
    };
    Some(format!("requires {required}, {what}"))
}
