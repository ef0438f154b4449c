//! Evaluation of reflection, and of light arriving without occlusion.

pub mod area;
pub mod area_far;
pub mod area_sampler;
mod area_specular;
mod emission;
mod facets;
pub mod highlight;
pub mod lights;
mod panel;
pub mod phong;
mod silhouette;
pub mod world;
