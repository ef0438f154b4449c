//! `penombre diff` as a script uses it: values computed by hand, limits and exit statuses, masks, broken inputs.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use glam::{Vec3, Vec4};
use penombre::image::exr::{Provenance, ReferenceLayers, write_reference};
use penombre::image::png;
use penombre::scene::camera::ImageSize;
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};

const SIZE: ImageSize = ImageSize { width: 2, height: 1 };

fn diff(folder: &Path, line: &str) -> Output {
    let words = line.split_whitespace();
    let output = Command::new(env!("CARGO_BIN_EXE_penombre")).arg("diff").args(words).current_dir(folder).output();
    output.unwrap_or_else(|e| panic!("{line}: {e}"))
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn json(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).unwrap_or_else(|e| panic!("{e}: {}", stderr(output)))
}

fn write_exr(path: &Path, size: ImageSize, rgb: &[Vec3], variance: f32, mask: Option<&[bool]>) {
    let mean: Vec<Vec4> = rgb.iter().map(|c| c.extend(1.0)).collect();
    let variance = vec![Vec3::splat(variance); rgb.len()];
    let layers = ReferenceLayers { size, mean: &mean, variance: &variance, mask, sampled: None };
    write_reference(path, &layers, &Provenance::default()).unwrap();
}

/// a.exr: the image; b.exr: the reference; m.exr: the same reference with its second pixel masked.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    write_exr(&at("a.exr"), SIZE, &[Vec3::new(1.5, 2.0, 2.0), Vec3::new(0.1, 0.0, 0.0)], 0.0, None);
    let reference = [Vec3::new(1.0, 2.0, 3.0), Vec3::ZERO];
    write_exr(&at("b.exr"), SIZE, &reference, 0.01, None);
    write_exr(&at("m.exr"), SIZE, &reference, 0.01, Some(&[true, false]));
    png::write_bytes(&at("half.png"), SIZE, &[255, 255, 255, 0, 0, 0]).unwrap();
    png::write_bytes(&at("black.png"), SIZE, &[0; 6]).unwrap();
    png::write_bytes(&at("grey.png"), SIZE, &[188; 6]).unwrap();
    folder
}

fn close(value: &Value, expected: f64) {
    let value = value.as_f64().unwrap_or_else(|| panic!("{value} is no number"));
    assert!((value - expected).abs() < 1e-6 * expected.abs().max(1.0), "{value} is not {expected}");
}

#[test]
fn the_json_holds_every_measure() {
    let folder = folder();
    let output = diff(folder.path(), "a.exr b.exr --json");
    assert_eq!((output.status.code(), stderr(&output)), (Some(0), String::new()));
    let json = json(&output);
    // Mean 1, so ε = 0.01; squares 0.25, 0, 1, 0.01, 0, 0.
    close(&json["rmse"], (1.26_f64 / 6.0).sqrt());
    close(&json["rmse_over_mean"], (1.26_f64 / 6.0).sqrt());
    close(&json["relmse"], (0.25 / 1.01 + 1.0 / 9.01 + 1.0) / 6.0);
    close(&json["relmse_epsilon"], 0.01);
    close(&json["own_relmse"], 0.01 * (1.0 / 1.01 + 1.0 / 4.01 + 1.0 / 9.01 + 3.0 / 0.01) / 6.0);
    close(&json["max"], 1.0);
    close(&json["mean_shift"], -0.4 / 6.0);
    close(&json["reference_mean"], 1.0);
    // z = 5, 0, −10, 1, 0, 0.
    close(&json["z"]["share_beyond_3"], 2.0 / 6.0);
    close(&json["z"]["values"], 6.0);
    let flip = json["flip"].as_f64().unwrap();
    assert!(flip > 0.0 && flip < 1.0, "{flip}");
    // Mean luminance (0.2126 + 2·0.7152 + 3·0.0722)/2 becomes 0.18.
    close(&json["shown"]["exposure"], (0.18_f64 / 0.9298).log2());
    assert_eq!(json["shown"]["tone_mapping"], "aces");
    assert_eq!((&json["counted"], &json["masked"], &json["not_finite"]), (&2.into(), &0.into(), &0.into()));
    assert_eq!(json["size"], serde_json::json!([2, 1]));
    assert_eq!((&json["image"], &json["reference"]), (&"a.exr".into(), &"b.exr".into()));
    assert_eq!((&json["masks"], &json["exceeded"]), (&serde_json::json!([]), &serde_json::json!([])));

    let absolute = self::json(&diff(folder.path(), "a.exr b.exr --json --epsilon-absolute 0.1 --exposure 1"));
    close(&absolute["relmse"], (0.25 / 1.1 + 1.0 / 9.1 + 0.01 / 0.1) / 6.0);
    close(&absolute["shown"]["exposure"], 1.0);
}

