//! Images: film, EXR and PNG files, tone mapping, metrics.

pub mod atomic;
pub mod error_picture;
pub mod exr;
pub mod film;
pub mod flip;
pub mod metrics;
pub mod png;
pub mod tone_mapping;

use std::path::Path;

/// The image formats that can be written, told by a file's extension.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileFormat {
    /// Linear, half or 32-bit float, with layers.
    Exr,
    /// As displayed: exposed, tone-mapped, 8-bit sRGB.
    Png,
}

impl FileFormat {
    /// The format that `path` asks for, whatever the case of its extension; `None` for any other.
    #[must_use]
    pub fn of(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_str()?.to_ascii_lowercase();
        match extension.as_str() {
            "exr" => Some(Self::Exr),
            "png" => Some(Self::Png),
            _ => None,
        }
    }
}
