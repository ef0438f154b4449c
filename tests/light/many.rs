//! More lights than light groups: groups against every lamp by itself, against brute force, and against the path tracer.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use crate::support::binary::{has_device, run};
use crate::support::by_hand::{Mirror, drawn, engine_with, front, light, material, options, patch, solve_pixels};
use glam::{DVec3, Vec3};
use penombre::geom::Ray;
use penombre::geom::bvh::Bvh;
use penombre::light::arrival::Arrival;
use penombre::light::group::LightGroup;
use penombre::light::lights::Lights;
use penombre::light::selection::LightChoice;
use penombre::light::source::Source;
use penombre::math::sequence::Sequence;
use penombre::refine::engine::{Budget, Engine, Visible};
use penombre::refine::options::Options;
use penombre::refine::update::Slot;
use penombre::scene::light::{LightKind, LightState};
use penombre::scene::material::Model;
use penombre::scene::{FaceId, Scene, TriangleId};
use std::f32::consts::PI;
use std::fmt::Write as _;
use std::path::Path;

const SIDE: f32 = 0.06;
const CLUSTERS: u32 = 18;
const LAMPS: u32 = 10;
const EYE: Vec3 = Vec3::new(0.0, 3.0, -5.0);

/// Lamp `k` of a cluster: where it hangs, and its light as an intensity. PixelMismatch ones are squares of the same flux straight down.
fn lamp(cluster: u32, k: u32) -> (Vec3, Vec3) {
    let sequence = Sequence::new(7);
    let [x, y, z, ..] = sequence.point(cluster);
    let [a, b, c, d] = sequence.point_of_set(cluster * LAMPS + k, 1);
    // Squares all in one plane, points below it: no lamp hides another from the floor.
    let centre = Vec3::new(x * 7.0 - 3.5, 2.2, z * 7.0 - 3.5);
    let drop = if k.is_multiple_of(2) { 0.02 + 0.6 * y + 0.1 * b } else { 0.0 };
    let offset = Vec3::new((a - 0.5) * 0.8, -drop, (c - 0.5) * 0.8);
    (centre + offset, Vec3::new(0.4 + d, 1.0, 1.4 - d) * if k == 0 { 0.5 } else { 0.1 })
}

/// The corner of a plate, and its side.
fn plate(i: u32) -> (Vec3, f32) {
    let [x, z, s, h] = Sequence::new(11).point(i);
    (Vec3::new(x * 6.0 - 3.0, 0.3 + 0.6 * h, z * 6.0 - 3.0), 0.4 + 0.6 * s)
}

/// A floor [-4, 4]², plates over it, and 180 lamps, half points and half squares. What lamp `k` of each
/// cluster sends is multiplied by `factor(k)`.
fn hall(glossy: bool, plates: bool, factor: impl Fn(u32) -> Vec3) -> (Scene, Vec<TriangleId>) {
    let mut scene = Scene::default();
    let grey = material(&mut scene, |m| {
        m.kd = Vec3::splat(0.5);
        m.model = if glossy { Model::phong(Vec3::splat(0.3), 30.0) } else { Model::default() };
    });
    let ids = patch(&mut scene, Vec3::new(-4.0, 0.0, -4.0), Vec3::Z * 8.0, Vec3::X * 8.0, 4, grey);
    for (corner, size) in (0..if plates { 5 } else { 0 }).map(plate) {
        patch(&mut scene, corner, Vec3::Z * size, Vec3::X * size, 1, grey);
    }
    for cluster in 0..CLUSTERS {
        for k in 0..LAMPS {
            let (position, intensity) = lamp(cluster, k);
            if k.is_multiple_of(2) {
                light(&mut scene, LightKind::Point { position, intensity: intensity * factor(k) });
                continue;
            }
            let bright = material(&mut scene, |m| m.ke = intensity / (SIDE * SIDE) * factor(k));
            let corner = position - Vec3::new(SIDE, 0.0, SIDE) * 0.5;
            let triangles = patch(&mut scene, corner, Vec3::X * SIDE, Vec3::Z * SIDE, 1, bright);
            light(&mut scene, LightKind::Area { triangles });
        }
    }
    (scene, ids)
}

fn evenly(_: u32) -> Vec3 {
    Vec3::ONE
}

