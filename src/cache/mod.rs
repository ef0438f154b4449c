//! The light cache: base vertices, their samples for each light, and the dynamic mesh that is drawn.

pub mod coarse_levels;
pub mod direct;
pub mod dynamic;
pub mod filter;
pub mod gather;
pub mod indirect;
pub mod layer;
pub mod luminance;
pub mod pixel_vertex;
pub mod pixels;
pub mod pool;
pub mod previous_lighting;
pub mod radiance_grid;
pub mod reweight;
pub mod topology;
pub mod vertex;
pub mod visibility_prior;
pub mod visibility_probe;
pub mod weld;
