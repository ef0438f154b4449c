//! Indirect light above the geometry: where a mesh is denser than its light, most vertices take what few have gathered.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use crate::support::by_hand::{Mirror, drawn, engine_with, light, material, options, patch, triangle};
use crate::support::shapes::icosphere;
use glam::Vec3;
use penombre::cache::ids::SlotId;
use penombre::math::luminance;
use penombre::refine::engine::{Budget, Engine, Visible};
use penombre::refine::options::Options;
use penombre::scene::light::LightKind;
use penombre::scene::{FaceId, Scene, TriangleId};
use std::f32::consts::PI;

/// Lights faces of a few pixels each until so many rays are traced.
fn lit(scene: Scene, ids: &[TriangleId], (threads, rays): (usize, u64)) -> (Engine, Mirror) {
    let options = Options { indirect: true, filter: false, ..options(5) };
    let mut engine = engine_with(scene, threads, options);
    let faces = ids.iter().map(|&t| (FaceId::new(t, false), 4)).collect();
    let mut mirror = Mirror::default();
    mirror.apply(engine.set_visible(&Visible { generation: 1, eye: Vec3::splat(0.1), image: None, faces }));
    while mirror.last.stats.rays < rays {
        mirror.apply(engine.step(Budget::Rays(10_000)));
        engine.counted(&drawn(&mirror));
    }
    mirror.apply(engine.settle());
    engine.cache().validate();
    (engine, mirror)
}

/// Slots of the visible faces, and those among them that have gathered.
fn slots(engine: &Engine, ids: &[TriangleId]) -> (Vec<SlotId>, usize) {
    let cache = engine.cache();
    let corners = |id: &TriangleId| cache.topology.nodes[cache.root_of(FaceId::new(*id, false)).unwrap()].corners;
    let mut slots: Vec<SlotId> = ids.iter().flat_map(corners).collect();
    slots.sort_unstable();
    slots.dedup();
    let sampled = slots.iter().filter(|&&slot| cache.indirect.is_sampled(slot)).count();
    (slots, sampled)
}

/// An integrating sphere: its indirect light is even, and known (see `indirect.rs`).
fn sphere(rays: u64) -> (Engine, Vec<TriangleId>, Vec3) {
    let albedo = Vec3::new(0.8, 0.5, 0.1);
    let mut scene = Scene::default();
    let wall = material(&mut scene, |m| m.kd = albedo);
    let ids = icosphere(&mut scene, Vec3::ZERO, 2.0, 5, true, wall);
    light(&mut scene, LightKind::Point { position: Vec3::new(0.9, 0.3, -0.5), intensity: Vec3::new(1.0, 2.0, 3.0) });
    let area: f32 = ids.iter().map(|&t| scene.area_vector(t).length() * 0.5).sum();
    let expected = 4.0 * Vec3::new(1.0, 2.0, 3.0) * albedo / (area * (1.0 - albedo));
    (lit(scene, &ids, (2, rays)).0, ids, expected)
}

#[test]
fn a_few_vertices_light_a_dense_sphere() {
    let (engine, ids, expected) = sphere(100_000);
    let (slots, sampled) = slots(&engine, &ids);
    let cache = engine.cache();
    let lights: Vec<_> = slots.iter().map(|s| cache.slots[*s].indirect()).collect();
    println!("{sampled} of {} gathered", slots.len());
    assert!(sampled < slots.len() / 4, "{sampled} of {}", slots.len());
    assert!(lights.iter().all(|l| l.known), "every vertex shows something");
    let off: Vec<f32> = lights.iter().map(|l| luminance(l.diffuse) / luminance(expected) - 1.0).collect();
    let mean = off.iter().sum::<f32>() / off.len() as f32;
    let rms = (off.iter().map(|o| o * o).sum::<f32>() / off.len() as f32).sqrt();
    println!("mean {mean:+.4}, RMS {rms:.4}");
    assert!(mean.abs() < 0.02 && rms < 0.12, "{mean} {rms}");
}

