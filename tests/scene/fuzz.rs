//! Whatever the bytes, loading ends: with a scene that keeps its promises or with a report. Seeds are fixed.

use penombre::error::Error;
use penombre::scene::camera_path::load_camera_path;
use penombre::scene::load::load;
use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use std::path::Path;

pub(super) fn runner(cases: u32) -> TestRunner {
    let config = Config { cases, failure_persistence: None, ..Config::default() };
    TestRunner::new_with_rng(config, TestRng::deterministic_rng(RngAlgorithm::ChaCha))
}

/// Loads `name` in a directory with `files` and checks what comes out.
pub(super) fn try_load(files: &[(&str, &[u8])], name: &str) -> Result<(), TestCaseError> {
    let directory = tempfile::tempdir().map_err(|e| TestCaseError::fail(e.to_string()))?;
    for (file, content) in files {
        std::fs::write(directory.path().join(file), content).map_err(|e| TestCaseError::fail(e.to_string()))?;
    }
    check(&directory.path().join(name))
}

fn check(path: &Path) -> Result<(), TestCaseError> {
    match load(path) {
        Ok(loaded) => {
            let scene = &loaded.scene;
            prop_assert!(!scene.triangles.is_empty() && !loaded.report.has_errors());
            prop_assert!(!scene.cameras.is_empty() && !scene.lights.is_empty());
            prop_assert!(scene.positions.iter().all(|p| p.is_finite()));
            prop_assert!(scene.normals.iter().flatten().all(|n| n.is_normalized()));
            prop_assert!(scene.uvs.iter().flatten().all(|uv| uv.is_finite()));
            prop_assert!(scene.triangles.iter().flatten().all(|&i| (i as usize) < scene.positions.len()));
            for m in &scene.materials {
                prop_assert!(
                    m.kd.min_element() >= 0.0 && m.phong().ks.min_element() >= 0.0 && m.ke.min_element() >= 0.0
                );
                prop_assert!(
                    (m.kd + m.phong().ks).max_element() <= 1.0 && m.ke.is_finite() && m.phong().shininess.is_finite()
                );
            }
        }
        Err(Error::Input(report)) => prop_assert!(report.has_errors()),
        Err(other) => return Err(TestCaseError::fail(format!("{other}"))),
    }
    Ok(())
}

/// Lines of an OBJ or MTL, each of them well or badly formed.
fn lines(keywords: &'static str, most: usize) -> impl Strategy<Value = Vec<u8>> {
    let keyword = prop::sample::select(keywords.split(' ').collect::<Vec<_>>());
    let value = prop_oneof![
        6 => (-3_i32..6).prop_map(|i| i.to_string().into_bytes()),
        3 => (-2.0_f32..2.0).prop_map(|x| x.to_string().into_bytes()),
        2 => prop::sample::select(vec!["1/1", "2//1", "3/1/1", "-1/-1/-1", "1/0", "4294967295", "nan", "-inf", "1e39", "1e-40",
            "a", "-s", "-o", "spectral", "#", "\\", "1//", "/", "-", "a.png", "a.mtl"]).prop_map(|s| s.as_bytes().to_vec()),
        1 => prop::collection::vec(any::<u8>(), 0..6),
    ];
    let line = (keyword, prop::collection::vec(value, 0..7), prop::sample::select(vec!["\n", "\r\n", "\\\n", "\n\n"]));
    prop::collection::vec(line, 0..most).prop_map(|lines| {
        let mut out = Vec::new();
        for (keyword, values, end) in lines {
            out.extend_from_slice(keyword.as_bytes());
            for value in values {
                out.push(b' ');
                out.extend_from_slice(&value);
            }
            out.extend_from_slice(end.as_bytes());
        }
        out
    })
}

const START: &[u8] = b"mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 1\nvt 0 1\nvn 0 0 1\nf 1 2 3\nusemtl 1\n";

#[test]
fn random_lines_never_break_the_loader() -> Result<(), TestCaseError> {
    let obj = lines("v v vt vn f f f usemtl mtllib g o s l p x", 60);
    let mtl = lines("newmtl Kd Ks Ke Ns d Tr illum map_Kd map_Ke map_d Ni x", 30);
    let run = runner(300).run(&(obj, mtl), |(obj, mtl)| {
        let obj = [START, &obj].concat();
        let mtl = [b"newmtl 1\n", &mtl[..]].concat();
        try_load(&[("a.obj", &obj), ("a.mtl", &mtl), ("a.png", b"no image")], "a.obj")
    });
    run.map_err(|e| TestCaseError::fail(e.to_string()))
}

#[test]
fn random_bytes_never_break_the_loader() -> Result<(), TestCaseError> {
    let run = runner(200).run(&prop::collection::vec(any::<u8>(), 1..400), |bytes| {
        let text: Vec<u8> = bytes.iter().copied().filter(|&b| b != 0).collect();
        try_load(&[("a.obj", &bytes)], "a.obj")?;
        try_load(&[("a.obj", &[START, &text].concat()), ("a.mtl", &bytes)], "a.obj")?;
        try_load(&[("a.toml", &text)], "a.toml")
    });
    run.map_err(|e| TestCaseError::fail(e.to_string()))
}

