//! What is said of pictures without light, and of runs that end before there is any.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use crate::support::binary::{has_device, penombre, run, stderr};
use std::fs;
use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

/// An open room of 4 × 3 × 4 with a panel just below the ceiling, wound to shine up.
const ROOM: &str = "mtllib room.mtl\nv -2 0 -2\nv 2 0 -2\nv 2 0 2\nv -2 0 2\nv -2 3 -2\nv 2 3 -2\nv 2 3 2\nv -2 3 2\n\
    usemtl wall\nf 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 4 1 5 8\nf 2 3 7 6\n\
    v -.6 2.999 -.6\nv .6 2.999 -.6\nv .6 2.999 .6\nv -.6 2.999 .6\nusemtl lamp\nf 12 11 10 9\n";

const MTL: &str = "newmtl wall\nKd .7 .7 .7\nnewmtl lamp\nKd .8 .8 .8\nKe 8 8 7\nnewmtl soot\nKd 0 0 0\n";

const FRONT: &str = "[camera]\nposition = [0, 1.5, 6.5]\nlook_at = [0, 1.4, 0]\n";

/// A folder with the room, and a scene file that adds `more` to it.
fn room(geometry: &str, more: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("room.obj"), ROOM).unwrap();
    fs::write(folder.path().join("dark.obj"), ROOM.replace("usemtl lamp", "usemtl wall")).unwrap();
    fs::write(
        folder.path().join("soot.obj"),
        ROOM.replace("usemtl wall", "usemtl soot").replace("usemtl lamp", "usemtl soot"),
    )
    .unwrap();
    fs::write(folder.path().join("room.mtl"), MTL).unwrap();
    fs::write(folder.path().join("s.toml"), format!("[geometry]\n{geometry}\n{more}")).unwrap();
    folder
}

fn said(folder: &Path, budget: &str) -> String {
    let output = run(folder, &format!("render s.toml -o o.png --size 64x48 --log l.csv {budget}"));
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let summary: serde_json::Value = serde_json::from_slice(&fs::read(folder.join("l.json")).unwrap()).unwrap();
    for line in stderr(&output).lines().filter(|line| line.starts_with("warning: ")) {
        assert!(summary["warnings"].as_array().unwrap().iter().any(|w| w == line), "{line}: not in the summary");
    }
    stderr(&output)
}

#[test]
fn a_black_picture_says_why() {
    if !has_device() {
        return;
    }
    let point = |position: &str, intensity: &str| {
        format!("[[light]]\nkind = \"point\"\nposition = {position}\nintensity = {intensity}\n")
    };
    let away = FRONT.replace("look_at = [0, 1.4, 0]", "look_at = [0, 1.5, 20]");
    let lit = point("[0, 2, 0]", "[9, 9, 9]");
    let cases = [
        ("obj = \"room.obj\"", FRONT.to_owned(), "behind the lamps (\"lamp\")"),
        ("obj = \"room.obj\"\nemit = \"both\"", away.clone(), "all of the scene is behind it"),
        (
            "obj = \"dark.obj\"",
            FRONT.to_owned() + &point("[0, 2, 0]", "[0, 0, 0]"),
            "none of the scene's lights (1) shines",
        ),
        (
            "obj = \"dark.obj\"",
            FRONT.to_owned() + &point("[0, 2, 0]", "[1e-6, 1e-6, 1e-6]"),
            "too faint to show: --exposure",
        ),
        (
            "obj = \"dark.obj\"",
            FRONT.to_owned() + &point("[0, 9, 0]", "[9, 9, 9]"),
            "something stands between the lights",
        ),
        ("obj = \"soot.obj\"", FRONT.to_owned() + &lit, "all that is in view is black (material soot)"),
    ];
    for (geometry, more, part) in cases {
        let folder = room(geometry, &more);
        let said = said(folder.path(), "--rays 60000 --direct-only");
        assert!(said.contains(part) && said.matches("warning: the picture is black: ").count() == 1, "{part}: {said}");
    }
    for (geometry, more) in
        [("obj = \"room.obj\"\nemit = \"both\"", FRONT.to_owned()), ("obj = \"dark.obj\"", FRONT.to_owned() + &lit)]
    {
        let folder = room(geometry, &more);
        let said = said(folder.path(), "--rays 60000");
        assert!(!said.contains("warning"), "{geometry}: {said}");
    }
}

