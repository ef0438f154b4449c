//! The file under the database: redb's own, held to a length, so that light never fills a disk.

use redb::StorageBackend;
use redb::backends::FileBackend;
use std::fs::OpenOptions;
use std::io;
use std::path::Path;

/// A file of at most so many bytes. It takes no locks: the directory has one.
#[derive(Debug)]
pub(super) struct StoreFile {
    file: FileBackend,
    most: u64,
}

impl StoreFile {
    /// Opens a file, which is made if it is not there.
    ///
    /// # Errors
    /// As the system says.
    pub(super) fn open(path: &Path, most: u64) -> io::Result<Self> {
        let file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path)?;
        let file = FileBackend::new(file).map_err(io::Error::other)?;
        Ok(Self { file, most })
    }
}

impl StorageBackend for StoreFile {
    fn len(&self) -> io::Result<u64> {
        self.file.len()
    }

    fn read(&self, offset: u64, out: &mut [u8]) -> io::Result<()> {
        self.file.read(offset, out)
    }

    fn set_len(&self, len: u64) -> io::Result<()> {
        // It may always get shorter.
        if len > self.most && len > self.len()? {
            return Err(io::Error::new(io::ErrorKind::StorageFull, format!("it would grow to {} MiB", len >> 20)));
        }
        self.file.set_len(len)
    }

    fn sync_data(&self) -> io::Result<()> {
        self.file.sync_data()
    }

    fn write(&self, offset: u64, data: &[u8]) -> io::Result<()> {
        self.file.write(offset, data)
    }

    fn close(&self) -> io::Result<()> {
        self.file.close()
    }
}
