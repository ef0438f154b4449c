//! The store of blocks: what comes back, after kills, damage and faults of the disk.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

mod damage;
mod faults;
mod keeping;
mod kills;
mod support;
