//! Writes the project's own scenes: `cargo run --release --example make-scenes [FOLDER]` (default `scenes`).

mod generate;

use std::path::PathBuf;
use std::process::ExitCode;

fn main() -> ExitCode {
    let folder = std::env::args_os().nth(1).map_or_else(|| PathBuf::from("scenes"), PathBuf::from);
    match generate::generate(&folder) {
        Ok(files) => {
            println!("wrote {} files to {}", files.len(), folder.display());
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("make-scenes: {}: {error}", folder.display());
            ExitCode::from(2)
        }
    }
}
