//! Vulkan objects, each with an owner that frees it.
