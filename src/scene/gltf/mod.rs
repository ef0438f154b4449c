//! glTF 2.0 files: meshes, materials, cameras and punctual lights of their default scene.

mod accessor;
mod cameras;
mod container;
mod data_uri;
mod document;
mod faults;
mod files;
mod lights;
mod maps;
mod materials;
mod named_extensions;
mod nodes;
mod parts;
mod transform;
mod triangles;

pub(super) use cameras::View;
pub(super) use files::GltfFiles;
pub(super) use lights::are_dim;
