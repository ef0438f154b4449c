//! The store of an engine: keys of its layers, what the store has of each cluster, and when to save.

use super::memory::Block;
use crate::cache::block::{BlockLayer, Blocks, ClusterId};
use crate::light::lights::Lights;
use crate::math::content_hash::{ContentHash, of_hashes};
use crate::scene::content::Content;
use crate::store::{BlockKey, Store, Use};
use rustc_hash::{FxHashMap, FxHashSet};
use std::collections::HashMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Time before the first round of saving, which looks at all clusters for what changed; between two of them, at least, and how many times
/// as long as a round takes.
const FIRST_ROUND: Duration = Duration::from_secs(1);
const ROUND: Duration = Duration::from_secs(3);
const PAUSE: u32 = 30;
/// Bytes before those of a block of a layer: a hash of the shape that it was written with, whose vertices it goes by.
const SHAPE: usize = 8;

/// Keys of layers in the store.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Keys {
    shape: u64,
    direct: Vec<u64>,
    indirect: u64,
}

impl Keys {
    fn new(content: &Content, lights: &Lights, method: &str) -> Self {
        // Lights that are the same twice have a layer each.
        let mut seen: HashMap<u64, u64> = HashMap::new();
        let mut key = |group: usize| {
            let key = content.direct_key(lights.sources_of_group(group));
            let before = seen.entry(key).or_insert(0);
            *before += 1;
            if *before == 1 { key } else { of_hashes("once more", &[key, *before]) }
        };
        let direct = (0..lights.group_count()).map(&mut key).collect();
        Self { shape: content.shape_key(), direct, indirect: content.indirect_key(method) }
    }

    fn all(&self) -> Vec<u64> {
        [self.shape, self.indirect].into_iter().chain(self.direct.iter().copied()).collect()
    }

    fn of(&self, layer: BlockLayer) -> u64 {
        match layer {
            BlockLayer::Shape => self.shape,
            BlockLayer::Direct(group) => self.direct.get(group as usize).copied().unwrap_or(0),
            BlockLayer::Indirect => self.indirect,
        }
    }
}

/// The store of an engine, and what is known of it.
#[derive(Debug)]
pub(super) struct Keeping {
    store: Arc<Store>,
    keys: Keys,
    /// Hashes of the blocks of clusters as the store has them, by layer.
    kept: FxHashMap<ClusterId, Box<[u32]>>,
    /// Clusters that were asked for.
    asked: FxHashSet<ClusterId>,
    /// Clusters from here on are to be looked at in this round.
    next: u32,
    /// Time that the round has taken so far.
    spent: Duration,
    /// When the next round is due.
    due: Instant,
}

impl Keeping {
    /// Begins a run of a scene of some content.
    pub(super) fn begin(store: Arc<Store>, content: &Content, lights: &Lights, method: &str) -> Self {
        let keys = Keys::new(content, lights, method);
        let note = serde_json::to_vec(content).unwrap_or_default();
        store.begin(Use { layers: keys.all(), note });
        let (kept, asked, due) = (FxHashMap::default(), FxHashSet::default(), Instant::now() + FIRST_ROUND);
        Self { store, keys, kept, asked, next: 0, spent: Duration::ZERO, due }
    }

    /// Whether a cluster is to be asked for: it was not before.
    pub(super) fn ask(&mut self, cluster: ClusterId) -> bool {
        self.asked.insert(cluster)
    }

    /// Has a cluster be asked for once more.
    pub(super) fn forget_asked(&mut self, cluster: ClusterId) {
        self.asked.remove(&cluster);
    }

    /// Whether blocks may be handed over without waiting.
    pub(super) fn has_room(&self) -> bool {
        self.store.has_room()
    }

    /// Waits until they may.
    pub(super) fn wait_for_room(&self) {
        self.store.wait_for_room();
    }

    /// Begins a round anew.
    pub(super) fn begin_round(&mut self) {
        self.next = 0;
    }

    /// The next cluster of a round, of so many.
    pub(super) fn next_of(&mut self, count: u32) -> Option<ClusterId> {
        let next = ClusterId(self.next);
        self.next += 1;
        (next.0 < count).then_some(next)
    }

