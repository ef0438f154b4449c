//! `--cache-dir`: light that a later run begins with, what changes leave of it, and what harms it.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use crate::support::binary::{CORNELL, has_device, penombre, run, stderr};
use penombre::image::exr::read_rgb;
use penombre::store::{Limits, Store};
use std::fs;
use std::path::Path;
use std::process::Stdio;
use std::time::Duration;

/// The Cornell box with a bulb beside its lamp, and a second camera.
const SCENE: &str = r#"[geometry]
obj = ["box.obj"]
[[camera]]
name = "main"
position = [278, 273, -800]
look_at = [278, 273, 0]
vertical_fov = 39.31
[[camera]]
name = "near"
position = [278, 250, -300]
look_at = [200, 150, 300]
vertical_fov = 50
[[light]]
name = "bulb"
kind = "point"
position = [150, 400, 200]
intensity = [20000, 20000, 20000]
"#;

/// A folder with the scene, with texts replaced in its files.
fn scene(folder: &Path, edits: &[(&str, &str)]) {
    let cornell = Path::new(CORNELL).with_extension("obj");
    let files = [
        ("scene.toml", SCENE.to_owned()),
        ("box.obj", fs::read_to_string(&cornell).unwrap()),
        ("cornell_box.mtl", fs::read_to_string(cornell.with_extension("mtl")).unwrap()),
    ];
    for (name, text) in files {
        let edited = edits.iter().fold(text, |text, (from, to)| text.replace(from, to));
        fs::write(folder.join(name), edited).unwrap();
    }
}

/// What a run did: rays, blocks used, blocks saved, and what it said.
struct Done {
    rays: u64,
    used: u64,
    saved: u64,
    damaged: u64,
    said: String,
}

/// Renders and looks at the summary.
fn render(folder: &Path, options: &str) -> Done {
    let size = if options.contains("--size") { "" } else { "--size 96x96" };
    let line = format!("render scene.toml {size} -o a.exr --log l.csv --cache-dir kept {options}");
    let output = run(folder, &line);
    let said = stderr(&output);
    assert_eq!(output.status.code(), Some(0), "{line}: {said}");
    let json: serde_json::Value = serde_json::from_slice(&fs::read(folder.join("l.json")).unwrap()).unwrap();
    let number = |name: &str| json["kept"][name].as_u64().unwrap();
    Done {
        rays: json["rays"].as_u64().unwrap(),
        used: number("reused_blocks"),
        saved: number("saved_blocks"),
        damaged: number("damaged_blocks"),
        said,
    }
}

/// relMSE between two pictures.
fn difference(a: &Path, b: &Path) -> f64 {
    let [a, b] = [a, b].map(|path| read_rgb(path).unwrap());
    let mean = b.rgb.iter().map(|p| f64::from(p.element_sum()) / 3.0).sum::<f64>() / b.rgb.len() as f64;
    let squares = a.rgb.iter().zip(&b.rgb).map(|(&a, &b)| {
        let d = (a - b).as_dvec3();
        let r = b.as_dvec3();
        (d * d / (r * r + 0.01 * mean * mean)).element_sum() / 3.0
    });
    squares.sum::<f64>() / b.rgb.len() as f64
}

#[test]
fn a_second_run_begins_with_the_light_of_the_first_whatever_the_view() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    scene(folder.path(), &[]);
    let first = render(folder.path(), "--error 0.01");
    assert!(first.said.contains("kept light: none yet") && first.used == 0 && first.saved > 0, "{}", first.said);
    fs::copy(folder.path().join("a.exr"), folder.path().join("first.exr")).unwrap();
    let again = render(folder.path(), "--error 0.01");
    assert!(again.used > 0 && again.rays < first.rays / 2, "{} rays, then {}", first.rays, again.rays);
    let off = difference(&folder.path().join("a.exr"), &folder.path().join("first.exr"));
    assert!(off < 2e-3, "{off}");
    // Other views of the same scene: exposure, size, camera.
    let brighter = render(folder.path(), "--error 0.01 --exposure 2 --seed 7");
    assert!(brighter.used > 0 && brighter.rays < first.rays / 2, "{}", brighter.rays);
    let near = render(folder.path(), "--error 0.01 --camera near --size 128x80");
    assert!(near.used > 0, "{}", near.said);
    let fresh =
        run(folder.path(), "render scene.toml --size 128x80 -o b.exr --log b.csv --error 0.01 --camera near -q");
    assert_eq!(fresh.status.code(), Some(0));
    let json: serde_json::Value = serde_json::from_slice(&fs::read(folder.path().join("b.json")).unwrap()).unwrap();
    assert!(near.rays < json["rays"].as_u64().unwrap() * 3 / 4, "{} rays, {} without", near.rays, json["rays"]);
}

