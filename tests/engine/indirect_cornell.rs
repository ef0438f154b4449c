//! All light of the engine in the Cornell box: against another program's irradiances, and its picture against the path tracer.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use crate::support::by_hand::{Mirror, bounces, drawn, engine_with, front, refined};
use glam::{Vec2, Vec3};
use penombre::cache::ids::SlotId;
use penombre::geom::Ray;
use penombre::geom::bvh::Bvh;
use penombre::light::context::SceneContext;
use penombre::light::lights::Lights;
use penombre::math::luminance;
use penombre::reference::{Accumulator, Filter, Settings, Strategy, Transport};
use penombre::refine::engine::{Budget, Engine, Visible};
use penombre::refine::options::Options;
use penombre::refine::pixel_lists::FaceImage;
use penombre::scene::camera::{ImageSize, View};
use penombre::scene::{FaceId, Scene, TriangleId, load};
use std::collections::HashMap;
use std::f32::consts::PI;
use std::path::Path;

fn cornell() -> Scene {
    let mut scene =
        load::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell_box/cornell_box.toml")).unwrap().scene;
    // The lamp of the program that the figures come from reflects nothing.
    scene.materials.iter_mut().filter(|m| m.is_emissive()).for_each(|m| m.kd = Vec3::ZERO);
    scene
}

/// A scene lit as its first camera sees it, a pixel a ray.
struct Picture {
    view: View,
    bvh: Bvh,
    mirror: Mirror,
    engine: Engine,
}

impl Picture {
    fn new(scene: &Scene, side: u32, options: Options, rays: u64) -> Self {
        let bvh = Bvh::build(scene);
        let view = scene.view(&scene.cameras[0].camera, ImageSize { width: side, height: side });
        let mut pixels: HashMap<FaceId, u32> = HashMap::new();
        for (x, y) in (0..side * 4).flat_map(|y| (0..side * 4).map(move |x| (x, y))) {
            // A sixteenth of a pixel each: as if the picture were four times as large.
            let direction = view.direction(Vec2::new(x as f32 + 0.5, y as f32 + 0.5) / 4.0);
            if let Some(hit) = bvh.closest(scene, &Ray { origin: view.eye, direction, t_max: f32::INFINITY }) {
                *pixels.entry(hit.face()).or_default() += 1;
            }
        }
        let seen = |pixel: usize| {
            let direction = view.direction(view.size.centre_of(pixel));
            let hit = bvh.closest(scene, &Ray { origin: view.eye, direction, t_max: f32::INFINITY });
            hit.map_or(0, |hit| hit.face().0 + 1)
        };
        let image = Some(FaceImage { view, faces: (0..view.size.pixels()).map(seen).collect() });
        let mut faces: Vec<(FaceId, u32)> = pixels.into_iter().collect();
        faces.sort();
        let mut engine = engine_with(scene.clone(), 2, Options { min_pixels: 3.0, ..options });
        let mut mirror = Mirror::default();
        mirror.apply(engine.set_visible(&Visible { generation: 1, eye: view.eye, image, faces }));
        while !mirror.last.stats.converged && mirror.last.stats.rays < rays {
            mirror.apply(engine.step(Budget::Rays(20_000)));
            engine.counted(&drawn(&mirror));
        }
        Self { view, bvh, mirror, engine }
    }
}

/// Five points of the Cornell box with their normals, reflectances, and direct and indirect irradiance, from 3·10⁶ paths each
/// of another program.
fn cornell_points() -> [(Vec3, Vec3, [Vec3; 2]); 5] {
    let v = Vec3::new;
    [
        (v(278.0, 0.0, 30.0), Vec3::Y, [v(0.3813, 0.2691, 0.0897), v(0.1169, 0.0428, 0.0092)]),
        (v(450.0, 0.0, 100.0), Vec3::Y, [v(0.5272, 0.3721, 0.1240), v(0.2104, 0.0622, 0.0141)]),
        (v(100.0, 400.0, 559.2), Vec3::NEG_Z, [v(0.5635, 0.3978, 0.1326), v(0.2487, 0.2220, 0.0368)]),
        (v(100.0, 548.8, 100.0), Vec3::NEG_Y, [Vec3::ZERO, v(0.2528, 0.2016, 0.0408)]),
        (v(0.0, 274.4, 279.6), Vec3::X, [v(0.7514, 0.5304, 0.1768), v(0.3780, 0.2284, 0.0578)]),
    ]
}

