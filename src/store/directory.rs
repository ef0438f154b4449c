//! The directory that a store has to itself, for as long as it is open.

use crate::error::{Error, Result};
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

/// Held while a process uses the directory.
const LOCK: &str = "lock";
/// The blocks.
const BLOCKS: &str = "light.redb";
/// A file of blocks that was found damaged.
const DAMAGED: &str = "light.redb.damaged";
/// Tells backups to leave the directory out (bford.info/cachedir).
const TAG: &str = "CACHEDIR.TAG";
const TAG_TEXT: &str = "Signature: 8a477f597d28d172789f06886806bc55\n# Light that Penombre keeps from one run to the next. \
    It can be deleted: it is computed again.\n";

/// A directory that no other process uses.
#[derive(Debug)]
pub(super) struct Directory {
    path: PathBuf,
    /// The system gives the lock back when this is closed, however the process ends.
    _lock: File,
}

impl Directory {
    /// Takes a directory, which is made if it is not there.
    ///
    /// # Errors
    /// [`Error::Usage`] if it is something else or in use, [`Error::Io`] if it cannot be made or written to.
    pub(super) fn take(path: &Path) -> Result<Self> {
        if fs::metadata(path).is_ok_and(|found| !found.is_dir()) {
            return Err(Error::Usage(format!("{}: is not a directory; give --cache-dir one", path.display())));
        }
        fs::create_dir_all(path).map_err(|e| Error::io(path, "cannot make the cache directory", e))?;
        let file = path.join(LOCK);
        let refused = |e| Error::io(&file, "cannot write to the cache directory", e);
        let lock = OpenOptions::new().create(true).truncate(false).write(true).open(&file).map_err(refused)?;
        match lock.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                let path = path.display();
                return Err(Error::Usage(format!(
                    "{path}: another process keeps its light there now; wait until it has ended, or give this one another --cache-dir"
                )));
            }
            Err(TryLockError::Error(e)) => return Err(Error::io(&file, "cannot lock the cache directory", e)),
        }
        let directory = Self { path: path.to_owned(), _lock: lock };
        directory.tag();
        Ok(directory)
    }

    fn tag(&self) {
        let tag = self.path.join(TAG);
        if !tag.exists() {
            // Nothing depends on it.
            let _ = fs::write(tag, TAG_TEXT);
        }
    }

    /// Where the blocks are.
    pub(super) fn blocks(&self) -> PathBuf {
        self.path.join(BLOCKS)
    }

    /// Puts a damaged file of blocks aside, over one that was put there before; its name from then on.
    ///
    /// # Errors
    /// As the system says.
    pub(super) fn put_aside(&self) -> io::Result<PathBuf> {
        let to = self.path.join(DAMAGED);
        fs::rename(self.blocks(), &to).map(|()| to)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_process_at_a_time_has_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a/b");
        let first = Directory::take(&path).unwrap();
        let refused = Directory::take(&path).unwrap_err();
        assert_eq!(refused.exit_status(), 2);
        assert!(refused.to_string().contains("another process keeps its light there"), "{refused}");
        drop(first);
        Directory::take(&path).unwrap();
        assert!(fs::read_to_string(path.join(TAG)).unwrap().starts_with("Signature: 8a477f597d28d172789f06886806bc55"));
    }

    #[test]
    fn what_is_no_directory_is_refused_with_its_name() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("scene.obj");
        fs::write(&file, "v 0 0 0").unwrap();
        for (path, why) in
            [(file.clone(), "is not a directory"), (file.join("below"), "cannot make the cache directory")]
        {
            let refused = Directory::take(&path).unwrap_err();
            assert_eq!(refused.exit_status(), 2);
            assert!(refused.to_string().contains(why), "{refused}");
        }
        assert_eq!(fs::read_to_string(&file).unwrap(), "v 0 0 0");
    }

    /// Not even the super-user may write there.
    #[cfg(target_os = "linux")]
    #[test]
    fn a_read_only_file_system_is_a_message() {
        let refused = Directory::take(Path::new("/proc/self/cache")).unwrap_err();
        assert_eq!(refused.exit_status(), 2);
        assert!(refused.to_string().contains("/proc/self/cache: cannot make the cache directory"), "{refused}");
    }
}
