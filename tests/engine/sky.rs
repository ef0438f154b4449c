//! Environments and suns in the light engine, against closed forms and the path tracer.
#![allow(clippy::expect_used, reason = "a failed expectation fails the test")]

use crate::support::by_hand::{
    Mirror, bounces, engine, engine_with, front, gather_light, light, material, options, patch, solve,
};
use glam::Vec3;
use penombre::geom::bvh::Bvh;
use penombre::light::context::SceneContext;
use penombre::light::lights::Lights;
use penombre::math::luminance;
use penombre::reference::{Accumulator, Filter, Settings, Strategy, Transport};
use penombre::refine::options::Options;
use penombre::scene::camera::{Camera, ImageSize};
use penombre::scene::environment::{Environment, Picture};
use penombre::scene::light::LightKind;
use penombre::scene::{Scene, TriangleId};
use std::f32::consts::PI;
use std::sync::Arc;

const RADIANCE: Vec3 = Vec3::new(0.5, 1.0, 2.0);

fn around(scene: &mut Scene, picture: Picture, rotation: f32) {
    light(scene, LightKind::Environment(Arc::new(Environment::new(Arc::new(picture), Vec3::Y, rotation))));
}

fn all_slots(mirror: &Mirror, ids: &[TriangleId]) -> Vec<Vec3> {
    front(ids).iter().flat_map(|&face| mirror.triangles(face)).flatten().map(|slot| slot.diffuse).collect()
}

#[test]
fn an_even_sky_shows_itself_on_any_plane() {
    let mut scene = Scene::default();
    let grey = material(&mut scene, |_| {});
    let mut ids = patch(&mut scene, Vec3::ZERO, Vec3::Z, Vec3::X, 1, grey);
    ids.extend(patch(&mut scene, Vec3::splat(5.0), Vec3::new(1.0, 0.2, 0.1), Vec3::new(0.3, -1.0, 0.4), 1, grey));
    around(&mut scene, Picture::constant(RADIANCE), 0.0);
    let mirror = solve(&mut engine(scene, 1, 1), &front(&ids), Vec3::Y * 9.0);
    let found = all_slots(&mirror, &ids);
    assert_eq!(found.len(), 12);
    for diffuse in found {
        assert!((diffuse / RADIANCE - 1.0).abs().max_element() < 1e-4, "{diffuse}");
    }
}

/// At the foot of a wall of height h and width 2w, in its middle and d before it, a floor loses this share of an even sky: the form factor of
/// a rectangle on a perpendicular plane.
fn share_of_wall(h: f32, w: f32, d: f32) -> f32 {
    let reach = (h * h + d * d).sqrt();
    2.0 * ((w / d).atan() - d / reach * (w / reach).atan()) / (2.0 * PI)
}

/// The light before a wall is that of what the wall leaves of the sky, and no light is counted twice: indirect light adds what the wall sends.
#[test]
fn before_a_wall_there_is_what_it_leaves_of_an_even_sky() {
    let (height, half_width, distance) = (1.5, 2.0, 0.6);
    let build = |kd: f32| {
        let mut scene = Scene::default();
        let grey = material(&mut scene, |m| m.kd = Vec3::splat(kd));
        let floor = material(&mut scene, |_| {});
        let corner = Vec3::new(-half_width, 0.0, 0.0);
        patch(&mut scene, corner, Vec3::X * 2.0 * half_width, Vec3::Y * height, 1, grey);
        let small = Vec3::new(-1e-3, 0.0, distance - 1e-3);
        let ids = patch(&mut scene, small, Vec3::Z * 2e-3, Vec3::X * 2e-3, 1, floor);
        around(&mut scene, Picture::constant(RADIANCE), 0.0);
        (scene, ids)
    };
    let hidden = share_of_wall(height, half_width, distance);
    let (scene, ids) = build(0.0);
    let direct = all_slots(&solve(&mut engine(scene, 1, 3), &front(&ids), Vec3::Y * 9.0), &ids);
    for diffuse in &direct {
        assert!((*diffuse / (RADIANCE * (1.0 - hidden)) - 1.0).abs().max_element() < 5e-3, "{diffuse} {hidden}");
    }
    // A wall of reflectance ρ sees the sky above and below, but for the tiny floor: its radiance is ρ L.
    let kd = 0.6;
    let (scene, ids) = build(kd);
    let mirror = gather_light(&mut engine_with(scene, 1, bounces(3)), &front(&ids), Vec3::Y * 9.0, 200_000);
    for diffuse in all_slots(&mirror, &ids) {
        let expected = RADIANCE * (1.0 - hidden + kd * hidden);
        assert!((diffuse / expected - 1.0).abs().max_element() < 0.01, "{diffuse}, not {expected}");
    }
}

