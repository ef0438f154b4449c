//! Evaluation of reflection, and of light arriving without occlusion.

pub mod area;
pub mod area_distant;
pub mod area_sampler;
mod area_specular;
mod bounds;
mod clustering;
pub mod context;
mod emission;
mod facets;
pub mod group;
pub mod highlight;
pub mod lights;
mod quad;
pub mod selection;
mod silhouette;
