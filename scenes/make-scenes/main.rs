//! Writes the project's own scenes: `cargo run --release --example make-scenes [FOLDER]` (default `scenes`); with `--glb [FILE]`
//! instead the moonlit library as glTF (default `out/moonlit_library.glb`).

mod generate;

use std::path::PathBuf;
use std::process::ExitCode;

fn main() -> ExitCode {
    let mut arguments = std::env::args_os().skip(1);
    if arguments.next().is_some_and(|first| first == "--glb") {
        let file = arguments.next().map_or_else(|| PathBuf::from("out/moonlit_library.glb"), PathBuf::from);
        let written = file.parent().map_or(Ok(()), std::fs::create_dir_all);
        let written = written.and_then(|()| std::fs::write(&file, generate::library_glb()?));
        return match written {
            Ok(()) => {
                println!("wrote {}", file.display());
                ExitCode::SUCCESS
            }
            Err(error) => {
                eprintln!("make-scenes: {}: {error}", file.display());
                ExitCode::from(2)
            }
        };
    }
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
