//! Light that is kept from one run to the next: opening the store, and what is said of it.

use super::args::CacheArgs;
use super::output;
use crate::error::Result;
use crate::log::summary::KeptLight;
use crate::store::{Limits, Saved, Store};
use std::sync::Arc;

/// The store of a run, if light is kept.
pub struct Kept {
    store: Option<Arc<Store>>,
    quiet: bool,
}

impl Kept {
    /// Opens the store of the directory that was given, if any, in a small part of so many bytes of memory.
    ///
    /// # Errors
    /// As [`Store::open`].
    pub fn open(args: &CacheArgs, memory: Option<u64>, quiet: bool) -> Result<Self> {
        let limits = memory.map_or_else(Limits::default, Limits::within);
        let open = |directory| Store::open(directory, limits).map(Arc::new);
        Ok(Self { store: args.cache_dir.as_deref().map(open).transpose()?, quiet })
    }

    /// The store, for a session.
    #[must_use]
    pub fn store(&self) -> Option<Arc<Store>> {
        self.store.clone()
    }

    /// Says by `report` what there is to say since the last call; the warnings among it.
    pub fn say(&self, report: impl Fn(&str)) -> Vec<String> {
        let Some(store) = &self.store else { return Vec::new() };
        store.news().iter().filter(|_| !self.quiet).for_each(|line| report(line));
        said(&store.warnings(), report)
    }

    /// Keeps what is not kept yet, once no engine uses it any more, and says what was done; that, and warnings.
    #[must_use]
    pub fn close(&self) -> (Option<KeptLight>, Vec<String>) {
        let Some(store) = &self.store else { return (None, Vec::new()) };
        let (saved, warnings) = store.close();
        let warnings = [self.say(output::report), said(&warnings, output::report)].concat();
        let Saved { blocks, bytes, read, read_bytes, damaged } = saved;
        let kept = KeptLight {
            reused_blocks: read,
            reused_bytes: read_bytes,
            saved_blocks: blocks,
            saved_bytes: bytes,
            damaged_blocks: damaged,
        };
        if !self.quiet {
            output::report(&kept.line());
        }
        (Some(kept), warnings)
    }
}

/// Says warnings, as it returns them.
fn said(warnings: &[String], report: impl Fn(&str)) -> Vec<String> {
    let lines: Vec<String> = warnings.iter().map(|warning| format!("warning: {warning}")).collect();
    lines.iter().for_each(|line| report(line));
    lines
}
