//! Blocks that tell who they are.

use penombre::store::{BlockKey, Limits, Store, Use};
use std::path::Path;
use std::time::Duration;

/// SplitMix64.
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    pub fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }
}

/// Bytes that only this block has in this round, 1 to 32 KiB.
pub fn block(key: BlockKey, round: u64) -> Vec<u8> {
    let mut random = Random(key.layer ^ u64::from(key.cluster) << 20 ^ round << 40);
    let words = 128 + random.below(4096 - 128);
    std::iter::once(round).chain((1..words).map(|_| random.next())).flat_map(u64::to_le_bytes).collect()
}

/// The round of a block, which must be whole.
pub fn round_of(key: BlockKey, bytes: &[u8]) -> u64 {
    let round = u64::from_le_bytes(bytes[..8].try_into().unwrap());
    assert!(bytes == block(key, round), "{key:?}: not the bytes of round {round}");
    round
}

pub fn key(layer: u64, cluster: u32) -> BlockKey {
    BlockKey { layer, cluster }
}

/// Commits as soon as something waits.
pub const AT_ONCE: Limits = Limits { most: 1 << 30, every: Duration::ZERO, waiting: 1 << 20, pages: 1 << 20 };

pub fn open(directory: &Path) -> Store {
    begun(directory, &[1, 2, 3], b"a note", AT_ONCE)
}

/// A store, and a run that uses some layers.
pub fn begun(directory: &Path, layers: &[u64], note: &[u8], limits: Limits) -> Store {
    let store = Store::open(directory, limits).unwrap();
    store.begin(Use { layers: layers.to_vec(), note: note.to_vec() });
    store
}
