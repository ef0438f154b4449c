//! A camera that moves along a corridor, driven without a GPU.
#![allow(clippy::expect_used, reason = "a failed expectation fails the test")]

use crate::support::by_hand::{Mirror, drawn, engine_with, light, material, options, patch};
use glam::Vec3;
use penombre::geom::Ray;
use penombre::geom::bvh::Bvh;
use penombre::refine::engine::{Budget, Engine, Visible};
use penombre::refine::options::Options;
use penombre::refine::pixel_lists::FaceImage;
use penombre::scene::camera::{Camera, ImageSize, View};
use penombre::scene::light::LightKind;
use penombre::scene::material::Model;
use penombre::scene::{FaceId, Scene};
use std::collections::BTreeMap;

const SIZE: ImageSize = ImageSize { width: 64, height: 48 };

/// A long floor of small squares between two walls, one of them glossy, half in the shadow of a board.
pub fn corridor() -> Scene {
    let mut scene = Scene::default();
    let grey = material(&mut scene, |m| m.kd = Vec3::splat(0.6));
    let glossy = material(&mut scene, |m| {
        (m.kd, m.model) = (Vec3::splat(0.4), Model::phong(Vec3::splat(0.3), 12.0));
    });
    for (origin, u, v, material) in [
        (Vec3::new(-4.0, 0.0, -0.5), Vec3::Z, Vec3::X * 8.0, grey),
        (Vec3::new(-4.0, 0.0, -0.5), Vec3::X * 8.0, Vec3::Y, glossy),
        (Vec3::new(-4.0, 0.0, 0.5), Vec3::Y, Vec3::X * 8.0, grey),
    ] {
        patch(&mut scene, origin, u, v, 24, material);
    }
    patch(&mut scene, Vec3::new(-1.0, 0.6, -0.2), Vec3::Z * 0.4, Vec3::X * 2.0, 1, grey);
    light(&mut scene, LightKind::Point { position: Vec3::new(0.3, 1.6, 0.1), intensity: Vec3::ONE });
    light(&mut scene, LightKind::Point { position: Vec3::new(-2.5, 1.1, -0.2), intensity: Vec3::splat(0.5) });
    scene
}

/// What the camera sees from a place along the corridor, as the visibility pass tells it; `ahead` is where it looks.
pub fn look(scene: &Scene, bvh: &Bvh, (x, ahead): (f32, f32), generation: u32) -> Visible {
    let camera = Camera {
        position: Vec3::new(x, 1.2, 0.3),
        look_at: Vec3::new(x + ahead, 0.2, -0.1),
        up: Vec3::Y,
        vertical_fov: 50.0,
    };
    let view = scene.view(&camera, SIZE);
    let seen = |pixel: usize| {
        let direction = view.direction(SIZE.centre_of(pixel)).normalize();
        let hit = bvh.closest(scene, &Ray { origin: view.eye, direction, t_max: f32::INFINITY });
        hit.map_or(0, |hit| FaceId::new(hit.triangle, hit.back).0 + 1)
    };
    let faces: Vec<u32> = (0..SIZE.pixels()).map(seen).collect();
    let mut counts: BTreeMap<FaceId, u32> = BTreeMap::new();
    faces.iter().filter(|id| **id > 0).for_each(|id| *counts.entry(FaceId(id - 1)).or_default() += 1);
    let image = Some(FaceImage { view, faces: faces.into() });
    Visible { generation, eye: view.eye, image, faces: counts.into_iter().collect() }
}

/// An engine and what it has told the GPU, which draws each update at once.
pub struct Run {
    pub scene: Scene,
    pub bvh: Bvh,
    pub engine: Engine,
    pub mirror: Mirror,
    pub generation: u32,
}

impl Run {
    pub fn new(threads: usize) -> Self {
        let scene = corridor();
        let options = Options { min_pixels: 1.0, listed: true, indirect: true, tolerance: 4e-3, ..options(3) };
        let engine = engine_with(scene.clone(), threads, options);
        Self { bvh: Bvh::build(&scene), scene, engine, mirror: Mirror::default(), generation: 0 }
    }

    pub fn look(&mut self, x: f32) -> Visible {
        self.turn(x, 0.6)
    }

    pub fn turn(&mut self, x: f32, ahead: f32) -> Visible {
        self.generation += 1;
        let visible = look(&self.scene, &self.bvh, (x, ahead), self.generation);
        self.mirror.apply(self.engine.set_visible(&visible));
        visible
    }

    pub fn work(&mut self, batches: usize) {
        for _ in 0..batches {
            self.engine.counted(&drawn(&self.mirror));
            self.mirror.apply(self.engine.step(Budget::Rays(2_000)));
        }
    }

    /// D under each pixel of a view.
    pub fn shown(&self, visible: &Visible) -> Vec<Vec3> {
        let image = visible.image.as_ref().expect("an image");
        let of_face = |face: FaceId| {
            let triangles = self.mirror.mesh.drawn().filter(move |(_, drawn, _)| drawn.face == face);
            triangles.map(|(.., corners)| corners).collect::<Vec<_>>()
        };
        let faces: BTreeMap<FaceId, _> = visible.faces.iter().map(|&(face, _)| (face, of_face(face))).collect();
        let point = |view: &View, pixel: usize, face: FaceId| {
            let direction = view.direction(SIZE.centre_of(pixel));
            let normal = self.scene.area_vector(face.triangle());
            let from_eye = self.scene.corners(face.triangle())[0] - view.eye;
            view.eye + direction * (from_eye.dot(normal) / direction.dot(normal))
        };
        let seen = image.faces.iter().enumerate().filter(|(_, id)| **id > 0);
        let diffuse = seen.filter_map(|(pixel, id)| {
            let face = FaceId(id - 1);
            let place = point(&image.view, pixel, face);
            faces[&face].iter().find_map(|corners| crate::support::by_hand::interpolated(corners, place))
        });
        diffuse.collect()
    }
}

/// Mean difference against the mean.
pub fn difference(a: &[Vec3], b: &[Vec3]) -> f32 {
    assert_eq!(a.len(), b.len());
    let off: f32 = a.iter().zip(b).map(|(a, b)| (*a - *b).abs().x).sum();
    off / b.iter().map(|b| b.x).sum::<f32>()
}
