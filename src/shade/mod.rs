//! Evaluation of reflection, and of light arriving without occlusion.

pub mod area;
pub mod area_far;
pub mod area_sampler;
mod area_specular;
mod emission;
mod facets;
mod grouping;
pub mod highlight;
pub mod light_choice;
pub mod light_mesh;
pub mod lights;
mod panel;
pub mod phong;
mod reach;
mod silhouette;
pub mod world;