#[test]
fn a_camera_inside_something_is_told() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let cube = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
        f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 3 4 8 7\nf 1 5 8 4\nf 2 3 7 6\n";
    fs::write(folder.path().join("cube.obj"), cube).unwrap();
    let scene = "[geometry]\nobj = \"cube.obj\"\n[camera]\nposition = [0.5, 0.5, 0.9]\nlook_at = [0.5, 0.4, 0]\n\
        [[light]]\nkind = \"point\"\nposition = [5, 5, 5]\nintensity = [99, 99, 99]\n";
    fs::write(folder.path().join("s.toml"), scene).unwrap();
    let said = said(folder.path(), "");
    assert!(said.contains("the picture is black: the camera is inside something"), "{said}");
}

/// A bumpy field of 2 n² triangles seen from above, lit.
fn field(n: usize) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let height = |x: usize, z: usize| (x as f32 * 0.7).sin() * (z as f32 * 0.9).cos();
    let mut obj: String = (0..=n).flat_map(|z| (0..=n).map(move |x| format!("v {x} {} {z}\n", height(x, z)))).collect();
    for (x, z) in (0..n).flat_map(|z| (0..n).map(move |x| (x, z))) {
        let a = z * (n + 1) + x + 1;
        let (b, c, d) = (a + 1, a + n + 1, a + n + 2);
        obj += &format!("f {a} {c} {d}\nf {a} {d} {b}\n");
    }
    fs::write(folder.path().join("field.obj"), obj).unwrap();
    let m = n as f32 / 2.0;
    let scene = format!(
        "[geometry]\nobj = \"field.obj\"\n[camera]\nposition = [{m}, {n}, {m}]\nlook_at = [{m}, 0, 0]\n\
         [[light]]\nkind = \"directional\"\ndirection = [-0.6, -1, -0.3]\nirradiance = [3, 3, 3]\n"
    );
    fs::write(folder.path().join("s.toml"), scene).unwrap();
    folder
}

#[test]
fn time_counts_from_the_first_light() {
    if !has_device() {
        return;
    }
    // The hierarchy takes far longer than the time that is given.
    let folder = field(300);
    let said = said(folder.path(), "--time 0.02");
    let summary: serde_json::Value = serde_json::from_slice(&fs::read(folder.path().join("l.json")).unwrap()).unwrap();
    assert!(summary["times"]["bvh"].as_f64().unwrap() > 0.05, "{summary}");
    assert!(summary["rays"].as_u64().unwrap() > 0 && summary["ended_by"] == "time", "{summary}");
    assert!(!said.contains("the picture is black"), "{said}");
    let log = fs::read_to_string(folder.path().join("l.csv")).unwrap();
    let first: f64 = log.lines().nth(1).unwrap().split(',').nth(1).unwrap().parse().unwrap();
    assert!(
        first < 1e3 * summary["times"]["first_frame"].as_f64().unwrap(),
        "the clock of the log starts with the frame"
    );
}

#[test]
fn a_run_that_ends_before_every_vertex_has_a_value_warns() {
    if !has_device() {
        return;
    }
    let folder = field(60);
    let cut_short = said(folder.path(), "--frames 1");
    assert!(
        cut_short.contains("warning: the run ended (frames) before every visible vertex had a value: "),
        "{cut_short}"
    );
    let figures = cut_short.split("had a value: ").nth(1).unwrap().split(" have none").next().unwrap();
    assert!(figures.contains(" of ") && figures.ends_with("(100 %)"), "{figures}");
    let whole = said(folder.path(), "--rays 200000");
    assert!(!whole.contains("warning"), "{whole}");
}

#[cfg(unix)]
#[test]
fn a_signal_before_there_is_light_ends_at_once_with_the_outputs() {
    if !has_device() {
        return;
    }
    let folder = field(700);
    let mut child = penombre(folder.path(), "render s.toml -o o.png --size 64x48 --log l.csv")
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // The log is there once the scene is; the hierarchy may be, and the engine is not.
    let start = Instant::now();
    while !folder.path().join("l.csv").exists() && start.elapsed() < Duration::from_secs(60) {
        std::thread::sleep(Duration::from_millis(2));
    }
    let id = child.id().to_string();
    assert!(std::process::Command::new("kill").args(["-s", "INT", &id]).status().unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    let mut said = String::new();
    std::io::Read::read_to_string(&mut child.stderr.take().unwrap(), &mut said).unwrap();
    let summary: serde_json::Value = serde_json::from_slice(&fs::read(folder.path().join("l.json")).unwrap()).unwrap();
    assert!(summary["times"]["lit_frame"].is_null(), "it waited for light: {summary}");
    assert!(folder.path().join("o.png").exists());
    assert!(said.contains("warning: the run ended before"), "{said}");
}
