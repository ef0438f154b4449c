//! The light cache: what is true of the light in a scene whatever is looked at.

pub mod ascending;
pub mod between;
pub mod bytes;
mod cell;
mod cell_table;
pub mod coarse_grids;
pub mod coarse_levels;
pub mod direct;
pub mod drawn_mesh;
mod filter;
pub mod gather;
pub mod ids;
pub mod indirect;
pub mod indirect_layer;
pub mod irradiance_prior;
pub mod layer;
pub mod luminance;
pub mod pieces;
pub mod pixel_vertex;
pub mod pixels;
pub mod pool;
mod prediction;
pub mod previous_lighting;
pub mod radiance_grid;
pub mod reweight;
pub mod slot;
pub mod sparse;
pub mod split;
pub mod store;
#[cfg(test)]
pub(crate) mod testing;
pub mod topology;
pub mod vertex;
pub mod visibility_prior;
pub mod visibility_probe;
pub mod visibility_table;
pub mod weld;
