//! The light cache: base vertices, their samples for each light, and the dynamic mesh that is drawn.

pub mod above;
pub mod direct;
pub mod dynamic;
pub mod earlier;
pub mod filter;
pub mod gather;
pub mod indirect;
pub mod inner;
pub mod layer;
pub mod luminance;
pub mod middle;
pub mod odds;
pub mod pixels;
pub mod pool;
pub mod radiance_grid;
pub mod remix;
pub mod topology;
pub mod vertex;
pub mod weld;
