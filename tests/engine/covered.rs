//! Indirect light of pixels beside things that lie on a surface: the vertices around them are covered and do not know it.
#![allow(clippy::expect_used, reason = "a failed expectation fails the test")]

use crate::support::by_hand::{Mirror, bounces, drawn, engine_with, light, material, patch};
use glam::Vec3;
use penombre::geom::Ray;
use penombre::geom::bvh::Bvh;
use penombre::light::context::SceneContext;
use penombre::light::lights::Lights;
use penombre::math::luminance;
use penombre::reference::{Accumulator, Filter, Settings, Strategy, Transport};
use penombre::refine::engine::{Budget, Visible};
use penombre::refine::options::Options;
use penombre::refine::pixel_lists::FaceImage;
use penombre::refine::update::{DrawnId, DrawnTriangle, Slot};
use penombre::scene::camera::{Camera, ImageSize, View};
use penombre::scene::light::{LightKind, LightState};
use penombre::scene::{FaceId, Scene, TriangleId};

const SIZE: ImageSize = ImageSize { width: 64, height: 64 };
const GREY: f32 = 0.5;
const LIMIT: f32 = 0.17;

/// A floor of one face under a ceiling, two spots that light the ceiling alone, and planks on the floor, closer to each other than they
/// are high: between them it is dark.
fn scene() -> (Scene, Vec<TriangleId>) {
    let mut scene = Scene::default();
    let grey = material(&mut scene, |m| m.kd = Vec3::splat(GREY));
    let floor = patch(&mut scene, Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0, 1, grey);
    patch(&mut scene, Vec3::new(-2.0, 3.0, -2.0), Vec3::X * 4.0, Vec3::Z * 4.0, 1, grey);
    for i in -12..12 {
        let (low, width, height) = (Vec3::new(i as f32 * 0.1, 1e-4, -1.0), Vec3::X * 0.06, Vec3::Y * 0.12);
        let long = Vec3::Z * 2.0;
        patch(&mut scene, low, width, long, 1, grey);
        patch(&mut scene, low + height, long, width, 1, grey);
        patch(&mut scene, low, long, height, 1, grey);
        patch(&mut scene, low + width, height, long, 1, grey);
    }
    for position in [Vec3::new(0.4, 1.0, 0.3), Vec3::new(-0.3, 1.0, -0.4)] {
        let (direction, intensity) = (Vec3::Y, Vec3::ONE);
        light(&mut scene, LightKind::Spot { position, direction, intensity, cos_inner: 0.6, cos_outer: 0.5 });
    }
    (scene, floor)
}

/// What a pixel shows of the floor.
struct Pixel {
    index: usize,
    at: Vec3,
    face: FaceId,
}

fn pixels_of_the_floor(scene: &Scene, bvh: &Bvh, view: &View, faces: &[FaceId]) -> Vec<Pixel> {
    let seen = |index: usize| {
        let ray = view.direction(SIZE.centre_of(index));
        let hit = bvh.closest(scene, &Ray { origin: view.eye, direction: ray, t_max: f32::INFINITY })?;
        faces.contains(&hit.face()).then_some(Pixel { index, at: view.eye + ray * hit.t, face: hit.face() })
    };
    (0..SIZE.pixels()).filter_map(seen).collect()
}

/// The drawn triangle that holds a point of the floor.
fn holder(mirror: &Mirror, x: Vec3) -> (DrawnId, DrawnTriangle) {
    let holds = |corners: &[Slot; 3]| {
        let [a, b, c] = corners.map(|slot| slot.position);
        let area = |p: Vec3, q: Vec3| (q - p).cross(x - p).y;
        [area(a, b), area(b, c), area(c, a)].into_iter().all(|area| area >= -1e-9)
    };
    let found = mirror.mesh.drawn().find(|(.., corners)| holds(corners));
    found.map(|(id, drawn, _)| (id, drawn)).expect("the floor has no gap")
}