/// Some lamps of each cluster off, others coloured.
fn unevenly(k: u32) -> Vec3 {
    [Vec3::ONE, Vec3::ZERO, Vec3::new(4.0, 0.5, 0.0), Vec3::new(0.0, 3.0, 1.0), Vec3::splat(0.2)][k as usize % 5]
}

fn factors(of: impl Fn(u32) -> Vec3) -> Vec<Vec3> {
    (0..CLUSTERS * LAMPS).map(|i| of(i % LAMPS)).collect()
}

/// Few groups, of six or so.
fn grouped(seed: u64) -> Options {
    Options { max_light_groups: 30, min_pixels: 3.0, shadow_size: 0.3, ..options(seed) }
}

/// Irradiance of all lamps at a point of the floor, ray by ray; squares by a grid of points.
fn brute_force(scene: &Scene, bvh: &Bvh, x: Vec3, factor: impl Fn(u32) -> Vec3) -> Vec3 {
    const N: u32 = 6;
    let origin = x + Vec3::Y * 1e-4;
    let unoccluded = |to: Vec3| {
        let ray = Ray { origin, direction: to.normalize(), t_max: (to.length() - 1e-4) * 0.999 };
        !bvh.occluded(scene, &ray)
    };
    let mut sum = Vec3::ZERO;
    for (cluster, k) in (0..CLUSTERS).flat_map(|c| (0..LAMPS).map(move |k| (c, k))) {
        let (position, intensity) = lamp(cluster, k);
        let intensity = intensity * factor(k);
        let n = if k.is_multiple_of(2) { 1 } else { N };
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            let at = |i: u32| ((i as f32 + 0.5) / n as f32 - 0.5) * SIDE;
            let to = position + Vec3::new(at(i), 0.0, at(j)) * f32::from(n > 1) - x;
            let (squared, cosine) = (to.length_squared(), to.normalize().y);
            let facing = if k.is_multiple_of(2) { 1.0 } else { cosine };
            if intensity != Vec3::ZERO && unoccluded(to) {
                sum += intensity * (facing * cosine / squared / (n * n) as f32);
            }
        }
    }
    sum
}

/// Points of the floor.
fn places() -> impl Iterator<Item = Vec3> {
    (0..300).map(|i| {
        let [x, z, ..] = Sequence::new(5).point(i);
        Vec3::new(x * 7.9 - 3.95, 0.0, z * 7.9 - 3.95)
    })
}

/// D at a point of the floor, if it lies in a triangle.
fn diffuse_in(triangle: &[Slot; 3], x: Vec3) -> Option<Vec3> {
    let [a, b, c] = triangle.map(|s| s.position.as_dvec3());
    let weight = |p: DVec3, q: DVec3| (q - p).cross(x.as_dvec3() - p).y / (b - a).cross(c - a).y;
    let weights = [weight(b, c), weight(c, a), weight(a, b)];
    let inside = weights.iter().all(|w| *w >= -1e-6);
    inside.then(|| (0..3).map(|i| triangle[i].diffuse * weights[i] as f32).sum())
}

/// RMSE of what the floor shows against brute force, over the mean.
fn error(mirror: &Mirror, scene: &Scene, ids: &[TriangleId], factor: impl Fn(u32) -> Vec3 + Copy) -> f32 {
    let bvh = Bvh::build(scene);
    let (mut squares, mut sum, mut count) = (0.0, 0.0, 0.0);
    let triangles: Vec<[Slot; 3]> = ids.iter().flat_map(|&t| mirror.triangles(FaceId::new(t, false))).collect();
    for x in places() {
        let shown = triangles.iter().find_map(|t| diffuse_in(t, x)).unwrap();
        let exact = brute_force(scene, &bvh, x, factor) / PI;
        squares += (shown - exact).length_squared() / 3.0;
        sum += exact.element_sum() / 3.0;
        count += 1.0;
    }
    (squares / count).sqrt() / (sum / count)
}

