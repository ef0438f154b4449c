//! Scenes built by hand, and an engine driven without a GPU.
#![allow(clippy::expect_used, reason = "a failed expectation fails the test")]

use glam::{DVec3, Vec2, Vec3};
use penombre::estimate::hemisphere::Method;
use penombre::geom::bvh::Bvh;
use penombre::light::lights::MAX_LIGHT_GROUPS;
use penombre::refine::engine::{Budget, Counted, Engine, Visible};
use penombre::refine::options::{Options, Pieces, Priority};
use penombre::refine::replay::HostMesh;
use penombre::refine::update::{Slot, Update};
use penombre::refine::workers::Workers;
use penombre::scene::light::{Light, LightKind};
use penombre::scene::material::{Material, MaterialId};
use penombre::scene::{FaceId, Scene, TriangleId};
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

/// The mesh as the GPU would hold it, with the last update.
#[derive(Default)]
pub struct Mirror {
    pub mesh: HostMesh,
    pub last: Update,
}

impl Mirror {
    /// Takes an update in, which must fit the mesh.
    pub fn apply(&mut self, update: Update) {
        self.mesh.apply(&update).expect("an update that fits the mesh");
        self.last = update;
    }

    /// Values at the corners of a face that was not split.
    pub fn face(&self, face: FaceId) -> [Slot; 3] {
        let triangles = self.triangles(face);
        assert_eq!(triangles.len(), 1, "the face is drawn as one triangle");
        triangles[0]
    }

    /// Drawn triangles of a face, as corner slots.
    pub fn triangles(&self, face: FaceId) -> Vec<[Slot; 3]> {
        self.mesh.drawn().filter(|(_, drawn, _)| drawn.face == face).map(|(.., corners)| corners).collect()
    }

    /// D at a point of a face, as the rasteriser interpolates it.
    pub fn diffuse_at(&self, face: FaceId, x: Vec3) -> Option<Vec3> {
        self.triangles(face).iter().find_map(|t| interpolated(t, x))
    }
}

/// D of a triangle at a point of its plane, as the rasteriser interpolates it, if that lies in it.
pub fn interpolated(t: &[Slot; 3], x: Vec3) -> Option<Vec3> {
    let [a, b, c] = t.map(|s| s.position.as_dvec3());
    let n = (b - a).cross(c - a);
    let w = |p: DVec3, q: DVec3| (q - p).cross(x.as_dvec3() - p).dot(n) / n.length_squared();
    let weights = [w(b, c), w(c, a), w(a, b)];
    weights.iter().all(|w| *w >= -1e-6).then(|| {
        let each = |f: &dyn Fn(&Slot) -> Vec3| (0..3).map(|i| f(&t[i]) * weights[i] as f32).sum::<Vec3>();
        each(&|s| s.diffuse * s.weight) / each(&|s| Vec3::splat(s.weight)).x
    })
}

/// No refinement: light at base vertices, penumbrae to the end.
pub fn options(seed: u64) -> Options {
    Options {
        indirect: false,
        filter: true,
        hemisphere: Method::Stratified,
        seed,
        max_light_groups: MAX_LIGHT_GROUPS,
        priority: Priority::Error,
        min_pixels: f32::INFINITY,
        listed: false,
        contrast: 0.02,
        shadow_size: 1.0,
        shadow_pixels: f32::INFINITY,
        white: f32::INFINITY,
        tolerance: 1e-3,
        without: Pieces::default(),
    }
}

pub fn engine(scene: Scene, threads: usize, seed: u64) -> Engine {
    engine_with(scene, threads, options(seed))
}

pub fn engine_with(scene: Scene, threads: usize, options: Options) -> Engine {
    let bvh = Arc::new(Bvh::build(&scene));
    Engine::new(Arc::new(scene), bvh, Workers::new(threads, false).expect("threads"), options)
}

/// The GPU's word that it has drawn everything.
pub fn drawn(mirror: &Mirror) -> Counted {
    let Update { generation, sequence, .. } = mirror.last;
    Counted { generation, sequence, pixels: Vec::new() }
}

/// Lights the given faces to the end.
pub fn solve(engine: &mut Engine, faces: &[FaceId], eye: Vec3) -> Mirror {
    solve_pixels(engine, faces, 10, eye)
}

/// Lights the given faces, each of so many pixels, to the end; the GPU is taken to draw each update at once.
pub fn solve_pixels(engine: &mut Engine, faces: &[FaceId], pixels: u32, eye: Vec3) -> Mirror {
    let mut faces: Vec<(FaceId, u32)> = faces.iter().map(|&f| (f, pixels)).collect();
    faces.sort();
    faces.dedup();
    let mut mirror = Mirror::default();
    mirror.apply(engine.set_visible(&Visible { generation: 1, eye, image: None, faces }));
    while !mirror.last.stats.converged {
        mirror.apply(engine.step(Budget::Rays(50_000)));
        engine.counted(&drawn(&mirror));
    }
    mirror
}

/// Both faces of triangles.
pub fn both_sides(triangles: &[TriangleId]) -> Vec<FaceId> {
    triangles.iter().flat_map(|&t| [FaceId::new(t, false), FaceId::new(t, true)]).collect()
}

/// No refinement, light that bounces, shown as it was sampled.
pub fn bounces(seed: u64) -> Options {
    Options { indirect: true, filter: false, ..options(seed) }
}

/// The front faces of `ids`.
pub fn front(ids: &[TriangleId]) -> Vec<FaceId> {
    ids.iter().map(|&t| FaceId::new(t, false)).collect()
}

/// Lights the given faces until `rays` are traced: indirect light is never done.
pub fn gather_light(engine: &mut Engine, faces: &[FaceId], eye: Vec3, rays: u64) -> Mirror {
    let mut faces: Vec<(FaceId, u32)> = faces.iter().map(|&f| (f, 4_000)).collect();
    faces.sort();
    let mut mirror = Mirror::default();
    mirror.apply(engine.set_visible(&Visible { generation: 1, eye, image: None, faces }));
    while !mirror.last.stats.converged && mirror.last.stats.rays < rays {
        mirror.apply(engine.step(Budget::Rays(20_000)));
        engine.counted(&drawn(&mirror));
    }
    engine.cache().validate();
    mirror
}

/// Lights a room, refined where it pays, until `rays` are traced.
pub fn refined(scene: Scene, ids: &[TriangleId], threads: usize, options: Options, rays: u64) -> (Engine, Mirror) {
    let mut engine = engine_with(scene, threads, Options { min_pixels: 3.0, ..options });
    let mirror = gather_light(&mut engine, &front(ids), Vec3::splat(0.5), rays);
    (engine, mirror)
}
