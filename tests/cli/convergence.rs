//! `penombre bench convergence` as a script uses it, each figure against a second way to it.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use crate::support::binary::{has_device, run, stderr};
use serde_json::Value;
use std::path::Path;

/// What a command prints that ends well and says nothing else.
pub fn stdout(folder: &Path, line: &str) -> String {
    let output = run(folder, line);
    assert_eq!((output.status.code(), stderr(&output)), (Some(0), String::new()), "{line}");
    String::from_utf8(output.stdout).unwrap()
}

pub fn json(folder: &Path, line: &str) -> Value {
    serde_json::from_str(&stdout(folder, line)).unwrap()
}

pub fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap_or_else(|| panic!("{key}: {value}"))
}

#[test]
fn both_curves_are_those_of_the_other_commands() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let size = "--size 96x72 --filter point -q";
    stdout(folder.path(), &format!("reference {{cornell}} {size} --pixels 2000 --spp 1024 --seed 1 -o ref.exr"));
    let line = "bench convergence {cornell} --reference ref.exr --time 0.4 --seed 7 --threads 2 -q";
    let found = json(folder.path(), &format!("{line} --json --plot plot.svg"));
    let engine = found["engine"]["points"].as_array().unwrap();
    let tracer = found["path_tracer"]["points"].as_array().unwrap();

    // The path tracer's second point is an image of two samples a pixel.
    stdout(folder.path(), &format!("reference {{cornell}} {size} --pixels 2000 --spp 2 --seed 7 -o two.exr"));
    let two = json(folder.path(), "diff two.exr ref.exr --json");
    let net = number(&two, "relmse") - number(&two, "own_relmse");
    assert!((number(&tracer[1], "relmse") / net - 1.0).abs() < 1e-5, "{} {net}", tracer[1]);
    assert_eq!(found["compared"], two["counted"]);
    assert!((number(&found, "own_relmse") / number(&two, "own_relmse") - 1.0).abs() < 1e-5);
    let a_pass = number(&found["path_tracer"], "cpu_seconds_a_pass");
    assert!((number(&tracer[1], "cpu_seconds") / (2.0 * a_pass) - 1.0).abs() < 1e-9);
    // How far either comes in the time depends on the machine: past the reference's noise nothing can be compared.
    let noise = number(&found, "own_relmse");
    let clears = |point: &&Value| number(point, "relmse") > 4.0 * noise;
    // Error times time is constant, or falls a little: samples are stratified.
    let product = |point: &Value| number(point, "relmse") * number(point, "cpu_seconds");
    let (first, last) = (product(&tracer[0]), product(tracer.iter().rfind(clears).unwrap()));
    assert!(tracer.len() > 4 && (0.2..1.5).contains(&(last / first)), "{first} {last}");

    // The last of the engine's points that stands clear of the reference's noise is near a run of as many rays.
    assert!(engine.windows(2).all(|pair| number(&pair[0], "cpu_seconds") < number(&pair[1], "cpu_seconds")));
    assert!(engine.iter().all(|point| point["flip"].is_null()), "a part of the pixels");
    let last = engine.last().unwrap();
    assert!(number(last, "cpu_seconds") >= 0.4 && number(last, "relmse") < 0.3 * number(&engine[0], "relmse"));
    let clear = engine.iter().rfind(clears).unwrap();
    let options = format!("--size 96x72 --no-filter --deterministic --seed 7 --rays {} -q -o image.exr", clear["rays"]);
    stdout(folder.path(), &format!("render {{cornell}} {options}"));
    let image = json(folder.path(), "diff image.exr ref.exr --json");
    let net = number(&image, "relmse") - number(&image, "own_relmse");
    // Each picture takes rounds on their way in, so that what comes next is chosen by other knowledge.
    assert!((0.4..2.5).contains(&(number(clear, "relmse") / net)), "{clear} {net}");

    for target in found["targets"].as_array().unwrap() {
        let (ours, theirs) = (&target["engine_cpu_seconds"], number(target, "path_tracer_cpu_seconds"));
        match ours.as_f64() {
            Some(ours) => assert!((number(target, "ratio") * ours / theirs - 1.0).abs() < 1e-9, "{target}"),
            None => assert!(target["ratio"].is_null()),
        }
    }
    let svg = std::fs::read_to_string(folder.path().join("plot.svg")).unwrap();
    // What is lost in the reference's noise has no logarithm.
    let drawn = engine.iter().chain(tracer).filter(|point| number(point, "relmse") > 0.0).count();
    assert_eq!(svg.matches("<circle").count(), drawn);
}

#[test]
fn runs_repeat_and_whole_references_have_flip() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    stdout(folder.path(), "reference {cornell} --size 48x36 --filter point -q --spp 64 --seed 1 -o ref.exr");
    let line = "bench convergence {cornell} --reference ref.exr --time 0.05 -q";
    let runs = [1, 2].map(|threads| json(folder.path(), &format!("{line} --json --threads {threads}")));
    let first = |run: &Value, key: &str| number(&run["engine"]["points"][0], key);
    for key in ["rays", "relmse", "rmse_over_mean", "flip", "estimated_error"] {
        assert_eq!(first(&runs[0], key).to_bits(), first(&runs[1], key).to_bits(), "{key}");
    }
    let text = stdout(folder.path(), line);
    let parts = ["without filter", "own relMSE", "estimated", "path tracer: ", "1e-2", "5e-3", "1e-3"];
    assert!(parts.iter().all(|part| text.contains(part)), "{text}");
}

#[test]
fn what_cannot_be_measured_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    stdout(folder.path(), "reference {cornell} --size 4x3 --filter point -q --spp 1 --direct-only -o ref.exr");
    for (line, part) in [
        ("{cornell} --reference none.exr", "none.exr: cannot read"),
        ("none.toml --reference ref.exr", "none.toml: cannot read"),
        ("{cornell} --reference ref.exr --camera back", "--camera back: the scene has main"),
        ("{cornell} --reference ref.exr --plot no/p.svg", "the folder no does not exist"),
        ("{cornell} --reference ref.exr --time 0", "--time"),
    ] {
        let output = run(folder.path(), &format!("bench convergence {line}"));
        assert_eq!(output.status.code(), Some(2), "{line}: {}", stderr(&output));
        assert!(stderr(&output).contains(part) && output.stdout.is_empty(), "{line}: {}", stderr(&output));
    }
}
