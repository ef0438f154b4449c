//! The light engine without a GPU: direct and indirect light, refinement, relighting.

#[path = "../support/mod.rs"]
mod support;

mod budget;
mod coarse_levels;
mod corridor;
mod covered;
mod determinism;
mod direct;
mod hidden_lights;
mod indirect;
mod indirect_cornell;
mod kept;
mod large_leaves;
mod memory;
mod moved_lights;
mod moving_camera;
mod penumbrae;
mod pixel_vertices;
mod refinement;
mod reflection;
mod relighting;
mod reveal;
mod sky;
mod specular;
mod whole;
