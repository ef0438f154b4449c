//! A page file: blocks of bytes that were spilled from memory, to be paged back in.
//!
//! Blocks are appended to pages of 64 KiB; a page is written once it is full and used again once none of its blocks is wanted any
//! more. Each has a checksum and a generation, so that a block is read as it was written or not at all. The file has no name from
//! the start: it goes with the process, however that ends. It is never mapped into memory: a full disk is an error of a write, not a
//! signal.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

/// Bytes of a page, its header included.
const PAGE: usize = 64 << 10;
/// Bytes before what a page holds: checksum and generation.
const HEADER: usize = 8;
/// Bytes that a page holds.
const ROOM: usize = PAGE - HEADER;

/// Where a block lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Extent {
    /// The place of its first byte among those that pages hold: page times [`ROOM`] and what lies before.
    start: u64,
    len: u32,
    /// Generations of its pages: they follow each other, and are written together.
    generation: u32,
}

impl Extent {
    /// Bytes of the block.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.len as usize
    }

    /// Whether it holds nothing.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.len == 0
    }

    fn pages(&self) -> std::ops::RangeInclusive<usize> {
        let last = self.start + u64::from(self.len.saturating_sub(1));
        (self.start / ROOM as u64) as usize..=(last / ROOM as u64) as usize
    }
}

/// What is known of a page.
#[derive(Clone, Copy, Debug, Default)]
struct Page {
    /// Blocks in it that are wanted.
    blocks: u32,
    generation: u32,
}

/// The file.
#[derive(Debug)]
pub struct PageFile {
    file: File,
    pages: Vec<Page>,
    /// Pages that can be written again.
    free: Vec<usize>,
    /// The page that blocks are appended to, and what it holds so far.
    open: Option<usize>,
    filling: Vec<u8>,
    /// Written so far: its number marks pages.
    generation: u32,
}

impl PageFile {
    /// Creates one in a folder.
    ///
    /// # Errors
    /// If that cannot be written to.
    pub fn create(folder: &Path) -> io::Result<Self> {
        let file = tempfile::tempfile_in(folder)?;
        Ok(Self { file, pages: Vec::new(), free: Vec::new(), open: None, filling: Vec::new(), generation: 0 })
    }

    /// The folder for files that go with the process.
    #[must_use]
    pub fn usual_folder() -> PathBuf {
        // Not /tmp where it is in memory, which is what is short.
        let disk = PathBuf::from("/var/tmp");
        if disk.is_dir() { disk } else { std::env::temp_dir() }
    }

    /// Bytes of the file.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        (self.pages.len() * PAGE) as u64
    }

    /// Keeps a block.
    ///
    /// # Errors
    /// If the disk is full or fails: nothing that was kept before is lost.
    pub fn write(&mut self, block: &[u8]) -> io::Result<Extent> {
        if block.len() > ROOM {
            return self.write_large(block);
        }
        if self.open.is_some() && self.filling.len() + block.len() > ROOM {
            self.close_page()?;
        }
        let page = match self.open {
            Some(page) => page,
            None => {
                let page = self.free.pop().unwrap_or_else(|| self.add_pages(1));
                self.generation = self.generation.wrapping_add(1);
                self.pages[page].generation = self.generation;
                self.open = Some(page);
                page
            }
        };
        let start = (page * ROOM + self.filling.len()) as u64;
        self.filling.extend_from_slice(block);
        self.pages[page].blocks += 1;
        Ok(Extent { start, len: block.len() as u32, generation: self.pages[page].generation })
    }

    /// One of more than a page: on new ones side by side.
    fn write_large(&mut self, block: &[u8]) -> io::Result<Extent> {
        let too_long = || io::Error::new(io::ErrorKind::FileTooLarge, "a block of more than 4 GiB");
        let len = u32::try_from(block.len()).map_err(|_| too_long())?;
        let count = block.len().div_ceil(ROOM);
        let first = self.add_pages(count);
        self.generation = self.generation.wrapping_add(1);
        for (page, part) in (first..).zip(block.chunks(ROOM)) {
            self.pages[page] = Page { blocks: 1, generation: self.generation };
            if let Err(fault) = self.write_page(page, part) {
                (first..first + count).for_each(|page| self.pages[page].blocks = 0);
                self.free.extend(first..first + count);
                return Err(fault);
            }
        }
        Ok(Extent { start: (first * ROOM) as u64, len, generation: self.generation })
    }

    fn add_pages(&mut self, count: usize) -> usize {
        self.pages.resize(self.pages.len() + count, Page::default());
        self.pages.len() - count
    }

    /// Writes the page that is being filled. If that fails it stays open, and its blocks in memory.
    fn close_page(&mut self) -> io::Result<()> {
        if let Some(page) = self.open {
            self.write_page(page, &self.filling)?;
            self.open = None;
            self.filling.clear();
        }
        Ok(())
    }

    fn write_page(&self, page: usize, content: &[u8]) -> io::Result<()> {
        let mut bytes = vec![0; HEADER];
        bytes.extend_from_slice(content);
        bytes.resize(PAGE, 0);
        bytes[4..8].copy_from_slice(&self.pages[page].generation.to_le_bytes());
        let sum = crc32fast::hash(&bytes[4..]);
        bytes[..4].copy_from_slice(&sum.to_le_bytes());
        write_at(&self.file, &bytes, (page * PAGE) as u64)
    }

    /// A block as it was kept; it stays.
    ///
    /// # Errors
    /// If it cannot be read, or is not what was written.
    pub fn read(&self, extent: Extent) -> io::Result<Vec<u8>> {
        let pages = extent.pages();
        if self.open == Some(*pages.start()) {
            let from = (extent.start % ROOM as u64) as usize;
            let block = self.filling.get(from..from + extent.len());
            return block.map(<[u8]>::to_vec).ok_or_else(damaged);
        }
        let mut content = Vec::with_capacity(pages.clone().count() * ROOM);
        let mut bytes = vec![0; PAGE];
        for page in pages.clone() {
            read_at(&self.file, &mut bytes, (page * PAGE) as u64)?;
            let word = |at: usize| u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]);
            if word(0) != crc32fast::hash(&bytes[4..]) || word(4) != extent.generation {
                return Err(damaged());
            }
            content.extend_from_slice(&bytes[HEADER..]);
        }
        let from = extent.start as usize - pages.start() * ROOM;
        content.get(from..from + extent.len()).map(<[u8]>::to_vec).ok_or_else(damaged)
    }

    /// Gives the place of a block back.
    pub fn forget(&mut self, extent: Extent) {
        for page in extent.pages() {
            self.pages[page].blocks = self.pages[page].blocks.saturating_sub(1);
            if self.pages[page].blocks == 0 {
                if self.open == Some(page) {
                    self.open = None;
                    self.filling.clear();
                }
                self.free.push(page);
            }
        }
    }
}

