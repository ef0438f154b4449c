//! Lamps that were measured, on a floor 5 m below them.
#![allow(clippy::expect_used, reason = "a failed expectation fails the test")]

use crate::reference::{FULL, camera, estimate};
use glam::Vec3;
use penombre::light::source::Source;
use penombre::reference::{Settings, Transport};
use penombre::scene::light::LightKind;
use penombre::scene::load::load;
use std::f32::consts::PI;
use std::fs;
use std::path::Path;

const DISTANCE: f32 = 5.0;
const KD: f32 = 0.6;

/// Candela that the file says at an angle from straight down, and in a plane.
fn candela(plane: f32, angle: f32) -> f32 {
    let along = angle.to_radians().cos().powi(2);
    1200.0 * along * (1.0 + 0.5 * (2.0 * plane.to_radians()).cos() * angle / 90.0)
}

/// A floor under a lamp of that distribution, measured in quarters.
fn write(folder: &Path, keys: &str) {
    let angles: Vec<f32> = (0..=36).map(|i| i as f32 * 2.5).collect();
    let planes: Vec<f32> = (0..=18).map(|i| i as f32 * 5.0).collect();
    let list = |numbers: &[f32]| numbers.iter().map(f32::to_string).collect::<Vec<_>>().join("\n");
    let values: Vec<f32> = planes.iter().flat_map(|&p| angles.iter().map(move |&a| candela(p, a))).collect();
    let head = format!("IESNA91\nTILT=NONE\n1 -1 1 {} {} 1 2 0 0 0\n1 1 100\n", angles.len(), planes.len());
    fs::write(
        folder.join("lamp.ies"),
        [head, list(&angles), "\n".into(), list(&planes), "\n".into(), list(&values)].concat(),
    )
    .expect("written");
    fs::write(folder.join("floor.mtl"), format!("newmtl floor\nKd {KD} {KD} {KD}\n")).expect("written");
    let floor = "mtllib floor.mtl\nusemtl floor\nv -9 0 9\nv 9 0 9\nv 9 0 -9\nv -9 0 -9\nf 1 2 3 4\n";
    fs::write(folder.join("floor.obj"), floor).expect("written");
    let scene = format!(
        "[geometry]\nobj = [\"floor.obj\"]\n[[camera]]\nposition = [0, 8, 8]\nlook_at = [0, 0, 0]\n[[light]]\nkind = \"point\"\n\
         position = [0, {DISTANCE}, 0]\nphotometry = \"lamp.ies\"\n{keys}\n"
    );
    fs::write(folder.join("scene.toml"), scene).expect("written");
}

#[test]
fn what_was_measured_arrives_on_the_floor() {
    let folder = tempfile::tempdir().expect("a folder");
    write(folder.path(), "");
    let scene = load(&folder.path().join("scene.toml")).expect("loaded").scene;
    for (plane, angle) in [(0.0_f32, 0.0_f32), (0.0, 30.0), (90.0, 45.0), (200.0, 20.0), (45.0, 40.0)] {
        let reach = DISTANCE * angle.to_radians().tan();
        // The lamp's z is the world's −y, its x the world's, so its y is z.
        let at = Vec3::new(plane.to_radians().cos(), 0.0, plane.to_radians().sin()) * reach;
        let cosine = angle.to_radians().cos();
        let irradiance = candela(plane, angle) / 683.0 * cosine.powi(3) / (DISTANCE * DISTANCE);
        let view = camera(at + Vec3::new(0.3, 3.0, 0.2), at, 0.05);
        let direct = Settings { transport: Transport::Direct, ..FULL };
        estimate(&scene, &view, direct, 16, 1).assert_is(Vec3::splat(KD / PI * irradiance), 1e-2);
    }
}

#[test]
fn flux_is_what_is_asked_for() {
    for (keys, lumen) in [("flux = 800", 800.0), ("flux = 800\nscale = 2\ncolour = [1, 0.5, 0.2]", 1600.0)] {
        let folder = tempfile::tempdir().expect("a folder");
        write(folder.path(), keys);
        let scene = load(&folder.path().join("scene.toml")).expect("loaded").scene;
        let LightKind::Lamp { position, lamp } = &scene.lights[0].kind else { panic!("{:?}", scene.lights) };
        // Through a sphere about it.
        let (rings, turns) = (400_u16, 200_u16);
        let mut sum = 0.0;
        for (ring, turn) in (0..rings).flat_map(|ring| (0..turns).map(move |turn| (ring, turn))) {
            let y = 1.0 - 2.0 * (f32::from(ring) + 0.5) / f32::from(rings);
            let (sin, cos) = ((f32::from(turn) + 0.5) / f32::from(turns) * 2.0 * PI).sin_cos();
            let sine = (1.0 - y * y).sqrt();
            let normal = Vec3::new(sine * cos, y, sine * sin);
            let source = Source::new(&scene, &scene.lights[0]);
            let rough = source.rough_irradiance(*position + normal, -normal);
            sum += penombre::math::luminance(rough) * 4.0 * PI / (f32::from(rings) * f32::from(turns));
        }
        assert!((sum * 683.0 / lumen - 1.0).abs() < 0.01, "{keys}: {}", sum * 683.0);
        assert!((penombre::math::luminance(lamp.power()) * 683.0 / lumen - 1.0).abs() < 0.01);
    }
}

#[test]
fn a_broken_file_is_an_error_of_its_line() {
    let folder = tempfile::tempdir().expect("a folder");
    write(folder.path(), "intensity = [1, 1, 1]");
    fs::write(folder.path().join("lamp.ies"), "IESNA91\nTILT=NONE\n1 1 x\n").expect("written");
    let message = load(&folder.path().join("scene.toml")).expect_err("refused").to_string();
    assert!(message.contains("scene.toml:9") && message.contains("lamp.ies:3"), "{message}");
    assert!(message.contains("scene.toml:10") && message.contains("intensity comes from"), "{message}");
}
