//! Light sources, and what of their light arrives without occlusion.
//!
//! - [`source`]: one interface to all kinds: sample, density, bounds, power, closed forms; `delta` and [`area`] are the kinds
//! - [`area`]: emissive surfaces: their geometry (`facets`, `silhouette`, `quad`), what a texture makes them emit (`emission`),
//!   points (`area_sampler`, `facet_cluster`), closed forms (`closed_form`, `area_distant`, `area_specular`)
//! - [`environment`]: a picture all around, sampled by `environment_cells`, integrated by `environment_sums` (`environment_texels`); [`sun`]: a disc beside it
//! - [`lights`]: all sources of a scene, in light groups (`group`, `clustering`), what they emit at a time ([`lighting`])
//! - [`selection`]: one light of many by the bounds of what each can send (`bounds`, `group_bounds`)
//! - [`context`]: what estimators read; the shadow ray from a place to a light
//! - [`appearance`], [`highlight`]: what surfaces show of a source without occlusion

pub mod appearance;
pub mod area;
mod area_distant;
pub mod area_sampler;
mod area_specular;
pub mod arrival;
mod bounds;
pub mod closed_form;
mod clustering;
pub mod context;
mod delta;
mod emission;
pub mod environment;
mod environment_cells;
mod environment_sums;
mod environment_texels;
mod facet_cluster;
mod facets;
pub mod group;
mod group_bounds;
pub mod group_points;
pub mod highlight;
pub mod lighting;
pub mod lights;
mod quad;
pub mod receiver;
pub mod selection;
mod silhouette;
pub mod source;
pub mod sun;
