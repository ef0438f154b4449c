//! Scenes built by hand, and an engine driven without a GPU.
#![allow(dead_code, reason = "each test file uses its own part")]

use glam::{Vec2, Vec3};
use penombre::geom::bvh::Bvh;
use penombre::refine::engine::{Budget, Engine, Visible};
use penombre::refine::options::{Options, Priority};
use penombre::refine::update::{Slot, SlotId, Update};
use penombre::refine::workers::Workers;
use penombre::scene::light::{Light, LightKind};
use penombre::scene::material::{Material, MaterialId};
use penombre::scene::{FaceId, Scene, TriangleId};
use std::collections::HashMap;
use std::sync::Arc;

/// Adds a material.
pub fn material(scene: &mut Scene, edit: impl FnOnce(&mut Material)) -> MaterialId {
    let mut material = Material::grey(&format!("m{}", scene.materials.len()));
    edit(&mut material);
    scene.materials.push(material);
    MaterialId(scene.materials.len() as u32 - 1)
}

/// Adds a flat triangle and returns its id.
pub fn triangle(scene: &mut Scene, corners: [Vec3; 3], material: MaterialId) -> TriangleId {
    let indices = corners.map(|p| {
        let found =
            scene.positions.iter().position(|q| q.to_array().map(f32::to_bits) == p.to_array().map(f32::to_bits));
        found.unwrap_or_else(|| {
            scene.positions.push(p);
            scene.positions.len() - 1
        }) as u32
    });
    scene.triangles.push(indices);
    let id = TriangleId(scene.triangles.len() as u32 - 1);
    scene.normals.push([scene.geometric_normal(id); 3]);
    scene.uvs.push([Vec2::new(0.0, 0.0), Vec2::new(1.0, 0.0), Vec2::new(1.0, 1.0)]);
    scene.triangle_materials.push(material);
    id
}

/// Adds a parallelogram `origin + s·u + t·v` facing u × v, in `n × n` cells of two triangles.
pub fn patch(scene: &mut Scene, origin: Vec3, u: Vec3, v: Vec3, n: u32, material: MaterialId) -> Vec<TriangleId> {
    let at = |i: u32, j: u32| origin + u * (i as f32 / n as f32) + v * (j as f32 / n as f32);
    let mut ids = Vec::new();
    for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
        ids.push(triangle(scene, [at(i, j), at(i + 1, j), at(i + 1, j + 1)], material));
        ids.push(triangle(scene, [at(i, j), at(i + 1, j + 1), at(i, j + 1)], material));
    }
    ids
}

/// Adds a light.
pub fn light(scene: &mut Scene, kind: LightKind) {
    let name = format!("light {}", scene.lights.len() + 1);
    scene.lights.push(Light { name, kind });
}

/// Slots and leaves as the GPU would hold them, with the update's last statistics.
#[derive(Default)]
pub struct Mirror {
    pub slots: HashMap<SlotId, Slot>,
    pub leaves: HashMap<FaceId, [SlotId; 3]>,
    pub last: Update,
}

impl Mirror {
    pub fn apply(&mut self, update: Update) {
        self.slots.extend(update.slots.iter().copied());
        self.leaves.extend(update.leaves.iter().map(|(_, leaf)| (leaf.face, leaf.slots)));
        self.last = update;
    }

    /// Values at the corners of a face.
    pub fn face(&self, face: FaceId) -> [Slot; 3] {
        self.leaves[&face].map(|slot| self.slots[&slot])
    }
}

/// No refinement: light at base vertices, penumbrae to the end.
pub fn options(seed: u64) -> Options {
    Options {
        seed,
        priority: Priority::Error,
        min_pixels: f32::INFINITY,
        contrast: 0.02,
        shadow_size: 1.0,
        tolerance: 1e-3,
    }
}

pub fn engine(scene: Scene, threads: usize, seed: u64) -> Engine {
    let bvh = Arc::new(Bvh::build(&scene));
    Engine::new(Arc::new(scene), bvh, Workers::new(threads).expect("threads"), options(seed))
}

/// Lights the given faces to the end.
pub fn solve(engine: &mut Engine, faces: &[FaceId], eye: Vec3) -> Mirror {
    let mut faces: Vec<(FaceId, u32)> = faces.iter().map(|&f| (f, 10)).collect();
    faces.sort();
    faces.dedup();
    let mut mirror = Mirror::default();
    mirror.apply(engine.set_visible(&Visible { generation: 1, eye, faces }));
    while !mirror.last.stats.converged {
        mirror.apply(engine.step(Budget::Rays(50_000)));
    }
    mirror
}

/// Both faces of triangles.
pub fn both_sides(triangles: &[TriangleId]) -> Vec<FaceId> {
    triangles.iter().flat_map(|&t| [FaceId::new(t, false), FaceId::new(t, true)]).collect()
}
