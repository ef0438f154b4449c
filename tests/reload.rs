//! A scene that is edited while it is looked at.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

mod support;

use crate::support::device;
use penombre::app::command::Command;
use penombre::app::reload::{Fresh, Reloader, Source};
use penombre::app::viewer::{Open, Viewer};
use penombre::scene::camera::ImageSize;
use penombre::session::{Batches, Budget, Options, Pace, Session, Unobserved};
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

const OBJ: &str = "mtllib s.mtl\nusemtl wall\nv -2 -2 0\nv 2 -2 0\nv 2 2 0\nv -2 2 0\nf 1 2 3 4\n";

const MTL: &str = "newmtl wall\nKd 0.5 0.5 0.5\n";

fn scene_file(lamps: &[(&str, f32)]) -> String {
    let mut text = "[geometry]\nobj = [\"s.obj\"]\n[[camera]]\nposition = [0, 0, 4]\nlook_at = [0, 0, 0]\n".to_owned();
    for (name, intensity) in lamps {
        let at = "position = [0, 0, 2]";
        text += &format!("[[light]]\nname = \"{name}\"\nkind = \"point\"\n{at}\nintensity = [{intensity}, 1, 1]\n");
    }
    text
}

/// A scene in files.
fn written(folder: &Path) -> Source {
    fs::write(folder.join("s.obj"), OBJ).unwrap();
    fs::write(folder.join("s.mtl"), MTL).unwrap();
    let path = folder.join("s.toml");
    fs::write(&path, scene_file(&[("lamp", 4.0), ("other", 1.0)])).unwrap();
    let files = ["s.mtl", "s.obj", "s.toml"].map(|name| folder.join(name)).to_vec();
    Source { path, up: None, files }
}

fn viewer_of(Fresh { scene, .. }: &Fresh) -> Viewer {
    let options = Options {
        size: ImageSize { width: 32, height: 32 },
        threads: Some(1),
        pace: Pace::Fixed(Batches { rays: 500, most: 500, counts_lag: 0 }),
        refresh: Some(Duration::ZERO),
        budget: Budget::default(),
        ..Options::default()
    };
    let session = Session::open(scene, &options).unwrap();
    let open = Open { hud: false, lights: false, help: false };
    Viewer::new(session, scene.cameras[0].camera, PathBuf::from("s"), open)
}

/// Mean of red and of green of some frames on.
fn colour(viewer: &mut Viewer) -> [f32; 2] {
    for _ in 0..4 {
        viewer.frame(&mut Unobserved).unwrap();
    }
    let pixels = viewer.session_mut().still().unwrap().combined;
    let mean = |channel: fn(&glam::Vec4) -> f32| pixels.iter().map(channel).sum::<f32>() / pixels.len() as f32;
    [mean(|pixel| pixel.x), mean(|pixel| pixel.y)]
}

#[test]
fn camera_and_switches_stay_and_a_broken_file_changes_nothing() {
    if device::device().is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let source = written(folder.path());
    let fresh = source.load().unwrap();
    let mut viewer = viewer_of(&fresh);
    viewer.execute(&Command::ToggleLight("other".to_owned())).unwrap();
    viewer.execute(&Command::Pan([0.1, 0.0])).unwrap();
    let before = colour(&mut viewer);
    let camera = viewer.flight().camera;
    assert!(before[0] > 3.0 * before[1] && before[1] > 0.0, "{before:?}");

    fs::write(&source.path, "[geometry]\nobj = [\"s.obj\"]\nnonsense = 1\n").unwrap();
    viewer.reloaded(source.load()).unwrap();
    viewer.advance(60.0);
    assert!(viewer.message().is_some_and(|said| said.contains("s.toml:3: error")), "{:?}", viewer.message());
    let still = colour(&mut viewer);
    assert!((still[0] / before[0] - 1.0).abs() < 0.01 && viewer.flight().camera == camera, "{still:?}, {before:?}");

    fs::write(&source.path, scene_file(&[("other", 1.0), ("lamp", 8.0), ("third", 0.0)])).unwrap();
    viewer.execute(&Command::Reload).unwrap();
    assert!(viewer.take_reload() && !viewer.take_reload());
    viewer.reloaded(source.load()).unwrap();
    assert!(viewer.message().is_some_and(|said| said.contains("again")), "{:?}", viewer.message());
    let on: Vec<(&str, bool)> = viewer.lights().all().iter().map(|light| (light.name.as_str(), light.on)).collect();
    assert_eq!(on, [("other", false), ("lamp", true), ("third", true)]);
    assert_eq!(viewer.flight().camera, camera);
    let after = colour(&mut viewer);
    // The lamp is twice as red; the third adds to green as much as the lamp does.
    let ratios = [after[0] / before[0], after[1] / before[1]];
    assert!(ratios.iter().all(|ratio| (ratio - 2.0).abs() < 0.02), "{ratios:?}");
}

#[test]
fn the_camera_stays_where_it_is_when_the_origin_moves() {
    if device::device().is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let source = written(folder.path());
    let mut viewer = viewer_of(&source.load().unwrap());
    let far = "mtllib s.mtl\nusemtl wall\nv 4e6 -2 0\nv 4000002 -2 0\nv 4000002 2 0\nf 1 2 3\n";
    fs::write(folder.path().join("s.obj"), far).unwrap();
    let camera = viewer.flight().camera;
    let fresh = source.load().unwrap();
    let origin = fresh.scene.origin.as_vec3();
    assert!((origin.x - 4e6).abs() < 1e3, "{origin}");
    viewer.reloaded(Ok(fresh)).unwrap();
    assert_eq!(viewer.flight().camera.position + origin, camera.position);
}

#[test]
fn files_that_change_are_loaded_once_they_are_at_rest() {
    let folder = tempfile::tempdir().unwrap();
    let source = written(folder.path());
    assert_eq!(source.load().map(|fresh| fresh.scene.lights.len()).unwrap(), 2);
    let reloader = Reloader::start(source.clone()).unwrap();
    let next = |within: Duration| {
        let start = Instant::now();
        while start.elapsed() < within {
            if let Some(loaded) = reloader.arrived() {
                return Some(loaded);
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        None
    };
    assert!(next(Duration::from_millis(1200)).is_none(), "nothing has changed");
    fs::write(folder.path().join("s.mtl"), "newmtl wall\nKd 0.25 0.5 0.5\n").unwrap();
    let fresh = next(Duration::from_secs(30)).unwrap().unwrap();
    assert!(fresh.scene.materials.iter().any(|material| material.kd.x < 0.3), "a file that the scene file names");
    fs::remove_file(folder.path().join("s.obj")).unwrap();
    let fault = next(Duration::from_secs(30)).unwrap().err().unwrap();
    assert!(fault.to_string().contains("s.obj"), "{fault}");
    fs::write(folder.path().join("s.obj"), OBJ).unwrap();
    assert!(next(Duration::from_secs(30)).unwrap().is_ok(), "it is back");
    reloader.ask();
    assert!(next(Duration::from_secs(30)).unwrap().is_ok(), "asked for");
    assert!(next(Duration::from_millis(700)).is_none(), "once");
}
