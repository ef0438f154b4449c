//! Where the pictures of a camera path are written.

use crate::session::pictures::Picture;
use clap_lex::OsStrExt as _;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

/// Where a picture is written that was asked for as `path`.
#[must_use]
pub fn file(path: &Path, picture: &Picture) -> PathBuf {
    if picture.on_path { numbered(path, picture.index + 1) } else { path.to_owned() }
}

/// A path with a number: in place of the last run of `#` in its file name, with as many digits at least, or else of four
/// digits after an underscore before the extension.
#[must_use]
pub fn numbered(path: &Path, number: u64) -> PathBuf {
    const DIGITS: usize = 4;
    let name = path.file_name().unwrap_or_default();
    let mut parts: Vec<&OsStr> = name.split("#").collect();
    let after = parts.pop().unwrap_or_default();
    if parts.is_empty() {
        let mut named = path.file_stem().unwrap_or_default().to_owned();
        named.push(format!("_{number:0DIGITS$}."));
        named.push(path.extension().unwrap_or_default());
        return path.with_file_name(named);
    }
    // The last run leaves nothing between its signs.
    let run = parts.iter().rev().take_while(|part| part.is_empty()).count().min(parts.len() - 1);
    let digits = run + 1;
    let mut named = parts[..parts.len() - run].join(OsStr::new("#"));
    named.push(format!("{number:0digits$}"));
    named.push(after);
    path.with_file_name(named)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_go_where_the_name_asks_for_them() {
        let text = |path: &str, number| numbered(Path::new(path), number).to_string_lossy().into_owned();
        assert_eq!(text("a/walk.png", 7), "a/walk_0007.png");
        assert_eq!(text("walk_##.exr", 7), "walk_07.exr");
        assert_eq!(text("##_#b.png", 123), "##_123b.png");
        assert_eq!(text("dir##/w#.png", 12), "dir##/w12.png");
        assert_eq!(text("a.b.png", 12345), "a.b_12345.png");
        assert_eq!(text("###.png", 7), "007.png");
    }

    #[cfg(unix)]
    #[test]
    fn numbered_names_keep_their_bytes() {
        use std::os::unix::ffi::OsStrExt as _;
        let named = |name: &[u8]| numbered(Path::new(OsStr::from_bytes(name)), 7).as_os_str().as_bytes().to_vec();
        assert_eq!(named(b"\xe9.png"), b"\xe9_0007.png");
        assert_eq!(named(b"\xe9##\xff.png"), b"\xe907\xff.png");
    }
}