const SCENE: &str = "[geometry]\nobj = [\"a.obj\"]\nsmooth_angle = 40\n[[camera]]\nname = \"main\"\nposition = [0, 0, 3]\n\
                     look_at = [0, 0, 0]\n[[light]]\nkind = \"spot\"\nposition = [0, 1, 2]\ndirection = [0, -1, 0]\n\
                     intensity = [1, 1, 1]\ninner_angle = 10\nouter_angle = 20\n[display]\nexposure = 1.0\n";

#[test]
fn mutated_scene_files_never_break_the_loader() -> Result<(), TestCaseError> {
    let edits = prop::collection::vec((any::<prop::sample::Index>(), "[ -~\n]{0,3}", 0_usize..4), 1..6);
    let run = runner(300).run(&edits, |edits| {
        let mut text = SCENE.to_owned();
        for (at, insert, remove) in edits {
            let start = at.index(text.len() + 1);
            text.replace_range(start..(start + remove).min(text.len()), &insert);
        }
        try_load(&[("a.obj", START), ("a.mtl", b"newmtl 1\nKd 1\n"), ("s.toml", text.as_bytes())], "s.toml")
    });
    run.map_err(|e| TestCaseError::fail(e.to_string()))
}

#[test]
fn mutated_images_never_break_the_loader() -> Result<(), TestCaseError> {
    let picture = image::RgbImage::from_fn(24, 17, |x, y| image::Rgb([(x * 10) as u8, (y * 14) as u8, (x * y) as u8]));
    let mut encoded = Vec::new();
    for format in [image::ImageFormat::Png, image::ImageFormat::Jpeg, image::ImageFormat::Bmp, image::ImageFormat::Tga]
    {
        let mut bytes = std::io::Cursor::new(Vec::new());
        picture.write_to(&mut bytes, format).map_err(|e| TestCaseError::fail(e.to_string()))?;
        encoded.push((format!("a.{}", format.extensions_str()[0]), bytes.into_inner()));
    }
    let edits = prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8);
    let inputs = (prop::sample::select(encoded), edits, any::<prop::sample::Index>(), any::<bool>());
    let run = runner(600).run(&inputs, |((name, mut bytes), edits, cut, is_cut)| {
        for (at, value) in edits {
            // Headers matter more than pixels.
            let at = at.index(bytes.len().min(if value & 1 == 0 { 64 } else { usize::MAX }));
            bytes[at] = value;
        }
        if is_cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        let mtl = format!("newmtl 1\nmap_Kd {name}\nmap_d {name}\n");
        try_load(&[("a.obj", &[START, b"f 1 2 3\n"].concat()), ("a.mtl", mtl.as_bytes()), (&name, &bytes)], "a.obj")
    });
    run.map_err(|e| TestCaseError::fail(e.to_string()))
}

#[test]
fn extremes_end_soon() -> Result<(), TestCaseError> {
    let start = std::time::Instant::now();
    let with = |line: String| [START, line.as_bytes(), b"\n"].concat();
    let spiral: String = (0..20_000)
        .map(|i| {
            let a = i as f32 * 0.01;
            format!("v {} {} 0\n", a * a.cos(), a * a.sin())
        })
        .collect();
    let all: String = (5..20_005).map(|i| format!(" {i}")).collect();
    let star: String = (0..200_000).map(|i| format!("v {i} 1 {}\nf 1 -1 -2\n", i % 7)).collect();
    for obj in [
        with(format!("f {}", "1 2 3 ".repeat(1 << 19))),
        with(format!("f {}", "\\\n".repeat(1 << 20))),
        with("#".repeat(4 << 20)),
        with("\\\n".repeat(1 << 20)),
        with(format!("usemtl {}", "x".repeat(4 << 20))),
        with(format!("{spiral}f{all}")),
        with(star),
    ] {
        try_load(&[("a.obj", &obj)], "a.obj")?;
        let scene = b"[geometry]\nobj = \"a.obj\"\nsmooth_angle = 80\n";
        try_load(&[("a.obj", &obj), ("s.toml", scene)], "s.toml")?;
    }
    for toml in ["[".repeat(100_000), format!("a = {}", "[".repeat(100_000)), format!("a = {}1", "{b=".repeat(50_000))]
    {
        try_load(&[("s.toml", toml.as_bytes())], "s.toml")?;
    }
    prop_assert!(start.elapsed().as_secs() < 10, "{:?}", start.elapsed());
    Ok(())
}

#[test]
fn random_camera_paths_never_break_the_loader() -> Result<(), TestCaseError> {
    let run = runner(200).run(&"(\\[\\[key\\]\\]\n|\\[\\[edit\\]\\]\n|time = [0-9.e-]{1,4}\n|position = \\[[0-9., -]{1,9}\\]\n|light = 1\n){0,9}", |text| {
        let directory = tempfile::tempdir().map_err(|e| TestCaseError::fail(e.to_string()))?;
        let path = directory.path().join("p.toml");
        std::fs::write(&path, text).map_err(|e| TestCaseError::fail(e.to_string()))?;
        match load_camera_path(&path, glam::DVec3::ZERO) {
            Ok(camera_path) => prop_assert!(!camera_path.keys.is_empty()),
            Err(Error::Input(report)) => prop_assert!(report.has_errors()),
            Err(other) => return Err(TestCaseError::fail(other.to_string())),
        }
        Ok(())
    });
    run.map_err(|e| TestCaseError::fail(e.to_string()))
}
