//! The project's own scenes: what is committed is what `make-scenes` writes, and it is what `scenes/README.md` says.

#![allow(clippy::expect_used, reason = "a test may end where its files cannot be read")]

#[path = "../../scenes/make-scenes/generate/mod.rs"]
pub mod generate;

use glam::{Vec2, Vec3};
use penombre::geom::Ray;
use penombre::geom::bvh::Bvh;
use penombre::math::sequence::Sequence;
use penombre::scene::camera::Camera;
use penombre::scene::camera_path::load_camera_path;
use penombre::scene::light::{LightKind, spot_falloff};
use penombre::scene::load::load;
use penombre::scene::{FaceId, Scene, TriangleId};
use std::collections::BTreeSet;
use std::f32::consts::{PI, TAU};
use std::path::{Path, PathBuf};

fn committed() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes")
}

/// A committed scene, which must load without a single warning.
fn scene(file: &str) -> Scene {
    let loaded = load(&committed().join(file)).expect("the scene loads");
    assert!(loaded.report.faults.is_empty(), "{:#?}", loaded.report.faults);
    assert_eq!(loaded.counts.zero_area, 0, "triangles without area");
    loaded.scene
}

/// Every file under a folder, relative to `root`.
fn files_under(root: &Path, folder: &Path, found: &mut BTreeSet<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("a readable folder") {
        let path = entry.expect("a readable entry").path();
        if path.is_dir() {
            files_under(root, &path, found);
        } else {
            found.insert(path.strip_prefix(root).expect("a path under the root").to_owned());
        }
    }
}

#[test]
fn committed_files_are_what_the_generator_writes() {
    let fresh = tempfile::tempdir().expect("a temporary folder");
    let written: BTreeSet<PathBuf> = generate::generate(fresh.path()).expect("the scenes").into_iter().collect();
    for file in &written {
        let [new, old] = [fresh.path(), &committed()].map(|root| std::fs::read(root.join(file)));
        let same = match (new, old) {
            // The encoder may change with the crate `image`; the picture may not.
            (Ok(new), Ok(old)) if file.extension().is_some_and(|e| e == "png") => {
                image::load_from_memory(&new).ok() == image::load_from_memory(&old).ok()
            }
            (Ok(new), Ok(old)) => new == old,
            _ => false,
        };
        assert!(same, "{} differs: run cargo run --release --example make-scenes", file.display());
    }
    let mut present = BTreeSet::new();
    for folder in ["cornell_box", "gltf_samples", "moonlit_library", "spheres"] {
        files_under(&committed(), &committed().join(folder), &mut present);
    }
    assert_eq!(present, written, "files that nothing writes");
}

#[test]
fn the_library_is_large_and_has_a_hundred_lights_of_four_kinds() {
    let (all, ten) = (scene("moonlit_library/moonlit_library.toml"), scene("moonlit_library/moonlit_library-ten.toml"));
    assert!((20_000..=150_000).contains(&all.triangles.len()), "{} triangles", all.triangles.len());
    assert_eq!((all.lights.len(), ten.lights.len()), (100, 10));
    let kinds = |scene: &Scene| {
        scene.lights.iter().fold([0; 4], |mut n, light| {
            match light.kind {
                LightKind::Point { .. } => n[0] += 1,
                LightKind::Spot { .. } => n[1] += 1,
                LightKind::Directional { .. } => n[2] += 1,
                LightKind::Area { .. } => n[3] += 1,
                _ => panic!("{} lights no hall", light.name),
            }
            n
        })
    };
    assert_eq!(kinds(&all), [12, 8, 1, 79]);
    assert_eq!(kinds(&ten), [1, 2, 1, 6]);
    // Only the power of the small lights differs, not what stands in the hall.
    assert_eq!(all.positions, ten.positions);
    assert_eq!(all.triangles, ten.triangles);
    assert!(all.cameras.len() >= 4);
}

