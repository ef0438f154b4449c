//! Shaders that are edited while a window is open (feature `shader-reload`).
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

mod support;

use crate::support::device::{self, add_quad, empty_scene};
use glam::Vec3;
use penombre::app::shader_watch::{Compiled, FOLDER, ShaderWatch};
use penombre::app::viewer::{Open, Viewer};
use penombre::scene::camera::ImageSize;
use penombre::scene::light::{Light, LightKind};
use penombre::session::{Batches, Budget, Options, Pace, Session, Unobserved};
use penombre::vk::edited_shaders::EditedShaders;
use std::fs;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// A copy of the shaders.
fn copied() -> tempfile::TempDir {
    let copy = tempfile::tempdir().unwrap();
    fs::create_dir(copy.path().join("include")).unwrap();
    for folder in ["", "include"] {
        for entry in fs::read_dir(Path::new(FOLDER).join(folder)).unwrap() {
            let from = entry.unwrap().path();
            if from.is_file() {
                fs::copy(&from, copy.path().join(folder).join(from.file_name().unwrap())).unwrap();
            }
        }
    }
    copy
}

fn edit(file: &Path, from: &str, to: &str) {
    let text = fs::read_to_string(file).unwrap();
    assert!(text.contains(from), "{from}");
    fs::write(file, text.replace(from, to)).unwrap();
}

fn viewer() -> Viewer {
    let mut scene = empty_scene();
    add_quad(&mut scene, Vec3::new(-1.0, -0.8, 1.0), Vec3::X * 2.0, Vec3::Z * -2.0, 0, 1.0);
    let kind = LightKind::Directional { direction: Vec3::NEG_Y, irradiance: Vec3::ONE };
    scene.lights.push(Light { name: "sun".to_owned(), kind });
    let options = Options {
        size: ImageSize { width: 32, height: 24 },
        threads: Some(1),
        pace: Pace::Fixed(Batches { rays: 500, most: 500, counts_lag: 0 }),
        refresh: Some(Duration::ZERO),
        budget: Budget::default(),
        ..Options::default()
    };
    let scene = Arc::new(scene);
    let session = Session::open(&scene, &options).unwrap();
    let open = Open { hud: false, lights: false, help: false };
    Viewer::new(session, scene.cameras[0].camera, "floor".into(), open)
}

fn picture(viewer: &mut Viewer) -> Vec<[u8; 4]> {
    for _ in 0..40 {
        viewer.frame(&mut Unobserved).unwrap();
    }
    viewer.session_mut().renderer_mut().read_display().unwrap()
}

fn faults(compiled: Compiled) -> String {
    compiled.unwrap_err().join("\n")
}

#[test]
fn pictures_are_drawn_with_edited_shaders_and_broken_ones_change_nothing() {
    if device::device().is_none() {
        return;
    }
    let copy = copied();
    let [combine, display] = ["combine.frag", "include/display.glsl"].map(|name| copy.path().join(name));
    let mut viewer = viewer();
    let before = picture(&mut viewer);
    edit(&display, "return vec4(", "return vec4(0.0, 1.0, 0.0, 1.0) * vec4(");
    viewer.edited(EditedShaders::compile(copy.path())).unwrap();
    assert!(viewer.message().is_some_and(|said| said.contains("again")));
    let green = picture(&mut viewer);
    assert!(green.iter().zip(&before).all(|(now, then)| *now == [0, then[1], 0, then[3]]) && green != before);

    edit(&combine, "void main() {", "void main() {\n    float wrong = nothing;");
    let broken = EditedShaders::compile(copy.path());
    let line = fs::read_to_string(&combine).unwrap().lines().position(|line| line.contains("wrong")).unwrap() + 1;
    assert!(faults(broken.clone()).contains(&format!("combine.frag:{line}: ")), "{}", faults(broken));
    viewer.edited(broken).unwrap();
    viewer.advance(60.0);
    assert!(viewer.message().is_some_and(|said| said.contains("combine.frag:")), "{:?}", viewer.message());
    assert!(picture(&mut viewer) == green);

    viewer.edited(EditedShaders::compile(Path::new(FOLDER))).unwrap();
    assert!(picture(&mut viewer) == before);
    viewer.advance(120.0);
    assert_eq!(viewer.message(), None, "it is mended");
}

#[test]
fn what_the_host_shares_must_stay_as_it_is() {
    let copy = copied();
    edit(&copy.path().join("include/frame.glsl"), "    vec3 position;\n", "    vec3 position;\n    float more;\n");
    let fault = faults(EditedShaders::compile(copy.path()));
    assert!(fault.contains("another `Slot`: build again"), "{fault}");
    fs::remove_file(copy.path().join("colour.frag")).unwrap();
    assert!(faults(EditedShaders::compile(copy.path())).contains("colour.frag: is not there"));
}

#[test]
fn files_that_change_are_compiled_once_they_are_at_rest() {
    let copy = copied();
    let watch = ShaderWatch::start(copy.path().to_owned());
    let next = |within: Duration| {
        let start = Instant::now();
        while start.elapsed() < within {
            if let Some(compiled) = watch.arrived() {
                return Some(compiled);
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        None
    };
    assert!(next(Duration::from_millis(1200)).is_none(), "nothing has changed");
    let display = copy.path().join("include/display.glsl");
    edit(&display, "vec4 displayed", "vec4 displayed // as a display has it\n");
    assert!(next(Duration::from_secs(30)).unwrap().is_ok());
    edit(&display, "vec4 displayed", "vec5 displayed");
    assert!(faults(next(Duration::from_secs(30)).unwrap()).contains("include/display.glsl:"));
}
