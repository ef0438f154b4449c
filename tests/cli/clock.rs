//! `penombre bench clock` as a script uses it.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use super::convergence::{json, number, stdout};
use crate::support::binary::{self, has_device, run, stderr};
use serde_json::Value;
use std::path::Path;

/// A scene with a reference, by few short runs.
fn small(folder: &Path) -> String {
    stdout(folder, "reference {cornell} --size 48x36 --filter point -q --spp 1024 --seed 1 -o ref.exr");
    let scene = binary::CORNELL;
    format!("bench clock {scene}=ref.exr {scene}@main --times 0.02,0.01 --rays 40000 --size 64x48 --pictures 3 -q")
}

fn median(figure: &Value) -> f64 {
    number(figure, "median")
}

#[test]
fn a_scene_is_clocked_from_the_start_of_the_process() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let line = small(folder.path());
    let found = json(folder.path(), &format!("{line} --runs 2 --targets 10,1e-9 --json --plot plot.svg --threads 1"));
    let [scene, bare] = [0, 1].map(|i| &found["scenes"][i]);
    assert_eq!(
        (found["runs"].as_u64(), found["threads"].as_u64(), scene["triangles"].as_u64()),
        (Some(2), Some(1), Some(32))
    );
    assert!(bare["errors"].is_null() && found["scenes"].as_array().unwrap().len() == 2);
    assert!(number(&found["machine"], "cores") >= 1.0 && found["device"].as_str().unwrap().len() > 2);
    for scene in [scene, bare] {
        stages_rise(&scene["whole_run"]);
        let moves = &scene["moves"];
        for what in ["engine_ms", "wall_ms"] {
            assert!(
                0.0 < median(&moves[what]["median"]) && median(&moves[what]["median"]) <= median(&moves[what]["worst"])
            );
        }
        // The engine's part of it is CPU time of two threads at most.
        assert!(median(&moves["engine_ms"]["worst"]) < 2.0 * median(&moves["wall_ms"]["worst"]) + 5.0, "{moves}");
    }
    let points = scene["errors"]["points"].as_array().unwrap();
    assert_eq!(points.iter().map(|point| number(point, "time")).collect::<Vec<_>>(), [0.01, 0.02]);
    assert!(points.iter().all(|point| median(&point["wall_seconds"]) > number(point, "time")), "{points:?}");
    assert!(points.iter().all(|point| (0.0..0.9).contains(&median(&point["relmse"]))), "{points:?}");
    let [easy, hard] = [0, 1].map(|i| &scene["errors"]["targets"][i]);
    assert_eq!(
        (&easy["wall_seconds"]["median"], &easy["at_most"]),
        (&points[0]["wall_seconds"]["median"], &true.into())
    );
    assert!(hard["wall_seconds"].is_null() && hard["at_most"] == false);
    assert_eq!(std::fs::read_to_string(folder.path().join("plot.svg")).unwrap().matches("<circle").count(), 2);
}

/// Clocks of a run go on from frame to frame, and its parts make up the whole.
fn stages_rise(run: &Value) {
    for clock in ["wall_seconds", "cpu_seconds"] {
        let stages = ["first_frame", "lit_frame", "complete_frame", "last_frame", "end"]
            .map(|stage| if run[clock][stage].is_null() { f64::NAN } else { median(&run[clock][stage]) });
        // CPU clocks there are on Unix only.
        assert!(stages.is_sorted() && stages[0] > 0.0 || clock == "cpu_seconds" && !cfg!(unix), "{run}");
    }
    let memory = &run["memory"];
    let bytes = median(&memory["bytes_a_triangle"]);
    assert!(bytes > 50.0 && bytes * median(&memory["triangles"]) < 2.0 * median(&memory["cache_bytes"]), "{memory}");
    if cfg!(target_os = "linux") {
        let threads = &run["threads"];
        let of = |kind: &str| median(&threads[kind]);
        let sum: f64 = ["tracing", "engine", "main", "rasteriser", "ended"].map(of).iter().sum();
        // Clocks of threads stop while the images are written.
        let whole = median(&run["cpu_seconds"]["end"]);
        assert!(sum > 0.4 * whole && sum < 1.2 * whole && of("tracing") > 0.0 && of("engine") > 0.0, "{run}");
        assert!((0.0..1.0).contains(&of("serial_share")) && of("tracing_share") < 1.0, "{threads}");
        assert!(median(&memory["peak_bytes"]) > median(&memory["cache_bytes"]), "{memory}");
    }
}