fn damaged() -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, "a page is not as it was written")
}

#[cfg(unix)]
fn write_at(file: &File, bytes: &[u8], offset: u64) -> io::Result<()> {
    std::os::unix::fs::FileExt::write_all_at(file, bytes, offset)
}

#[cfg(unix)]
fn read_at(file: &File, bytes: &mut [u8], offset: u64) -> io::Result<()> {
    std::os::unix::fs::FileExt::read_exact_at(file, bytes, offset)
}

#[cfg(not(unix))]
fn write_at(mut file: &File, bytes: &[u8], offset: u64) -> io::Result<()> {
    use std::io::{Seek, SeekFrom, Write};
    file.seek(SeekFrom::Start(offset))?;
    file.write_all(bytes)
}

#[cfg(not(unix))]
fn read_at(mut file: &File, bytes: &mut [u8], offset: u64) -> io::Result<()> {
    use std::io::{Read, Seek, SeekFrom};
    file.seek(SeekFrom::Start(offset))?;
    file.read_exact(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::mix;

    fn block(seed: u64) -> Vec<u8> {
        let longest = if seed.is_multiple_of(50) { 3 * PAGE as u64 } else { 20_000 };
        (0..1 + mix(seed) % longest).map(|i| mix(seed + i) as u8).collect()
    }

    #[test]
    fn blocks_come_back_as_they_were_in_any_order() {
        let mut file = PageFile::create(&std::env::temp_dir()).expect("a folder for temporary files");
        let (mut kept, mut most): (Vec<(Extent, u64)>, usize) = (Vec::new(), 0);
        for step in 0..2000 {
            if mix(step).is_multiple_of(2) || kept.is_empty() {
                kept.push((file.write(&block(step)).expect("room"), step));
            } else {
                let (extent, seed) = kept.swap_remove((mix(step) >> 8) as usize % kept.len());
                assert!(file.read(extent).expect("kept") == block(seed), "block {seed}");
                file.forget(extent);
            }
            most = most.max(kept.iter().map(|(extent, _)| extent.len()).sum());
        }
        kept.iter().for_each(|(extent, seed)| assert!(file.read(*extent).expect("kept") == block(*seed)));
        assert!(file.bytes() < 8 * most as u64, "places are used again: {} {most}", file.bytes());
    }

    #[test]
    fn a_page_that_was_changed_is_noticed() {
        let mut file = PageFile::create(&std::env::temp_dir()).expect("a folder for temporary files");
        let first = file.write(&vec![1; ROOM]).expect("room");
        let second = file.write(&vec![2; ROOM]).expect("room");
        assert!(file.read(first).is_ok() && file.read(second).is_ok());
        write_at(&file.file, &[7], 100).expect("written");
        assert_eq!(file.read(first).map_err(|fault| fault.kind()), Err(io::ErrorKind::InvalidData));
        assert!(file.read(second).is_ok(), "still in memory");
        file.forget(first);
        let third = file.write(&vec![3; ROOM]).expect("room");
        file.write(&[4; 9]).expect("closes the page before");
        assert!(file.read(third).is_ok());
        assert!(file.read(first).is_err(), "its page belongs to another now");
    }
}
