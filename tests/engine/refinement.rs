//! Refinement without a GPU: tiling, sharing, order of convergence, shadows against brute force.
#![allow(clippy::expect_used, reason = "a failed expectation fails the test")]

use crate::support::by_hand::{
    self, Mirror, both_sides, drawn, engine_with, front, light, material, options, patch, solve_pixels,
};
use glam::{Vec2, Vec3};
use penombre::geom::Ray;
use penombre::geom::bvh::Bvh;
use penombre::math::sequence::Sequence;
use penombre::refine::engine::{Budget, Visible};
use penombre::refine::options::{Options, Priority};
use penombre::scene::light::LightKind;
use penombre::scene::material::Model;
use penombre::scene::{FaceId, Scene, TriangleId};
use std::f32::consts::PI;
use std::sync::LazyLock;

fn refine(seed: u64) -> Options {
    Options { min_pixels: 3.0, shadow_size: 0.1, ..options(seed) }
}

/// For what does not rest on how exact the light is: refined as far, but a hundredth of the mean is exact enough for points in the
/// penumbra, on which nearly all rays go otherwise.
fn coarse(seed: u64) -> Options {
    Options { tolerance: 1e-2, ..refine(seed) }
}

/// A floor [-1, 1]² of two triangles facing up.
fn floor(scene: &mut Scene) -> Vec<TriangleId> {
    let grey = material(scene, |_| {});
    patch(scene, Vec3::new(-1.0, 0.0, -1.0), Vec3::Z * 2.0, Vec3::X * 2.0, 1, grey)
}

/// A lamp of 0.4 × 0.4 at height 1 facing down, and a blocker of 0.5 × 0.5 at height 0.4 over x > 0.
fn lamp_and_blocker(scene: &mut Scene) {
    let bright = material(scene, |m| m.ke = Vec3::ONE * 5.0);
    let triangles = patch(scene, Vec3::new(-0.2, 1.0, -0.2), Vec3::X * 0.4, Vec3::Z * 0.4, 1, bright);
    light(scene, LightKind::Area { triangles });
    let dark = material(scene, |_| {});
    patch(scene, Vec3::new(0.05, 0.4, -0.25), Vec3::Z * 0.5, Vec3::X * 0.5, 1, dark);
}

/// Every face is tiled by its drawn triangles: areas add up, orientation is kept, no triangle's edge has another's vertex
/// on it (no T-junction within a face or between faces that share an edge).
fn assert_tiled(mirror: &Mirror, scene: &Scene, faces: &[FaceId]) {
    let mut vertices: Vec<Vec3> = Vec::new();
    let mut edges: Vec<[Vec3; 2]> = Vec::new();
    for &face in faces {
        let normal = scene.area_vector(face.triangle());
        let mut area = 0.0_f64;
        for t in mirror.triangles(face) {
            let [a, b, c] = t.map(|s| s.position);
            let cross = (b - a).cross(c - a);
            assert!(cross.dot(normal) > 0.0, "orientation is kept");
            area += f64::from(cross.length());
            vertices.extend([a, b, c]);
            edges.extend([[a, b], [b, c], [c, a]]);
        }
        let whole = f64::from(normal.length());
        assert!((area / whole - 1.0).abs() < 1e-5, "{face:?}: {area} of {whole}");
    }
    vertices.sort_by(|a, b| a.to_array().partial_cmp(&b.to_array()).expect("finite"));
    vertices.dedup();
    // Sorted by x first: only those with about the middle's need be looked at.
    let is_vertex = |p: Vec3| {
        let near = vertices.partition_point(|v| v.x < p.x - 1e-6);
        vertices[near..].iter().take_while(|v| v.x <= p.x + 1e-6).any(|v| v.distance(p) < 1e-6)
    };
    for [a, b] in edges {
        assert!(!is_vertex((a + b) * 0.5), "a vertex hangs on the edge {a} {b}");
    }
}

