//! Rays against triangles by brute force, closed meshes, faces in one plane.

#[path = "../support/mod.rs"]
mod support;

mod coplanar;
mod rays;
mod watertight;