#[test]
fn grouped_light_is_that_of_every_lamp() {
    let (scene, ids) = hall(false, true, evenly);
    let solved = |max_light_groups| {
        let mut engine = engine_with(scene.clone(), 2, Options { max_light_groups, ..grouped(1) });
        let mirror = solve_pixels(&mut engine, &front(&ids), 1000, EYE);
        engine.cache().validate();
        (error(&mirror, &scene, &ids, evenly), mirror.last.stats, engine.cache().layers.len())
    };
    let (error, stats, groups) = solved(30);
    let (error_alone, alone, all) = solved(1000);
    println!("groups: {error} by {} rays; every lamp: {error_alone} by {} rays", stats.rays, alone.rays);
    assert_eq!((groups, all), (30, 180));
    assert!(error < 0.02, "{error}; every lamp by itself: {error_alone}");
    // What groups save is memory and evaluation; rays only where a place sees many of their members.
    assert!(stats.vertices < alone.vertices && stats.cache_bytes < alone.cache_bytes / 2, "{stats:?} {alone:?}");
}

/// Without occlusion nothing is sampled: diffuse light and highlights of groups are those of their members.
#[test]
fn without_occlusion_groups_are_exact() {
    let (scene, ids) = hall(true, false, evenly);
    let shown = |max_light_groups| {
        // Faint lights are not put off for ever.
        let options = Options { max_light_groups, tolerance: 1e-7, ..options(3) };
        let mirror = solve_pixels(&mut engine_with(scene.clone(), 1, options), &front(&ids), 10, EYE);
        ids.iter()
            .flat_map(|&t| mirror.face(FaceId::new(t, false)))
            .map(|s| [s.diffuse, s.specular])
            .collect::<Vec<_>>()
    };
    let (groups, alone) = (shown(30), shown(1000));
    assert!(alone.iter().any(|[_, s]| s.x > 0.01), "there are highlights");
    for (a, b) in groups.iter().flatten().zip(alone.iter().flatten()) {
        assert!((*a - *b).abs().max_element() <= 1e-4 * b.max_element().max(1e-3), "{a} {b}");
    }
}

/// The mean of rounds of points is what arrives: without occlusion the closed form, with a wall in between what every lamp
/// sends past it.
#[test]
fn points_of_a_group_are_unbiased() {
    let (scene, _) = hall(false, true, evenly);
    let (bvh, lights) = (Bvh::build(&scene), Lights::in_groups(&scene, 12));
    let mut partly = 0;
    // Under the edges of the plates.
    for (corner, size) in (0..5).map(plate) {
        let place = Place { scene: &scene, bvh: &bvh, x: Vec3::new(corner.x, 0.0, corner.z + 0.5 * size) };
        for group in (0..lights.group_count()).map(|group| lights.group(group)) {
            let all = group.sources().map(|(source, _)| place.arriving(source));
            let exact = all.fold([0.0; 2], |sum, one| [sum[0] + one[0], sum[1] + one[1]]);
            place.assert_mean_is(group, exact);
            partly += u32::from(exact[1] > 0.05 * exact[0] && exact[1] < 0.95 * exact[0]);
        }
    }
    assert!(partly >= 5, "{partly} groups are in partial shadow");
}

/// A point of the floor.
struct Place<'a> {
    scene: &'a Scene,
    bvh: &'a Bvh,
    x: Vec3,
}

impl Place<'_> {
    /// What some light adds to irradiance (green), without and with occlusion.
    fn values(&self, arrival: Option<Arrival>) -> [f32; 2] {
        let Some(a) = arrival else { return [0.0; 2] };
        let origin = self.x + Vec3::Y * 1e-4;
        let ray = Ray { origin, direction: a.direction, t_max: (a.distance - 1e-4) * 0.999 };
        let value = a.facing.y * a.direction.y.max(0.0);
        [value, if self.bvh.occluded(self.scene, &ray) { 0.0 } else { value }]
    }

    /// What a source adds.
    fn arriving(&self, source: &Source) -> [f32; 2] {
        let sampler = source.sampler(self.x, Vec3::Y);
        let count = if source.is_delta() { 1 } else { 1024 };
        mean((0..count).map(|i| {
            let [u, v, ..] = Sequence::new(99).point(i);
            self.values(sampler.sample(self.scene, || [u, v]))
        }))
    }

    /// Checks the mean over many rounds of a few points: neither one turn nor two.
    fn assert_mean_is(&self, group: LightGroup<'_>, exact: [f32; 2]) {
        const ROUNDS: u64 = 1500;
        let round = |round: u64| {
            let points = group.points((self.x, Vec3::Y), Sequence::new(round * 77 + 5));
            mean((0..7).map(|i| self.values(points.sample(self.scene, i))))
        };
        let rounds: Vec<[f32; 2]> = (0..ROUNDS).map(round).collect();
        let found = mean(rounds.iter().copied());
        for k in 0..2 {
            let square: f32 = rounds.iter().map(|r| (r[k] - exact[k]).powi(2)).sum();
            let deviation = square.sqrt() / ROUNDS as f32;
            let off = (found[k] - exact[k]).abs();
            assert!(off < 4.0 * deviation + 1e-3 * exact[0], "{found:?} {exact:?} ± {deviation}");
            assert!(deviation < 0.03 * exact[0], "sure enough to say something: ± {deviation} of {exact:?}");
        }
    }
}

