//! Which file a path leads to.

use std::path::Path;

/// A file, whatever its name; nothing where there is none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct FileIdentity(Option<[u64; 2]>);

impl FileIdentity {
    /// The file at a path.
    pub(super) fn of(path: &Path) -> Self {
        Self(std::fs::metadata(path).ok().map(|found| numbers(&found)))
    }
}

#[cfg(unix)]
fn numbers(file: &std::fs::Metadata) -> [u64; 2] {
    use std::os::unix::fs::MetadataExt as _;
    [file.dev(), file.ino()]
}

/// Whether it is there is all that can be told.
#[cfg(not(unix))]
const fn numbers(_: &std::fs::Metadata) -> [u64; 2] {
    [0; 2]
}
