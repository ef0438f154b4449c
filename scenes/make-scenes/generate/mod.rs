//! The generator behind `make-scenes`; `tests/scene/generated.rs` includes it too.

mod arch;
mod books;
mod cornell;
mod furniture;
pub mod glb;
mod hall;
mod lamps;
mod library;
mod library_glb;
mod obj;
mod paint;
mod rng;
pub mod samples;
mod shapes;
pub mod spheres;
mod stairs;
mod textures;
mod toml;

use std::io;
use std::path::{Path, PathBuf};

/// A file to write.
pub struct File {
    /// Path under the output folder, with `/`.
    pub path: String,
    /// Content.
    pub bytes: Vec<u8>,
}

/// The moonlit library as one binary glTF file: 7 MB, which is why it is made on demand.
///
/// # Errors
/// If a texture cannot be encoded.
pub fn library_glb() -> io::Result<Vec<u8>> {
    library_glb::bytes().map_err(io::Error::other)
}

/// Writes all scenes and the samples under `folder` and returns the files' paths, relative to it.
///
/// # Errors
/// If a texture cannot be encoded or a file cannot be written.
pub fn generate(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut files = cornell::files();
    files.extend(library::files().map_err(io::Error::other)?);
    files.extend(spheres::files());
    files.extend(samples::files().map_err(io::Error::other)?);
    for file in &files {
        let path = folder.join(&file.path);
        if let Some(parent) = path.parent() {
            std::fs::create_dir_all(parent)?;
        }
        std::fs::write(&path, &file.bytes)?;
    }
    Ok(files.into_iter().map(|f| PathBuf::from(f.path)).collect())
}
