//! The frame: visibility, colour, luminance, combine, read-back (docs/method/updates.md), and what they read.
//!
//! [`Renderer`] is what commands use; `frame.rs` is the frame itself, readable top to bottom.

mod clusters;
mod colour;
mod colouring;
mod combine;
mod coplanar;
mod counters;
mod culled_visibility;
mod debug_view;
mod depth;
mod device_array;
mod fill;
mod filling;
mod frame;
mod frustum;
mod light_volume;
mod lit_materials;
mod lookup;
mod luminance;
mod mesh;
mod modes;
mod needs;
mod occlusion;
mod options;
mod pixel_counts;
mod plan;
mod raster;
mod readback;
mod renderer;
mod scene_buffers;
mod shared;
mod show;
mod sky;
mod survivors;
mod tailor;
mod targets;
mod texel_buffers;
mod texture_maps;
mod update;
mod visibility;
mod warm_up;

pub use debug_view::DebugImage;
pub use depth::{Depth, DepthFormat, DepthOrder};
pub use frame::{FrameOptions, FrameStats};
pub use options::RendererOptions;
pub use pixel_counts::DrawnCounts;
pub use readback::{Layers, LuminanceLayers};
pub use renderer::Renderer;
pub use update::UpdateMode;
