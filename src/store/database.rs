//! The database of a store: blocks by key, what is known of their layers, and notes, in one file of the crate redb.
//!
//! A transaction is there as a whole or not at all: redb writes new pages beside the old ones and switches to them last. Quick repair
//! keeps what a file that was left open needs with each commit, so that opening it after a kill takes no longer. When it is opened all of it
//! is read and checked: redb trusts pages that it once wrote, and a changed one could make it panic.

use super::block::{BlockKey, MAX_BLOCK};
use super::store_file::StoreFile;
use redb::{Durability, ReadableDatabase, ReadableTable, TableDefinition, WriteTransaction};
use std::collections::BTreeSet;
use std::path::Path;

/// Sealed blocks by layer and cluster.
const BLOCKS: TableDefinition<'_, (u64, u32), &[u8]> = TableDefinition::new("blocks");
/// By layer: the run that used it last, its bytes, its blocks.
const LAYERS: TableDefinition<'_, u64, (u64, u64, u64)> = TableDefinition::new("layers");
/// What runs left to be told of later, by run.
const NOTES: TableDefinition<'_, u64, &[u8]> = TableDefinition::new("notes");
/// Numbers by name.
const NUMBERS: TableDefinition<'_, &str, u64> = TableDefinition::new("numbers");
const FORMAT: &str = "format";
const RUNS: &str = "runs";

/// Version of these tables.
const VERSION: u64 = 1;
/// Notes that are kept, and the longest, bytes.
const MOST_NOTES: u64 = 16;
pub(super) const MAX_NOTE: usize = 4 << 20;
/// A file is made smaller when it is this much longer than its blocks.
const SLACK: u64 = 64 << 20;

/// Why a file of blocks cannot be used.
#[derive(Debug)]
pub(super) enum Refusal {
    /// A later version of the program wrote it.
    Newer(u64),
    /// It is damaged, or none of ours; why.
    Damaged(String),
    /// The system says no; why.
    System(String),
}

/// An open file of blocks.
pub(super) struct Database {
    inner: redb::Database,
    /// Number of this run.
    run: u64,
    /// Bytes of blocks that are kept at most, those of the present run included.
    most: u64,
}

/// What was there when a file was opened.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Found {
    /// Notes of earlier runs, the newest first.
    pub(super) notes: Vec<Vec<u8>>,
    /// Blocks and bytes of layers that were asked for.
    pub(super) blocks: u64,
    pub(super) bytes: u64,
}

impl Database {
    /// Opens a file, which is made if it is not there, and may take so many bytes of blocks; so many bytes of it are held in memory.
    ///
    /// # Errors
    /// Why it cannot be used; it is left as it is.
    pub(super) fn open(path: &Path, most: u64, pages: usize) -> Result<Self, Refusal> {
        let file = StoreFile::open(path, longest(most)).map_err(|e| Refusal::System(e.to_string()))?;
        let mut builder = redb::Database::builder();
        builder.set_cache_size(pages).set_check_integrity_on_open(true);
        let mut database = Self { inner: builder.create_with_backend(file).map_err(refusal)?, run: 0, most };
        let damaged = |e: redb::Error| Refusal::Damaged(e.to_string());
        if let Some(version) = database.number(FORMAT).map_err(damaged)?.filter(|&version| version > VERSION) {
            return Err(Refusal::Newer(version));
        }
        database.make_smaller(path);
        Ok(database)
    }

    fn number(&self, name: &str) -> Result<Option<u64>, redb::Error> {
        match self.inner.begin_read()?.open_table(NUMBERS) {
            Ok(table) => Ok(table.get(name)?.map(|value| value.value())),
            Err(redb::TableError::TableDoesNotExist(_)) => Ok(None),
            Err(fault) => Err(fault.into()),
        }
    }

    fn transaction(&self) -> Result<WriteTransaction, redb::Error> {
        let mut transaction = self.inner.begin_write()?;
        transaction.set_quick_repair(true);
        transaction.set_durability(Durability::Immediate)?;
        Ok(transaction)
    }

    /// Begins a run that uses `layers`; of others the oldest are dropped if there are too many. What of them is there.
    ///
    /// # Errors
    /// Those of the disk.
    pub(super) fn begin_run(&mut self, layers: &[u64]) -> Result<Found, redb::Error> {
        let transaction = self.transaction()?;
        let mut found = Found::default();
        {
            let mut numbers = transaction.open_table(NUMBERS)?;
            self.run = numbers.get(RUNS)?.map_or(0, |value| value.value()).saturating_add(1);
            numbers.insert(RUNS, self.run)?;
            numbers.insert(FORMAT, VERSION)?;
            transaction.open_table(BLOCKS)?;
            let mut kept = transaction.open_table(LAYERS)?;
            for layer in layers {
                let known = kept.get(layer)?.map(|value| value.value());
                if let Some((_, bytes, blocks)) = known {
                    kept.insert(layer, (self.run, bytes, blocks))?;
                    (found.bytes, found.blocks) =
                        (found.bytes.saturating_add(bytes), found.blocks.saturating_add(blocks));
                }
            }
            let notes = transaction.open_table(NOTES)?;
            for entry in notes.iter()?.rev() {
                found.notes.push(entry?.1.value().to_vec());
            }
        }
        drop_oldest(&transaction, self.run, self.most)?;
        transaction.commit()?;
        Ok(found)
    }

