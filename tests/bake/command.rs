//! The command as a user types it.

use crate::support::binary::{penombre, run, stderr};
use std::fs;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

#[test]
fn mistakes_are_refused_before_any_work() {
    let folder = tempfile::tempdir().unwrap();
    for (line, word) in [
        ("bake {cornell}", "OUT"),
        ("bake {cornell} -o a.obj", ".ply or .glb"),
        ("bake {cornell} -o a.ply --frames 3", "--frames"),
        ("bake {cornell} -o a.ply --texel 0", "more than 0"),
        ("bake {cornell} -o a.ply --scale nan", "more than 0"),
        ("bake {cornell} -o a.ply --mesh fine", "adapted"),
        ("bake {cornell} -o a.ply --sides left", "lit"),
        ("bake {cornell} -o a.ply -o ./a.ply", "twice"),
        ("bake {cornell} -o nowhere/a.ply", "does not exist"),
        ("bake nothing.toml -o a.ply", "nothing.toml"),
    ] {
        let output = run(folder.path(), line);
        assert_eq!(output.status.code(), Some(2), "{line}: {}", stderr(&output));
        assert!(stderr(&output).contains(word), "{line}: {}", stderr(&output));
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

/// The same work gives the same bytes, whatever the threads; and there is no device.
#[test]
fn rays_and_seed_say_what_is_written() {
    let folder = tempfile::tempdir().unwrap();
    for threads in [1, 3] {
        let line = format!("bake {{cornell}} -q --rays 150000 --threads {threads} -o {threads}.ply -o {threads}.glb");
        let mut command = penombre(folder.path(), &line);
        let output =
            command.env("VK_DRIVER_FILES", "/nonexistent").env("VK_ICD_FILENAMES", "/nonexistent").output().unwrap();
        assert_eq!((output.status.code(), stderr(&output)), (Some(0), String::new()));
    }
    for extension in ["ply", "glb"] {
        let [one, three] = [1, 3].map(|n| fs::read(folder.path().join(format!("{n}.{extension}"))).unwrap());
        assert!(one == three, "{extension}");
    }
}

#[cfg(unix)]
#[test]
fn ctrl_c_writes_what_there_is() {
    let folder = tempfile::tempdir().unwrap();
    let mut command = penombre(folder.path(), "bake {cornell} --time 100 -o a.ply");
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    std::thread::sleep(Duration::from_millis(1500));
    let start = Instant::now();
    assert!(Command::new("kill").args(["-s", "INT", &child.id().to_string()]).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130), "{}", stderr(&output));
    assert!(start.elapsed() < Duration::from_secs(30));
    assert!(stderr(&output).contains("(interrupted)"), "{}", stderr(&output));
    assert!(fs::metadata(folder.path().join("a.ply")).unwrap().len() > 1000);
}

#[test]
fn too_many_lights_to_keep_apart_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let light = |i: usize| {
        format!("[[light]]\nname = \"l{i}\"\nkind = \"point\"\nposition = [0, 1, 0]\nintensity = [1, 1, 1]\n")
    };
    let lights: String = (0..257).map(light).collect();
    fs::write(folder.path().join("a.obj"), "v 0 0 0\nv 1 0 0\nv 0 0 -1\nf 1 2 3\n").unwrap();
    fs::write(folder.path().join("a.toml"), format!("[geometry]\nobj = [\"a.obj\"]\n{lights}")).unwrap();
    let output = run(folder.path(), "bake a.toml -o a.ply --per-light");
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(stderr(&output).contains("257 lights"), "{}", stderr(&output));
}
