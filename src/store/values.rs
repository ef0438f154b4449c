//! What a store is asked for, and what it tells, as plain values.

use std::time::Duration;

/// How much a store keeps, and how often.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Bytes of blocks kept, those of earlier scenes included: of these the oldest go first.
    pub most: u64,
    /// Longest time between a block's being handed over and its being committed.
    pub every: Duration,
    /// Bytes that may wait to be committed.
    pub waiting: usize,
    /// Bytes of the file that are held in memory.
    pub pages: usize,
}

impl Default for Limits {
    fn default() -> Self {
        Self { most: 8 << 30, every: Duration::from_secs(2), waiting: 32 << 20, pages: 8 << 20 }
    }
}

impl Limits {
    /// Limits by which a store takes a small part of so many bytes of memory.
    #[must_use]
    pub fn within(memory: u64) -> Self {
        let Self { waiting, pages, .. } = Self::default();
        let share = |part: u64, most: usize| ((memory / part) as usize).clamp(1 << 20, most);
        Self { waiting: share(16, waiting), pages: share(32, pages), ..Self::default() }
    }

    /// Memory that a store takes at most, bytes.
    #[must_use]
    pub const fn memory(&self) -> usize {
        self.waiting + self.pages
    }
}

/// What a run uses of a store, and tells of itself.
#[derive(Clone, Debug, Default)]
pub struct Use {
    /// The layers that it has: they are not dropped.
    pub layers: Vec<u64>,
    /// What it tells later runs with the first blocks that are kept, at most 4 MiB.
    pub note: Vec<u8>,
}

/// What was there when a store was opened.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Before {
    /// What earlier runs told, the newest first.
    pub notes: Vec<Vec<u8>>,
    /// Blocks of the run's layers.
    pub blocks: u64,
    /// Their bytes.
    pub bytes: u64,
}

/// What a store did for a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Saved {
    /// Blocks that were committed, each as often as it was.
    pub blocks: u64,
    /// Their bytes.
    pub bytes: u64,
    /// Blocks that were read and whole.
    pub read: u64,
    /// Their bytes.
    pub read_bytes: u64,
    /// Blocks that were damaged, and not believed.
    pub damaged: u64,
}