fn mean(values: impl ExactSizeIterator<Item = [f32; 2]>) -> [f32; 2] {
    let n = values.len() as f32;
    values.fold([0.0; 2], |sum, v| [sum[0] + v[0] / n, sum[1] + v[1] / n])
}

/// Every light is drawn as often as is said, groups or none, and every one that can contribute may be.
#[test]
fn lights_are_drawn_with_the_chances_that_are_told() {
    let (scene, _) = hall(false, false, evenly);
    for (max, factors) in [(30, factors(evenly)), (30, factors(unevenly)), (1000, factors(unevenly))] {
        let mut lights = Lights::in_groups(&scene, max);
        let states: Vec<LightState> = factors.into_iter().map(LightState::times).collect();
        lights.set(&states);
        for (x, normal) in [(Vec3::new(0.5, 0.0, 1.0), Vec3::Y), (Vec3::new(-2.0, 2.0, 0.3), Vec3::new(0.6, 0.0, 0.8))]
        {
            let mut choice = LightChoice::default();
            choice.prepare(&lights, x, normal);
            const DRAWS: u32 = 1 << 16;
            let mut counts = vec![0_u32; lights.sources.len()];
            for i in 0..DRAWS {
                let Some(drawn) = choice.draw(&lights, (i as f32 + 0.5) / DRAWS as f32) else { continue };
                counts[drawn.light] += 1;
                let chance = choice.chance(&lights, drawn.light);
                assert!((chance * drawn.inverse_chance - 1.0).abs() < 1e-4, "{chance} {drawn:?}");
            }
            for (light, &count) in counts.iter().enumerate() {
                let chance = choice.chance(&lights, light);
                assert!((count as f32 / DRAWS as f32 - chance).abs() < 2e-4, "{light}: {count} {chance}");
                let may = lights.sources[light].bound(x, normal) > 0.0 && lights.factor(light) != Vec3::ZERO;
                assert_eq!(chance > 0.0, may, "{light}");
            }
        }
    }
}

#[test]
fn as_many_groups_as_lights_are_one_each() {
    let (scene, ids) = hall(false, true, evenly);
    let alone = Lights::in_groups(&scene, 180);
    assert_eq!(alone.group_count(), 180);
    assert!((0..180).all(|i| alone.sources_of_group(i) == [i as u32]));
    let most = Lights::in_groups(&scene, 179);
    let sizes: Vec<usize> = (0..most.group_count()).map(|i| most.sources_of_group(i).len()).collect();
    assert_eq!((sizes.len(), sizes.iter().filter(|&&n| n == 2).count()), (179, 1));
    let shown = |max_light_groups| {
        let mut engine = engine_with(scene.clone(), 1, Options { max_light_groups, ..options(3) });
        all_shown(&solve_pixels(&mut engine, &front(&ids), 10, EYE))
    };
    assert_eq!(shown(180), shown(100_000));
    assert_ne!(shown(180), shown(30));
}

/// D and S of everything drawn, as bits.
fn all_shown(mirror: &Mirror) -> Vec<[u32; 9]> {
    let slots = mirror.mesh.drawn().flat_map(|(.., corners)| corners);
    let bits = |v: Vec3| v.to_array().map(f32::to_bits);
    let mut all: Vec<[u32; 9]> = slots
        .map(|s| {
            let [p, d, s] = [s.position, s.diffuse, s.specular].map(bits);
            std::array::from_fn(|i| [p, d, s][i / 3][i % 3])
        })
        .collect();
    all.sort_unstable();
    all
}