/// Clear blue above, brown below, and one texel of 1e5 times the radiance.
fn with_sun() -> Picture {
    let texel = |i: u32| if i / 256 < 64 { Vec3::new(0.5, 0.7, 1.0) } else { Vec3::splat(0.2) };
    let mut texels: Vec<Vec3> = (0..256 * 128).map(texel).collect();
    texels[36 * 256 + 90] = Vec3::new(9e4, 8e4, 7e4);
    Picture::new([256, 128], texels)
}

/// A floor with a box on it: shadows of sky and sun.
fn yard(rotation: f32) -> (Scene, Vec<TriangleId>) {
    let mut scene = Scene::default();
    let grey = material(&mut scene, |m| m.kd = Vec3::splat(0.5));
    let ids = patch(&mut scene, Vec3::new(-1.0, 0.0, -1.0), Vec3::Z * 2.0, Vec3::X * 2.0, 8, grey);
    let (x, y, z) = (Vec3::X * 0.5, Vec3::Y * 0.6, Vec3::Z * 0.5);
    let corner = Vec3::new(-0.25, 0.0, -0.25);
    for (origin, u, v) in [(corner, y, x), (corner + z, x, y), (corner, z, y), (corner + x, y, z), (corner + y, z, x)] {
        patch(&mut scene, origin, u, v, 1, grey);
    }
    around(&mut scene, with_sun(), rotation);
    (scene, ids)
}

/// Relative square error of D over vertices of the floor, against many rays.
fn relative_error(rotation: f32, rays: u64) -> f64 {
    let lit = |rays: u64, seed: u64| {
        let (scene, ids) = yard(rotation);
        let mirror = gather_light(&mut engine_with(scene, 2, options(seed)), &front(&ids), Vec3::Y * 5.0, rays);
        all_slots(&mirror, &ids)
    };
    let (found, truth) = (lit(rays, 1), lit(3_000_000, 2));
    let mean = truth.iter().map(|d| f64::from(luminance(*d))).sum::<f64>() / truth.len() as f64;
    let square = |(a, b): (&Vec3, &Vec3)| {
        let (a, b) = (f64::from(luminance(*a)), f64::from(luminance(*b)));
        (a - b) * (a - b) / (b * b + 0.01 * mean * mean)
    };
    found.iter().zip(&truth).map(square).sum::<f64>() / truth.len() as f64
}

#[test]
fn a_sun_of_one_texel_converges_however_the_sky_is_turned() {
    let errors =
        [0.0_f32, 90.0].map(|degrees| [10_000, 300_000].map(|rays| relative_error(degrees.to_radians(), rays)));
    for [few, many] in errors {
        assert!(many < 1e-4 && many < few, "{errors:?}");
    }
    assert!((0.2..5.0).contains(&(errors[0][1] / errors[1][1])), "turning changes the noise: {errors:?}");
}

/// Sun and sky are switched and dimmed apart, without a ray, and come back to the bit.
#[test]
fn the_sun_is_dimmed_by_itself() {
    use penombre::refine::engine::Visible;
    use penombre::scene::light::LightState;
    let mut scene = Scene::default();
    let grey = material(&mut scene, |_| {});
    let ids = patch(&mut scene, Vec3::ZERO, Vec3::Z, Vec3::X, 1, grey);
    around(&mut scene, Picture::constant(RADIANCE), 0.0);
    let direction = Vec3::new(0.6, 0.8, 0.0);
    light(&mut scene, LightKind::Sun { direction, half_angle: 0.01, radiance: Vec3::splat(1e4) });
    let of_sun = 1e4 * 0.01_f32.sin().powi(2) * 0.8;
    let mut engine = engine_with(scene, 1, Options { ..options(1) });
    let eye = Vec3::Y * 9.0;
    let mut mirror = solve(&mut engine, &front(&ids), eye);
    let is = |mirror: &Mirror, expected: Vec3| {
        let found = all_slots(mirror, &ids);
        assert!(found.iter().all(|d| (*d / expected - 1.0).abs().max_element() < 1e-3), "{found:?}, not {expected}");
    };
    is(&mirror, RADIANCE + of_sun);
    let before = (all_slots(&mirror, &ids), mirror.last.stats.rays);
    let faces = front(&ids).iter().map(|&face| (face, 10)).collect::<Vec<_>>();
    for (generation, factors, expected) in [(2, [1.0, 0.0], RADIANCE), (3, [0.5, 2.0], RADIANCE * 0.5 + 2.0 * of_sun)] {
        let visible = Visible { generation, eye, image: None, faces: faces.clone() };
        mirror.apply(engine.relight(&factors.map(|f| LightState::times(Vec3::splat(f))), &visible));
        is(&mirror, expected);
    }
    mirror.apply(engine.relight(&[], &Visible { generation: 4, eye, image: None, faces }));
    assert_eq!((all_slots(&mirror, &ids), mirror.last.stats.rays), before);
}

