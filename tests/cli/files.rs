//! The binary as a user drives it: files, statuses and messages, with the validation layers listening.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use crate::support::binary::{has_device, penombre, run, stderr};
use exr::prelude::{FlatSamples, read_all_flat_layers_from_file};
use glam::{Vec2, Vec3};
use penombre::scene::camera::ImageSize;
use penombre::scene::footprint::Footprint;
use penombre::scene::{FaceId, load};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// A run that ends well and has nothing to say.
fn run_well(folder: &Path, line: &str) {
    let output = run(folder, line);
    assert_eq!((output.status.code(), stderr(&output)), (Some(0), String::new()), "{line}");
    assert!(output.stdout.is_empty(), "{}", String::from_utf8_lossy(&output.stdout));
}

/// Every channel of an EXR file by its name.
fn channels(path: &Path) -> BTreeMap<String, FlatSamples> {
    let image = read_all_flat_layers_from_file(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    assert_eq!(image.layer_data.len(), 1);
    let list = image.layer_data.into_iter().flat_map(|layer| layer.channel_data.list);
    list.map(|channel| (channel.name.to_string(), channel.sample_data)).collect()
}

fn values(samples: &FlatSamples) -> Vec<f32> {
    samples.values_as_f32().collect()
}

#[test]
fn wrong_input_is_named_with_status_2_and_leaves_nothing_behind() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("place")).unwrap();
    for (line, part) in [
        ("render none.toml -o a.png", "none.toml: cannot read"),
        ("render none.obj -o a.png", "none.obj: cannot read"),
        ("render place -o a.png", "place: error: is a directory"),
        ("render {cornell} -o a.png --camera back", "--camera back: the scene has main"),
        ("render {cornell} -o no/a.png", "the folder no does not exist"),
        ("render {cornell} -o place/.png", ".png"),
        ("render {cornell} -o a.png -o a.png", "named twice"),
        ("render {cornell} -o a.png --log no/l.csv", "the folder no does not exist"),
        ("render {cornell} -o a.png --log l.csv --reference none.exr", "none.exr: cannot read"),
        ("render {cornell} -o a.png --size 0x3", "WIDTHxHEIGHT"),
        ("render {cornell} -o a.png --frams 3", "--frames"),
        ("render {cornell} -o a.png --camera-path none.toml", "none.toml: cannot read"),
        ("render {cornell} -o a.png --camera-path p.toml --log l.csv --reference r.exr", "cannot be used with"),
        ("render {cornell} -o no/a.png --camera-path p.toml", "the folder no does not exist"),
        ("render {cornell} -o a.png --hemisphere even", "stratified, adaptive, paper"),
        ("render {cornell} -o a.png --hemisphere paper --direct-only", "--direct-only"),
        ("bench", "scenes/cornell_box/cornell_box.toml is not here"),
        ("bench {cornell} --camera back", "--camera back: the scene has main"),
        ("bench {cornell} --threads 0", "--threads"),
        ("reference {cornell} -o a.exr --size 8x8 --pixels 65", "--pixels 65: the image has 64"),
        ("reference {cornell} -o a.exr --pixels 0", "--pixels"),
        ("reference none.toml -o a.exr --direct-only", "none.toml: cannot read"),
        ("reference {cornell} -o a.exr --direct-only --camera back", "--camera back: the scene has main"),
    ] {
        let output = run(folder.path(), line);
        assert_eq!(output.status.code(), Some(2), "{line}: {}", stderr(&output));
        assert!(stderr(&output).contains(part), "{line}: {}", stderr(&output));
        assert!(output.stdout.is_empty(), "{line}");
    }
    let left: Vec<_> = std::fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(left, ["place"]);
}

