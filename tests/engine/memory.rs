//! What the engine holds for a scene of irregular pieces in direct and indirect light: the dearest of leaves, each with three slots of
//! its own, which coarser vertices predict.

use crate::support::by_hand::{Mirror, drawn, engine_with, light, material, options};
use crate::support::shapes::{icosphere, room};
use glam::Vec3;
use penombre::refine::engine::{Budget, Visible};
use penombre::refine::options::Options;
use penombre::scene::light::LightKind;
use penombre::scene::material::Model;
use penombre::scene::{FaceId, Scene, TriangleId};

/// Balls of many sizes that stand in each other and in the walls of a room, seen with a few pixels a face.
fn balls() -> (Scene, Vec<FaceId>) {
    let mut scene = Scene::default();
    let [matt, glossy] = [0.0, 20.0].map(|shininess| {
        material(&mut scene, |m| {
            (m.kd, m.model) = (Vec3::splat(0.6), Model::phong(Vec3::splat(shininess * 0.01), shininess))
        })
    });
    room(&mut scene, [matt; 6], false);
    for i in 0..8 {
        let turn = i as f32 * 2.4;
        let centre = Vec3::new(0.5 + 0.35 * turn.cos(), 0.1 * i as f32, 0.5 + 0.35 * turn.sin());
        icosphere(&mut scene, centre, 0.08 + 0.02 * i as f32, 3, false, if i % 2 == 0 { matt } else { glossy });
    }
    light(&mut scene, LightKind::Point { position: Vec3::splat(0.5), intensity: Vec3::splat(0.1) });
    let faces = (0..scene.triangles.len() as u32).map(|t| FaceId::new(TriangleId(t), false)).collect();
    (scene, faces)
}

#[test]
fn a_leaf_of_unrefined_flat_facets_takes_no_more_than_it_did() {
    let (scene, faces) = balls();
    let mut engine = engine_with(scene, 2, Options { indirect: true, ..options(3) });
    let faces = faces.into_iter().map(|face| (face, 12)).collect();
    let mut mirror = Mirror::default();
    mirror.apply(engine.set_visible(&Visible { generation: 1, eye: Vec3::splat(0.45), image: None, faces }));
    while mirror.last.stats.rays < 200_000 {
        mirror.apply(engine.step(Budget::Rays(20_000)));
        engine.counted(&drawn(&mirror));
    }
    let stats = engine.settle().stats;
    let bytes = stats.cache_bytes / stats.triangles;
    let parts = engine.cache().bytes_by_part().map(|(part, held)| (part, held as u64 / stats.triangles));
    println!("{} leaves, {bytes} bytes each: {parts:?}", stats.triangles);
    assert!(stats.triangles > 10_000 && bytes < 1050, "{bytes} bytes a leaf of {}: {parts:?}", stats.triangles);
}
