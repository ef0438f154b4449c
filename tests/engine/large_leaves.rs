//! Walls whose corners lie in the dark are found to be lit between them.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use super::pixel_vertices::{counting, image, view};
use crate::support::by_hand::{Mirror, drawn, engine_with, light, material, patch};
use glam::Vec3;
use penombre::refine::engine::{Budget, Visible};
use penombre::scene::light::LightKind;
use penombre::scene::{FaceId, Scene};

/// Luminance of D by which pixels of a floor's two leaves are found to differ from what the corners say, when all vertices have just
/// been visited; a cap over each corner or none.
fn found(caps: bool) -> [f32; 2] {
    let mut scene = Scene::default();
    let grey = material(&mut scene, |_| {});
    let floor = patch(&mut scene, Vec3::new(-1.0, 0.0, -1.0), Vec3::Z * 2.0, Vec3::X * 2.0, 1, grey);
    if caps {
        for (x, z) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
            let corner = Vec3::new(x, 0.05, z) - Vec3::new(0.1, 0.0, 0.1);
            patch(&mut scene, corner, Vec3::Z * 0.2, Vec3::X * 0.2, 1, grey);
        }
    }
    light(&mut scene, LightKind::Point { position: Vec3::Y, intensity: Vec3::ONE });
    let faces: Vec<FaceId> = floor.iter().map(|&t| FaceId::new(t, false)).collect();
    let image = image(&scene, &faces, &view(&scene, 0.0));
    let mut engine = engine_with(scene, 2, counting(1));
    let mut mirror = Mirror::default();
    let (eye, seen) = (image.view.eye, faces.iter().map(|&face| (face, 1500)).collect());
    mirror.apply(engine.set_visible(&Visible { generation: 1, eye, image: Some(image), faces: seen }));
    while !mirror.last.stats.complete {
        mirror.apply(engine.step(Budget::Rays(1)));
        engine.counted(&drawn(&mirror));
    }
    let roots = [0, 1].map(|i| engine.cache().root_of(faces[i]).unwrap());
    roots.map(|root| engine.view().hidden.get(root).mismatch)
}

#[test]
fn light_between_corners_in_the_dark_is_found_at_once() {
    // Luminance straight below the light is 1/π, half way to the corners a fifth of that and more.
    let with_caps = found(true);
    assert!(with_caps.iter().all(|&luminance| luminance > 0.05), "{with_caps:?}");
    assert_eq!(found(false), [0.0; 2], "corners tell the truth");
}