#[test]
fn a_scene_with_ten_faults_lists_ten() {
    let folder = tempfile::tempdir().unwrap();
    let text = "[geometry]\nobj = [\"none.obj\"]\nemitt = \"front\"\n[[camera]]\nname = \"main\"\nposition = [0, 0]\n\
        look_at = \"x\"\nvertical_fov = 270\n[[light]]\nkind = \"laser\"\n[[light]]\nkind = \"point\"\n\
        position = [0, 0, 0]\nintensity = [1, nan, 1]\n[display]\nexposure = \"bright\"\ntone_mapping = \"film\"\n\
        [[lamp]]\nkind = \"point\"\n";
    std::fs::write(folder.path().join("faults.toml"), text).unwrap();
    let output = run(folder.path(), "render faults.toml -o a.png");
    assert_eq!(output.status.code(), Some(2));
    let said = stderr(&output);
    let mut found: Vec<&str> = said.lines().filter_map(|l| l.strip_prefix("faults.toml:")?.split(':').next()).collect();
    found.sort_unstable_by_key(|line| line.parse::<u32>().unwrap());
    assert_eq!(found, ["2", "3", "6", "7", "8", "10", "14", "16", "17", "18"], "{said}");
    assert_eq!(said.lines().count(), 10, "{said}");
}

#[test]
fn a_render_writes_everything_that_was_asked_for() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    run_well(folder.path(), "render {cornell} --size 64x48 --frames 3 -o a.exr -o a.png --log l.csv -q");
    let channels = channels(&at("a.exr"));
    let names: Vec<&str> = channels.keys().map(String::as_str).collect();
    #[rustfmt::skip]
    let expected = [
        "A", "B", "D.B", "D.G", "D.R", "G", "Le.B", "Le.G", "Le.R", "R", "S.B", "S.G", "S.R", "face.id", "kd.B",
        "kd.G", "kd.R", "ks.B", "ks.G", "ks.R", "level",
    ];
    assert_eq!(names, expected);
    for (name, samples) in &channels {
        let is_right = match name.as_str() {
            "face.id" | "level" => matches!(samples, FlatSamples::U32(_)),
            _ => matches!(samples, FlatSamples::F16(_)),
        };
        assert!(is_right, "{name}");
        assert_eq!(samples.len(), 64 * 48);
    }
    let covered = values(&channels["A"]).iter().filter(|&&a| a == 1.0).count();
    assert!(covered > 64 * 48 / 3 && covered < 64 * 48, "the box does not fill the image: {covered}");
    let (size, pixels) = penombre::image::png::read(&at("a.png")).unwrap();
    assert_eq!(size, ImageSize { width: 64, height: 48 });
    assert!(pixels.iter().any(|p| p[0] > 100), "the picture is dark");
    let log = std::fs::read_to_string(at("l.csv")).unwrap();
    let rows: Vec<&str> = log.lines().skip(1).collect();
    assert!(!rows.is_empty() && rows.len() <= 3, "{log}");
    assert!(log.lines().all(|row| row.split(',').count() == 25), "{log}");
    let summary = std::fs::read_to_string(at("l.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    assert_eq!(summary["frames"], rows.len());
    assert_eq!(summary["size"], serde_json::json!([64, 48]));
    assert_eq!((&summary["stand_ins"], &summary["warnings"]), (&serde_json::json!([]), &serde_json::json!([])));
}

#[test]
fn the_image_does_not_depend_on_threads() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    for aa in [1, 4] {
        for threads in [1, 2] {
            let line =
                format!("--size 64x48 --frames 4 --aa {aa} --deterministic --threads {threads} -o {threads}.exr -q");
            run_well(folder.path(), &format!("render {{cornell}} {line}"));
        }
        let [one, two] = ["1.exr", "2.exr"].map(|name| std::fs::read(folder.path().join(name)).unwrap());
        assert!(one == two, "--aa {aa}: the files differ");
    }
}

