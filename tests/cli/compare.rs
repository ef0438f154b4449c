//! `penombre compare` as a user runs it, with the validation layers listening: the figures that the update modes must keep, the
//! files, and how it ends.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use crate::support::binary::{has_device, penombre, stderr};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::thread::sleep;
use std::time::Duration;

/// The binary on the Cornell box at a small size, `options` separated by blanks.
fn compare(folder: &Path, options: &str) -> Command {
    let mut command = penombre(folder, "compare {cornell} --threads 1");
    if !options.contains("--size") {
        command.args(["--size", "256x192"]);
    }
    if !options.contains("--out") {
        command.args(["--out", "report"]);
    }
    command.args(options.split_whitespace());
    command
}

fn run(folder: &Path, options: &str) -> Output {
    compare(folder, options).output().unwrap_or_else(|e| panic!("{options}: {e}"))
}

fn report(folder: &Path) -> Value {
    serde_json::from_slice(&fs::read(folder.join("report/report.json")).unwrap()).unwrap()
}

fn number(row: &Value, field: &str) -> f64 {
    row[field].as_f64().unwrap_or_else(|| panic!("{field} of {row}"))
}

/// The largest figure of a mode on a depth format, over all tilts.
fn worst(report: &Value, mode: &str, depth: &str, field: &str) -> f64 {
    let rows: Vec<&Value> = report["modes"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|r| r["mode"] == mode && r["depth_format"] == depth)
        .collect();
    assert_eq!(rows.len(), 3, "{mode} {depth}: a row a tilt");
    assert!(rows.iter().all(|row| number(row, "updated_pixels") > 100_000.0), "there is something to update");
    rows.iter().map(|row| number(row, field)).fold(0.0, f64::max)
}

#[test]
fn modes_keep_their_figures() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let output = run(folder.path(), "--updates 12 --runs 0 --depth-formats d32s8,d24s8 -q");
    assert_eq!((output.status.code(), stderr(&output)), (Some(0), String::new()));
    let report = report(folder.path());
    for depth in ["d32s8", "d24s8"] {
        let figure = |mode, field| {
            let figure = worst(&report, mode, depth, field);
            println!("{depth} {mode}: {field} {figure:.2e}");
            figure
        };
        // Measured: 13 and 20 % on D32; on D24, whose steps swallow a part of the differences, 7 and 11 %.
        let resolved = if depth == "d32s8" { 0.1 } else { 0.04 };
        assert!(figure("depth-less-equal", "missed_fraction") > resolved);
        assert!(figure("depth-equal", "missed_fraction") > 1.5 * resolved);
        assert!(figure("depth-equal", "stale_fraction") > resolved && figure("depth-equal", "flip") > 0.01);
        // The only mode that a device may lack.
        let exports = report["modes"].as_array().unwrap().iter().any(|row| row["mode"] == "stencil-export");
        for mode in [Some("stencil"), exports.then_some("stencil-export")].into_iter().flatten() {
            assert!(figure(mode, "missed_fraction") <= 5e-5 && figure(mode, "foreign_fraction") <= 2e-5);
        }
        assert!(figure("id", "missed_fraction") <= 5e-5 && figure("id", "foreign_fraction") == 0.0);
        assert!(figure("depth-bias", "missed_fraction") <= 5e-5);
        assert_eq!(figure("lookup", "missed_fraction") + figure("lookup", "foreign_fraction"), 0.0);
        let rows = report["modes"].as_array().unwrap().iter();
        let lookup = rows.filter(|r| r["mode"] == "lookup" && r["depth_format"] == depth);
        assert!(lookup.map(|row| number(row, "close_fraction")).all(|close| close >= 0.999), "within 1e-3 of full");
        for field in ["missed_fraction", "foreign_fraction", "stale_fraction", "max_error", "flip"] {
            assert_eq!(figure("full", field), 0.0, "the truth against itself");
        }
    }
}

