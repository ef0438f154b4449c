//! Penombre: progressive global illumination whose geometry is exact from the first frame.
//!
//! The GPU draws geometry; a CPU engine computes light at mesh vertices and streams what changed. The map:
//!
//! - [`math`]: frames, sampling sequences, running statistics
//! - [`scene`]: flat arrays of geometry, materials, lights, cameras; the loader
//! - [`geom`]: rays, hits, the BVH
//! - [`bsdf`]: reflection; [`light`]: lamps
//! - [`estimate`]: light arriving at a point from one source
//! - [`store`]: blocks of bytes that outlive a run
//! - [`cache`]: vertices, their samples a light, the dynamic mesh
//! - [`refine`]: the engine thread that owns the cache
//! - [`mod@reference`]: the brute-force path tracer, no cache
//! - [`mod@bench`]: measurements of the rest
//! - [`vk`]: Vulkan objects with owners; [`pass`]: the frame
//! - [`image`]: film, EXR, PNG, tone mapping, metrics; [`log`]: frame log
//! - [`mod@compare`]: update modes compared, and the report of it
//! - [`session`]: a run, one loop between engine and renderer, without a command line
//! - [`system`]: what the system tells of this process and of the machine
//! - [`trace`]: what threads and device do when, for a time line
//! - [`mod@bake`]: the lit mesh of all faces, as PLY and glTF
//! - [`app`]: the window: commands, keys, mouse, panels, scripts
//! - [`cli`]: one file a subcommand
//!
//! Dependencies point one way: `math ← scene ← geom ← bsdf, light ← estimate ← cache ← refine` and `vk ← pass`; `pass` reads
//! `refine::update` and never the cache; nothing in the first chain names `ash`; `session` puts both chains together, and `cli` alone uses it.
//! `tests/layers.rs` holds the rule.

pub mod app;
pub mod bake;
pub mod bench;
pub mod bsdf;
pub mod cache;
pub mod cli;
pub mod compare;
pub mod error;
pub mod estimate;
pub mod geom;
pub mod image;
pub mod light;
pub mod log;
pub mod math;
pub mod pass;
pub mod reference;
pub mod refine;
pub mod scene;
pub mod session;
pub mod store;
pub mod system;
pub mod trace;
pub mod vk;