#[test]
fn refined_faces_are_tiled_without_t_junctions() {
    for seed in 0..3 {
        let mut scene = Scene::default();
        let ids = floor(&mut scene);
        lamp_and_blocker(&mut scene);
        let mut engine = engine_with(scene.clone(), 1, coarse(seed));
        let mirror = solve_pixels(&mut engine, &both_sides(&ids), 20_000, Vec3::Y);
        engine.cache().validate();
        assert!(mirror.last.stats.triangles > 1000, "{:?}", mirror.last.stats);
        assert_tiled(&mirror, &scene, &front(&ids));
    }
}

#[test]
fn refinement_stops_at_the_smallest_leaf() {
    let mut scene = Scene::default();
    let ids = floor(&mut scene);
    lamp_and_blocker(&mut scene);
    let count = |min_pixels| {
        let options = Options { min_pixels, ..coarse(0) };
        let mut engine = engine_with(scene.clone(), 1, options);
        solve_pixels(&mut engine, &front(&ids), 4096, Vec3::Y).last.stats.triangles
    };
    // Hard edges go further than the rest, which is most of the floor.
    assert!(count(3.0) > 2 * count(300.0) && count(300.0) > count(30_000.0));
    assert_eq!(count(f32::INFINITY), 2);
}

#[test]
fn even_light_needs_no_split() {
    let mut scene = Scene::default();
    let ids = floor(&mut scene);
    light(&mut scene, LightKind::Directional { direction: Vec3::NEG_Y, irradiance: Vec3::ONE });
    // No shadow smaller than the floor is wanted.
    let options = Options { shadow_size: 10.0, ..refine(0) };
    let mirror = solve_pixels(&mut engine_with(scene, 1, options), &front(&ids), 100_000, Vec3::Y);
    assert_eq!(mirror.last.stats.triangles, 2);
}

/// E is smooth under a far point light: its second derivative is even, so that the error falls 16-fold a level (in the mean
/// square; 4-fold in the value).
#[test]
fn smooth_light_converges_at_second_order() {
    let error_at = |levels: i32| {
        let mut scene = Scene::default();
        let grey = material(&mut scene, |_| {});
        let n = 2_u32.pow(levels as u32);
        let ids = patch(&mut scene, Vec3::new(-1.0, 0.0, -1.0), Vec3::Z * 2.0, Vec3::X * 2.0, n, grey);
        let position = Vec3::new(0.3, 3.0, 0.1);
        light(&mut scene, LightKind::Point { position, intensity: Vec3::ONE });
        let options = Options { min_pixels: f32::INFINITY, ..refine(0) };
        let mirror = solve_pixels(&mut engine_with(scene, 1, options), &front(&ids), 100, Vec3::Y);
        let mut square = 0.0;
        let points = 200;
        for i in 0..points {
            let [u, v, ..] = Sequence::new(5).point(i);
            let x = Vec3::new(u * 2.0 - 1.0, 0.0, v * 2.0 - 1.0) * 0.999;
            let d = position - x;
            let exact = d.y / d.length().powi(3) / PI;
            let shown = front(&ids).iter().find_map(|&f| mirror.diffuse_at(f, x)).expect("on the floor");
            square += f64::from(shown.x - exact).powi(2);
        }
        square / f64::from(points)
    };
    let errors: Vec<f64> = (1..5).map(error_at).collect();
    for pair in errors.windows(2) {
        let ratio = pair[0] / pair[1];
        assert!(ratio > 11.0 && ratio < 23.0, "{errors:?}");
    }
}

/// Irradiance of the lamp at a point of the floor, from many points of the lamp: brute force.
fn brute_force(scene: &Scene, bvh: &Bvh, x: Vec3) -> f32 {
    let n = 64;
    let mut sum = 0.0;
    for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
        let at = |k: i32| (k as f32 + 0.5) / n as f32;
        let y = Vec3::new(-0.2 + 0.4 * at(i), 1.0, -0.2 + 0.4 * at(j));
        let d = y - x;
        let (length, direction) = (d.length(), d.normalize());
        let ray = Ray { origin: x + Vec3::Y * 1e-4, direction, t_max: length * 0.999 };
        if !bvh.occluded(scene, &ray) {
            sum += direction.y * direction.y / (length * length);
        }
    }
    5.0 * sum * 0.16 / (n * n) as f32
}

