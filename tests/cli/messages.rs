//! What is said of files and command lines that are almost right.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use crate::support::binary::{has_device, penombre, run, stderr};
use penombre::error::Error;
use penombre::scene::load::{Loaded, load};
use penombre::scene::report::{Report, Severity};
use penombre::scene::{Scene, TriangleId};
use std::path::Path;

fn obj(text: &str) -> Result<Loaded, Error> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.obj"), text).unwrap();
    load(&folder.path().join("a.obj"))
}

fn loaded(text: &str) -> Loaded {
    obj(text).unwrap_or_else(|e| panic!("{e}"))
}

/// Line and message of each fault that has a line.
fn faults(report: &Report) -> Vec<(u32, &str)> {
    report.faults.iter().filter_map(|fault| Some((fault.place.line?, fault.message.as_str()))).collect()
}

fn area(scene: &Scene) -> f64 {
    (0..scene.triangles.len()).map(|t| f64::from(scene.area_vector(TriangleId(t as u32)).length()) / 2.0).sum()
}

#[test]
fn decimal_commas_are_named() {
    let loaded = loaded("v 0,0 0,0 0,0\nv 1,5 0,0 0,0\nv 1,5 1,5 0,0\nv 0,0 1,5 0,0\nvt 0,5 1,0\nf 1/1 2 3 4\n");
    assert_eq!(area(&loaded.scene), 1.5 * 1.5);
    assert_eq!(loaded.scene.uvs[0][0].to_array(), [0.5, 1.0]);
    let faults = faults(&loaded.report);
    assert!(faults.len() == 1 && faults[0].0 == 1 && faults[0].1.contains("decimal commas"), "{faults:?}");
}

#[test]
fn commas_between_numbers_are_named() {
    for text in ["v 0, 0, 0\nv 2, 0, 0\nv 0, 1, 0\nf 1 2 3\n", "v 0,0,0\nv 2,0,0\nv 0,1,0\nf 1 2 3\n"] {
        let loaded = loaded(text);
        assert_eq!(area(&loaded.scene), 1.0);
        assert_eq!(faults(&loaded.report), [(1, "commas between numbers are read as blanks")]);
    }
    let Err(Error::Input(report)) = obj("v 0,0 1\nv 1 0 0\nv 0 1 0\nf 1 2 3\n") else { panic!("accepted") };
    let is_named = faults(&report).iter().any(|(line, message)| *line == 1 && message.contains("blanks between them"));
    assert!(is_named, "two numbers are no vertex: {report:?}");
}

#[test]
fn free_form_surfaces_are_one_line() {
    let surface = "cstype bspline\ndeg 1 1\nsurf 0 1 0 1 1 2 3 4\nparm u 0 0 1 1\nparm v 0 0 1 1\nend\n";
    let vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\n";
    let Err(Error::Input(report)) = obj(&format!("{vertices}{surface}{surface}")) else { panic!("accepted") };
    let expected =
        "free-form curves and surfaces (cstype bspline) are not supported: tessellate to polygons when exporting";
    assert_eq!(faults(&report), [(5, expected)]);
    let loaded = loaded(&format!("{vertices}{surface}f 1 2 3\n"));
    assert_eq!((loaded.counts.drawn, faults(&loaded.report)), (1, vec![(5, expected)]));
}

#[test]
fn a_missing_library_is_one_line() {
    let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\nusemtl b\nf 1 2 3\nl 1 2\n";
    let loaded = loaded(&("mtllib gone.mtl\n".repeat(200) + triangle));
    assert_eq!(faults(&loaded.report).iter().filter(|(_, message)| message.contains("\"gone.mtl\"")).count(), 1);
    let lines = loaded.report.collapsed();
    assert!(lines.iter().any(|line| line.contains("materials a, b: in no MTL file")), "{lines:?}");
    assert!(lines.iter().any(|line| line.contains("lines and points")), "{lines:?}");
}

#[test]
fn polygons_of_any_number_of_corners_are_cut_right() {
    // A square from which teeth are missing, in one face; the line is longer than a mebibyte.
    let n = 60_000;
    let top = |i: usize| if i.is_multiple_of(2) { 1.0 } else { 0.5 };
    let teeth: String = (0..=n).map(|i| format!("v {} {} 0\n", i as f64 / f64::from(n as u32), top(i))).collect();
    let corners: String = (0..=n).rev().map(|i| format!(" {0:010}/{0:010}", i + 1)).collect();
    let texture: String = "vt 0 0\n".repeat(n + 3);
    let loaded = loaded(&format!("{teeth}v 0 0 0\nv 1 0 0\n{texture}f {}/1 {}/1{corners}\n", n + 2, n + 3));
    assert_eq!((loaded.counts.drawn, loaded.report.lines(Severity::Warning).len()), (n + 1, 2), "and camera and light");
    assert!((area(&loaded.scene) - 0.75).abs() < 1e-4, "{}", area(&loaded.scene));
    assert!((0..n + 1).all(|t| loaded.scene.area_vector(TriangleId(t as u32)).z > 0.0));
}

#[test]
fn an_unknown_device_is_answered_with_those_there_are() {
    if !has_device() {
        return;
    }
    let output = run(Path::new("."), "render {cornell} -o a.png --device nosuch");
    let said = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("no Vulkan device matches --device nosuch; there ") && said.contains(": 0 = "), "{said}");
}

/// Every path of the command line may have any bytes.
#[cfg(unix)]
#[test]
fn file_names_need_not_be_utf8() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt as _;
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path().join(OsStr::from_bytes(b"d\xe9"));
    std::fs::create_dir(&place).unwrap();
    std::fs::write(place.join(OsStr::from_bytes(b"\xe9.obj")), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    std::fs::write(
        place.join(OsStr::from_bytes(b"\xe9.toml")),
        "[[key]]\ntime = 0\nposition = [0, 0, 4]\nlook_at = [0, 0, 0]\n",
    )
    .unwrap();
    let run = |words: &[&[u8]]| {
        let output = penombre(&place, "").args(words.iter().map(|word| OsStr::from_bytes(word))).output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    };
    run(&[
        b"render",
        b"\xe9.obj",
        b"-o",
        b"\xe9.exr",
        b"-o",
        b"\xe9.png",
        b"--log",
        b"\xe9.csv",
        b"--size",
        b"8x8",
        b"--frames",
        b"2",
    ]);
    run(&[
        b"render",
        b"\xe9.obj",
        b"-o",
        b"\xe9##\xff.exr",
        b"--camera-path",
        b"\xe9.toml",
        b"--size",
        b"8x8",
        b"--frames",
        b"1",
    ]);
    run(&[b"diff", b"\xe9.exr", b"\xe901\xff.exr", b"-o", b"\xe9-diff.png"]);
    run(&[b"reference", b"\xe9.obj", b"-o", b"\xe9-ref.exr", b"--size", b"8x8", b"--spp", b"1"]);
    for name in [&b"\xe9.png"[..], b"\xe9.csv", b"\xe9.json", b"\xe901\xff.exr", b"\xe9-diff.png", b"\xe9-ref.exr"] {
        assert!(place.join(OsStr::from_bytes(name)).is_file(), "{}", String::from_utf8_lossy(name));
    }
    // The image's comments name the scene.
    std::fs::rename(place.join(OsStr::from_bytes(b"\xe9.obj")), place.join("\u{6728}.obj")).unwrap();
    run(&[b"render", "\u{6728}.obj".as_bytes(), b"-o", b"a.exr", b"--size", b"8x8", b"--frames", b"1"]);
}
