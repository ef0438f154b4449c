//! The window's insides without a window: panels by what they say and do, debug views by what they show.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

#[path = "../support/mod.rs"]
mod support;

mod debug_views;
mod modes;
mod moved_lights;
mod panels;
mod reference;

use crate::support::device::{self, add_quad, empty_scene, finish};
use glam::Vec3;
use penombre::geom::bvh::Bvh;
use penombre::pass::Renderer;
use penombre::scene::Scene;
use penombre::scene::camera::ImageSize;
use penombre::scene::light::{Light, LightKind};
use penombre::session::{Batches, Budget, Options, Pace, Quality, Refinement, Session, Unobserved, owned_engine};
use std::sync::Arc;

/// Half a room with a board in it under two lamps.
fn room() -> Scene {
    let mut scene = empty_scene();
    add_quad(&mut scene, Vec3::new(-1.0, -0.8, 1.0), Vec3::X * 2.0, Vec3::Z * -2.0, 0, 1.0);
    add_quad(&mut scene, Vec3::new(-1.0, -0.8, -1.0), Vec3::X * 2.0, Vec3::Y * 1.6, 0, 1.0);
    add_quad(&mut scene, Vec3::new(-0.5, -0.2, 0.3), Vec3::X * 0.6, Vec3::Z * -0.6, 0, 1.0);
    for (name, x) in [("left", -0.7), ("right", 0.7)] {
        let kind = LightKind::Point { position: Vec3::new(x, 0.6, 0.4), intensity: Vec3::new(2.0, 1.5, 1.0) };
        scene.lights.push(Light { name: name.to_owned(), kind });
    }
    scene
}

/// A floor in the sun: nothing of it is worth a split.
fn floor() -> Scene {
    let mut scene = empty_scene();
    add_quad(&mut scene, Vec3::new(-1.0, -0.8, 1.0), Vec3::X * 2.0, Vec3::Z * -2.0, 0, 1.0);
    let kind = LightKind::Directional { direction: Vec3::NEG_Y, irradiance: Vec3::ONE };
    scene.lights.push(Light { name: "sun".to_owned(), kind });
    scene
}

fn options(indirect: bool) -> Options {
    Options {
        size: ImageSize { width: 48, height: 36 },
        threads: Some(1),
        pace: Pace::Fixed(Batches { rays: 20_000, most: 20_000, counts_lag: 2 }),
        refinement: Refinement { indirect, thresholds: Quality::Draft.thresholds(), ..Refinement::default() },
        budget: Budget::default(),
        ..Options::default()
    }
}

/// Runs a test on a session that looks at a scene, watched by the validation layers, if there is a device.
fn with_session(scene: Scene, indirect: bool, test: impl FnOnce(Session)) {
    let Some(device) = device::device() else { return };
    let (scene, options) = (Arc::new(scene), options(indirect));
    let made_for = options.renderer_options(&device).unwrap();
    let mut renderer = Renderer::with_options(Arc::clone(&device), options.size, made_for).unwrap();
    renderer.load(&scene).unwrap();
    renderer.resize(options.size).unwrap();
    let engine = owned_engine(&scene, &Arc::new(Bvh::build(&scene)), &options).unwrap();
    let mut session = Session::new(renderer, engine, &scene, &options);
    session.look_through(&scene.cameras[0].camera, &[]).unwrap();
    test(session);
    finish(device);
}

/// Steps until nothing is left to do.
fn converge(session: &mut Session) {
    for _ in 0..500 {
        session.step(&mut Unobserved).unwrap();
        if session.is_idle() && !session.renderer().has_pending() {
            return;
        }
    }
    panic!("no end in sight");
}