/// Predictions are what to start from, not what to stay with: every vertex gathers in the end.
#[test]
fn every_vertex_gathers_in_the_end() {
    let mut scene = Scene::default();
    let grey = material(&mut scene, |m| m.kd = Vec3::splat(0.5));
    let mut ids = patch(&mut scene, Vec3::ZERO, Vec3::Z, Vec3::X, 40, grey);
    ids.extend(patch(&mut scene, Vec3::ZERO, Vec3::Y, Vec3::Z, 40, grey));
    let position = Vec3::new(0.7, 0.6, 0.4);
    light(&mut scene, LightKind::Point { position, intensity: Vec3::ONE });
    let (early, _) = lit(scene.clone(), &ids, (1, 20_000));
    let (late, _) = lit(scene, &ids, (1, 3_000_000));
    let [(slots_early, few), (slots_late, all)] = [slots(&early, &ids), slots(&late, &ids)];
    println!("{few} of {} early, {all} of {} late", slots_early.len(), slots_late.len());
    assert!(few < slots_early.len() / 2);
    // Those on the line where the two meet may be covered by each other.
    assert!(all + 90 >= slots_late.len());
}

/// One vertex's gather, predicted for surfaces turned against it: the light of a sky brighter to one side.
#[test]
fn predictions_turn_with_the_surface() {
    use penombre::estimate::hemisphere::{Method, gather};
    use penombre::estimate::light_vector::LightVector;
    use penombre::math::sequence::Sequence;
    let mut vector = LightVector::default();
    let sky = |_, direction: Vec3| Vec3::splat(1.0 + 0.8 * direction.x);
    let sink = |sample: penombre::estimate::hemisphere::Sample| vector.push(Vec3::Z, &sample);
    gather(Method::Stratified, &[Vec3::Z], 0..4096, &Sequence::new(3), sky, sink);
    for angle in [-0.4_f32, -0.1, 0.0, 0.1, 0.4] {
        let turned = Vec3::new(angle.sin(), 0.0, angle.cos());
        // ∫ (1 + b·ω) (m·ω)⁺ dω = π + 2π/3 b·m over the whole sphere.
        let exact = (PI + 2.0 * PI / 3.0 * 0.8 * turned.x) / PI;
        let found = vector.turning(Vec3::Z, turned);
        assert!((found / exact - 1.0).abs() < 0.02, "{angle}: {found} {exact}");
    }
}

/// Shards that no coarser vertex predicts, in a room: until they gather they show about the light of what faces the same way.
#[test]
fn what_nothing_predicts_is_lit_before_it_gathers() {
    let mut scene = Scene::default();
    let grey = material(&mut scene, |m| m.kd = Vec3::splat(0.6));
    let mut walls = icosphere(&mut scene, Vec3::ZERO, 2.0, 3, true, grey);
    let turned = |i: u32, axis: u32| ((i * 37 + axis * 59) % 101) as f32 / 50.0 - 1.0;
    let shards: Vec<TriangleId> = (0..200)
        .map(|i| {
            let centre = Vec3::new(turned(i, 1), turned(i, 2), turned(i, 3));
            let corner = |k: u32| centre + 0.02 * Vec3::new(turned(i + k, 4), turned(i * k, 5), turned(i + 3 * k, 6));
            triangle(&mut scene, [corner(1), corner(2), corner(3)], grey)
        })
        .collect();
    light(&mut scene, LightKind::Point { position: Vec3::new(0.0, 1.9, 0.0), intensity: Vec3::ONE });
    let expected = 4.0 * 0.6 / ((1.0 - 0.6) * 4.0 * PI * 4.0);
    walls.extend(&shards);
    let (engine, mirror) = lit(scene, &walls, (2, 12_000));
    let (slots, _) = slots(&engine, &shards);
    let cache = engine.cache();
    let unknown = slots.iter().filter(|&&slot| !cache.slots[slot].indirect().known).count();
    assert!(unknown > slots.len() / 4, "{unknown} of {} know nothing", slots.len());
    let shown = shards.iter().flat_map(|&id| mirror.face(FaceId::new(id, false))).map(|slot| slot.diffuse.x);
    let least = shown.fold(f32::INFINITY, f32::min);
    assert!(least > 0.5 * expected, "{least} against {expected}");
}

#[test]
fn threads_change_nothing() {
    let [one, two] = [1, 2].map(|threads| {
        let mut scene = Scene::default();
        let wall = material(&mut scene, |m| m.kd = Vec3::splat(0.6));
        let ids = icosphere(&mut scene, Vec3::ZERO, 2.0, 4, true, wall);
        light(&mut scene, LightKind::Point { position: Vec3::X, intensity: Vec3::ONE });
        let (engine, _) = lit(scene, &ids, (threads, 60_000));
        engine.cache().slots.ids().map(|i| engine.cache().slots[i].indirect()).collect::<Vec<_>>()
    });
    assert!(one == two);
}
