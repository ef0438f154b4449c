//! The binary as a user or a script drives it, with the validation layers listening.

use std::path::Path;
use std::process::{Command, Output};

/// The Cornell box of this repository.
pub const CORNELL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell_box/cornell_box.toml");

/// The binary in `folder`, its arguments separated by blanks, `{cornell}` standing for the box's path. The layers' messages go to
/// standard output or error, which tests look at.
pub fn penombre(folder: &Path, line: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_penombre"));
    let words = line.split_whitespace().map(|word| if word == "{cornell}" { CORNELL } else { word });
    command.args(words).current_dir(folder).env("PENOMBRE_VALIDATION", "1");
    command
}

pub fn run(folder: &Path, line: &str) -> Output {
    penombre(folder, line).output().unwrap_or_else(|e| panic!("{line}: {e}"))
}

pub fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Whether there is a device; says so once where not. `PENOMBRE_REQUIRE_GPU=1` makes that a failure.
pub fn has_device() -> bool {
    let output = run(Path::new("."), "info");
    let required = std::env::var("PENOMBRE_REQUIRE_GPU").is_ok_and(|v| v == "1");
    if output.status.code() == Some(3) && !required {
        println!("skipped: {}", stderr(&output));
        return false;
    }
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    true
}
