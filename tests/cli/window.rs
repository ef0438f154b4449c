//! `penombre view` in a window, on a virtual X server of its own.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use crate::support::binary::{has_device, penombre, stderr};
use penombre::image::png;
use std::fs;
use std::io::{BufRead as _, BufReader};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

/// A virtual X server, which ends with this.
struct Server {
    process: Child,
    display: String,
}

impl Server {
    /// Starts one; `None`, with one line said, where Xvfb is not installed. `PENOMBRE_REQUIRE_DISPLAY=1` makes that a failure.
    fn start() -> Option<Self> {
        let mut command = Command::new("Xvfb");
        command.args(["-displayfd", "1", "-screen", "0", "800x600x24", "-nolisten", "tcp"]);
        let started = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn();
        let required = std::env::var("PENOMBRE_REQUIRE_DISPLAY").is_ok_and(|v| v == "1");
        let mut process = match started {
            Ok(process) => process,
            Err(reason) if !required => {
                println!("skipped: Xvfb cannot be started: {reason}");
                return None;
            }
            Err(reason) => panic!("Xvfb cannot be started: {reason}"),
        };
        let mut number = String::new();
        BufReader::new(process.stdout.take().unwrap()).read_line(&mut number).unwrap();
        Some(Self { process, display: format!(":{}", number.trim()) })
    }

    fn run(&self, folder: &Path, line: &str) -> Output {
        let mut command = penombre(folder, line);
        command.env("DISPLAY", &self.display).env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET");
        command.output().unwrap()
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

#[test]
fn a_script_plays_in_a_window() {
    if !has_device() {
        return;
    }
    let Some(server) = Server::start() else { return };
    let folder = tempfile::tempdir().unwrap();
    let script = "0 help.toggle\n0.2 window.screenshot help.png\n0.2 camera.fly 0 0 1\n0.4 camera.fly 0 0 0\n0.4 help.toggle\n\
                  0.4 hud.toggle\n0.6 window.screenshot bare.png\n0.6 window.picture bare.exr\n0.8 app.quit\n";
    fs::write(folder.path().join("walk.script"), script).unwrap();
    let output = server.run(folder.path(), "view {cornell} --size 320x240 --script walk.script");
    assert_eq!((output.status.code(), stderr(&output).as_str()), (Some(0), ""));
    assert!(output.stdout.is_empty());
    let [help, bare] = ["help.png", "bare.png"].map(|name| png::read(&folder.path().join(name)).unwrap());
    assert_eq!((help.0.width, help.0.height), (320, 240));
    assert_ne!(help.1, bare.1);
    assert!(bare.1.as_flattened().iter().any(|&byte| byte > 60), "the box is lit");
    assert!(folder.path().join("bare.exr").exists());
}

#[test]
fn a_display_that_is_not_there_is_no_panic() {
    let folder = tempfile::tempdir().unwrap();
    let mut command = penombre(folder.path(), "view {cornell}");
    let output = command.env("DISPLAY", ":4095").env_remove("WAYLAND_DISPLAY").output().unwrap();
    if cfg!(target_os = "linux") {
        assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
        assert!(stderr(&output).starts_with("error: the display cannot be opened: Failed"), "{}", stderr(&output));
    }
}

#[test]
fn a_display_that_goes_away_ends_the_program_in_order() {
    if !has_device() {
        return;
    }
    let Some(mut server) = Server::start() else { return };
    let folder = tempfile::tempdir().unwrap();
    let script = "0 session.record again.script\n0.1 window.screenshot there.png\n";
    fs::write(folder.path().join("walk.script"), script).unwrap();
    let mut command = penombre(folder.path(), "view {cornell} --size 320x240 --script walk.script");
    command.env("DISPLAY", &server.display).env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET");
    let program = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let start = Instant::now();
    while !folder.path().join("there.png").exists() && start.elapsed() < Duration::from_secs(60) {
        std::thread::sleep(Duration::from_millis(50));
    }
    server.process.kill().unwrap();
    let output = program.wait_with_output().unwrap();
    assert_eq!((output.status.code(), stderr(&output).as_str()), (Some(3), "error: the display is gone\n"));
    assert!(folder.path().join("again.script").exists(), "what was recorded is written");
}

#[test]
fn a_window_outlives_a_lost_device() {
    if !has_device() {
        return;
    }
    let Some(server) = Server::start() else { return };
    let folder = tempfile::tempdir().unwrap();
    let script = "0.1 window.screenshot before.png\n0.2 light.toggle lamp\n0.3 light.toggle lamp\n\
                  0.8 window.screenshot after.png\n1 app.quit\n";
    fs::write(folder.path().join("walk.script"), script).unwrap();
    let line = "view {cornell} --size 320x240 --script walk.script --lose-device-at 3 --trace t.json";
    let output = server.run(folder.path(), line);
    assert_eq!((output.status.code(), stderr(&output).as_str()), (Some(0), ""));
    let [before, after] = ["before.png", "after.png"].map(|name| png::read(&folder.path().join(name)).unwrap());
    assert_eq!(before.0, after.0);
    assert!(after.1.as_flattened().iter().any(|&byte| byte > 60), "the box is lit");
    let trace = fs::read_to_string(folder.path().join("t.json")).unwrap();
    assert!(["\"penombre-draw\"", "\"present\"", "light.toggle lamp"].iter().all(|what| trace.contains(what)));
}
