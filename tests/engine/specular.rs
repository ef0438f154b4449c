//! Specular luminance of faces that stay in view while the eye moves.
#![allow(clippy::expect_used, reason = "a failed expectation fails the test")]

use crate::support::by_hand::{Mirror, bounces, drawn, engine_with, front, light, material, patch};
use glam::Vec3;
use penombre::refine::engine::{Budget, Engine, Visible};
use penombre::refine::replay::HostMesh;
use penombre::refine::update::{Slot, SlotId};
use penombre::scene::light::LightKind;
use penombre::scene::material::Model;
use penombre::scene::{FaceId, Scene};
use std::time::Duration;

const EYES: [Vec3; 3] = [Vec3::new(0.0, 1.0, 3.0), Vec3::new(0.1, 1.0, 2.9), Vec3::new(1.0, 1.5, 1.0)];

/// A floor with highlights and a wall without, under a lamp; the floor has 128 faces.
fn corner() -> (Scene, Vec<FaceId>) {
    let mut scene = Scene::default();
    let glossy = material(&mut scene, |m| m.model = Model::phong(Vec3::splat(0.2), 10.0));
    let matte = material(&mut scene, |_| {});
    let mut seen = patch(&mut scene, Vec3::new(-1.0, 0.0, -1.0), Vec3::Z * 2.0, Vec3::X * 2.0, 8, glossy);
    seen.extend(patch(&mut scene, Vec3::new(-1.0, 0.0, -1.0), Vec3::X * 2.0, Vec3::Y * 2.0, 4, matte));
    light(&mut scene, LightKind::Point { position: Vec3::new(0.3, 1.6, 0.4), intensity: Vec3::splat(4.0) });
    let faces = front(&seen);
    (scene, faces)
}

fn view(generation: u32, faces: &[FaceId]) -> Visible {
    let eye = EYES[generation as usize - 1];
    Visible { generation, eye, image: None, faces: faces.iter().map(|&face| (face, 2000)).collect() }
}

/// An engine that has looked from the first eye for a while.
fn looked(wait: Option<Duration>) -> (Engine, Mirror, Vec<FaceId>) {
    let (scene, faces) = corner();
    let mut engine = engine_with(scene, 1, bounces(4));
    wait.into_iter().for_each(|wait| engine.answer_views_within(wait));
    let mut mirror = Mirror::default();
    mirror.apply(engine.set_visible(&view(1, &faces)));
    for _ in 0..4 {
        mirror.apply(engine.step(Budget::Rays(2_000)));
        engine.counted(&drawn(&mirror));
    }
    (engine, mirror, faces)
}

/// What all slots show.
fn slots(engine: &mut Engine) -> Vec<(SlotId, Slot)> {
    let whole = engine.whole();
    HostMesh::default().apply(&whole).expect("an update of its own");
    whole.slots
}

#[test]
fn what_a_view_does_not_wait_for_follows() {
    let (mut waits, _, faces) = looked(None);
    let (mut defers, _, _) = looked(Some(Duration::ZERO));
    assert_eq!(slots(&mut waits), slots(&mut defers), "nothing is deferred for an eye that stays");
    let moved = defers.set_visible(&view(2, &faces)).stats;
    assert_eq!(moved.outdated_specular, 128, "the faces of the floor");
    assert!(!moved.converged);
    assert_eq!(waits.set_visible(&view(2, &faces)).stats.outdated_specular, 0);
    let is_alike = |waits: &mut Engine, defers: &mut Engine| slots(waits) == slots(defers);
    assert!(!is_alike(&mut waits, &mut defers), "S is of the eye before");
    // A view that comes before that is done takes its place.
    for engine in [&mut waits, &mut defers] {
        engine.set_visible(&view(3, &faces));
        assert_eq!(engine.settle().stats.outdated_specular, 0);
    }
    assert!(is_alike(&mut waits, &mut defers));
}

#[test]
fn batches_bring_it_up_to_date() {
    let (mut engine, _, faces) = looked(Some(Duration::ZERO));
    let mut left = engine.set_visible(&view(2, &faces)).stats.outdated_specular;
    assert_eq!(left, 128);
    for _ in 0..128 {
        let outdated = engine.step(Budget::Rays(1)).stats.outdated_specular;
        assert!(outdated < left || outdated == 0, "{outdated} of {left}");
        left = outdated;
    }
    assert_eq!(left, 0);
}