/// Points of the floor, and what they show of the lamp's light.
static EXACT: LazyLock<Vec<(Vec3, f64)>> = LazyLock::new(|| {
    let mut scene = Scene::default();
    lamp_and_blocker(&mut scene);
    let bvh = Bvh::build(&scene);
    let point = |i| {
        let [u, v, ..] = Sequence::new(9).point(i);
        let p = Vec2::new(u, v) * 1.998 - 0.999;
        let x = Vec3::new(p.x, 0.0, p.y);
        (x, f64::from(brute_force(&scene, &bvh, x) / PI))
    };
    (0..1500).map(point).collect()
});

/// Error of the lamp's light on the floor once so many vertices were traced, in batches of so many rays.
fn penumbra_error(priority: Priority, vertices: u64, batch: u64) -> (f64, u64) {
    let mut scene = Scene::default();
    let ids = floor(&mut scene);
    lamp_and_blocker(&mut scene);
    // At the end of refinement noise is the smaller part of the error: a tolerance of 1e-3 takes four times the rays for the same.
    let mut engine = engine_with(scene, 2, Options { priority, tolerance: 2e-3, ..refine(1) });
    let mut mirror = Mirror::default();
    let faces = front(&ids).iter().map(|&f| (f, 30_000)).collect();
    mirror.apply(engine.set_visible(&Visible { generation: 1, eye: Vec3::Y, image: None, faces }));
    while !mirror.last.stats.converged && mirror.last.stats.vertices < vertices {
        mirror.apply(engine.step(Budget::Rays(batch)));
        engine.counted(&drawn(&mirror));
    }
    let (mut square, mut mean) = (0.0, 0.0);
    for &(x, exact) in EXACT.iter() {
        let shown = front(&ids).iter().find_map(|&f| mirror.diffuse_at(f, x)).expect("on the floor");
        square += (f64::from(shown.x) - exact).powi(2);
        mean += exact;
    }
    let n = EXACT.len() as f64;
    ((square / n).sqrt() / (mean / n), mirror.last.stats.vertices)
}

#[test]
fn penumbrae_converge_to_brute_force() {
    let (error, vertices) = penumbra_error(Priority::Error, u64::MAX, 50_000);
    assert!(error < 0.006, "{error} with {vertices} vertices");
}

#[test]
fn the_queue_beats_random_choice() {
    let (queue, _) = penumbra_error(Priority::Error, 1500, 500);
    let (random, _) = penumbra_error(Priority::Random, 1500, 500);
    assert!(queue < 0.03 && queue < 0.7 * random, "queue {queue}, random {random}");
}

#[test]
fn refinement_does_not_depend_on_threads() {
    let run = |threads| {
        let mut scene = Scene::default();
        let ids = floor(&mut scene);
        lamp_and_blocker(&mut scene);
        let mut engine = engine_with(scene, threads, coarse(4));
        let mirror = solve_pixels(&mut engine, &front(&ids), 5_000, Vec3::Y);
        let mut slots: Vec<(u32, [u32; 3])> =
            mirror.mesh.slots().map(|(id, s)| (id.0, s.diffuse.to_array().map(f32::to_bits))).collect();
        slots.sort_unstable();
        (slots, mirror.last.stats.rays)
    };
    let one = run(1);
    assert!(one == run(2) && one == run(3));
}

/// A camera that comes back finds its light again without a ray, and triangles that GPU and engine agree on.
#[test]
fn a_view_that_returns_costs_no_ray() {
    let mut scene = Scene::default();
    let ids = floor(&mut scene);
    lamp_and_blocker(&mut scene);
    let mut engine = engine_with(scene.clone(), 1, coarse(2));
    let mut mirror = solve_pixels(&mut engine, &front(&ids), 8_000, Vec3::Y);
    let rays = mirror.last.stats.rays;
    let triangles = front(&ids).into_iter().map(|face| mirror.triangles(face).len()).collect::<Vec<_>>();
    let away = Visible { generation: 2, eye: Vec3::X, image: None, faces: vec![(FaceId::new(ids[0], true), 100)] };
    mirror.apply(engine.set_visible(&away));
    let back =
        Visible { generation: 3, eye: Vec3::Y, image: None, faces: front(&ids).iter().map(|&f| (f, 8_000)).collect() };
    mirror.apply(engine.set_visible(&back));
    assert_eq!(mirror.last.stats.rays, rays);
    assert_tiled(&mirror, &scene, &front(&ids));
    assert_eq!(front(&ids).into_iter().map(|face| mirror.triangles(face).len()).collect::<Vec<_>>(), triangles);
}

