//! Many lamps of which most hang behind something: the first picture takes few rays for them, and is nearly right all the same.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use crate::support::by_hand::{Mirror, engine_with, light, material, options, patch};
use glam::Vec3;
use penombre::math::sequence::Sequence;
use penombre::refine::engine::{Budget, Visible};
use penombre::scene::light::LightKind;
use penombre::scene::{FaceId, Scene, TriangleId};
use std::f32::consts::PI;

const INTENSITY: f32 = 3.0;

/// Some lamps below a ceiling, others above it.
#[derive(Clone, Copy)]
struct Lamps {
    below: u32,
    all: u32,
}

impl Lamps {
    fn position(self, i: u32) -> Vec3 {
        let [x, y, z, ..] = Sequence::new(3).point(i);
        let height = if i < self.below { 1.0 + 0.5 * y } else { 2.2 + 0.5 * y };
        Vec3::new(x * 8.0 - 4.0, height, z * 8.0 - 4.0)
    }

    /// D of the lamps below the ceiling.
    fn exact(self, x: Vec3) -> f32 {
        let from = |lamp: Vec3| INTENSITY * lamp.y / (lamp - x).length().powi(3);
        (0..self.below).map(|i| from(self.position(i))).sum::<f32>() / PI
    }
}

/// A finely meshed floor [-4, 4]² under a ceiling that hides some of the lamps from it.
fn storeys(lamps: Lamps) -> (Scene, Vec<TriangleId>) {
    let mut scene = Scene::default();
    let grey = material(&mut scene, |m| m.kd = Vec3::splat(0.5));
    let floor = patch(&mut scene, Vec3::new(-4.0, 0.0, -4.0), Vec3::Z * 8.0, Vec3::X * 8.0, 50, grey);
    patch(&mut scene, Vec3::new(-20.0, 2.0, -20.0), Vec3::Z * 40.0, Vec3::X * 40.0, 1, grey);
    for position in (0..lamps.all).map(|i| lamps.position(i)) {
        light(&mut scene, LightKind::Point { position, intensity: Vec3::splat(INTENSITY) });
    }
    (scene, floor)
}

/// What the first complete picture took and shows.
struct First {
    /// Rays a vertex.
    rays: f32,
    /// Relative errors at the corners of the faces: the largest, the mean.
    worst: f32,
    mean: f32,
}

fn first_picture(lamps: Lamps) -> First {
    let (scene, floor) = storeys(lamps);
    let mut engine = engine_with(scene, 2, options(5));
    let faces: Vec<FaceId> = floor.iter().map(|&t| FaceId::new(t, false)).collect();
    let visible = faces.iter().map(|&face| (face, 1)).collect();
    let mut mirror = Mirror::default();
    let eye = Vec3::new(0.0, 1.0, 0.0);
    mirror.apply(engine.set_visible(&Visible { generation: 1, eye, image: None, faces: visible }));
    while !mirror.last.stats.complete {
        mirror.apply(engine.step(Budget::Rays(1)));
    }
    let stats = mirror.last.stats;
    let a_vertex = stats.rays as f32 / stats.vertices as f32;
    let errors = faces.iter().flat_map(|&face| mirror.face(face)).map(|s| s.diffuse.y / lamps.exact(s.position) - 1.0);
    let errors: Vec<f32> = errors.collect();
    let (worst, mean) =
        (errors.iter().fold(0.0_f32, |m, e| m.max(e.abs())), errors.iter().sum::<f32>() / errors.len() as f32);
    println!("{a_vertex} rays a vertex; off by {worst} at most, {mean} in the mean");
    First { rays: a_vertex, worst, mean }
}

#[test]
fn hidden_lamps_are_hardly_asked() {
    let First { rays, worst, mean } = first_picture(Lamps { below: 10, all: 64 });
    assert!(rays < 40.0, "{rays} rays a vertex of 64 lamps");
    assert!(worst < 0.4 && mean.abs() < 0.1, "{worst} {mean}");
}

/// To come back for one of a few would cost more than its ray.
#[test]
fn few_lamps_are_all_asked() {
    let First { worst, .. } = first_picture(Lamps { below: 3, all: 7 });
    assert!(worst < 1e-3, "{worst}");
}