#[test]
fn the_log_has_errors_against_a_reference() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let size = "--size 64x48 -q";
    run_well(folder.path(), &format!("reference {{cornell}} {size} --direct-only --filter point --spp 2 -o ref.exr"));
    run_well(folder.path(), &format!("render {{cornell}} {size} --frames 2 -o a.exr --log l.csv --reference ref.exr"));
    let log = std::fs::read_to_string(folder.path().join("l.csv")).unwrap();
    assert!(log.lines().next().unwrap().contains(",rmse,relmse,flip,stale_specular,filled_faces,light_mib,"));
    let last: Vec<f64> = log.lines().last().unwrap().split(',').skip(18).take(3).map(|v| v.parse().unwrap()).collect();
    let output = run(folder.path(), "diff a.exr ref.exr --json --exposure 1.5");
    let diff: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    for (value, name) in last.iter().zip(["rmse", "relmse", "flip"]) {
        let expected = diff[name].as_f64().unwrap();
        assert!((value / expected - 1.0).abs() < 2e-3, "{name}: {value} in the log, {expected} by diff");
    }
    let part = "reference {cornell} --size 64x48 -q --direct-only --filter point --spp 2 --pixels 500 -o part.exr";
    run_well(folder.path(), part);
    let output =
        run(folder.path(), "render {cornell} --size 64x48 --frames 2 -o b.exr --log l.csv --reference part.exr");
    let diff: serde_json::Value =
        serde_json::from_slice(&run(folder.path(), "diff b.exr part.exr --json").stdout).unwrap();
    assert_eq!((&diff["not_sampled"], diff["flip"].is_null()), (&serde_json::json!(64 * 48 - 500), true));
    let said = format!("--reference: {} of 3072 pixels compared", diff["counted"]);
    assert!(stderr(&output).contains(&said), "{said}: {}", stderr(&output));
    let log = std::fs::read_to_string(folder.path().join("l.csv")).unwrap();
    let last: Vec<&str> = log.lines().last().unwrap().split(',').skip(18).collect();
    assert_eq!((last.len(), last[2]), (10, ""), "no FLIP of some of the pixels");
    let relmse: f64 = last[1].parse().unwrap();
    assert!((relmse / diff["relmse"].as_f64().unwrap() - 1.0).abs() < 2e-3, "{relmse} {diff}");
    let too_small = run(folder.path(), "render {cornell} --size 32x24 -o b.png --log m.csv --reference ref.exr");
    assert_eq!(too_small.status.code(), Some(2));
    assert!(stderr(&too_small).contains("64x48, the render 32x24"), "{}", stderr(&too_small));
}

/// A camera path through the box whose lamp changes colour, goes out and comes back.
const WALK: &str = "[[key]]\ntime = 0\nposition = [278, 273, -800]\nlook_at = [278, 273, 0]\n\
    [[key]]\ntime = 4\nposition = [300, 273, -700]\nlook_at = [278, 273, 0]\n\
    [[edit]]\ntime = 1\nlight = \"lamp\"\ncolour = [0.5, 0.25, 0.125]\n\
    [[edit]]\ntime = 2.5\nlight = \"lamp\"\nswitch = \"off\"\n[[edit]]\ntime = 4\nlight = \"lamp\"\nswitch = \"on\"\n";

/// Largest value of each channel of a layer.
fn largest(path: &Path, layer: &str) -> [f32; 3] {
    let channels = channels(path);
    ["R", "G", "B"].map(|c| values(&channels[&format!("{layer}{c}")]).into_iter().fold(0.0, f32::max))
}

#[test]
fn a_camera_path_makes_numbered_pictures_and_switches_lights() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("walk.toml"), WALK).unwrap();
    let common = "render {cornell} --size 64x48 --camera-path walk.toml --frames 5 --deterministic --rays 200000 -q";
    run_well(folder.path(), &format!("{common} --threads 1 -o one_#.exr -o walk.png --log l.csv"));
    run_well(folder.path(), &format!("{common} --threads 2 -o two_#.exr"));
    for number in 1..=5 {
        let [one, two] = ["one", "two"].map(|n| std::fs::read(at(&format!("{n}_{number}.exr"))).unwrap());
        assert!(one == two, "picture {number} depends on threads");
        assert!(at(&format!("walk_000{number}.png")).exists());
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1 + 15 + 2);
    let log = std::fs::read_to_string(at("l.csv")).unwrap();
    assert_eq!(log.lines().skip(1).filter(|row| row.split(',').nth(2) == Some("1")).count(), 5, "{log}");

    let picture = |number: u32, layer: &str| largest(&at(&format!("one_{number}.exr")), layer);
    let lamp = picture(1, "Le.");
    let coloured = [0.5, 0.25, 0.125].map(|factor| factor as f32);
    for (number, factors) in [(1, [1.0; 3]), (2, coloured), (3, coloured), (4, [0.0; 3]), (5, coloured)] {
        let (emitted, diffuse) = (picture(number, "Le."), picture(number, "D."));
        for channel in 0..3 {
            let expected = lamp[channel] * factors[channel];
            assert!((emitted[channel] - expected).abs() <= 1e-3 * expected, "picture {number}: {emitted:?}");
            assert_eq!(diffuse[channel] > 0.0, factors[channel] > 0.0, "picture {number}: {diffuse:?}");
        }
    }
    assert_eq!((picture(4, ""), picture(4, "S.")), ([0.0; 3], [0.0; 3]), "all is dark without the lamp");
}