/// A floor and a wall apart from each other under the clear sky of a scene file, the sun switched off.
#[test]
fn a_clear_sky_sends_its_integral_to_a_floor_and_a_wall() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("written");
    write(
        "planes.obj",
        "v 0 0 0\nv 0 0 1\nv 1 0 1\nv 1 0 0\nf 1 2 3 4\nv 500 0 0\nv 501 0 0\nv 501 1 0\nv 500 1 0\nf 5 6 7 8\n",
    );
    write(
        "scene.toml",
        "[geometry]\nobj = [\"planes.obj\"]\n[[camera]]\nposition = [0, 5, 5]\nlook_at = [0, 0, 0]\n[[light]]\nkind = \"sky\"\n\
         sun_elevation = 35\nsun_azimuth = 200\nturbidity = 4\nsun = false\n",
    );
    let scene = penombre::scene::load::load(&folder.path().join("scene.toml")).expect("loaded").scene;
    let LightKind::Environment(environment) = scene.lights[0].kind.clone() else { panic!("{:?}", scene.lights) };
    // By the middles of a grid over the sphere.
    let irradiance = |normal: Vec3| {
        let (rings, turns) = (720_u16, 1440_u16);
        let mut sum = glam::DVec3::ZERO;
        for ring in 0..rings {
            let height = 1.0 - 2.0 * (f32::from(ring) + 0.5) / f32::from(rings);
            let sine = (1.0 - height * height).sqrt();
            for turn in 0..turns {
                let (x, z) = ((f32::from(turn) + 0.5) / f32::from(turns) * 2.0 * PI).sin_cos();
                let direction = Vec3::new(sine * x, height, sine * z);
                sum += (environment.radiance(direction) * normal.dot(direction).max(0.0)).as_dvec3();
            }
        }
        (sum * 4.0 * std::f64::consts::PI / (f64::from(rings) * f64::from(turns))).as_vec3()
    };
    let ids: Vec<TriangleId> = (0..4).map(TriangleId).collect();
    let mirror = solve(&mut engine(scene.clone(), 1, 1), &front(&ids), Vec3::new(0.0, 5.0, 5.0));
    let (bvh, lights) = (Bvh::build(&scene), Lights::new(&scene));
    for (ids, normal, middle) in
        [(&ids[..2], Vec3::Y, Vec3::new(0.5, 0.0, 0.5)), (&ids[2..], Vec3::Z, Vec3::new(500.5, 0.5, 0.0))]
    {
        let expected = irradiance(normal) / PI;
        for found in all_slots(&mirror, ids) {
            assert!((found / expected - 1.0).abs().max_element() < 0.01, "{normal}: {found}, not {expected}");
        }
        let context = SceneContext::new(&scene, &bvh, &lights, 1, scene.scale());
        let position = middle + normal * 3.0;
        let up = if normal == Vec3::Y { Vec3::Z } else { Vec3::Y };
        let camera = Camera { position, look_at: middle, up, vertical_fov: 1.0 };
        let view = scene.view(&camera, ImageSize { width: 16, height: 16 });
        let mut accumulator = Accumulator::new(&view);
        let direct = Settings { filter: Filter::Box, transport: Transport::Direct, strategy: Strategy::Both };
        (0..256).for_each(|_| assert!(accumulator.pass(&context, &view, direct, || false).finished));
        let image = accumulator.image();
        // The grey of a face without a material.
        let found = image.mean.iter().map(|m| m.truncate()).sum::<Vec3>() / (image.mean.len() as f32 * 0.8);
        assert!((found / expected - 1.0).abs().max_element() < 0.01, "{normal}: {found}, not {expected}");
    }
}