/// Radiant power in W, mean over RGB; of parallel light, what enters the five windows (1.7 m × 4.25 m).
fn power(scene: &Scene, kind: &LightKind) -> f32 {
    let mean = |v: Vec3| v.element_sum() / 3.0;
    match kind {
        LightKind::Point { intensity, .. } => 2.0 * TAU * mean(*intensity),
        LightKind::Spot { intensity, cos_inner, cos_outer, .. } => {
            let cone: f32 = (0..1000)
                .map(|i| {
                    spot_falloff(cos_outer + (1.0 - cos_outer) * (i as f32 + 0.5) / 1000.0, *cos_inner, *cos_outer)
                })
                .sum();
            mean(*intensity) * TAU * (1.0 - cos_outer) * cone / 1000.0
        }
        LightKind::Directional { direction, irradiance } => mean(*irradiance) * direction.x.abs() * 5.0 * 1.7 * 4.25,
        LightKind::Area { triangles } => triangles.iter().map(|&t| mean(emitted_by(scene, t)) * PI).sum(),
        _ => 0.0,
    }
}

/// Radiance times area of a triangle's front, W·sr⁻¹; the texture by 256 points.
fn emitted_by(scene: &Scene, triangle: TriangleId) -> Vec3 {
    let sequence = Sequence::new(3);
    let radiance: Vec3 = (0..256)
        .map(|i| {
            let [a, b, ..] = sequence.point_of_set(i, 0);
            let root = a.sqrt();
            scene.emitted_at(FaceId::new(triangle, false), root * (1.0 - b), root * b)
        })
        .sum();
    radiance / 256.0 * scene.area_vector(triangle).length() * 0.5
}

#[test]
fn ten_lights_are_strong_and_ninety_small() {
    let (all, ten) = (scene("moonlit_library/moonlit_library.toml"), scene("moonlit_library/moonlit_library-ten.toml"));
    let strong: BTreeSet<&str> = ten.lights.iter().map(|l| l.name.as_str()).collect();
    assert_eq!(strong.len(), 10);
    for light in &all.lights {
        let watts = power(&all, &light.kind);
        if strong.contains(light.name.as_str()) {
            assert!(watts > 20.0, "{}: {watts} W", light.name);
        } else {
            assert!((0.5..=10.0).contains(&watts), "{}: {watts} W", light.name);
        }
        if let LightKind::Area { triangles } = &light.kind {
            assert!(triangles.len() <= 80, "{}: {} triangles", light.name, triangles.len());
        }
    }
}

/// Directions in the view of a camera, spread over its image.
fn rays(camera: &Camera, count: u32) -> impl Iterator<Item = Ray> {
    let forward = (camera.look_at - camera.position).normalize();
    let right = forward.cross(camera.up).normalize();
    let up = right.cross(forward);
    let half = (camera.vertical_fov.to_radians() * 0.5).tan();
    let (origin, sequence) = (camera.position, Sequence::new(4));
    (0..count).map(move |i| {
        let [a, b, ..] = sequence.point_of_set(i, 0);
        let d = (Vec2::new(a, b) * 2.0 - 1.0) * half * Vec2::new(4.0 / 3.0, 1.0);
        Ray { origin, direction: forward + right * d.x + up * d.y, t_max: f32::INFINITY }
    })
}

#[test]
fn the_library_is_closed_and_wound_outwards() {
    let scene = scene("moonlit_library/moonlit_library.toml");
    let bvh = Bvh::build(&scene);
    // Leaves, cloth, lattice and open pages are single sheets, seen from both sides.
    let sheets = ["leaf", "rattan", "rug", "pages"];
    for named in &scene.cameras {
        let mut behind = BTreeSet::new();
        for ray in rays(&named.camera, 20_000) {
            match bvh.closest(&scene, &ray) {
                Some(hit) if hit.back => {
                    behind.insert(scene.material(hit.triangle).name.clone());
                }
                Some(_) => {}
                None => {
                    // Only the night over the roofs, through a window of the west wall, is left open.
                    let wall = ray.origin + ray.direction * ((-4.7 - ray.origin.x) / ray.direction.x);
                    let open = ray.direction.x < 0.0 && (1.2..5.46).contains(&wall.y) && wall.z.abs() < 8.0;
                    assert!(open, "{}: a ray escapes towards {}", named.name, ray.direction);
                }
            }
        }
        behind.retain(|name: &String| !sheets.contains(&name.as_str()));
        assert!(behind.is_empty(), "{}: seen from behind: {behind:?}", named.name);
    }
}

