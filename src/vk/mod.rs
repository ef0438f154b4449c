//! Vulkan objects, each with an owner that frees it.

pub mod shaders;
#[cfg(test)]
mod spirv_layout;
