//! Camera paths as people write them: stops on the way, and views straight down.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use glam::Vec3;
use penombre::error::Result;
use penombre::scene::camera::{Camera, ImageSize, View};
use penombre::scene::camera_path::{CameraPath, load_camera_path};
use penombre::scene::horizon::Horizon;
use std::fmt::Write as _;
use std::fs;

const BASE: Camera = Camera { position: Vec3::ZERO, look_at: Vec3::X, up: Vec3::Y, vertical_fov: 60.0 };

/// A key: time, position, point looked at.
type Key = (f32, [f32; 3], [f32; 3]);

/// The path of some keys, and its horizon.
fn path(keys: &[Key]) -> (CameraPath, Result<Horizon>) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("p.toml");
    fs::write(&file, text(keys)).unwrap();
    let path = load_camera_path(&file, glam::DVec3::ZERO).unwrap();
    let horizon = Horizon::of(&path, BASE.up, &file);
    (path, horizon)
}

fn text(keys: &[Key]) -> String {
    let mut text = String::new();
    for (time, position, look_at) in keys {
        writeln!(text, "[[key]]\ntime = {time:?}\nposition = {position:?}\nlook_at = {look_at:?}").unwrap();
    }
    text
}

/// The cameras of `count` pictures spread evenly over the path.
fn cameras(keys: &[Key], count: u32) -> Vec<Camera> {
    let (path, horizon) = path(keys);
    let horizon = horizon.unwrap();
    let time = |i: u32| path.duration() * i as f32 / (count - 1) as f32;
    (0..count).map(|i| horizon.hold(time(i), path.camera_at(time(i), &BASE))).collect()
}

/// Forward, right and down of a picture.
fn axes(camera: &Camera) -> [Vec3; 3] {
    let view = View::new(camera, ImageSize { width: 8, height: 8 }, 10.0);
    [view.forward, view.right.normalize(), view.down.normalize()]
}

const STOP: [Key; 4] = [
    (0.0, [8.0, 1.7, 8.0], [0.0, 1.5, 0.0]),
    (1.0, [3.0, 1.7, 8.0], [0.0, 1.5, 0.0]),
    (3.0, [3.0, 1.7, 8.0], [0.0, 1.5, 0.0]),
    (4.0, [-3.0, 1.7, 8.0], [0.0, 1.5, 0.0]),
];

#[test]
fn a_camera_that_stops_stands_still() {
    let pictures = cameras(&STOP, 9);
    assert!(pictures[2..7].iter().all(|camera| *camera == pictures[2]), "{pictures:#?}");
    assert_ne!(pictures[1], pictures[2]);
    assert_ne!(pictures[7], pictures[2]);
    let swings = cameras(&STOP, 400).windows(2).filter(|w| w[1].position.x > w[0].position.x).count();
    assert_eq!(swings, 0, "it never goes back");
}

#[test]
fn a_flight_over_the_top_turns_without_a_jump() {
    let middle = [0.0, 1.5, 0.0];
    let over: [Key; 3] = [(0.0, [0., 2., 12.], middle), (1.0, [0., 12., 0.], [0.; 3]), (2.0, [0., 2., -12.], middle)];
    let level = |camera: &Camera| {
        let [_, right, down] = axes(camera);
        right.y.abs() < 1e-5 && down.y < 0.0
    };
    let nine = cameras(&over, 9);
    assert!([0, 1, 2, 6, 7, 8].iter().all(|&i| level(&nine[i])), "{nine:#?}");
    assert!(axes(&nine[0])[1].x > 0.99 && axes(&nine[8])[1].x < -0.99, "level on both sides: half a turn between");
    for pair in cameras(&over, 2001).windows(2) {
        let [a, b] = [axes(&pair[0]), axes(&pair[1])];
        let turn = a[1].angle_between(b[1]).max(a[2].angle_between(b[2])).to_degrees();
        assert!(turn < 1.0, "{turn} degrees from {:?} to {:?}", pair[0], pair[1]);
    }
}

#[test]
fn a_flight_may_end_straight_above() {
    let down: [Key; 2] = [(0.0, [6., 2., 10.], [0., 1.5, 0.]), (1.0, [0., 15., 0.], [0.; 3])];
    let pictures = cameras(&down, 1001);
    for pair in pictures.windows(2) {
        let [a, b] = [axes(&pair[0]), axes(&pair[1])];
        assert!(a[1].angle_between(b[1]).to_degrees() < 0.5, "from {:?} to {:?}", pair[0], pair[1]);
    }
    // The way that it came is at the bottom of the picture.
    let came = Vec3::new(6.0, 0.0, 10.0).normalize();
    assert!(axes(&pictures[1000])[2].dot(came) > 0.9, "{:?}", pictures[1000]);
}

#[test]
fn a_flight_that_always_looks_straight_down_needs_another_up() {
    let keys: [Key; 2] = [(0.0, [0., 9., 0.], [0.; 3]), (1.0, [5., 9., 0.], [5., 0., 0.])];
    let fault = path(&keys).1.unwrap_err().to_string();
    assert!(fault.contains("p.toml:1: error: the view is parallel to the camera's up all along the path"), "{fault}");
}
