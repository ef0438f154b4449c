//! The process as a shell sees it: exit statuses, closed pipes, signals.

use penombre::cli::interrupt;
use penombre::image::atomic;
use std::fs;
use std::io::{self, Write as _};
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

fn penombre(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_penombre"));
    command.args(arguments);
    command
}

fn run(arguments: &[&str]) -> Output {
    penombre(arguments).output().unwrap_or_else(|e| panic!("{arguments:?}: {e}"))
}

#[test]
fn help_and_version_are_answers_and_mistakes_are_not() {
    for arguments in [&["--help"][..], &["--version"], &["render", "--help"], &["help", "info"]] {
        let output = run(arguments);
        assert_eq!(output.status.code(), Some(0), "{arguments:?}");
        assert!(!output.stdout.is_empty() && output.stderr.is_empty());
    }
    for arguments in [&[][..], &["rendre"], &["render"], &["render", "a.obj", "-o", "a.jpg"]] {
        let output = run(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(output.stdout.is_empty() && !output.stderr.is_empty());
    }
}

#[cfg(unix)]
#[test]
fn a_reader_that_goes_away_is_no_fault() {
    // The shell closes the pipe before anything is written.
    let line = format!("sleep 0.1; '{}' --help", env!("CARGO_BIN_EXE_penombre"));
    let mut child =
        Command::new("sh").args(["-c", &line]).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0));
    assert!(output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
}

const FOLDER: &str = "PENOMBRE_TEST_FOLDER";

/// Not a test by itself: the process that the next test interrupts. It writes a file for as long as it is let.
#[test]
fn interrupted_child() {
    let Ok(folder) = std::env::var(FOLDER) else { return };
    let folder = Path::new(&folder);
    interrupt::install().unwrap();
    let _ = atomic::write(&folder.join("image.exr"), |file| {
        file.write_all(b"half of an image")?;
        fs::write(folder.join("ready"), "")?;
        while !interrupt::requested() {
            sleep(Duration::from_millis(1));
        }
        fs::write(folder.join("asked"), "")?;
        sleep(Duration::from_secs(60));
        Err(io::Error::other("the second signal did not come"))
    });
}

/// Not a test by itself: panics on a worker while a file is half written and the main thread waits for ever.
#[test]
fn panicking_child() {
    let Ok(folder) = std::env::var(FOLDER) else { return };
    penombre::cli::install_panic_hook();
    let _ = atomic::write(&Path::new(&folder).join("image.exr"), |file| {
        file.write_all(b"half of an image")?;
        std::thread::spawn(|| panic!("a broken invariant"));
        sleep(Duration::from_secs(60));
        Err(io::Error::other("the panic did not end the process"))
    });
}

#[test]
fn a_panic_on_any_thread_is_a_message_and_status_70() {
    let folder = tempfile::tempdir().unwrap();
    let output = Command::new(std::env::current_exe().unwrap())
        .args(["process::panicking_child", "--exact", "--nocapture"])
        .env(FOLDER, folder.path())
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(70));
    let said = String::from_utf8_lossy(&output.stderr);
    for part in ["internal error", "a broken invariant", "tests/cli/process.rs:", "please report"] {
        assert!(said.contains(part), "{part}: {said}");
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0, "the temporary file is gone");
}

#[cfg(unix)]
#[test]
fn the_first_signal_asks_and_the_second_ends_at_once_with_nothing_half_written() {
    for signal in ["INT", "TERM"] {
        let folder = tempfile::tempdir().unwrap();
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args(["process::interrupted_child", "--exact", "--nocapture"])
            .env(FOLDER, folder.path())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let send =
            || assert!(Command::new("kill").args(["-s", signal, &child.id().to_string()]).status().unwrap().success());
        let names = || fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().file_name()).collect::<Vec<_>>();
        wait_for(&folder.path().join("ready"));
        assert_eq!(names().len(), 2, "the flag and the temporary file: {:?}", names());
        send();
        wait_for(&folder.path().join("asked"));
        send();
        let start = Instant::now();
        let status = child.wait().unwrap();
        assert_eq!(status.code(), Some(130));
        assert!(start.elapsed() < Duration::from_secs(20));
        let mut left = names();
        left.sort();
        assert_eq!(left, ["asked", "ready"], "no temporary file, no image");
        let mut said = String::new();
        io::Read::read_to_string(&mut child.stderr.take().unwrap(), &mut said).unwrap();
        assert!(said.contains("interrupted: finishing the frame"), "{said}");
    }
}

#[cfg(unix)]
fn wait_for(path: &Path) {
    let start = Instant::now();
    while !path.exists() {
        assert!(start.elapsed() < Duration::from_secs(30), "{} does not appear", path.display());
        sleep(Duration::from_millis(2));
    }
}
