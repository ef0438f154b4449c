//! The shaders of `glsl/`, compiled by `build.rs`, and the memory layouts of the structs that they share with the host.

include!(concat!(env!("OUT_DIR"), "/shaders.rs"));