#[test]
fn limits_decide_the_exit_status_and_are_named() {
    let folder = folder();
    let within = diff(folder.path(), "a.exr b.exr --max-rmse 0.5 --max-relmse 0.3 --max-flip 1 --max-mean-shift 0.07");
    assert_eq!((within.status.code(), stderr(&within)), (Some(0), String::new()));
    for (limit, name) in
        [("rmse 0.4", "rmse"), ("relmse 0.2", "relmse"), ("flip 0", "flip"), ("mean-shift 0.06", "mean_shift")]
    {
        let output = diff(folder.path(), &format!("a.exr b.exr --json --max-{limit}"));
        assert_eq!(output.status.code(), Some(1), "{limit}");
        assert_eq!(json(&output)["exceeded"], serde_json::json!([name]));
        assert!(stderr(&output).starts_with(&format!("--max-{limit} is exceeded: ")), "{}", stderr(&output));
    }
}

#[test]
fn an_image_does_not_differ_from_itself() {
    let folder = folder();
    for name in ["b.exr", "m.exr", "grey.png"] {
        let limits = "--max-rmse 0 --max-relmse 0 --max-flip 0 --max-mean-shift 0";
        let output = diff(folder.path(), &format!("{name} {name} {limits}"));
        assert_eq!((output.status.code(), stderr(&output)), (Some(0), String::new()), "{name}");
    }
}

#[test]
fn masks_leave_pixels_out_and_are_said() {
    let folder = folder();
    for line in ["a.exr m.exr", "a.exr b.exr --mask half.png", "a.exr m.exr --mask half.png"] {
        let json = json(&diff(folder.path(), &format!("{line} --json")));
        close(&json["reference_mean"], 2.0);
        close(&json["relmse"], (0.25 / 1.04 + 1.0 / 9.04) / 3.0);
        assert_eq!((&json["counted"], &json["masked"]), (&1.into(), &1.into()), "{line}");
        let text = String::from_utf8(diff(folder.path(), line).stdout).unwrap();
        assert!(text.contains("1 compared, 1 masked ("), "{text}");
    }
    let nothing = diff(folder.path(), "a.exr b.exr --mask black.png");
    assert_eq!(nothing.status.code(), Some(2));
    assert!(stderr(&nothing).contains("no pixel is left"), "{}", stderr(&nothing));
}

/// A pixel that one of the images has no value of is compared nowhere, and never counted as masked.
#[test]
fn pixels_that_were_not_sampled_are_left_out() {
    let folder = folder();
    let mean = [Vec4::new(1.0, 2.0, 3.0, 1.0), Vec4::ZERO];
    let layers = ReferenceLayers {
        size: SIZE,
        mean: &mean,
        variance: &[Vec3::splat(0.01); 2],
        mask: Some(&[true, false]),
        sampled: Some(&[true, false]),
    };
    write_reference(&folder.path().join("part.exr"), &layers, &Provenance::default()).unwrap();
    for line in ["a.exr part.exr", "a.exr part.exr --mask half.png"] {
        let json = json(&diff(folder.path(), &format!("{line} --json")));
        close(&json["reference_mean"], 2.0);
        close(&json["relmse"], (0.25 / 1.04 + 1.0 / 9.04) / 3.0);
        close(&json["own_relmse"], 0.01 * (1.0 / 1.04 + 1.0 / 4.04 + 1.0 / 9.04) / 3.0);
        assert_eq!((&json["counted"], &json["masked"], &json["not_sampled"]), (&1.into(), &0.into(), &1.into()));
        assert!(json["flip"].is_null(), "{}", json["flip"]);
        let text = String::from_utf8(diff(folder.path(), line).stdout).unwrap();
        assert!(text.contains("1 compared, 0 masked (") && text.contains("), 1 not sampled"), "{text}");
    }
    let other_way = json(&diff(folder.path(), "part.exr b.exr --json"));
    assert_eq!((&other_way["counted"], &other_way["not_sampled"]), (&1.into(), &1.into()));
    let limit = diff(folder.path(), "a.exr part.exr --max-flip 1");
    assert_eq!(limit.status.code(), Some(2));
    assert!(stderr(&limit).contains("--max-flip"), "{}", stderr(&limit));
}

