//! `penombre bench ablate`, and the switches behind it, as a script uses them.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use super::convergence::{json, number, stdout};
use crate::support::binary::{self, has_device, run, stderr};
use std::path::Path;

fn make_reference(folder: &Path) {
    stdout(folder, "reference {cornell} --size 48x36 --filter point -q --spp 256 --seed 1 -o ref.exr");
}

#[test]
fn pieces_are_measured_with_and_without() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    make_reference(folder.path());
    let scene = format!("{}=ref.exr", binary::CORNELL);
    let line = format!("bench ablate {scene} --pieces radiance-grid,filter,deferred --seeds 2 --rays 20000,60000 -q");
    let found = json(folder.path(), &format!("{line} --json"));
    let of_scene = &found["scenes"][0];
    assert_eq!(of_scene["tables"].as_array().unwrap().len(), 2);
    for (table, rays) in of_scene["tables"].as_array().unwrap().iter().zip([20_000, 60_000]) {
        let pieces = table["pieces"].as_array().unwrap();
        let [grid, filter, deferred] = [0, 1, 2].map(|i| &pieces[i]);
        // Whole paths are dearer, once the grid has learnt; the box has one light.
        let least = if rays == 20_000 { 0.9 } else { 1.2 };
        assert!(number(&grid["trimmed"], "median") > least, "{grid}");
        assert_eq!((number(&deferred["relmse"], "least"), number(&deferred["relmse"], "greatest")), (1.0, 1.0));
        assert_eq!((&filter["without"], &grid["with"]), (&table["with_all"]["runs"], &table["with_all"]["runs"]));
        assert_ne!(filter["with"], filter["without"]);
        for run in table["with_all"]["runs"].as_array().unwrap() {
            assert!((number(run, "rays") / f64::from(rays) - 1.0).abs() < 0.5, "{run}");
            assert!(number(run, "trimmed") < number(run, "relmse"), "{run}");
        }
    }

    let text = stdout(folder.path(), &format!("{line} --threads 1"));
    let grid = &of_scene["tables"][1]["pieces"][0]["relmse"];
    let ratios = ["median", "least", "greatest"].map(|key| format!("{:.3}", number(grid, key)));
    let parts = ["all pieces", "worst 1 % left out", "mean shift", "60000 rays", "filter "];
    assert!(parts.iter().all(|part| text.contains(part)), "{text}");
    let row = format!("  radiance-grid       {} ({} .. {})", ratios[0], ratios[1], ratios[2]);
    assert!(text.contains(&row), "{row}\n{text}");
}

#[test]
fn runs_are_those_of_bench_convergence() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    make_reference(folder.path());
    let curve =
        json(folder.path(), "bench convergence {cornell} --reference ref.exr --time 0.05 --json -q --without darks");
    let point = &curve["engine"]["points"][0];
    let line = format!("{}=ref.exr --rays {} --pieces darks --seeds 1 --json -q", binary::CORNELL, point["rays"]);
    let found = json(folder.path(), &format!("bench ablate {line}"));
    let table = &found["scenes"][0]["tables"][0];
    assert_eq!(table["pieces"][0]["without"][0]["relmse"], point["relmse"]);
    assert_ne!(table["with_all"]["runs"][0]["relmse"], point["relmse"]);
}

#[test]
fn a_picture_without_a_piece_is_another() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let render = |name: &str, options: &str| {
        let line = format!("render {{cornell}} --size 48x36 --rays 60000 --deterministic -q -o {name}.exr {options}");
        stdout(folder.path(), &line);
        json(folder.path(), &format!("diff {name}.exr with.exr --json"))
    };
    stdout(folder.path(), "render {cornell} --size 48x36 --rays 60000 --deterministic -q -o with.exr");
    assert_eq!(number(&render("again", ""), "rmse"), 0.0);
    for piece in ["radiance-grid", "filter", "pooled-variance", "checks", "darks"] {
        assert!(number(&render("without", &format!("--without {piece}")), "rmse") > 0.0, "{piece}");
    }
    // The box has one light.
    assert_eq!(number(&render("same", "--without deferred"), "rmse"), 0.0);
}

#[test]
fn what_cannot_be_measured_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    stdout(folder.path(), "reference {cornell} --size 4x3 --filter point -q --spp 1 --direct-only -o ref.exr");
    let scene = format!("{}=ref.exr", binary::CORNELL);
    for (line, part) in [
        ("render {cornell} -o a.exr --without nonsense".to_owned(), "invalid value 'nonsense'"),
        ("render {cornell} -o a.exr --without chekcs".to_owned(), "'checks'"),
        (format!("bench ablate {scene} --pieces nonsense"), "invalid value 'nonsense'"),
        (format!("bench ablate {}=none.exr", binary::CORNELL), "none.exr: cannot read"),
        ("bench ablate none.toml=ref.exr".to_owned(), "none.toml: cannot read"),
        (format!("bench ablate {scene}@back"), "--camera back: the scene has main"),
    ] {
        let output = run(folder.path(), &line);
        assert_eq!(output.status.code(), Some(2), "{line}: {}", stderr(&output));
        assert!(stderr(&output).contains(part) && output.stdout.is_empty(), "{line}: {}", stderr(&output));
    }
}
