//! Vulkan objects with owners: every handle belongs to one struct whose `Drop` destroys it.
//!
//! Ownership points one way, `Instance ← DeviceCore ← objects`; [`Device`] is the user's end of it and prints by name
//! what still lives when it is dropped. Work is recorded through [`commands::Recording`], which borrows what it
//! records and waits for the device before it lets go: an object may therefore be dropped or written as soon as no
//! recording borrows it, and nothing needs a list of things to retire. Only a [`presenter::Presenter`] leaves work to the device while
//! the program goes on; it holds a share of what that reads until its fence is signalled.
//!
//! What the `unsafe` blocks rely on, stated once: handles are created by their owner and destroyed by it alone; the
//! device outlives its objects through the `Arc` each of them holds; host access to queue, pools and command buffers
//! is exclusive through `&mut` or a mutex; create-infos and the arrays they point to live until the call returns.
#![allow(unsafe_code, reason = "the only module that calls Vulkan")]

pub mod barrier;
pub mod buffer;
mod calibration;
pub mod commands;
pub mod descriptor;
pub mod device;
#[cfg(feature = "shader-reload")]
pub mod edited_shaders;
pub mod image;
pub mod instance;
pub mod memory;
pub mod overlay;
pub mod pipeline;
pub mod presenter;
pub mod query;
pub mod report;
#[cfg(feature = "shader-reload")]
pub mod shader_compiler;
pub mod shaders;
#[cfg(any(test, feature = "shader-reload"))]
#[allow(dead_code, reason = "names of constants are for build.rs alone")]
mod spirv_layout;
pub mod surface;
pub mod swapchain;
pub mod timestamp;
pub mod window_handles;

pub use buffer::Buffer;
pub use commands::{Commands, Pass, Recording};
pub use descriptor::Bindings;
pub use device::{Device, DeviceOptions};
pub use image::Image;
pub use overlay::Overlay;
pub use pipeline::Pipeline;
pub use presenter::Presenter;
pub use query::OcclusionQueries;
pub use report::DeviceReport;
pub use surface::Surface;
pub use swapchain::Vsync;
pub use window_handles::WindowHandles;

use crate::error::Error;
use ash::vk;

/// Turns a Vulkan result into the error a user sees; `doing` as in "creating the swapchain".
pub(crate) fn error(result: vk::Result, doing: &str) -> Error {
    match result {
        vk::Result::ERROR_DEVICE_LOST => Error::DeviceLost(format!("the Vulkan device was lost while {doing}")),
        vk::Result::ERROR_OUT_OF_DEVICE_MEMORY | vk::Result::ERROR_OUT_OF_POOL_MEMORY => {
            Error::Exhausted(format!("out of device memory while {doing}; try a smaller --size"))
        }
        vk::Result::ERROR_OUT_OF_HOST_MEMORY => Error::Exhausted(format!("out of host memory while {doing}")),
        other => Error::Internal(format!("Vulkan reports {other:?} while {doing}")),
    }
}
