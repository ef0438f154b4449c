//! The store of blocks: what comes back, after kills, damage and faults of the disk.

mod damage;
mod faults;
mod keeping;
mod kills;
mod support;