#[test]
fn png_images_are_compared_as_displayed() {
    let folder = folder();
    let json = json(&diff(folder.path(), "grey.png half.png --json"));
    // sRGB code 188 is 0.5029 of full light.
    close(&json["mean_shift"], 0.502_886_5 - 0.5);
    assert!(json["shown"].is_null() && json["z"].is_null() && json["own_relmse"].is_null());
}

#[test]
fn the_error_picture_is_red_where_too_bright_and_grey_where_masked() {
    let folder = folder();
    let bright = [Vec3::splat(9.0), Vec3::ONE];
    write_exr(&folder.path().join("bright.exr"), SIZE, &bright, 0.0, None);
    let output = diff(folder.path(), "bright.exr m.exr -o errors.png");
    assert_eq!((output.status.code(), stderr(&output)), (Some(0), String::new()));
    let (size, pixels) = png::read(&folder.path().join("errors.png")).unwrap();
    assert_eq!((size, pixels), (SIZE, vec![[103, 0, 31], [64; 3]]));
}

#[test]
fn values_that_are_no_numbers_fail_a_limit() {
    let folder = folder();
    let bad = [Vec3::new(1.0, 2.0, 3.0), Vec3::new(0.0, f32::NAN, 0.0)];
    write_exr(&folder.path().join("nan.exr"), SIZE, &bad, 0.0, None);
    let output = diff(folder.path(), "nan.exr b.exr --max-rmse 1");
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("NaN or infinite in one of the images: 1 pixels"), "{}", stderr(&output));
}

#[test]
fn inputs_that_cannot_be_compared_are_refused() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    write_exr(&at("wide.exr"), ImageSize { width: 3, height: 1 }, &[Vec3::ONE; 3], 0.0, None);
    let whole = std::fs::read(at("a.exr")).unwrap();
    std::fs::write(at("cut.exr"), &whole[..whole.len() / 2]).unwrap();
    let whole = std::fs::read(at("grey.png")).unwrap();
    std::fs::write(at("cut.png"), &whole[..whole.len() / 2]).unwrap();
    std::fs::write(at("text.png"), "no image").unwrap();
    for (line, parts) in [
        ("wide.exr b.exr", &["wide.exr is 3x1", "b.exr is 2x1"][..]),
        ("a.exr grey.png", &["two of a kind"]),
        ("a.exr b.exr --mask cut.png", &["cut.png: error: cannot be read"]),
        ("cut.exr b.exr", &["cut.exr"]),
        ("cut.png grey.png", &["cut.png: error: cannot be read"]),
        ("text.png grey.png", &["text.png: error: cannot be read"]),
        ("none.exr b.exr", &["none.exr: cannot read"]),
        ("none.png grey.png", &["none.png: cannot read"]),
        ("grey.png grey.png --exposure 1", &["--exposure"]),
        ("grey.png grey.png -o grey.png", &["both an input and the output"]),
        ("a.exr b.exr -o no/errors.png", &["folder", "does not exist"]),
        ("a.exr b.exr --max-rmse -1", &["0 or more"]),
        ("a.jpg b.exr", &[".exr"]),
    ] {
        let output = diff(folder.path(), line);
        assert_eq!(output.status.code(), Some(2), "{line}: {}", stderr(&output));
        assert!(output.stdout.is_empty());
        assert!(parts.iter().all(|part| stderr(&output).contains(part)), "{line}: {}", stderr(&output));
    }
}
