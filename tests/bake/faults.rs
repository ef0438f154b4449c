//! Faults of the system: a full disk, folders that take no files, signals, readers that go away.

use crate::support::binary::{CORNELL, penombre, run, stderr};
use std::fs;
use std::process::{Command, Stdio};
use std::time::Duration;

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_said_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["full.ply", "full.glb"] {
        std::os::unix::fs::symlink("/dev/full", folder.path().join(name)).unwrap();
        let output = run(folder.path(), &format!("bake {{cornell}} -q --mesh base --rays 1000 -o {name}"));
        assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
        assert!(stderr(&output).contains(name) && stderr(&output).contains("No space left"), "{}", stderr(&output));
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
}

/// Whoever may not write is told so before any work. Root may write anywhere: it becomes somebody else first, if it can.
#[cfg(target_os = "linux")]
#[test]
fn a_folder_of_somebody_else_is_refused_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let (binary, out) = (env!("CARGO_BIN_EXE_penombre"), folder.path().join("a.ply"));
    // Where nobody may reach it.
    let reachable = tempfile::tempdir_in("/tmp").unwrap();
    let copy = reachable.path().join("penombre");
    fs::copy(binary, &copy).unwrap();
    fs::set_permissions(reachable.path(), std::os::unix::fs::PermissionsExt::from_mode(0o755)).unwrap();
    fs::write(reachable.path().join("a.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    fs::set_permissions(folder.path(), std::os::unix::fs::PermissionsExt::from_mode(0o755)).unwrap();
    let as_nobody = ["--reuid", "65534", "--regid", "65534", "--clear-groups"];
    let mut command = Command::new("setpriv");
    command.args(as_nobody).arg(&copy).arg("bake").arg(reachable.path().join("a.obj")).arg("-o").arg(&out);
    let Ok(output) = command.output() else { return println!("skipped: no setpriv") };
    if stderr(&output).contains("setpriv:") {
        return println!("skipped: {}", stderr(&output));
    }
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(stderr(&output).contains("cannot write into"), "{}", stderr(&output));
}

/// Whichever signal asks for an end, what there is is written.
#[cfg(unix)]
#[test]
fn signals_end_a_run_in_order() {
    for signal in ["TERM", "HUP"] {
        let folder = tempfile::tempdir().unwrap();
        let mut command = penombre(folder.path(), "bake {cornell} --time 100 -o a.glb");
        let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(1500));
        assert!(Command::new("kill").args(["-s", signal, &child.id().to_string()]).status().unwrap().success());
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(130), "{signal}: {}", stderr(&output));
        assert!(folder.path().join("a.glb").exists(), "{signal}");
    }
}

/// Nobody reads what is said: the work is done all the same.
#[cfg(unix)]
#[test]
fn closed_streams_are_no_fault() {
    let folder = tempfile::tempdir().unwrap();
    let mut command = penombre(folder.path(), "bake {cornell} --mesh base --rays 1000 -v -o a.ply");
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    drop((child.stdout.take(), child.stderr.take()));
    assert_eq!(child.wait().unwrap().code(), Some(0));
    assert!(folder.path().join("a.ply").exists());
}

/// A file that outgrows the limit of the process is refused as on a full disk, and nothing is left of it.
#[cfg(target_os = "linux")]
#[test]
fn a_limit_of_files_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let line =
        format!("ulimit -f 8; exec '{}' bake '{}' -q --rays 100000 -o a.ply", env!("CARGO_BIN_EXE_penombre"), CORNELL);
    let output = Command::new("bash").args(["-c", &line]).current_dir(folder.path()).output().unwrap();
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(stderr(&output).contains("a.ply") && stderr(&output).contains("File too large"), "{}", stderr(&output));
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}
