//! `penombre view` without a window: scripts, and what is said where there is no display.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use crate::support::binary::{has_device, penombre, run, stderr};
use penombre::image::exr::read_rgb;
use penombre::image::png;
use std::fs;
use std::path::Path;

const HEADLESS: &str = "view {cornell} --headless --size 64x64 --threads 1 --rays 4000 --script walk.script";

/// Mean of the bytes of a picture.
fn brightness(path: &Path) -> f64 {
    let (_, pixels) = png::read(path).unwrap();
    let bytes = pixels.as_flattened();
    bytes.iter().map(|&byte| f64::from(byte)).sum::<f64>() / bytes.len() as f64
}

#[test]
fn a_light_that_is_switched_off_is_dark_in_the_next_frame() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let script = "0.25 window.screenshot off.png\n0.25 light.toggle lamp\n0.25 window.picture off.exr\n\
                  0.5 light.dim lamp 0.5\n0.5 light.toggle lamp # to the end\n";
    fs::write(folder.path().join("walk.script"), script).unwrap();
    let output = run(folder.path(), &format!("{HEADLESS} --fps 8 -o frame_##.png"));
    assert_eq!((output.status.code(), stderr(&output).as_str()), (Some(0), ""));
    let frames: Vec<f64> = (1..=5).map(|n| brightness(&folder.path().join(format!("frame_{n:02}.png")))).collect();
    assert!(!folder.path().join("frame_06.png").exists(), "the script ends at half a second");
    assert!(frames[1] > 40.0, "{frames:?}");
    assert!(frames[2] < 1.0, "off in the frame in which it was switched: {frames:?}");
    assert!(frames[4] > 10.0 && frames[4] < frames[1], "half of it: {frames:?}");
    assert!(brightness(&folder.path().join("off.png")) < 1.0, "the frame of its time, after all that is done then");
    let linear = read_rgb(&folder.path().join("off.exr")).unwrap();
    assert_eq!(linear.size.width, 64);
}

#[test]
fn a_panel_is_there_in_the_frame_in_which_it_is_opened() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("walk.script"), "0.25 help.toggle\n0.5 help.toggle\n").unwrap();
    let line = HEADLESS.replace("64x64", "160x120");
    let output = run(folder.path(), &format!("{line} --fps 8 -o frame_#.png"));
    assert_eq!((output.status.code(), stderr(&output).as_str()), (Some(0), ""));
    // The help covers half of the picture.
    let dark = |n: u32| {
        let (_, pixels) = png::read(&folder.path().join(format!("frame_{n}.png"))).unwrap();
        pixels.iter().filter(|pixel| pixel[..] == [0; 3]).count()
    };
    let dark: Vec<usize> = (2..=5).map(dark).collect();
    assert!(dark[1] > dark[0] + 5000 && dark[2] == dark[1] && dark[3] == dark[0], "{dark:?}");
}

#[test]
fn the_same_script_gives_the_same_frames() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let script = "0 camera.fly 0.5 0 1\n0.1 camera.look 5 2\n0.2 camera.fly 0 0 0\n0.3 window.picture end.exr\n";
    fs::write(folder.path().join("walk.script"), script).unwrap();
    let end = folder.path().join("end.exr");
    let pictures = ["1", "2"].map(|threads| {
        let line = HEADLESS.replace("--threads 1", &format!("--threads {threads}"));
        let output = run(folder.path(), &format!("{line} --fps 10"));
        assert_eq!((output.status.code(), stderr(&output).as_str()), (Some(0), ""));
        fs::read(&end).unwrap()
    });
    assert!(pictures[0] == pictures[1]);
}

#[test]
fn what_was_recorded_can_be_played_and_rendered() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let script = "0 session.record again.script\n0 camera.record path.toml\n0.1 camera.fly 0 0 0.5\n\
                  0.4 light.dim lamp 0.25\n0.5 app.quit\n";
    fs::write(folder.path().join("walk.script"), script).unwrap();
    let output = run(folder.path(), &format!("{HEADLESS} --fps 10"));
    assert_eq!(output.status.code(), Some(0));
    assert_eq!(stderr(&output), "recorded again.script\nrecorded path.toml\n");
    let again = run(folder.path(), &HEADLESS.replace("walk.script", "again.script"));
    assert_eq!((again.status.code(), stderr(&again).as_str()), (Some(0), ""));
    let line = "render {cornell} --size 32x32 --threads 1 --frames 2 --rays 2000 --camera-path path.toml -q -o p_#.png";
    let rendered = run(folder.path(), line);
    assert_eq!((rendered.status.code(), stderr(&rendered).as_str()), (Some(0), ""));
    assert!(folder.path().join("p_2.png").exists());
}

#[test]
fn faults_of_a_script_are_listed_before_anything_is_done() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("walk.script"), "1 camera.flie 1\nsoon app.quit\n").unwrap();
    let output = run(folder.path(), HEADLESS);
    assert_eq!(output.status.code(), Some(2));
    let said = stderr(&output);
    assert!(said.contains("walk.script:1: error: ") && said.contains("walk.script:2: error: "), "{said}");
    fs::write(folder.path().join("walk.script"), "1 light.toggle lmap\n").unwrap();
    let output = run(folder.path(), HEADLESS);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("walk.script:1: error: the scene has no light \"lmap\": did you mean \"lamp\"?"));
    fs::write(folder.path().join("walk.script"), "1 light.move lamp 0 1 0\n").unwrap();
    let said = stderr(&run(folder.path(), HEADLESS));
    assert!(said.contains("walk.script:1: error: \"lamp\" is geometry: it stays where it is"), "{said}");
}

#[test]
fn no_display_is_said_at_once() {
    let mut command = penombre(Path::new("."), "view {cornell}");
    let output = command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET").output();
    let output = output.unwrap();
    if cfg!(target_os = "linux") {
        assert_eq!(output.status.code(), Some(3));
        assert!(stderr(&output).contains("neither WAYLAND_DISPLAY nor DISPLAY is set"), "{}", stderr(&output));
    }
}

#[test]
fn help_lists_every_command() {
    for line in ["help view", "view --help"] {
        let output = run(Path::new("."), line);
        let unwrapped = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
        let text = unwrapped(&String::from_utf8_lossy(&output.stdout));
        for entry in penombre::app::table::ENTRIES {
            assert!(text.contains(&entry.usage()) && text.contains(entry.help), "{line}: {}", entry.name);
        }
    }
}

#[test]
fn after_a_lost_device_all_goes_on_as_if_nothing_had_been() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let script = "0 camera.fly 0.5 0 1\n0.2 light.dim lamp 0.5\n0.3 camera.fly 0 0 0\n0.5 window.picture end.exr\n";
    fs::write(folder.path().join("walk.script"), script).unwrap();
    let end = folder.path().join("end.exr");
    let line = format!("{HEADLESS} --fps 10");
    let pictures = ["", " --lose-device-at 3"].map(|lost| {
        let output = run(folder.path(), &format!("{line}{lost}"));
        assert_eq!((output.status.code(), stderr(&output).as_str()), (Some(0), ""));
        fs::read(&end).unwrap()
    });
    assert!(pictures[0] == pictures[1]);
    let output = run(folder.path(), &format!("{line} --lose-device-at 3 --lose-device-at 4"));
    assert_eq!(output.status.code(), Some(4), "{}", stderr(&output));
    assert!(stderr(&output).contains("the Vulkan device was lost"), "{}", stderr(&output));
}