#[test]
fn pictures_of_a_still_camera_trace_no_direct_light_again() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let still = "[[key]]\ntime = 0\nposition = [278, 273, -800]\nlook_at = [278, 273, 0]\n";
    std::fs::write(folder.path().join("still.toml"), still).unwrap();
    let line = "--size 64x48 --camera-path still.toml --frames 4 --direct-only --error 0.05 --deterministic -o a.png --log l.csv -q";
    run_well(folder.path(), &format!("render {{cornell}} {line}"));
    let log = std::fs::read_to_string(folder.path().join("l.csv")).unwrap();
    let rows: Vec<Vec<&str>> = log.lines().skip(1).map(|row| row.split(',').collect()).collect();
    let starts: Vec<usize> = (0..rows.len()).filter(|&i| rows[i][2] == "1").collect();
    assert_eq!(starts.len(), 4, "{log}");
    let rays = |row: usize| rows[row][13].parse::<u64>().unwrap();
    let (first, second, last) = (rays(starts[1] - 1), rays(starts[2] - 1), rays(rows.len() - 1));
    // The second probes small leaves whose pixels were counted only after the end of the first.
    let probes = first / 50;
    assert!(first > 1000 && second <= first + probes && last == second, "{first} rays, then {second}, then {last}");
}

#[test]
fn edits_of_lights_that_are_not_there_are_listed() {
    let folder = tempfile::tempdir().unwrap();
    let path =
        format!("{WALK}[[edit]]\ntime = 1\nlight = \"lamb\"\nswitch = \"off\"\n[[edit]]\ntime = -1\nlight = \"x\"\n");
    std::fs::write(folder.path().join("walk.toml"), &path).unwrap();
    let output = run(folder.path(), "render {cornell} -o a.png --camera-path walk.toml");
    assert_eq!(output.status.code(), Some(2));
    let said = stderr(&output);
    assert!(said.lines().count() == 2 && said.contains("time must be") && said.contains("changes nothing"), "{said}");
    std::fs::write(folder.path().join("walk.toml"), path.split("[[edit]]\ntime = -1").next().unwrap()).unwrap();
    let output = run(folder.path(), "render {cornell} -o a.png --camera-path walk.toml");
    assert_eq!(output.status.code(), Some(2));
    let said = stderr(&output);
    assert_eq!(said, "walk.toml:23: error: the scene has no light \"lamb\": did you mean \"lamp\"?\n");
}

/// A tilted floor of small checks, a chrome ball's stand-in and a pane of glass.
fn stand_in_scene(folder: &Path) {
    let checks: Vec<u8> = (0..64 * 64).flat_map(|i| [if (i / 4 + i / 256) % 2 == 0 { 230 } else { 20 }; 3]).collect();
    penombre::image::png::write_bytes(&folder.join("checks.png"), ImageSize { width: 64, height: 64 }, &checks)
        .unwrap();
    let mtl = "newmtl floor\nKd 1 0.9 0.8\nmap_Kd checks.png\nnewmtl chrome\nKd 0.1 0.1 0.1\nKs 0.8 0.8 0.8\nNs 5000\n\
        illum 3\nnewmtl pane\nKd 0.5 0.5 0.5\nd 0.3\n";
    std::fs::write(folder.join("a.mtl"), mtl).unwrap();
    let obj = "mtllib a.mtl\nv -4 0 0\nv 4 0 0\nv 4 0 -20\nv -4 0 -20\nv 0 2 -4\nv 1 2 -4\nv 1 3 -4\nvt 0 0\nvt 8 0\nvt 8 20\n\
        vt 0 20\nusemtl floor\nf 1/1 2/2 3/3 4/4\nusemtl chrome\nf 5 6 7\nusemtl pane\nf 5 7 1\n";
    std::fs::write(folder.join("a.obj"), obj).unwrap();
    let toml = "[geometry]\nobj = [\"a.obj\"]\n[camera]\nposition = [0, 1.5, 1]\nlook_at = [0, 0.5, -4]\nup = [0, 1, 0]\n\
        vertical_fov = 50\n[[light]]\nkind = \"point\"\nposition = [0, 5, 0]\nintensity = [50, 50, 50]\n";
    std::fs::write(folder.join("a.toml"), toml).unwrap();
}