#[test]
fn threads_do_not_change_groups() {
    let (scene, ids) = hall(true, true, evenly);
    let shown = |threads| {
        let mut engine = engine_with(scene.clone(), threads, Options { tolerance: 1e-2, ..grouped(4) });
        all_shown(&solve_pixels(&mut engine, &front(&ids), 1000, EYE))
    };
    assert_eq!(shown(1), shown(2));
}

fn relit(engine: &mut Engine, mirror: &mut Mirror, ids: &[TriangleId], factors: &[Vec3]) {
    let faces = front(ids).into_iter().map(|face| (face, 1000)).collect();
    let generation = mirror.last.generation + 1;
    let states: Vec<LightState> = factors.iter().copied().map(LightState::times).collect();
    mirror.apply(engine.relight(&states, &Visible { generation, eye: EYE, image: None, faces }));
}

/// Members that change against each other: no ray is traced at once, what is shown is nearly what it was in quality, and it
/// converges to the new light. Back again likewise; all alike is exact.
#[test]
fn members_can_be_changed_one_by_one() {
    let (scene, ids) = hall(false, true, evenly);
    let mut engine = engine_with(scene.clone(), 2, grouped(6));
    let mut mirror = solve_pixels(&mut engine, &front(&ids), 1000, EYE);
    let (before, rays) = (all_shown(&mirror), mirror.last.stats.rays);
    relit(&mut engine, &mut mirror, &ids, &factors(|_| Vec3::new(0.0, 0.5, 2.0)));
    relit(&mut engine, &mut mirror, &ids, &factors(|_| Vec3::ZERO));
    relit(&mut engine, &mut mirror, &ids, &factors(evenly));
    assert_eq!(all_shown(&mirror), before, "all off and on again drawn_triangles no trace");
    relit(&mut engine, &mut mirror, &ids, &factors(unevenly));
    assert_eq!(mirror.last.stats.rays, rays, "no ray");
    let at_once = error(&mirror, &scene, &ids, unevenly);
    while !mirror.last.stats.converged {
        mirror.apply(engine.step(Budget::Rays(50_000)));
        engine.counted(&drawn(&mirror));
    }
    let in_the_end = error(&mirror, &scene, &ids, unevenly);
    println!("at once {at_once}, in the end {in_the_end}");
    assert!(at_once < 0.015 && in_the_end < 0.012, "{at_once} {in_the_end}");
}

/// The written image against the path tracer's, in a Cornell box with 150 lamps.
#[test]
fn the_image_is_the_path_tracers() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let obj = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell_box/cornell_box.obj");
    let text = std::fs::read_to_string(&obj).unwrap();
    let mtl = std::fs::read_to_string(obj.with_extension("mtl")).unwrap();
    std::fs::write(folder.path().join("cornell_box.obj"), text).unwrap();
    std::fs::write(folder.path().join("cornell_box.mtl"), mtl).unwrap();
    let cornell = std::fs::read_to_string(obj.with_extension("toml")).unwrap();
    let mut toml = cornell;
    for i in 0..150 {
        let [x, y, z, c] = Sequence::new(2).point(i / 10);
        let [dx, dy, dz, _] = Sequence::new(3).point(i);
        let p = Vec3::new(x, 0.6 + 0.3 * y, z) * 450.0 + Vec3::new(dx, dy, dz) * 40.0 + 25.0;
        write!(
            toml,
            "\n[[light]]\nkind = \"point\"\nposition = [{}, {}, {}]\nintensity = [{}, 3000, 2000]\n",
            p.x,
            p.y,
            p.z,
            2000.0 + 3000.0 * c
        )
        .unwrap();
    }
    std::fs::write(folder.path().join("many.toml"), toml).unwrap();
    for line in [
        "reference many.toml --size 96x96 --direct-only --filter point --spp 1500 -q -o ref.exr",
        "render many.toml --size 96x96 --direct-only --deterministic --rays 4000000 --max-light-meshes 40 -q -o out.exr",
        "diff ref.exr out.exr --max-relmse 4e-3",
    ] {
        let output = run(folder.path(), line);
        println!("{}", String::from_utf8_lossy(&output.stdout));
        assert_eq!(output.status.code(), Some(0), "{line}: {}", String::from_utf8_lossy(&output.stderr));
    }
}