#[test]
fn tables_are_markdown_for_a_results_page() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let line = small(folder.path());
    std::fs::write(folder.path().join("walk.toml"), WALK).unwrap();
    let line = line.replace(&format!("{}@main ", binary::CORNELL), "--camera-path walk.toml ");
    let text = stdout(folder.path(), &format!("{line} --runs 1"));
    let parts = [
        "**Machine** ",
        "**Load average** ",
        "- cornell_box: `",
        "ref.exr`, 48x36, ",
        "## First pictures",
        "## Error by wall clock",
    ];
    assert!(parts.iter().all(|part| text.contains(part)), "{text}");
    let parts = [
        "to a relMSE, between the runs",
        "## Where the time goes",
        "## Memory",
        "## Camera moves",
        "| walk.toml, 3 pictures |",
    ];
    assert!(parts.iter().all(|part| text.contains(part)), "{text}");
    let table: Vec<&str> = text.lines().filter(|line| line.starts_with('|')).collect();
    let columns = |line: &str| line.matches('|').count();
    assert!(
        table.len() > 20
            && table.windows(2).all(|two| !two[1].starts_with("| --") || columns(two[0]) == columns(two[1]))
    );
}

const WALK: &str = "[[key]]\ntime = 0\nposition = [278, 273, -800]\nlook_at = [278, 273, 0]\n\
    [[key]]\ntime = 1\nposition = [300, 273, -700]\nlook_at = [278, 273, 0]\n";

#[test]
fn what_cannot_be_clocked_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    stdout(folder.path(), "reference {cornell} --size 4x3 --filter point -q --spp 1 --direct-only -o ref.exr");
    let scene = format!("{}=ref.exr", binary::CORNELL);
    for (line, part) in [
        ("".to_owned(), "SCENE"),
        ("box.png".to_owned(), "expected SCENE"),
        ("none.toml".to_owned(), "none.toml: cannot read"),
        (format!("{}=none.exr", binary::CORNELL), "none.exr: cannot read"),
        (format!("{scene}@back"), "--camera back: the scene has main"),
        (format!("{scene} --times 0"), "--times"),
        (format!("{scene} --targets -1"), "--targets"),
        (format!("{scene} --runs 0"), "--runs"),
        (format!("{scene} --pictures 1"), "--pictures"),
        (format!("{scene} --plot ref.svg --plot no/p.svg"), "--plot"),
        (format!("{scene} --plot no/p.svg"), "the folder no does not exist"),
        ("{cornell} --plot p.svg".to_owned(), "no errors to draw"),
        (format!("{scene} {{cornell}} --camera-path walk.toml"), "--camera-path is of one scene"),
        (format!("{scene} --camera-path none.toml"), "none.toml: cannot read"),
    ] {
        let output = run(folder.path(), &format!("bench clock {line}"));
        assert_eq!(output.status.code(), Some(2), "{line}: {}", stderr(&output));
        assert!(stderr(&output).contains(part) && output.stdout.is_empty(), "{line}: {}", stderr(&output));
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "the reference");
}

#[cfg(unix)]
#[test]
fn a_signal_ends_it_with_its_runs_and_nothing_written() {
    use std::process::{Command, Stdio};
    use std::time::{Duration, Instant};
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let temporary = folder.path().join("temporary");
    std::fs::create_dir(&temporary).unwrap();
    let line = small(folder.path()).replace("--rays 40000", "--rays 1000000000000");
    let mut command = binary::penombre(folder.path(), &format!("{line} --plot plot.svg"));
    let child = command.env("TMPDIR", &temporary).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    // The run has begun when its log is there.
    let logs = || walk(&temporary).into_iter().filter(|path| path.ends_with("frames.csv")).count();
    let start = Instant::now();
    while logs() == 0 {
        assert!(start.elapsed() < Duration::from_secs(60), "no run begins");
        std::thread::sleep(Duration::from_millis(5));
    }
    assert_eq!(processes_that_name(&temporary), 1, "the run");
    assert!(Command::new("kill").args(["-s", "INT", &child.id().to_string()]).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130), "{}", stderr(&output));
    assert!(output.stdout.is_empty() && !folder.path().join("plot.svg").exists());
    assert_eq!(walk(&temporary), Vec::<std::path::PathBuf>::new());
    assert_eq!(processes_that_name(&temporary), 0, "its run would take for ever");
}

/// Processes whose command line has a path in it.
#[cfg(unix)]
fn processes_that_name(path: &Path) -> usize {
    let listed = std::process::Command::new("ps").args(["ax", "-o", "args"]).output().unwrap();
    let path = path.to_str().unwrap();
    String::from_utf8_lossy(&listed.stdout).lines().filter(|line| line.contains(path)).count()
}

/// All files below a folder.
#[cfg(unix)]
fn walk(folder: &Path) -> Vec<std::path::PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    entries.flat_map(|path| if path.is_dir() { walk(&path) } else { vec![path] }).collect()
}