#[test]
fn the_report_is_complete() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let options = "--updates 4 --every 3 --runs 2 --patches 5,40 --tilts oblique --modes id,depth-equal \
        --depth-formats d16,d32s8 --depth ordinary --direct-only";
    let output = run(folder.path(), options);
    let said = stderr(&output);
    assert_eq!(output.status.code(), Some(0), "{said}");
    assert!(said.lines().count() == 1 && said.contains("id 0") && said.contains("cheapest"), "{said}");
    let out = folder.path().join("report");
    let report = report(folder.path());
    let rows = report["modes"].as_array().unwrap();
    assert_eq!(rows.len(), 4);
    for row in rows {
        for field in [
            "frames",
            "updates",
            "updated_pixels",
            "missed_pixels",
            "foreign_pixels",
            "double_pixels",
            "missed_fraction",
            "max_error",
            "mean_error",
            "luminance_ms_median",
            "draws",
            "queries",
        ] {
            assert!(row[field].is_number(), "{field}");
        }
        assert!(row["depth_order"] == "ordinary" && row["tilt"] == "oblique" && row["updates"] == 4);
        // After the third update and the last.
        assert_eq!(
            row["steps"].as_array().unwrap().iter().map(|s| s["update"].as_u64()).collect::<Vec<_>>(),
            [Some(3), Some(4)]
        );
        let name =
            format!("oblique_{}-ordinary_{}", row["depth_format"].as_str().unwrap(), row["mode"].as_str().unwrap());
        for file in [format!("{name}.png"), format!("{name}_mask.png")] {
            let (size, _) = penombre::image::png::read(&out.join(file)).unwrap();
            assert_eq!((size.width, size.height), (256, 192));
        }
    }
    let costs = report["costs"].as_array().unwrap();
    assert_eq!(costs.len(), 4, "two modes, two numbers of patches");
    assert!(costs.iter().all(|row| number(row, "cpu_ms") > 0.0 && row["draws"] == 1));
    assert!(report["device"]["name"].is_string() && report["command"].is_array());
    let page = fs::read_to_string(out.join("report.html")).unwrap();
    assert!(page.contains("<svg") && page.contains("data:image/png;base64,") && !page.contains("http"));
    assert_eq!(fs::read_to_string(out.join("artefacts.csv")).unwrap().lines().count(), 5);
    assert_eq!(fs::read_to_string(out.join("cost.csv")).unwrap().lines().count(), 5);
}

#[test]
fn limits_and_refusals_have_their_statuses() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let small = "--updates 6 --runs 0 --tilts grazing --depth-formats d32s8 -q";
    let over = run(folder.path(), &format!("{small} --modes depth-equal --max-missed 0.01"));
    assert_eq!(over.status.code(), Some(1));
    assert!(stderr(&over).contains("depth-equal, d32s8, grazing: --max-missed 0.01 exceeded"), "{}", stderr(&over));
    let under = run(folder.path(), &format!("{small} --modes id --max-missed 0.01 --max-foreign 0 --max-error 0.01"));
    assert_eq!((under.status.code(), stderr(&under)), (Some(0), String::new()));
    let stencilless = run(folder.path(), "--modes stencil --depth-formats d16 -q");
    assert_eq!(stencilless.status.code(), Some(2));
    assert!(stderr(&stencilless).contains("d32s8 or d24s8"), "{}", stderr(&stencilless));
    let huge = run(folder.path(), "--size 16000x16000 --updates 1000");
    assert!(huge.status.code() == Some(2) && stderr(&huge).contains("--every"), "{}", stderr(&huge));
    fs::write(folder.path().join("file"), "").unwrap();
    let blocked = run(folder.path(), "--out file/report");
    assert_eq!(blocked.status.code(), Some(2), "{}", stderr(&blocked));
}

#[cfg(unix)]
#[test]
fn an_interrupted_run_writes_what_it_has() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let child = compare(folder.path(), "--updates 1000 --rays 100").stderr(Stdio::piped()).spawn().unwrap();
    sleep(Duration::from_secs(4));
    let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(sent.success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130), "{}", stderr(&output));
    assert_eq!(report(folder.path())["interrupted"], true);
    assert!(fs::read_to_string(folder.path().join("report/report.html")).unwrap().contains("interrupted"));
}
