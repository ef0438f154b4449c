//! Telling what a file is, and refusing what is no scene with one clear message.

use std::path::Path;

/// Largest OBJ or MTL file that is read, bytes.
const MAX_FILE: u64 = 2 << 30;
/// Largest binary file that is read, bytes.
const MAX_BINARY: u64 = 4 << 30;
/// Largest scene file, bytes: its parsed form is many times larger.
const MAX_SCENE_FILE: u64 = 16 << 20;
/// So much of a file is searched for NUL bytes, which no text has.
const SNIFFED: usize = 4096;

/// What the main file is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// A scene file in TOML.
    SceneFile,
    /// A bare OBJ.
    Obj,
    /// A bare glTF, as text or binary.
    Gltf,
}

/// The kind of `path` by its name, or why it is no scene.
pub(super) fn kind(path: &Path) -> Result<Kind, String> {
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    match extension.as_str() {
        "toml" => Ok(Kind::SceneFile),
        "obj" => Ok(Kind::Obj),
        "gltf" | "glb" => Ok(Kind::Gltf),
        _ => Err("is neither a scene file (.toml) nor an OBJ (.obj) nor glTF (.gltf, .glb): give one of these".into()),
    }
}

const GLTF: &str = "is a binary glTF file: name it .glb";

/// Reads a file of any bytes whole, or says why not; as [`read_text`].
pub(super) fn read_binary(path: &Path) -> Result<Vec<u8>, String> {
    whole(path, MAX_BINARY)
}

/// Reads an OBJ or MTL file whole, or says why not. Never reads devices, pipes or files beyond 2 GiB.
pub(super) fn read_text(path: &Path) -> Result<Vec<u8>, String> {
    read_up_to(path, MAX_FILE)
}

/// Reads a scene file whole, or says why not.
pub(super) fn read_scene_file(path: &Path) -> Result<Vec<u8>, String> {
    read_up_to(path, MAX_SCENE_FILE)
}

fn read_up_to(path: &Path, limit: u64) -> Result<Vec<u8>, String> {
    let bytes = whole(path, limit)?;
    refuse(&bytes).map_or(Ok(bytes), |why| Err(why.into()))
}

fn whole(path: &Path, limit: u64) -> Result<Vec<u8>, String> {
    let data = std::fs::metadata(path).map_err(|e| format!("cannot be read: {e}"))?;
    if data.is_dir() {
        return Err("is a directory: name a file in it".into());
    }
    if !data.is_file() {
        return Err("is not a regular file".into());
    }
    if data.len() > limit {
        return Err(format!("is larger than {} MiB: split it into several files", limit >> 20));
    }
    std::fs::read(path).map_err(|e| format!("cannot be read: {e}"))
}

fn refuse(bytes: &[u8]) -> Option<&'static str> {
    if bytes.trim_ascii().is_empty() {
        return Some("is empty");
    }
    if bytes.starts_with(b"glTF") {
        return Some(GLTF);
    }
    let head = &bytes[..bytes.len().min(SNIFFED)];
    memchr::memchr(0, head).map(|_| "is a binary file, not text")
}
