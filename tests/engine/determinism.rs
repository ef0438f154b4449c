//! What an engine knows after a fixed number of rays does not depend on the number of threads: on three scenes, with room and without.
#![allow(clippy::expect_used, reason = "a failed expectation fails the test")]

use crate::corridor::corridor;
use crate::support::by_hand::{Mirror, drawn, engine_with, options};
use penombre::cache::digest::Digest;
use penombre::geom::Ray;
use penombre::geom::bvh::Bvh;
use penombre::refine::engine::{Budget, Visible};
use penombre::refine::memory::Memory;
use penombre::refine::options::Options;
use penombre::refine::pixel_lists::FaceImage;
use penombre::scene::camera::{Camera, ImageSize};
use penombre::scene::{FaceId, Scene, load};
use penombre::store::page_file::PageFile;
use std::collections::BTreeMap;
use std::path::Path;

const SIZE: ImageSize = ImageSize { width: 64, height: 48 };
const RAYS: u64 = 60_000;

/// What a camera of a scene sees.
fn look(scene: &Scene, bvh: &Bvh, camera: &Camera, generation: u32) -> Visible {
    let view = scene.view(camera, SIZE);
    let seen = |pixel: usize| {
        let direction = view.direction(SIZE.centre_of(pixel)).normalize();
        let hit = bvh.closest(scene, &Ray { origin: view.eye, direction, t_max: f32::INFINITY });
        hit.map_or(0, |hit| FaceId::new(hit.triangle, hit.back).0 + 1)
    };
    let faces: Vec<u32> = (0..SIZE.pixels()).map(seen).collect();
    let mut counts: BTreeMap<FaceId, u32> = BTreeMap::new();
    faces.iter().filter(|id| **id > 0).for_each(|id| *counts.entry(FaceId(id - 1)).or_default() += 1);
    Visible {
        generation,
        eye: view.eye,
        image: Some(FaceImage { view, faces: faces.into() }),
        faces: counts.into_iter().collect(),
    }
}

/// What is known after two views, and what was evicted.
fn known(scene: &Scene, threads: usize, budget: Option<usize>) -> (Digest, u64, u64) {
    let options = Options { min_pixels: 1.0, listed: true, indirect: true, ..options(5) };
    let (bvh, mut engine) = (Bvh::build(scene), engine_with(scene.clone(), threads, options));
    if let Some(budget) = budget {
        engine.limit_memory(Memory::limited(budget, PageFile::create(&std::env::temp_dir())));
    }
    let camera = scene.cameras.first().map_or_else(
        || Camera {
            position: glam::Vec3::new(-2.0, 1.2, 0.3),
            look_at: glam::Vec3::new(-2.6, 0.2, -0.1),
            up: glam::Vec3::Y,
            vertical_fov: 50.0,
        },
        |named| named.camera,
    );
    let aside = camera.position.lerp(camera.look_at, 0.3);
    let turned = Camera { position: aside, look_at: aside + (aside - camera.look_at), ..camera };
    let mut mirror = Mirror::default();
    for (camera, generation) in [&camera, &turned, &camera].into_iter().zip(1..) {
        mirror.apply(engine.set_visible(&look(scene, &bvh, camera, generation)));
        while mirror.last.stats.rays < RAYS * u64::from(generation) && !engine.is_idle() {
            mirror.apply(engine.step(Budget::Rays(5_000)));
            engine.counted(&drawn(&mirror));
        }
    }
    mirror.apply(engine.settle());
    (engine.cache().digest(), mirror.last.stats.memory.held, mirror.last.stats.memory.evicted)
}

fn scene(path: &str) -> Scene {
    load::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(path)).expect("a scene").scene
}

fn is_known_alike(name: &str, scene: &Scene) {
    let (one, held, _) = known(scene, 1, None);
    let tight = Some(held as usize * 3 / 5);
    let (one_tight, _, evicted) = known(scene, 1, tight);
    println!(
        "{name}: {:016x} with room, {:016x} in 3/5 of {held} bytes, {evicted} faces evicted",
        one.total(),
        one_tight.total()
    );
    for threads in [2, 7] {
        for (budget, one) in [(None, &one), (tight, &one_tight)] {
            let several = known(scene, threads, budget).0;
            let difference = one.first_difference(&several).map(|difference| difference.to_string());
            assert_eq!(difference, None, "{name}, {threads} threads, budget {budget:?}");
        }
    }
    assert!(one.vertices.len() > 100, "{}", one.vertices.len());
}

#[test]
fn a_box_is_known_alike_by_any_number_of_threads() {
    is_known_alike("Cornell box", &scene("cornell_box/cornell_box.toml"));
}

#[test]
fn a_corridor_is_known_alike_by_any_number_of_threads() {
    is_known_alike("corridor", &corridor());
}

#[test]
fn spheres_are_known_alike_by_any_number_of_threads() {
    is_known_alike("spheres", &scene("spheres/lamp.toml"));
}