/// Which face of the floor each pixel sees.
fn image(pixels: &[Pixel], view: &View) -> FaceImage {
    let mut faces = vec![0; SIZE.pixels()];
    pixels.iter().for_each(|pixel| faces[pixel.index] = pixel.face.0 + 1);
    FaceImage { view: *view, faces: faces.into() }
}

/// What the pixels show by the path tracer, those lights on whose factor is 1.
fn reference(scene: &Scene, bvh: &Bvh, view: &View, factors: &[Vec3]) -> Vec<f32> {
    let mut scene = scene.clone();
    let mut on = factors.iter().map(|&factor| factor == Vec3::ONE);
    scene.lights.retain(|_| on.next() == Some(true));
    let lights = Lights::new(&scene);
    let context = SceneContext::new(&scene, bvh, &lights, 3, scene.scale());
    let settings = Settings { filter: Filter::Point, transport: Transport::Full, strategy: Strategy::Both };
    let mut accumulator = Accumulator::new(view);
    (0..600).for_each(|_| assert!(accumulator.pass(&context, view, settings, || false).finished));
    accumulator.image().mean.iter().map(|mean| luminance(mean.truncate())).collect()
}

/// RMSE over the mean of the pixels that show a vertex inside a leaf with a covered corner.
fn error_beside(mirror: &Mirror, pixels: &[Pixel], reference: &[f32]) -> f32 {
    let (mut square, mut all, mut beside) = (0.0, 0.0, 0);
    for pixel in pixels {
        let (_, drawn) = holder(mirror, pixel.at);
        let covered = drawn.slots.into_iter().any(|slot| mirror.mesh.slot(slot).weight < 1.0);
        let Some(flat) = drawn.flat.filter(|_| covered) else { continue };
        square += (GREY * luminance(mirror.mesh.slot(flat).diffuse) - reference[pixel.index]).powi(2);
        all += reference[pixel.index];
        beside += 1;
    }
    assert!(beside > 50, "{beside} pixels");
    (square / beside as f32).sqrt() / (all / beside as f32)
}

/// In one light, then in another seen by the same camera: what was left to gather, or was gathered before, must not be forgotten.
#[test]
fn what_lies_on_the_floor_does_not_light_the_pixels_beside_it() {
    let (scene, floor) = scene();
    let faces: Vec<FaceId> = floor.iter().map(|&t| FaceId::new(t, false)).collect();
    let (position, look_at) = (Vec3::new(0.1, 2.0, 0.2), Vec3::new(0.1, 0.0, 0.21));
    let camera = Camera { position, look_at, up: Vec3::Z, vertical_fov: 50.0 };
    let (view, bvh) = (scene.view(&camera, SIZE), Bvh::build(&scene));
    let pixels = pixels_of_the_floor(&scene, &bvh, &view, &faces);
    let options = Options { min_pixels: 3.0, shadow_size: 0.2, listed: true, ..bounces(5) };
    let mut engine = engine_with(scene.clone(), 2, options);
    let mut mirror = Mirror::default();
    let visible = faces.iter().map(|&f| (f, 1500)).collect();
    let mut visible = Visible { generation: 1, eye: view.eye, image: Some(image(&pixels, &view)), faces: visible };
    for factors in [[Vec3::ONE, Vec3::ONE], [Vec3::ZERO, Vec3::ONE]] {
        mirror.apply(engine.relight(&factors.map(LightState::times), &visible));
        visible.generation += 1;
        let rays = mirror.last.stats.rays + 600_000;
        while mirror.last.stats.rays < rays {
            engine.counted(&drawn(&mirror));
            mirror.apply(engine.step(Budget::Rays(10_000)));
        }
        engine.cache().validate();
        let error = error_beside(&mirror, &pixels, &reference(&scene, &bvh, &view, &factors));
        println!("{error}");
        assert!(error < LIMIT, "{factors:?}: {error}");
    }
}
