//! The lit mesh of all faces: its light, its triangles, its files.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

#[path = "../support/mod.rs"]
mod support;

mod command;
mod faults;
mod files;
mod light;
mod triangles;

use penombre::bake::baker::{Baker, Plan};
use penombre::bake::lit_mesh::{LitMesh, Vertex};
use penombre::geom::bvh::Bvh;
use penombre::refine::engine::Budget;
use penombre::refine::options::Options;
use penombre::refine::workers::Workers;
use penombre::scene::Scene;
use std::sync::Arc;
use support::by_hand;

/// Bakes until nothing is left to do, or so many rays are traced.
fn bake(scene: &Scene, picture: Options, plan: Plan, rays: u64) -> LitMesh {
    let scene = Arc::new(scene.clone());
    let bvh = Arc::new(Bvh::build(&scene));
    let options = plan.engine_options(&scene, Options { min_pixels: 3.0, ..picture }, Some(12.0));
    let mut baker = Baker::new(scene, bvh, Workers::new(2, false).unwrap(), options, plan).unwrap();
    loop {
        let stats = baker.step(Budget::Rays(20_000)).unwrap();
        if stats.converged || stats.rays >= rays {
            return baker.lit_mesh().unwrap();
        }
    }
}

/// Direct light alone.
fn direct() -> Options {
    Options { tolerance: 2.5e-4, ..by_hand::options(1) }
}

/// Light that bounces, too.
fn all_light() -> Options {
    Options { tolerance: 2.5e-4, filter: true, ..by_hand::bounces(1) }
}

fn vertices(mesh: &LitMesh) -> impl Iterator<Item = &Vertex> {
    mesh.parts.iter().flat_map(|part| &part.vertices)
}
