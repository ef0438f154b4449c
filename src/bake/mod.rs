//! The lit mesh: all faces of a scene, lit by the engine alone, written as PLY or glTF (docs/bake.md). No eye, no device.

pub mod baker;
mod barycentric;
mod base_texture;
pub mod drawn;
mod fill;
pub mod glb;
pub mod lit_mesh;
mod mend;
pub mod ply;
mod reached;
mod texels;
