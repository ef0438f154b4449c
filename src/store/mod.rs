//! What is kept outside of memory: a page file for what does not fit in while the process lives, and a store of blocks that outlives it,
//! bytes by key in one directory, in a file of the crate redb (docs/cache.md).
//!
//! The store is four functions: [`Store::open`], [`Store::read`], [`Store::write`], [`Store::close`]. What the blocks mean is the caller's; the
//! store sees to it that a block which comes back is the one that went in, that a process which is killed leaves the old state or the new,
//! and that no fault of the disk ends a run.

mod block;
mod database;
mod directory;
mod file_identity;
pub mod page_file;
mod saver;
mod store_file;
mod values;

pub use block::{BlockKey, MAX_BLOCK};
pub use saver::Store;
pub use values::{Before, Limits, Saved, Use};