/// Creased ground: no vertex, split or not, may end up behind a facet and turn black.
#[test]
fn creased_ground_keeps_its_light() {
    let mut scene = Scene::default();
    let grey = material(&mut scene, |_| {});
    let n = 8;
    let at = |i: i32, j: i32| {
        let height = Sequence::new(3).point((i * (n + 1) + j) as u32)[0] * 0.25;
        Vec3::new(i as f32 / 4.0 - 1.0, height, j as f32 / 4.0 - 1.0)
    };
    let mut ids = Vec::new();
    for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
        ids.push(by_hand::triangle(&mut scene, [at(i, j), at(i, j + 1), at(i + 1, j + 1)], grey));
        ids.push(by_hand::triangle(&mut scene, [at(i, j), at(i + 1, j + 1), at(i + 1, j)], grey));
    }
    let position = Vec3::new(0.2, 4.0, 0.1);
    light(&mut scene, LightKind::Point { position, intensity: Vec3::ONE });
    let bvh = Bvh::build(&scene);
    let mirror = solve_pixels(&mut engine_with(scene.clone(), 2, refine(0)), &front(&ids), 400, Vec3::Y);
    let (mut square, mut mean) = (0.0, 0.0);
    for (k, &id) in (0_u32..).zip(&ids) {
        for i in 0..8 {
            let [u, v, ..] = Sequence::new(11).point(k * 8 + i);
            let (b, c) = (u.sqrt() * (1.0 - v), u.sqrt() * v);
            let [p, q, r] = scene.corners(id);
            let x = p * (1.0 - b - c) + q * b + r * c;
            let normal = scene.geometric_normal(id);
            let d = position - x;
            let ray = Ray { origin: x + normal * 1e-4, direction: d.normalize(), t_max: d.length() };
            let lit = !bvh.occluded(&scene, &ray);
            let exact = if lit { normal.dot(d).max(0.0) / d.length().powi(3) / PI } else { 0.0 };
            let Some(shown) = mirror.diffuse_at(FaceId::new(id, false), x) else { continue };
            square += f64::from(shown.x - exact).powi(2);
            mean += f64::from(exact);
        }
    }
    let samples = (ids.len() * 8) as f64;
    let error = (square / samples).sqrt() / (mean / samples);
    assert!(error < 0.06, "{error}");
}

/// The ladder of tolerances is climbed down to its end however small the batches: an empty queue on an upper rung is no end.
#[test]
fn small_batches_end_on_the_same_rung() {
    let run = |rays| {
        let mut scene = Scene::default();
        let ids = floor(&mut scene);
        light(&mut scene, LightKind::Point { position: Vec3::new(0.2, 0.6, 0.1), intensity: Vec3::ONE });
        let options = Options { tolerance: 1e-3, shadow_size: 10.0, min_pixels: 0.0, ..refine(0) };
        let mut engine = engine_with(scene, 1, options);
        let mut mirror = Mirror::default();
        let faces = front(&ids).iter().map(|&f| (f, 30_000)).collect();
        mirror.apply(engine.set_visible(&Visible { generation: 1, eye: Vec3::Y, image: None, faces }));
        while !mirror.last.stats.converged {
            mirror.apply(engine.step(Budget::Rays(rays)));
            engine.counted(&drawn(&mirror));
        }
        mirror.last.stats.estimated_error.expect("all is known")
    };
    let (small, large) = (run(1), run(1_000_000));
    assert!(small < 1.1 * large && large < 1.1 * small, "{small} {large}");
}