#[test]
fn the_walk_stays_in_the_hall() {
    let path =
        load_camera_path(&committed().join("moonlit_library/walk.toml"), glam::DVec3::ZERO).expect("the path loads");
    let scene = scene("moonlit_library/moonlit_library.toml");
    let bvh = Bvh::build(&scene);
    let base = scene.cameras[0].camera;
    let mut last = path.camera_at(0.0, &base).position;
    let steps = (path.duration() * 10.0) as u32;
    for i in 1..=steps {
        let next = path.camera_at(i as f32 / 10.0, &base).position;
        let blocked = bvh.occluded(&scene, &Ray { origin: last, direction: next - last, t_max: 1.0 });
        assert!(!blocked, "the camera walks through something near {next} at {} s", i as f32 / 10.0);
        last = next;
    }
}

#[test]
fn the_cornell_box_is_the_published_one() {
    let scene = scene("cornell_box/cornell_box.toml");
    let camera = &scene.cameras[0].camera;
    assert_eq!((camera.position, camera.look_at), (Vec3::new(278.0, 273.0, -800.0), Vec3::new(278.0, 273.0, 0.0)));
    assert!((camera.vertical_fov - 2.0 * (0.0125f32 / 0.035).atan().to_degrees()).abs() < 0.005);
    assert_eq!(scene.triangles.len(), 2 * (6 + 2 * 5));
    let total = |pick: &dyn Fn(&str, Vec3) -> bool| -> Vec3 {
        (0..scene.triangles.len() as u32)
            .map(TriangleId)
            .filter(|&t| pick(&scene.material(t).name, scene.area_vector(t)))
            .map(|t| scene.area_vector(t) * 0.5)
            .sum()
    };
    // The lamp: 130 × 105, emitting downwards; the walls face the room: red lies at x > 0, green at x = 0.
    assert_eq!(total(&|name, _| name == "lamp"), Vec3::new(0.0, -130.0 * 105.0, 0.0));
    let green = total(&|name, _| name == "green");
    assert!(green.abs_diff_eq(Vec3::new(548.8 * 559.2, 0.0, 0.0), 1.0), "{green}");
    let red = total(&|name, _| name == "red");
    assert!(red.x < -0.99 * 548.8 * 559.2 && red.y.abs() < 5000.0, "{red}");
    // Blocks without bottoms: floor and tops face up, the ceiling down.
    let up = total(&|name, a| name == "white" && a.y > 1.0).y;
    let quad = |[a, b, c, d]: [Vec2; 4]| (c - a).perp_dot(d - b).abs() * 0.5;
    let floor = quad([Vec2::new(552.8, 0.0), Vec2::ZERO, Vec2::new(0.0, 559.2), Vec2::new(549.6, 559.2)]);
    let short =
        quad([Vec2::new(130.0, 65.0), Vec2::new(82.0, 225.0), Vec2::new(240.0, 272.0), Vec2::new(290.0, 114.0)]);
    let tall =
        quad([Vec2::new(423.0, 247.0), Vec2::new(265.0, 296.0), Vec2::new(314.0, 456.0), Vec2::new(472.0, 406.0)]);
    assert!((up - floor - short - tall).abs() < 1.0, "{up}");
    let down = total(&|name, a| name == "white" && a.y < -1.0).y;
    assert!((down + 556.0 * 559.2).abs() < 1.0, "{down}");
}
