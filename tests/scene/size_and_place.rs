//! Scenes far from the origin, on huge grounds, with tiny things: the same picture wherever and however large they are.

#![allow(clippy::expect_used, reason = "a test may end where its files cannot be written")]

use crate::support::binary::{has_device, run, stderr};
use penombre::image::exr::{RgbImage, read_rgb};
use std::fmt::Write as _;
use std::path::Path;

/// A hut of 4 m with a door on a ground of half the width `ground`, moved and scaled, as an exporter prints it.
fn hut(at: [f64; 3], unit: f64, ground: f64) -> String {
    let mut text = String::from("mtllib hut.mtl\n");
    let mut vertex = |x: f64, y: f64, z: f64| {
        let [x, y, z] = [(x, at[0]), (y, at[1]), (z, at[2])].map(|(p, offset)| (p + offset) * unit);
        let _ = writeln!(text, "v {x:.6} {y:.6} {z:.6}");
    };
    for y in [0.0, 3.0] {
        [(-2.0, -2.0), (2.0, -2.0), (2.0, 2.0), (-2.0, 2.0)].iter().for_each(|&(x, z)| vertex(x, y, z));
    }
    [(0.0, 4.5, -2.0), (0.0, 4.5, 2.0)].iter().for_each(|&(x, y, z)| vertex(x, y, z));
    [(-0.5, 0.0), (0.5, 0.0), (0.5, 2.1), (-0.5, 2.1)].iter().for_each(|&(x, y)| vertex(x, y, 2.02));
    [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].iter().for_each(|&(x, z)| vertex(x * ground, 0.0, z * ground));
    text + "usemtl walls\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\nf 8 7 10\nf 5 9 6\nusemtl roof\nf 5 8 10 9\nf 6 9 10 7\n\
            usemtl door\nf 11 12 13 14\nusemtl ground\nf 15 18 17 16\n"
}

const MTL: &str = "newmtl walls\nKd 0.7 0.65 0.5\nnewmtl roof\nKd 0.6 0.2 0.1\nnewmtl door\nKd 0.1 0.2 0.5\n\
                   newmtl ground\nKd 0.3 0.5 0.15\n";

/// A scene file whose camera, `distance` from `at`, looks down on it.
fn scene(at: [f64; 3], unit: f64, eye: [f64; 3], target: [f64; 3]) -> String {
    let place = |p: [f64; 3]| [0, 1, 2].map(|i| (p[i] + at[i]) * unit);
    format!(
        "[geometry]\nobj = [\"m.obj\"]\n[[camera]]\nposition = {:?}\nlook_at = {:?}\nvertical_fov = 50\n\
         [[light]]\nkind = \"directional\"\ndirection = [-0.5, -1, -0.6]\nirradiance = [3, 3, 2.8]\n",
        place(eye),
        place(target)
    )
}

/// The picture of an OBJ, by options, and what the program said.
fn picture_of(options: &str, obj: &str, scene: &str) -> (RgbImage, String) {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, text) in [("hut.mtl", MTL), ("m.obj", obj), ("s.toml", scene)] {
        std::fs::write(folder.path().join(name), text).expect("a file");
    }
    let output = run(folder.path(), &format!("render s.toml {options} --deterministic -o o.exr"));
    let said = stderr(&output);
    assert_eq!(output.status.code(), Some(0), "{said}");
    assert!(!said.contains("VUID"), "{said}");
    (read_rgb(&folder.path().join("o.exr")).expect("a picture"), said)
}

fn picture(obj: &str, scene: &str) -> (RgbImage, String) {
    picture_of("--size 96x72 --rays 400000", obj, scene)
}

fn mean(image: &RgbImage) -> f32 {
    image.rgb.iter().map(|c| c.element_sum()).sum::<f32>() / image.rgb.len() as f32
}

/// Mean difference of the pixels, against the mean of the first.
fn difference(a: &RgbImage, b: &RgbImage) -> f32 {
    let sum: f32 = a.rgb.iter().zip(&b.rgb).map(|(p, q)| (*p - *q).abs().element_sum()).sum();
    sum / a.rgb.len() as f32 / mean(a)
}

const EYE: [f64; 3] = [6.0, 4.0, 10.0];
const TARGET: [f64; 3] = [0.0, 1.0, 0.0];

#[test]
fn a_hut_far_from_the_origin_is_the_hut_at_the_origin() {
    if !has_device() {
        return;
    }
    let (near, said) = picture(&hut([0.0; 3], 1.0, 10.0), &scene([0.0; 3], 1.0, EYE, TARGET));
    assert!(!said.contains("origin"), "{said}");
    for (at, unit) in [
        ([1.0, 0.0, -1.0], 1.0),
        ([1e3, 10.0, -1e3], 1.0),
        ([1e6, 10.0, -1e6], 1.0),
        ([412_345.25, 35.0, -5_412_345.75], 1.0),
        ([412_345.25, 35.0, -5_412_345.75], 1e3),
    ] {
        let (far, said) = picture(&hut(at, unit, 10.0), &scene(at, unit, EYE, TARGET));
        assert_eq!(said.contains("is moved so that"), at[0] > 1.0, "{said}");
        let difference = difference(&near, &far);
        println!("{at:?} times {unit}: {difference}");
        assert!(difference < 0.01, "{at:?} times {unit}: {difference}");
    }
}

