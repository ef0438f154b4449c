//! Output files appear whole or not at all: written beside the target, then renamed over it.

use crate::error::{Error, Result};
use std::fs::{self, File, OpenOptions, Permissions};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use tempfile::NamedTempFile;

/// Temporary files that exist now, for [`remove_temporaries`].
static IN_FLIGHT: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

fn in_flight() -> MutexGuard<'static, Vec<PathBuf>> {
    // The list is valid after any panic: every change is a single push or retain.
    IN_FLIGHT.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Keeps a temporary file listed while it exists.
struct Listed(PathBuf);

impl Listed {
    fn new(path: &Path) -> Self {
        in_flight().push(path.to_owned());
        Self(path.to_owned())
    }
}

impl Drop for Listed {
    fn drop(&mut self) {
        in_flight().retain(|p| *p != self.0);
    }
}

/// Deletes the temporary files of writes under way, for a process about to exit without unwinding.
pub fn remove_temporaries() {
    for path in in_flight().iter() {
        // Nothing can be done about a failure here, and the process is ending.
        let _ = fs::remove_file(path);
    }
}

/// Writes `path` through `write`: a new file in the same folder, synced and renamed over the old one.
///
/// A symbolic link is followed; a device or pipe is written in place. A new file gets the permissions of any created
/// file (0666 less the umask), a replaced one keeps its own.
///
/// # Errors
/// [`Error::Io`] naming `path`; the old file is then untouched and the temporary one removed.
pub fn write(path: &Path, write: impl FnOnce(&mut File) -> io::Result<()>) -> Result<()> {
    let attempt = || -> io::Result<()> {
        let target = resolve(path);
        match fs::metadata(&target) {
            Ok(old) if old.is_file() => replace(&target, Some(old.permissions()), write),
            Ok(_) => {
                let mut device = OpenOptions::new().write(true).open(&target)?;
                write(&mut device)
            }
            Err(_) => replace(&target, None, write),
        }
    };
    attempt().map_err(|e| Error::io(path, "cannot write", e))
}

/// The file that `path` stands for: symbolic links followed, even one whose target does not exist yet.
fn resolve(path: &Path) -> PathBuf {
    if let Ok(target) = fs::canonicalize(path) {
        return target;
    }
    match fs::read_link(path) {
        Ok(link) => folder_of(path).join(link),
        Err(_) => path.to_owned(),
    }
}

/// Whether two paths name the same file, or would once it exists.
#[must_use]
pub fn is_same_file(a: &Path, b: &Path) -> bool {
    let located = |path: &Path| {
        let target = resolve(path);
        // The file may not exist yet, but `./a` and `a` share a folder that does.
        let folder = fs::canonicalize(folder_of(&target)).unwrap_or_else(|_| folder_of(&target).to_owned());
        folder.join(target.file_name().unwrap_or_default())
    };
    located(a) == located(b)
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

fn replace(
    target: &Path,
    permissions: Option<Permissions>,
    write: impl FnOnce(&mut File) -> io::Result<()>,
) -> io::Result<()> {
    let mut temporary = temporary_beside(target)?;
    // Declared after `temporary`, so delisted before it is deleted; the gap is harmless.
    let _listed = Listed::new(temporary.path());
    write(temporary.as_file_mut())?;
    if let Some(permissions) = permissions {
        temporary.as_file().set_permissions(permissions)?;
    }
    // Without this a power cut shortly after the rename could leave an empty file under the final name.
    temporary.as_file().sync_all()?;
    temporary.persist(target).map_err(|e| e.error)?;
    Ok(())
}

fn temporary_beside(target: &Path) -> io::Result<NamedTempFile> {
    let name = target.file_name().unwrap_or_default().to_string_lossy();
    // Bounded, so that a long but legal name stays legal with the random part.
    let short: String = name.chars().take(40).collect();
    let prefix = format!(".{short}.");
    let mut builder = tempfile::Builder::new();
    builder.prefix(&prefix).suffix(".tmp");
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder_of(target))
}

/// Checks before any work that every path can be written: its folder takes new files, it is no folder itself, and
/// no two are the same file.
///
/// # Errors
/// One [`Error::Usage`] that lists every fault, a line each.
pub fn check_writable(paths: &[&Path]) -> Result<()> {
    let mut faults: Vec<String> = paths.iter().filter_map(|p| fault_of(p)).collect();
    for (i, path) in paths.iter().enumerate() {
        if paths[..i].iter().any(|earlier| is_same_file(earlier, path)) {
            faults.push(format!("{}: named twice as an output; give each its own file", path.display()));
        }
    }
    if faults.is_empty() { Ok(()) } else { Err(Error::Usage(faults.join("\n"))) }
}