#[test]
fn cornell_box_irradiances() {
    let scene = cornell();
    let ids: Vec<TriangleId> = (0..scene.triangles.len() as u32).map(TriangleId).collect();
    let (_, mirror) = refined(scene.clone(), &ids, 2, Options { shadow_size: 10.0, ..bounces(10) }, 4_000_000);
    let mut mean = 0.0;
    for (point, normal, [direct, indirect]) in cornell_points() {
        let faces = front(&ids).into_iter().filter(|f| {
            let (corner, facet) = (scene.corners(f.triangle())[0], scene.geometric_normal(f.triangle()));
            facet.dot(normal) > 0.999 && (corner - point).dot(normal).abs() < 0.5
        });
        let found = faces.filter_map(|f| mirror.diffuse_at(f, point)).next().unwrap() * PI;
        let off = found / (direct + indirect) - 1.0;
        assert!(off.abs().max_element() < 0.03, "{point}: {found}, off by {off}");
        mean += off.element_sum() / 15.0;
    }
    assert!(mean.abs() < 0.015, "{mean}");
}

/// The picture against the path tracer: in the mean, and pixel by pixel beyond the path tracer's own noise.
#[test]
fn the_picture_is_the_path_tracers() {
    let (side, passes) = (32, 512);
    let scene = cornell();
    let picture = Picture::new(&scene, side, Options { shadow_size: 10.0, ..bounces(11) }, 3_000_000);
    let lights = Lights::new(&scene);
    let context = SceneContext::new(&scene, &picture.bvh, &lights, 12, scene.scale());
    let settings = Settings { filter: Filter::Point, transport: Transport::Full, strategy: Strategy::Both };
    let mut accumulator = Accumulator::new(&picture.view);
    (0..passes).for_each(|_| assert!(accumulator.pass(&context, &picture.view, settings, || false).finished));
    let reference = accumulator.image();
    let (mut off, mut variance, mut mean, mut square, mut count) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for (i, expected) in reference.mean.iter().enumerate().filter(|(i, _)| reference.mask[*i]) {
        let pixel = Vec2::new((i as u32 % side) as f32 + 0.5, (i as u32 / side) as f32 + 0.5);
        let ray = Ray { origin: picture.view.eye, direction: picture.view.direction(pixel), t_max: f32::INFINITY };
        let hit = picture.bvh.closest(&scene, &ray).unwrap();
        let at = ray.origin + ray.direction * hit.t;
        let Some(diffuse) = picture.mirror.diffuse_at(hit.face(), at) else { continue };
        let shown = scene.kd_at(hit.triangle, hit.u, hit.v) * diffuse;
        let d = f64::from(luminance(shown) - luminance(expected.truncate()));
        off += d;
        square += d * d;
        mean += f64::from(luminance(expected.truncate()));
        let weights = Vec3::new(0.2126, 0.7152, 0.0722);
        variance += f64::from((weights * weights).dot(reference.variance[i]));
        count += 1.0;
    }
    let bias = off / mean;
    let noise = variance.sqrt() / mean;
    let rmse = ((square - variance).max(0.0) / count).sqrt() / (mean / count);
    assert!(bias.abs() < 4.0 * noise + 0.008, "{bias} ± {noise}");
    assert!(rmse < 0.02 && count > 900.0, "{rmse} over {count} pixels");
}

/// Where a block meets the floor the mesh of indirect light is refined far below a pixel, and coarser leaves beside are drawn through its
/// vertices: those must not be left with the few rays that are good for leaves without a pixel.
#[test]
fn vertices_on_edges_of_coarser_leaves_get_their_rays() {
    let picture = Picture::new(&cornell(), 96, Options { filter: false, min_pixels: 0.0, ..bounces(11) }, 6_000_000);
    let cache = picture.engine.cache();
    // What a vertex shows of its noise, as squares times pixels, and whether all of that is in leaves that it is no corner of.
    let mut shown: HashMap<SlotId, (f32, bool)> = HashMap::new();
    for (drawn, ..) in picture.mirror.mesh.drawn() {
        let drawn = &cache.drawn.triangles[drawn];
        let pixels = picture.engine.view().leaves[drawn.node].pixels;
        let own = cache.corner_vertices(cache.topology.indirect_leaf(drawn.node));
        for slot in drawn.slots.into_iter().filter(|&slot| cache.indirect.is_sampled(slot)) {
            let of_slot = shown.entry(slot).or_insert((0.0, true));
            of_slot.0 += cache.slots[slot].indirect().variance * pixels / cache.drawn.of_node(drawn.node).len() as f32;
            of_slot.1 &= !own.contains(&cache.slots[slot].vertex) || pixels < 0.1;
        }
    }
    let a_ray = |slot: &SlotId, shown: f32| shown / cache.indirect.rays(cache.slots[*slot].vertex) as f32;
    // What nine in ten of them stay below.
    let most = |hanging: bool| {
        let mut keys: Vec<f32> =
            shown.iter().filter(|(_, s)| s.1 == hanging).map(|(slot, s)| a_ray(slot, s.0)).collect();
        assert!(keys.len() > 1000, "{}", keys.len());
        keys.sort_by(f32::total_cmp);
        keys[keys.len() * 9 / 10]
    };
    let (hanging, others) = (most(true), most(false));
    assert!(hanging < 1.6 * others, "a ray would take away {hanging} of their noise, and {others} of that of others");
}