    /// Notes that the round goes on later, and what it took so far.
    pub(super) fn pause(&mut self, spent: Duration) {
        self.spent += spent;
    }

    /// Notes that the round is over.
    pub(super) fn end_round(&mut self, spent: Duration) {
        self.due = Instant::now() + ROUND.max((self.spent + spent) * PAUSE);
        (self.next, self.spent) = (0, Duration::ZERO);
    }

    /// Bytes held for the store, and for what is known of it.
    pub(super) fn bytes(&self) -> usize {
        let a_cluster = size_of::<(ClusterId, Box<[u32]>)>() + size_of::<ClusterId>() + 2;
        let hashes = self.kept.len() * (self.keys.direct.len() + 2) * size_of::<u32>();
        self.kept.capacity().max(self.asked.capacity()) * a_cluster + hashes + self.store.limits().memory()
    }

    /// Whether a round is under way, or the next is due.
    pub(super) fn is_due(&self) -> bool {
        self.next > 0 || Instant::now() >= self.due
    }

    /// The blocks of a cluster that are kept and fit together; nothing without a shape.
    pub(super) fn read(&mut self, cluster: ClusterId, is_current: &impl Fn(BlockLayer) -> bool) -> Option<Vec<Block>> {
        let shape = self.store.read(self.key(BlockLayer::Shape, cluster))?;
        let hash = hash_of(&shape);
        let groups = (0..self.keys.direct.len() as u32).map(BlockLayer::Direct);
        let mut kept = vec![short(hash)];
        let mut blocks = Vec::new();
        for layer in groups.chain([BlockLayer::Indirect]) {
            let found = self.store.read(self.key(layer, cluster));
            kept.push(found.as_deref().map_or(0, |bytes| short(hash_of(bytes))));
            if let Some((of, bytes)) = found.as_deref().and_then(<[u8]>::split_first_chunk::<SHAPE>)
                && u64::from_le_bytes(*of) == hash
            {
                blocks.push(Block { layer, bytes: bytes.to_vec(), is_current: is_current(layer) });
            }
        }
        blocks.insert(0, Block { layer: BlockLayer::Shape, bytes: shape, is_current: true });
        self.kept.insert(cluster, kept.into());
        Some(blocks)
    }

    /// Hands over those blocks of a cluster that are not as the store has them.
    pub(super) fn write(&mut self, cluster: ClusterId, blocks: &Blocks) {
        if blocks.is_empty() {
            return;
        }
        let hash = hash_of(&blocks.shape);
        let with_shape = |bytes: &[u8]| [&hash.to_le_bytes()[..], bytes].concat();
        let layers =
            (0..).map(BlockLayer::Direct).zip(&blocks.direct).chain([(BlockLayer::Indirect, &blocks.indirect)]);
        let layers = layers.map(|(layer, bytes)| (layer, bytes.as_deref().map(with_shape)));
        let all: Vec<(BlockLayer, Option<Vec<u8>>)> =
            std::iter::once((BlockLayer::Shape, Some(blocks.shape.clone()))).chain(layers).collect();
        let hash_of = |bytes: Option<&[u8]>| bytes.map_or(0, |bytes| short(hash_of(bytes)));
        let hashes: Box<[u32]> = all.iter().map(|(_, bytes)| hash_of(bytes.as_deref())).collect();
        let before = self.kept.insert(cluster, hashes.clone()).unwrap_or_default();
        let is_new = |at: usize| before.get(at) != Some(&hashes[at]);
        let changed = all.into_iter().enumerate().filter(|(at, _)| is_new(*at));
        let changed = changed.filter_map(|(_, (layer, bytes))| Some((self.key(layer, cluster), bytes?)));
        self.store.write(changed);
    }

    fn key(&self, layer: BlockLayer, ClusterId(cluster): ClusterId) -> BlockKey {
        BlockKey { layer: self.keys.of(layer), cluster }
    }
}

/// Enough of a hash to tell whether a block is as it was.
const fn short(hash: u64) -> u32 {
    hash as u32
}

fn hash_of(bytes: &[u8]) -> u64 {
    let mut hash = ContentHash::new("block");
    hash.bytes(bytes);
    hash.finish()
}
