//! Environments and skies of scene files: what they become, and what is said of those with faults.
#![allow(clippy::expect_used, reason = "a test may end where its files cannot be written")]

use glam::Vec3;
use penombre::error::Error;
use penombre::scene::environment::Environment;
use penombre::scene::light::LightKind;
use penombre::scene::load::{Loaded, load};
use penombre::scene::report::{Report, Severity};
use std::path::Path;
use std::sync::Arc;
use tempfile::TempDir;

const HEAD: &str = "[geometry]\nobj = \"a.obj\"\n[camera]\nposition = [0, 0, 1]\nlook_at = [0, 0, 0]\n";
/// Line of the first thing after the head.
const FIRST: u32 = 6;

fn folder(text: &str) -> TempDir {
    let folder = tempfile::tempdir().expect("a temporary directory");
    std::fs::write(folder.path().join("a.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").expect("written");
    std::fs::write(folder.path().join("s.toml"), format!("{HEAD}{text}")).expect("written");
    folder
}

fn loaded(folder: &Path) -> Loaded {
    load(&folder.join("s.toml")).unwrap_or_else(|error| panic!("{error}"))
}

fn refused(text: &str) -> Report {
    let folder = folder(text);
    match load(&folder.path().join("s.toml")) {
        Err(Error::Input(report)) => report,
        other => panic!("{text}: {other:?}"),
    }
}

fn environment(loaded: &Loaded) -> Arc<Environment> {
    match &loaded.scene.lights[0].kind {
        LightKind::Environment(environment) => Arc::clone(environment),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_constant_and_a_picture_are_read() {
    let folder = folder("[[light]]\nkind = \"environment\"\nradiance = [1, 2, 3]\nscale = 0.5\n");
    let environment_of = |folder: &TempDir| environment(&loaded(folder.path()));
    assert_eq!(environment_of(&folder).radiance(Vec3::X), Vec3::new(0.5, 1.0, 1.5));
    let picture = image::Rgb32FImage::from_fn(8, 4, |x, y| {
        image::Rgb(if (x, y) == (5, 1) { [f32::NAN, -1.0, 4.0] } else { [x as f32, y as f32, f32::from(x == 7) * 1e9] })
    });
    for name in ["p.hdr", "p.exr"] {
        picture.save(folder.path().join(name)).expect("written");
        let text =
            format!("{HEAD}[[light]]\nkind = \"environment\"\nfile = \"{name}\"\nrotation = 90\nscale = [2, 1, 1]\n");
        std::fs::write(folder.path().join("s.toml"), text).expect("written");
        let loaded = loaded(folder.path());
        let found = environment(&loaded).radiance(Vec3::new(-1.0, -0.1, -0.1).normalize());
        assert!(
            (found - Vec3::new(8.0, 2.0, 0.0)).abs().max_element() < 0.05,
            "{name}: {found}, the middle to the left"
        );
        assert!(loaded.files.iter().any(|file| file.ends_with(name)), "{:?}", loaded.files);
        if name == "p.exr" {
            let warnings = loaded.report.lines(Severity::Warning);
            assert!(warnings.len() == 1 && warnings[0].contains("s.toml:8"), "{warnings:?}");
            assert!(warnings[0].contains("1 pixels hold"), "{warnings:?}");
            let cleaned = environment(&loaded).picture.texels()[8 + 5];
            assert_eq!(cleaned, Vec3::new(0.0, 0.0, 4.0));
        }
    }
    image::RgbImage::from_pixel(4, 2, image::Rgb([188, 0, 255])).save(folder.path().join("p.png")).expect("written");
    std::fs::write(folder.path().join("s.toml"), format!("{HEAD}[light]\nkind = \"environment\"\nfile = \"p.png\"\n"))
        .expect("written");
    let found = environment_of(&folder).radiance(Vec3::Y);
    assert!((found - Vec3::new(0.503, 0.0, 1.0)).abs().max_element() < 2e-3, "sRGB: {found}");
}

#[test]
fn a_sky_has_a_sun_of_its_own() {
    let sky = |more: &str| {
        let folder = folder(&format!(
            "[[light]]\nkind = \"sky\"\nname = \"above\"\nsun_elevation = 30\nsun_azimuth = 90\n{more}"
        ));
        loaded(folder.path())
    };
    let both = sky("");
    let names: Vec<&str> = both.scene.lights.iter().map(|light| light.name.as_str()).collect();
    assert_eq!(names, ["above", "sun"]);
    let LightKind::Sun { direction, half_angle, radiance } = both.scene.lights[1].kind else { panic!("no sun") };
    assert!(direction.distance(Vec3::new(0.75_f32.sqrt(), 0.5, 0.0)) < 1e-5, "in the east, which is +x: {direction}");
    assert!((half_angle.to_degrees() - 0.265).abs() < 1e-4);
    let picture = environment(&both);
    let [towards, away] = [1.0, -1.0].map(|side| picture.radiance(Vec3::new(side * 0.85, 0.5, 0.1).normalize()));
    assert!(towards.min_element() > 2.0 * away.x, "brighter around the sun: {towards} {away}");
    let dimmed =
        sky("scale = 0.5\n[[light]]\nname = \"sun\"\nkind = \"point\"\nposition = [0, 0, 0]\nintensity = [1, 1, 1]\n");
    let LightKind::Sun { radiance: half, .. } = dimmed.scene.lights[2].kind else { panic!("no sun") };
    assert!((half * 2.0 / radiance - 1.0).abs().max_element() < 1e-5);
    assert_eq!(dimmed.scene.lights[2].name, "sun (sky)");
    assert_eq!(sky("sun = false\n").scene.lights.len(), 1);
    let z_up = sky("up = [0, 0, 1]\nnorth = [1, 0, 0.2]\n");
    let LightKind::Sun { direction, .. } = z_up.scene.lights[1].kind else { panic!("no sun") };
    assert!(
        direction.distance(Vec3::new(0.0, -(0.75_f32.sqrt()), 0.5)) < 1e-5,
        "east is −y where north is +x: {direction}"
    );
}

#[test]
fn the_sun_may_be_told_by_place_and_time() {
    // Munich, half past one in summer time, the sun almost in the south: 90° − 48.1° + 23.4°.
    for [date, time] in [["2026-06-21", "13:16:00"], ["\"2026-06-21\"", "\"13:16\""]] {
        let text = format!("date = {date}\ntime = {time}\nutc_offset = 2\nlatitude = 48.14\nlongitude = 11.58\n");
        let folder = folder(&format!("[light]\nkind = \"sky\"\n{text}"));
        let LightKind::Sun { direction, .. } = loaded(folder.path()).scene.lights[1].kind else { panic!("no sun") };
        assert!((direction.y.asin().to_degrees() - 65.3).abs() < 0.2, "{direction}");
        assert!(direction.z > 0.0 && direction.x.abs() < 0.02, "the south is +z: {direction}");
    }
}

#[test]
fn faults_have_their_lines() {
    let said = |text: &str, line: u32, words: &str| {
        let report = refused(text);
        let at =
            |fault: &&penombre::scene::report::Fault| fault.place.line == Some(line) && fault.message.contains(words);
        assert!(report.faults.iter().any(|fault| at(&fault)), "no {words:?} at line {line}: {report:#?}");
    };
    let environment = "[[light]]\nkind = \"environment\"\n";
    let sky = "[[light]]\nkind = \"sky\"\n";
    let third = FIRST + 2;
    said(environment, FIRST, "radiance = [r, g, b] or file");
    said(&format!("{environment}file = \"gone.hdr\""), third, "gone.hdr");
    said(&format!("{environment}file = \"a.obj\""), third, "a.obj");
    said(&format!("{environment}file = \".\""), third, "is no file");
    said(&format!("{environment}radiance = [1, 1, 1]\nfile = \"a.hdr\""), third, "leave one out");
    said(&format!("{environment}radiance = [1, -1, 1]"), third, "negative");
    said(&format!("{environment}radiance = [1, 1, 1]\nup = [0, 0, 0]"), third + 1, "up is zero");
    said(&format!("{environment}radiance = [1, 1, 1]\nscale = -1"), third + 1, "scale");
    said(&format!("{environment}radiance = [1, 1, 1]\nturbidity = 3"), third + 1, "turbidity");
    said(sky, FIRST, "no sun");
    said(&format!("{sky}sun_elevation = 20\nsun_direction = [0, 1, 0]"), FIRST, "too many suns");
    said(&format!("{sky}sun_elevation = -3"), third, "from 0 to 90");
    said(&format!("{sky}sun_azimuth = 3"), FIRST, "lacks sun_elevation");
    said(&format!("{sky}sun_direction = [0, -1, 0]"), third, "above the horizon");
    said(&format!("{sky}sun_elevation = 20\nturbidity = 11"), third + 1, "from 1 to 10");
    said(&format!("{sky}sun_elevation = 20\nground_albedo = [0, 2, 0]"), third + 1, "from 0 to 1");
    said(&format!("{sky}sun_elevation = 20\nnorth = [0, 5, 0]"), third + 1, "north");
    said(&format!("{sky}sun_elevation = 20\nsun = 1"), third + 1, "true or false");
    said(&format!("{sky}date = 2026-06-21\ntime = 12:00:00\nlatitude = 91\nlongitude = 0"), third + 2, "latitude");
    said(
        &format!("{sky}date = 2026-06-21\ntime = 01:00:00\nlatitude = 48\nlongitude = 0"),
        third + 1,
        "below the horizon",
    );
    said(&format!("{sky}date = 2026-06-21\ntime = 12:00:00\nlatitude = 48"), FIRST, "lacks longitude");
    said(&format!("{sky}date = 2026-13-21\ntime = 12:00:00\nlatitude = 48\nlongitude = 0"), third, "");
    said(&format!("{sky}sun_elevation = 20\n{environment}radiance = [1, 1, 1]"), third + 1, "two environments");
}

/// A header that asks for more than there is does not get it.
#[test]
fn pictures_that_are_too_large_or_cut_off_are_refused() {
    let text = "[[light]]\nkind = \"environment\"\nfile = \"p.hdr\"\n";
    for (content, words) in [
        ("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 40000 +X 80000\n", "80000 × 40000 texels"),
        ("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 64 +X 128\nshort", "p.hdr"),
        ("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 0 +X 0\n", "p.hdr"),
        ("", "p.hdr"),
    ] {
        let folder = folder(text);
        std::fs::write(folder.path().join("p.hdr"), content).expect("written");
        let Err(Error::Input(report)) = load(&folder.path().join("s.toml")) else { panic!("{content}: accepted") };
        let lines = report.lines(Severity::Error);
        assert!(lines.len() == 1 && lines[0].contains("s.toml:8") && lines[0].contains(words), "{lines:?}");
    }
}
