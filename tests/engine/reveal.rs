//! Faces that come into view a part at a time.
#![allow(clippy::expect_used, reason = "a failed expectation fails the test")]

use crate::support::by_hand::{Mirror, bounces, engine_with, front, light, material, patch};
use glam::Vec3;
use penombre::refine::engine::{Budget, Engine, Visible};
use penombre::refine::replay::HostMesh;
use penombre::scene::light::LightKind;
use penombre::scene::{FaceId, Scene};
use std::collections::BTreeSet;
use std::time::Duration;

/// A floor of 200 faces under a lamp.
fn floor() -> (Scene, Vec<FaceId>) {
    let mut scene = Scene::default();
    let grey = material(&mut scene, |_| {});
    let seen = patch(&mut scene, Vec3::new(-1.0, 0.0, -1.0), Vec3::Z * 2.0, Vec3::X * 2.0, 10, grey);
    light(&mut scene, LightKind::Point { position: Vec3::new(0.3, 1.6, 0.4), intensity: Vec3::splat(4.0) });
    let faces = front(&seen);
    (scene, faces)
}

/// The last face is the largest.
fn view(generation: u32, faces: &[FaceId]) -> Visible {
    let eye = Vec3::new(0.1 * generation as f32, 1.0, 3.0);
    let faces = (0..).zip(faces).map(|(number, &face)| (face, 100 + number)).collect();
    Visible { generation, eye, image: None, faces }
}

fn drawn(engine: &mut Engine) -> BTreeSet<FaceId> {
    let whole = engine.whole();
    HostMesh::default().apply(&whole).expect("an update of its own");
    whole.drawn_triangles.iter().map(|(_, triangle)| triangle.face).collect()
}

fn engine() -> (Engine, Vec<FaceId>) {
    let (scene, faces) = floor();
    let mut engine = engine_with(scene, 1, bounces(0));
    engine.answer_views_within(Duration::ZERO);
    (engine, faces)
}

#[test]
fn the_largest_come_first_and_the_rest_in_batches() {
    let (mut engine, faces) = engine();
    let mut mirror = Mirror::default();
    mirror.apply(engine.set_visible(&view(1, &faces)));
    let first = drawn(&mut engine);
    assert!(first.len() < 100 && first.contains(&faces[199]) && !first.contains(&faces[0]), "{}", first.len());
    assert!(!mirror.last.stats.complete && !mirror.last.stats.converged);
    // A view that comes before that is done does not lose them.
    mirror.apply(engine.set_visible(&view(2, &faces)));
    let second = drawn(&mut engine);
    assert!(second.len() > first.len() && second.len() < 200, "{}", second.len());
    let mut batches = 0;
    while !mirror.last.stats.complete && batches < 50 {
        mirror.apply(engine.step(Budget::Rays(1)));
        batches += 1;
    }
    assert!(mirror.last.stats.complete);
    assert_eq!(drawn(&mut engine), faces.into_iter().collect());
}

#[test]
fn a_picture_that_is_kept_has_them_all() {
    let (mut engine, faces) = engine();
    let mut mirror = Mirror::default();
    mirror.apply(engine.set_visible(&view(1, &faces)));
    mirror.apply(engine.settle());
    assert_eq!(drawn(&mut engine), faces.into_iter().collect());
}

#[test]
fn those_that_leave_the_view_before_they_are_drawn_are_let_go() {
    let (mut engine, faces) = engine();
    let mut mirror = Mirror::default();
    mirror.apply(engine.set_visible(&view(1, &faces)));
    let first = drawn(&mut engine);
    mirror.apply(engine.set_visible(&view(2, &faces[190..])));
    mirror.apply(engine.settle());
    assert_eq!(drawn(&mut engine), first, "what was drawn stays drawn");
}