#[test]
fn stand_ins_are_listed_and_said_once() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    stand_in_scene(folder.path());
    let output = run(folder.path(), "render a.toml --size 64x48 --rays 20000 -o a.png --log l.csv -q");
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let summary = std::fs::read_to_string(folder.path().join("l.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    let listed: Vec<&str> = summary["stand_ins"].as_array().unwrap().iter().map(|s| s.as_str().unwrap()).collect();
    assert_eq!(listed.len(), 2, "{listed:?}");
    for part in ["material chrome: mirrors", "material pane: d 0.3 (transparent)"] {
        assert_eq!(listed.iter().filter(|l| l.contains(part)).count(), 1, "{part}: {listed:?}");
        assert_eq!(stderr(&output).matches(part).count(), 1, "{}", stderr(&output));
    }
    assert_eq!(summary["warnings"], serde_json::json!([]));
}

#[test]
fn the_kd_layer_is_what_reference_filters() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    stand_in_scene(folder.path());
    let output = run(folder.path(), "render a.toml --size 96x72 --frames 1 -o a.exr -q");
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let channels = channels(&folder.path().join("a.exr"));
    let [r, g, b] = ["kd.R", "kd.G", "kd.B"].map(|name| values(&channels[name]));
    let FlatSamples::U32(ids) = &channels["face.id"] else { panic!("face.id is not unsigned") };
    let scene = load::load(&folder.path().join("a.toml")).unwrap().scene;
    let view = scene.view(&scene.cameras[0].camera, ImageSize { width: 96, height: 72 });
    let (mut seen, mut off) = (0, 0);
    for (i, &id) in ids.iter().enumerate().filter(|&(_, &id)| id != 0) {
        let triangle = FaceId(id - 1).triangle();
        let point = Vec2::new((i % 96) as f32 + 0.5, (i / 96) as f32 + 0.5);
        let [u, v] = plane_hit(scene.corners(triangle), view.eye, view.direction(point));
        let footprint = Footprint::of_pixel(scene.corners(triangle), &view, point, 1.0);
        let expected = scene.kd_over(triangle, u, v, &footprint);
        let error = (Vec3::new(r[i], g[i], b[i]) - expected).abs();
        seen += 1;
        off += usize::from(error.cmpgt(expected * 2f32.powi(-10) + 1e-4).any());
    }
    assert!(seen > 2000 && off * 1000 <= seen, "{off} of {seen} pixels differ");
}

/// Barycentrics of corners 1 and 2 where a ray meets a triangle's plane, by Cramer's rule.
fn plane_hit(corners: [Vec3; 3], origin: Vec3, direction: Vec3) -> [f32; 2] {
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    let system = glam::DMat3::from_cols(b - a, c - a, -direction.as_dvec3());
    let solution = system.inverse() * (origin.as_dvec3() - a);
    [solution.x as f32, solution.y as f32]
}