    /// Gives the disk back what is not used, if that is much.
    fn make_smaller(&mut self, path: &Path) {
        let used = self.bytes().unwrap_or(u64::MAX);
        let long = std::fs::metadata(path).map_or(0, |file| file.len());
        if long > used.saturating_mul(2).saturating_add(SLACK) {
            // A file that stays long is no fault.
            let _ = self.inner.compact();
        }
    }

    /// Bytes of all blocks.
    fn bytes(&self) -> Result<u64, redb::Error> {
        let table = self.inner.begin_read()?.open_table(LAYERS)?;
        let mut sum = 0u64;
        for entry in table.iter()? {
            sum = sum.saturating_add(entry?.1.value().1);
        }
        Ok(sum)
    }

    /// A sealed block.
    pub(super) fn block(&self, key: BlockKey) -> Result<Option<Vec<u8>>, redb::Error> {
        let table = self.inner.begin_read()?.open_table(BLOCKS)?;
        let found = table.get((key.layer, key.cluster))?;
        Ok(found.map(|value| value.value().get(..MAX_BLOCK + 64).unwrap_or(value.value()).to_vec()))
    }

    /// Keeps sealed blocks, all or none, and what is to be told of them; older layers are dropped until there is room, if
    /// that is enough. The bytes that are kept then.
    pub(super) fn keep<'a>(
        &self,
        blocks: impl Iterator<Item = (BlockKey, &'a [u8])>,
        note: Option<&[u8]>,
    ) -> Result<u64, redb::Error> {
        let transaction = self.transaction()?;
        {
            let mut table = transaction.open_table(BLOCKS)?;
            let mut layers = transaction.open_table(LAYERS)?;
            for (key, block) in blocks {
                let before = table.insert((key.layer, key.cluster), block)?.map(|old| old.value().len() as u64);
                let (_, bytes, count) = layers.get(key.layer)?.map_or((0, 0, 0), |value| value.value());
                let bytes = bytes.saturating_sub(before.unwrap_or(0)).saturating_add(block.len() as u64);
                layers.insert(key.layer, (self.run, bytes, count + u64::from(before.is_none())))?;
            }
            if let Some(note) = note {
                let mut notes = transaction.open_table(NOTES)?;
                notes.insert(self.run, note)?;
                notes.retain(|run, _| run + MOST_NOTES > self.run)?;
            }
        }
        let kept = drop_oldest(&transaction, self.run, self.most)?;
        transaction.commit()?;
        Ok(kept)
    }
}

/// The longest a file may get: what a change replaces stays until it is committed, and redb doubles a file that grows.
const fn longest(most: u64) -> u64 {
    most.saturating_mul(4).saturating_add(SLACK)
}

/// Drops layers that this run does not use, those that were used longest ago first, until no more than `most` bytes are kept: how
/// many are kept then.
fn drop_oldest(transaction: &WriteTransaction, run: u64, most: u64) -> Result<u64, redb::Error> {
    let mut layers = transaction.open_table(LAYERS)?;
    let mut by_age = BTreeSet::new();
    let mut kept = 0u64;
    for entry in layers.iter()? {
        let (layer, value) = entry?;
        let (used, bytes, _) = value.value();
        kept = kept.saturating_add(bytes);
        if used != run {
            by_age.insert((used, layer.value(), bytes));
        }
    }
    let mut blocks = transaction.open_table(BLOCKS)?;
    for (_, layer, bytes) in by_age {
        if kept <= most {
            break;
        }
        blocks.retain_in((layer, 0)..=(layer, u32::MAX), |_, _| false)?;
        layers.remove(layer)?;
        kept = kept.saturating_sub(bytes);
    }
    Ok(kept)
}

fn refusal(fault: redb::DatabaseError) -> Refusal {
    use redb::{DatabaseError, StorageError};
    match fault {
        DatabaseError::Storage(StorageError::Io(e)) if is_of_content(e.kind()) => Refusal::Damaged(e.to_string()),
        DatabaseError::Storage(StorageError::Io(e)) => Refusal::System(e.to_string()),
        DatabaseError::Storage(StorageError::Corrupted(why)) => Refusal::Damaged(why),
        other => Refusal::Damaged(other.to_string()),
    }
}

/// Whether an error is about what a file holds.
fn is_of_content(kind: std::io::ErrorKind) -> bool {
    matches!(kind, std::io::ErrorKind::InvalidData | std::io::ErrorKind::UnexpectedEof)
}
