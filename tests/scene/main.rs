//! Scenes: what files mean, what is said of those that are wrong, textures, where a camera is put.

#[path = "../support/mod.rs"]
mod support;

mod bare_obj;
mod camera_paths;
mod content;
mod corpus;
mod environments;
mod exporters;
mod file;
mod fuzz;
mod generated;
mod gltf_broken;
mod gltf_fuzz;
mod gltf_materials;
mod gltf_samples;
mod malformed;
mod size_and_place;
mod texture_files;
mod textures;
mod vertex_colours;