#[test]
fn a_hut_stands_on_a_ground_of_any_size() {
    if !has_device() {
        return;
    }
    // What light the ground sends the hut from beyond 300 m is little.
    let down = ([0.5, 8.0, 6.0], [0.0, 0.0, 0.5]);
    // A larger ground takes more splits to get to the hut.
    let picture = |ground| {
        let scene = scene([0.0; 3], 1.0, down.0, down.1);
        picture_of("--size 96x72 --rays 1500000", &hut([0.0; 3], 1.0, ground), &scene).0
    };
    let small = picture(300.0);
    for ground in [2e4, 1e5, 1e6] {
        let large = picture(ground);
        let difference = difference(&small, &large);
        println!("{ground}: {difference}");
        assert!(difference < 0.01, "{ground}: {difference}");
    }
}

/// Cubes of 8 mm on a triangle of 1 km, or on one of 2 m.
fn bolts(at: [f64; 3], half: f64) -> String {
    let mut text = String::from("mtllib hut.mtl\n");
    let mut vertex = |x: f64, y: f64, z: f64| {
        let _ = writeln!(text, "v {:.6} {:.6} {:.6}", x + at[0], y + at[1], z + at[2]);
    };
    [(-half, -half), (0.0, 1.8 * half), (half, -half)].iter().for_each(|&(x, z)| vertex(x, 0.0, z));
    let places: Vec<(f64, f64)> = (0..16).map(|i| (f64::from(i % 4), f64::from(i / 4))).collect();
    for &(x, z) in &places {
        let (x, z) = (x * 0.03 - 0.045, z * 0.03 - 0.045);
        for y in [0.0, 0.008] {
            [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
                .iter()
                .for_each(|&(dx, dz)| vertex(x + dx * 0.004, y, z + dz * 0.004));
        }
    }
    text.push_str("usemtl ground\nf 1 2 3\nusemtl roof\n");
    for k in 0..places.len() {
        let v = |i: usize| 4 + 8 * k + i;
        for face in [[0, 4, 5, 1], [1, 5, 6, 2], [2, 6, 7, 3], [3, 7, 4, 0], [4, 7, 6, 5]] {
            let [a, b, c, d] = face.map(v);
            let _ = writeln!(text, "f {a} {b} {c} {d}");
        }
    }
    text
}

#[test]
fn bolts_on_a_triangle_of_a_kilometre_cast_their_shadows() {
    if !has_device() {
        return;
    }
    let (eye, target) = ([0.1, 0.14, -0.2], [0.0, 0.0, 0.0]);
    // Of some pixels each: shadows of two or three are found late beside what casts them, on any ground.
    let picture =
        |half, at| picture_of("--size 256x192 --rays 400000", &bolts(at, half), &scene(at, 1.0, eye, target)).0;
    let small = picture(2.0, [0.0; 3]);
    for at in [0.0, 1.0, 1e3, 1e6] {
        let at = [at, 0.0, -at];
        let large = picture(500.0, at);
        let difference = difference(&small, &large);
        println!("{at:?}: {difference}");
        assert!(difference < 0.01, "{at:?}: {difference}");
    }
}

#[test]
fn the_origin_is_in_the_summary_and_camera_paths_are_in_file_coordinates() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let at = [412_345.25, 35.0, -5_412_345.75];
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("a file");
    write("hut.mtl", MTL);
    write("m.obj", &hut(at, 1.0, 10.0));
    write("s.toml", &scene(at, 1.0, EYE, TARGET));
    let place = |p: [f64; 3]| [0, 1, 2].map(|i| p[i] + at[i]);
    write("path.toml", &format!("[[key]]\ntime = 0\nposition = {:?}\nlook_at = {:?}\n", place(EYE), place(TARGET)));
    let line = "render s.toml --size 48x36 --rays 20000 --deterministic";
    let still = run(folder.path(), &format!("{line} -o still.exr --log l.csv"));
    assert_eq!(still.status.code(), Some(0), "{}", stderr(&still));
    let path = run(folder.path(), &format!("{line} -o path_#.exr --camera-path path.toml --frames 1"));
    assert_eq!(path.status.code(), Some(0), "{}", stderr(&path));
    let image = |name: &str| read_rgb(&folder.path().join(name)).expect("a picture");
    assert!(difference(&image("still.exr"), &image("path_1.exr")) < 0.02);
    let moved = origin(&folder.path().join("l.json"));
    assert!((0..3).all(|i| (moved[i] - at[i]).abs() <= 10.0 && moved[i] % 10.0 == 0.0), "{moved:?}");
}

fn origin(summary: &Path) -> [f64; 3] {
    let text = std::fs::read_to_string(summary).expect("a summary");
    let json: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    [0, 1, 2].map(|i| json["origin"][i].as_f64().expect("a number"))
}
