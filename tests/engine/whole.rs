//! All that the updates so far add up to, as one update.
#![allow(clippy::expect_used, reason = "a failed expectation fails the test")]

use crate::support::by_hand::{Mirror, bounces, drawn, engine_with, front, light, material, patch};
use glam::Vec3;
use penombre::refine::engine::{Budget, Engine, Visible};
use penombre::refine::replay::HostMesh;
use penombre::scene::light::{LightKind, LightState};
use penombre::scene::material::Model;
use penombre::scene::{FaceId, Scene, TriangleId};

/// A floor and a wall under a lamp, and a board that shades a part of them.
fn corner() -> (Scene, Vec<TriangleId>) {
    let mut scene = Scene::default();
    let grey = material(&mut scene, |m| m.model = Model::phong(Vec3::splat(0.2), 10.0));
    let mut seen = patch(&mut scene, Vec3::new(-1.0, 0.0, -1.0), Vec3::Z * 2.0, Vec3::X * 2.0, 2, grey);
    seen.extend(patch(&mut scene, Vec3::new(-1.0, 0.0, -1.0), Vec3::X * 2.0, Vec3::Y * 2.0, 2, grey));
    patch(&mut scene, Vec3::new(0.0, 0.5, -0.5), Vec3::Z * 0.5, Vec3::X * 0.5, 1, grey);
    let kind = LightKind::Point { position: Vec3::new(0.3, 1.6, 0.4), intensity: Vec3::splat(4.0) };
    light(&mut scene, kind);
    (scene, seen)
}

fn view(generation: u32, eye: Vec3, faces: &[FaceId]) -> Visible {
    Visible { generation, eye, image: None, faces: faces.iter().map(|&face| (face, 2000)).collect() }
}

/// Checks that what is told anew draws what all updates together do, and nothing else.
fn check(engine: &mut Engine, mirror: &Mirror, when: &str) {
    let whole = engine.whole();
    assert!(whole.whole && (whole.sequence, whole.generation) == (mirror.last.sequence, mirror.last.generation));
    let mut anew = HostMesh::default();
    anew.apply(&whole).expect("an update of its own");
    assert!(anew.drawn().count() > 4 && anew.drawn().eq(mirror.mesh.drawn()), "{when}");
}

#[test]
fn it_draws_what_all_updates_together_draw() {
    let (scene, ids) = corner();
    let faces = front(&ids);
    let mut engine = engine_with(scene, 1, bounces(0));
    let mut mirror = Mirror::default();
    let step = |engine: &mut Engine, mirror: &mut Mirror| {
        mirror.apply(engine.step(Budget::Rays(2_000)));
        engine.counted(&drawn(mirror));
    };
    mirror.apply(engine.set_visible(&view(1, Vec3::new(0.0, 1.0, 3.0), &faces[..8])));
    check(&mut engine, &mirror, "the first view");
    for batch in 0..6 {
        step(&mut engine, &mut mirror);
        check(&mut engine, &mirror, &format!("batch {batch}"));
    }
    mirror.apply(
        engine.relight(&[LightState::times(Vec3::new(0.5, 1.0, 2.0))], &view(2, Vec3::new(0.5, 1.5, 2.0), &faces)),
    );
    check(&mut engine, &mirror, "another view in other light");
    for batch in 0..6 {
        step(&mut engine, &mut mirror);
        check(&mut engine, &mirror, &format!("batch {batch} of the second view"));
    }
    mirror.apply(engine.settle());
    check(&mut engine, &mirror, "settled");
    step(&mut engine, &mut mirror);
    check(&mut engine, &mirror, "what comes after goes on from it");
}
