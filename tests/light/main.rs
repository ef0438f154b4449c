//! Lamps: closed forms, sampling, groups, emission textures.

#[path = "../support/mod.rs"]
mod support;

mod area;
mod area_sampling;
mod emission_textures;
mod many;