#[test]
fn what_changed_is_computed_anew_and_told_and_the_rest_is_used() {
    if !has_device() {
        return;
    }
    // Three blocks a cluster: shape, lamp, bulb; and indirect light.
    for (edit, used, told) in [
        (("[20000, 20000, 20000]", "[60000, 5000, 5000]"), [3, 4], "light 'bulb': another power; direct light is used"),
        (("[150, 400, 200]", "[400, 300, 100]"), [2, 4], "light 'bulb': changed; its direct light"),
        (("Ke 17 12 4", "Ke 9 12 14"), [2, 4], "light 'lamp': changed; its direct light"),
        (("Kd 0.63 0.065 0.05", "Kd 0.1 0.065 0.6"), [3, 4], "material 'red': changed; indirect light"),
        (("v 552.8 0 0", "v 552.8 3 0"), [0, 4], "geometry: changed; all light"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        scene(folder.path(), &[]);
        let first = render(folder.path(), "--rays 300000 --deterministic");
        scene(folder.path(), &[edit]);
        let changed = render(folder.path(), "--rays 300000 --deterministic");
        println!("{edit:?}: {} used, {} saved first\n{}", changed.used, first.saved, changed.said);
        assert!(changed.said.contains(told), "{}", changed.said);
        assert_eq!(changed.used * used[1], first.saved * used[0], "{edit:?}: {}", changed.said);
        let line = "render scene.toml --size 96x96 -o b.exr --rays 300000 --deterministic -q";
        assert_eq!(run(folder.path(), line).status.code(), Some(0));
        let off = difference(&folder.path().join("a.exr"), &folder.path().join("b.exr"));
        assert!(off < 4e-3, "{edit:?}: {off} against a run without kept light");
    }
}

#[test]
fn resumed_runs_are_the_same_to_the_bit_whatever_the_threads() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    scene(folder.path(), &[]);
    render(folder.path(), "--rays 100000 --deterministic");
    let kept = fs::read(folder.path().join("kept/light.redb")).unwrap();
    let pictures = [1, 2, 7].map(|threads| {
        fs::write(folder.path().join("kept/light.redb"), &kept).unwrap();
        let done = render(folder.path(), &format!("--rays 100000 --deterministic --threads {threads}"));
        assert!(done.used > 0, "{}", done.said);
        fs::read(folder.path().join("a.exr")).unwrap()
    });
    assert!(pictures[0] == pictures[1] && pictures[0] == pictures[2]);
}

#[test]
fn damaged_files_are_told_and_the_picture_is_made() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    scene(folder.path(), &[]);
    render(folder.path(), "--rays 50000 --deterministic");
    let path = folder.path().join("kept/light.redb");
    let whole = fs::read(&path).unwrap();
    let truncated = whole[..whole.len() / 2].to_vec();
    let mut flipped = whole;
    for at in (0..flipped.len()).step_by(997) {
        flipped[at] ^= 16;
    }
    for bytes in [truncated, flipped, b"not a database at all".to_vec()] {
        fs::write(&path, bytes).unwrap();
        let done = render(folder.path(), "--rays 50000 --deterministic");
        assert!(done.said.contains("warning: kept/light.redb: the file is damaged"), "{}", done.said);
        assert!(done.used == 0 && done.damaged == 0 && done.saved > 0, "{}", done.said);
        let again = render(folder.path(), "--rays 50000 --deterministic");
        assert!(again.used > 0 && !again.said.contains("warning"), "{}", again.said);
    }
}

#[test]
fn a_directory_that_cannot_be_used_is_told_before_any_work() {
    let folder = tempfile::tempdir().unwrap();
    scene(folder.path(), &[]);
    let _held = Store::open(&folder.path().join("held"), Limits::default()).unwrap();
    for (options, part) in [
        ("--cache-dir held", "held: another process keeps its light there now"),
        ("--cache-dir scene.toml", "scene.toml: is not a directory"),
        ("--cache-dir scene.toml/a", "cannot make the cache directory"),
        ("--cache-dir /proc/a", "cannot make the cache directory"),
        ("--cache-dir kept --without checks", "cannot be used with"),
    ] {
        let output = run(folder.path(), &format!("render scene.toml -o a.exr {options}"));
        assert_eq!(output.status.code(), Some(2), "{options}: {}", stderr(&output));
        assert!(stderr(&output).contains(part), "{options}: {}", stderr(&output));
        assert!(!folder.path().join("a.exr").exists());
    }
}

#[cfg(unix)]
#[test]
fn a_run_whose_directory_is_removed_ends_well() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    scene(folder.path(), &[]);
    let line = "render scene.toml --size 96x96 -o a.exr --cache-dir kept --time 1.5";
    let child = penombre(folder.path(), line).stderr(Stdio::piped()).spawn().unwrap();
    std::thread::sleep(Duration::from_millis(900));
    fs::remove_dir_all(folder.path().join("kept")).unwrap();
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0));
    assert!(stderr(&output).contains("it was removed or replaced meanwhile"), "{}", stderr(&output));
    assert!(folder.path().join("a.exr").exists());
}

/// Kills renders and looks at what they leave: how much light the next begins with.
#[cfg(unix)]
fn kills(count: u64) {
    let folder = tempfile::tempdir().unwrap();
    scene(folder.path(), &[]);
    let mut used = Vec::new();
    for kill in 0..count {
        let line = "render scene.toml --size 160x160 -o a.exr --cache-dir kept --time 60 -q";
        let mut child = penombre(folder.path(), line).stderr(Stdio::null()).spawn().unwrap();
        // Some before anything is saved, most while rounds are.
        let more = if kill + 1 == count { 5000 } else { kill.wrapping_mul(0x9e37_79b9_7f4a_7c15) % 5000 };
        std::thread::sleep(Duration::from_millis(200 + more));
        child.kill().unwrap();
        child.wait().unwrap();
        if kill % 10 == 9 || kill + 1 == count {
            let done = render(folder.path(), "--rays 1000 --deterministic");
            assert!(done.damaged == 0 && !done.said.contains("warning"), "kill {kill}: {}", done.said);
            assert!(done.used >= used.last().copied().unwrap_or(0), "kill {kill}: what was kept is gone");
            used.push(done.used);
        }
    }
    println!("{count} kills; blocks that later runs began with: {used:?}");
    assert!(used.last().is_some_and(|&used| used > 0));
}

#[cfg(unix)]
#[test]
fn killed_renders_leave_light_that_the_next_begins_with() {
    if has_device() {
        kills(2);
    }
}

/// cargo test --release --test cli -- --ignored --nocapture two_hundred_killed_renders (make kills)
#[cfg(unix)]
#[test]
#[ignore = "takes ten minutes"]
fn two_hundred_killed_renders() {
    kills(200);
}