#[cfg(unix)]
#[test]
fn ctrl_c_writes_what_there_is() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let line = format!("render {} --size 96x72 --time 60 -o a.exr -o a.png --log l.csv", library());
    let child = penombre(folder.path(), &line).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let rows = || std::fs::read_to_string(folder.path().join("l.csv")).map_or(0, |text| text.lines().count());
    let start = Instant::now();
    while rows() < 4 {
        assert!(start.elapsed() < Duration::from_secs(30), "no frame appears");
        std::thread::sleep(Duration::from_millis(5));
    }
    let before = rows();
    assert!(Command::new("kill").args(["-s", "INT", &child.id().to_string()]).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130), "{}", stderr(&output));
    assert!(start.elapsed() < Duration::from_secs(30));
    let said = stderr(&output);
    assert!(said.contains("interrupted: finishing the frame") && said.contains("(interrupted)"), "{said}");
    let early = said.lines().filter(|line| line.starts_with("warning: the run ended (interrupted) before")).count();
    assert_eq!(said.lines().count() - early, 2, "{said}");
    assert!(rows() >= before, "rows were lost");
    let image = penombre::image::exr::read_rgb(&folder.path().join("a.exr")).unwrap();
    assert!(image.rgb.iter().any(|c| c.max_element() > 0.0), "the image is black");
    penombre::image::png::read(&folder.path().join("a.png")).unwrap();
    let summary = std::fs::read_to_string(folder.path().join("l.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    assert_eq!(summary["ended_by"], "interrupted");
}

fn library() -> String {
    format!("{}/scenes/moonlit_library/moonlit_library.toml", env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn info_as_json_names_each_device() {
    if !has_device() {
        return;
    }
    let output = run(Path::new("."), "info --json");
    assert_eq!((output.status.code(), stderr(&output)), (Some(0), String::new()));
    let devices: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let devices = devices.as_array().unwrap();
    assert!(devices.iter().any(|device| device["missing"] == serde_json::json!([])));
    for (i, device) in devices.iter().enumerate() {
        assert_eq!(device["index"], i);
        assert!(device["name"].is_string() && device["formats"]["id"].is_string(), "{device}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn without_vulkan_the_package_to_install_is_named() {
    let folder = tempfile::tempdir().unwrap();
    for line in ["info", "info --json", "render {cornell} -o a.png"] {
        let mut command = penombre(folder.path(), line);
        for variable in ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"] {
            command.env(variable, PathBuf::from("/nonexistent.json"));
        }
        let output = command.output().unwrap();
        assert_eq!(output.status.code(), Some(3), "{line}: {}", stderr(&output));
        assert!(stderr(&output).contains("apt install"), "{line}: {}", stderr(&output));
        assert!(output.stdout.is_empty());
    }
}

#[test]
fn bench_measures_what_it_promises() {
    let output = run(Path::new("."), "bench {cornell} --json --threads 2 --seed 3");
    assert_eq!((output.status.code(), stderr(&output)), (Some(0), String::new()));
    let found: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&found["seed"], &found["lights"]), (&serde_json::json!(3), &serde_json::json!(1)));
    for rate in ["camera", "closest", "shadow", "path_tracer", "path_tracer_share"] {
        assert!(found["rates"][rate]["median"].as_f64().unwrap() > 0.01, "{rate}: {}", found["rates"]);
    }
    assert!(found["choice"].as_array().unwrap().iter().all(|c| c["nanoseconds"]["median"].as_f64().unwrap() > 1.0));
    let errors = found["hemisphere"]["errors"].as_array().unwrap();
    assert_eq!(errors.len(), 2 * 3 * 4, "kinds of hits, methods, allowances");
    for row in errors {
        let value = |key: &str| row[key].as_f64().unwrap();
        assert!(value("rays") <= value("allowed") && value("bias").abs() <= value("rmse"), "{row}");
        if row["method"] == "stratified" {
            assert!(value("bias").abs() < 4.0 * value("bias_error"), "{row}");
            assert!((0.7..2.0).contains(&(value("expected") / value("rmse"))), "{row}");
        } else {
            assert!(row["expected"].is_null(), "{row}");
        }
    }
    let stratified: Vec<f64> = errors[..4].iter().map(|row| row["rmse"].as_f64().unwrap()).collect();
    assert!(stratified[3] < stratified[0] / 8.0, "as independent rays, or worse: {stratified:?}");
}

/// With light that bounces and without, the picture is as bright as the path tracer's; what bounces is about half of it.
#[test]
fn pictures_are_as_bright_as_the_reference() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let size = "--size 64x48 -q";
    for (name, only) in [("full", ""), ("direct", "--direct-only")] {
        run_well(
            folder.path(),
            &format!("reference {{cornell}} {size} {only} --filter point --spp 64 -o ref-{name}.exr"),
        );
        let line = format!("render {{cornell}} {size} {only} --deterministic --rays 1500000 -o {name}.exr");
        run_well(folder.path(), &line);
    }
    // A twentieth of the mean of the full picture.
    let status = |a, b| run(folder.path(), &format!("diff {a}.exr ref-{b}.exr --max-mean-shift 0.003")).status.code();
    assert_eq!([("full", "full"), ("direct", "direct")].map(|(a, b)| status(a, b)), [Some(0); 2]);
    assert_eq!([("direct", "full"), ("full", "direct")].map(|(a, b)| status(a, b)), [Some(1); 2]);
}