/// A shadow that is small in the scene but covers a hundred pixels near the eye is found, though all vertices around it
/// agree that the light is visible.
#[test]
fn small_shadows_near_the_eye_are_found() {
    let in_the_shadow = |shadow_pixels| {
        let mut scene = Scene::default();
        let ids = floor(&mut scene);
        light(&mut scene, LightKind::Directional { direction: Vec3::NEG_Y, irradiance: Vec3::splat(PI) });
        let dark = material(&mut scene, |_| {});
        let side = 0.024;
        patch(&mut scene, Vec3::new(0.13, 0.02, 0.17), Vec3::Z * side, Vec3::X * side, 1, dark);
        let options = Options { shadow_size: 0.6, shadow_pixels, ..refine(0) };
        let mirror = solve_pixels(&mut engine_with(scene, 1, options), &front(&ids), 500_000, Vec3::Y);
        let middle = Vec3::new(0.13, 0.0, 0.17) + Vec3::new(side, 0.0, side) * 0.5;
        front(&ids).iter().find_map(|&f| mirror.diffuse_at(f, middle)).expect("on the floor").x
    };
    assert!(in_the_shadow(f32::INFINITY) > 0.99, "the size in the scene alone misses it");
    assert!(in_the_shadow(72.0) < 0.01);
}

/// A mirror-like highlight in the middle of a face, of which its corners know nothing, is found and followed to its peak.
#[test]
fn highlights_between_vertices_are_found() {
    let (eye, position, shininess) = (Vec3::new(-0.6, 0.9, 0.2), Vec3::new(0.7, 1.1, 0.05), 500.0);
    let mut scene = Scene::default();
    let glossy = material(&mut scene, |m| (m.kd, m.model) = (Vec3::ZERO, Model::phong(Vec3::ONE, shininess)));
    let ids = patch(&mut scene, Vec3::new(-1.0, 0.0, -1.0), Vec3::Z * 2.0, Vec3::X * 2.0, 1, glossy);
    light(&mut scene, LightKind::Point { position, intensity: Vec3::ONE });
    let options = Options { shadow_size: 10.0, ..refine(0) };
    let mirror = solve_pixels(&mut engine_with(scene, 1, options), &front(&ids), 100_000, eye);
    // The eye's mirror image sees the light through the peak.
    let image = eye * Vec3::new(1.0, -1.0, 1.0);
    let ray = position - image;
    let at_peak = image + ray * (-image.y / ray.y);
    let distance = position.distance(at_peak);
    let exact = (position.y / distance) / distance.powi(2) * (shininess + 2.0) / (2.0 * PI);
    let slots = front(&ids).iter().flat_map(|&f| mirror.triangles(f)).flatten().collect::<Vec<_>>();
    let shown = slots.iter().map(|s| s.specular.x).fold(0.0, f32::max);
    assert!(shown > 0.97 * exact && shown < 1.03 * exact, "{shown} of {exact}");
}

/// An engine whose updates nobody takes waits, and does not keep the program from ending.
#[test]
fn a_waiting_engine_can_be_dropped() {
    use penombre::refine::thread::{Crew, EngineThread, Pace};
    let mut scene = Scene::default();
    let ids = floor(&mut scene);
    lamp_and_blocker(&mut scene);
    let options = Options { min_pixels: 0.0, tolerance: 1e-6, ..refine(0) };
    let pace = Pace::Free(std::time::Duration::from_millis(4));
    let crew = Crew { threads: 1, beside_frames: false };
    let build = move |_| engine_with(scene, 1, options);
    let thread = EngineThread::spawn(pace, crew, build, |_| {}).expect("thread");
    let faces = front(&ids).iter().map(|&f| (f, 1_000_000)).collect();
    thread.relight(Vec::new(), Visible { generation: 1, eye: Vec3::Y, image: None, faces });
    std::thread::sleep(std::time::Duration::from_millis(600));
    let waiting = thread.drain().expect("alive").len();
    assert!((2..=65).contains(&waiting), "{waiting} updates waited");
    std::thread::sleep(std::time::Duration::from_millis(600));
    drop(thread);
}