fn fault_of(path: &Path) -> Option<String> {
    let shown = path.display();
    let target = resolve(path);
    let folder = folder_of(&target);
    if path.file_name().is_none() || target.is_dir() {
        return Some(format!("{shown}: is a folder; name a file in it"));
    }
    if target.exists() && !target.is_file() {
        return None; // a device or a pipe: opening it now could block or have an effect
    }
    if !folder.exists() {
        return Some(format!("{shown}: the folder {} does not exist; create it first", folder.display()));
    }
    if !folder.is_dir() {
        return Some(format!("{shown}: {} is not a folder", folder.display()));
    }
    // Trying is the only test that knows of access lists, read-only mounts and quotas.
    temporary_beside(&target).err().map(|e| format!("{shown}: cannot write into {}: {e}", folder.display()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write as _;

    fn entries(folder: &Path) -> usize {
        fs::read_dir(folder).expect("folder").count()
    }

    #[test]
    fn a_failed_write_leaves_the_old_file_and_no_other() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("a.exr");
        write(&path, |f| f.write_all(b"old")).expect("first");
        let failed = write(&path, |f| {
            f.write_all(b"half of the new")?;
            assert_eq!(entries(folder.path()), 2, "the new file lies beside the old one while it is written");
            Err(io::Error::other("no more"))
        });
        let message = failed.expect_err("fails").to_string();
        assert!(message.contains("a.exr") && message.contains("no more"), "{message}");
        assert_eq!(fs::read(&path).expect("old"), b"old");
        assert_eq!(entries(folder.path()), 1);
        write(&path, |f| f.write_all(b"new")).expect("second");
        assert_eq!(fs::read(&path).expect("new"), b"new");
    }

    #[test]
    fn an_exit_without_unwinding_can_remove_what_is_half_written() {
        let folder = tempfile::tempdir().expect("folder");
        let failed = write(&folder.path().join("a.exr"), |f| {
            f.write_all(b"half")?;
            let own: Vec<_> = fs::read_dir(folder.path())?.collect::<io::Result<_>>()?;
            assert_eq!(own.len(), 1);
            assert!(in_flight().contains(&own[0].path()));
            // Only this file: other tests write at the same time.
            in_flight().iter().filter(|p| p.starts_with(folder.path())).for_each(|p| fs::remove_file(p).expect("rm"));
            Ok(())
        });
        assert!(failed.is_err(), "nothing is left to rename");
        assert_eq!(entries(folder.path()), 0);
        assert!(!in_flight().iter().any(|p| p.starts_with(folder.path())));
    }

    #[cfg(unix)]
    #[test]
    fn permissions_links_and_devices() {
        use std::os::unix::fs::{PermissionsExt as _, symlink};
        let folder = tempfile::tempdir().expect("folder");
        let at = |name: &str| folder.path().join(name);
        let mode = |path: &Path| fs::metadata(path).expect("file").permissions().mode() & 0o777;
        fs::write(at("plain"), b"").expect("plain");
        write(&at("new"), |_| Ok(())).expect("new");
        assert_eq!(mode(&at("new")), mode(&at("plain")), "as any created file");
        fs::set_permissions(at("new"), Permissions::from_mode(0o640)).expect("chmod");
        write(&at("new"), |_| Ok(())).expect("replace");
        assert_eq!(mode(&at("new")), 0o640, "a replaced file keeps its mode");

        symlink("new", at("link")).expect("link");
        write(&at("link"), |f| f.write_all(b"through")).expect("through the link");
        assert_eq!(fs::read(at("new")).expect("target"), b"through");
        assert!(fs::symlink_metadata(at("link")).expect("link").is_symlink());

        symlink("later", at("dangling")).expect("link");
        write(&at("dangling"), |f| f.write_all(b"made")).expect("through a dangling link");
        assert_eq!(fs::read(at("later")).expect("target"), b"made");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_disk_is_an_error_with_the_name() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("full.exr");
        std::os::unix::fs::symlink("/dev/full", &path).expect("link");
        let error = write(&path, |f| f.write_all(b"x")).expect_err("full").to_string();
        assert!(error.contains("full.exr") && error.contains("No space"), "{error}");
    }

    #[test]
    fn all_bad_outputs_are_named_at_once() {
        let folder = tempfile::tempdir().expect("folder");
        let good = folder.path().join("good.exr");
        let nowhere = folder.path().join("nowhere/a.exr");
        fs::write(folder.path().join("file"), b"").expect("file");
        let under_file = folder.path().join("file/a.exr");
        let error = check_writable(&[&good, &nowhere, folder.path(), &under_file, &good]).expect_err("faults");
        assert_eq!(error.exit_status(), 2);
        let text = error.to_string();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), 4, "{text}");
        assert!(lines[0].contains("nowhere") && lines[0].contains("does not exist"), "{text}");
        assert!(lines[1].contains("is a folder"), "{text}");
        assert!(lines[2].contains("file is not a folder"), "{text}");
        assert!(lines[3].contains("twice"), "{text}");
        check_writable(&[&good]).expect("a good path");
        assert!(is_same_file(&good, &folder.path().join(".").join("good.exr")));
        assert!(!is_same_file(&good, &nowhere));
        assert_eq!(entries(folder.path()), 1, "the check leaves nothing behind");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_folder_that_takes_no_files_is_found_out() {
        // Even root cannot create files in /proc.
        let error = check_writable(&[Path::new("/proc/a.exr")]).expect_err("refused").to_string();
        assert!(error.contains("cannot write into /proc"), "{error}");
    }
}
