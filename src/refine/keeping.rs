//! Light that outlives the run: what changed is handed to a store now and then, and what an earlier run left there is taken in when a
//! face of its cluster comes into view.
//!
//! Only light of the scene as it was loaded is kept: once lights have been switched, dimmed or moved in a run, no more is.

use super::engine::Engine;
use super::memory::Block;
use crate::cache::block::{BlockLayer, Blocks, ClusterId};
use crate::light::lights::Lights;
use crate::math::content_hash::{ContentHash, of_hashes};
use crate::scene::FaceId;
use crate::scene::content::Content;
use crate::store::{Before, BlockKey, Store, Use};
use crate::trace::within;
use rustc_hash::{FxHashMap, FxHashSet};
use std::collections::HashMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Time between two rounds of saving, which look at all clusters for what changed: at least so long, and so many times as long as a round
/// takes.
const ROUND: Duration = Duration::from_secs(3);
const PAUSE: u32 = 30;
/// Time that a batch may take for it.
const A_BATCH: Duration = Duration::from_millis(1);
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
pub struct Keeping {
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

impl Engine {
    /// Keeps light in a store from now on, and begins with what is there of a scene of some content.
    pub fn keep_in(&mut self, store: Arc<Store>, content: &Content) {
        let keys = Keys::new(content, &self.lights, self.options.hemisphere.name());
        let note = serde_json::to_vec(content).unwrap_or_default();
        store.begin(Use { layers: keys.all(), note });
        let before = within("open the store", || store.before());
        said_of(&before, content).into_iter().for_each(|line| store.tell(line));
        let (kept, asked, due) = (FxHashMap::default(), FxHashSet::default(), Instant::now() + ROUND);
        self.keeping = Some(Keeping { store, keys, kept, asked, next: 0, spent: Duration::ZERO, due });
    }

    /// Takes in what is kept of clusters that come into view for the first time.
    pub(super) fn take_kept(&mut self, faces: &[(FaceId, u32)]) {
        let Some(keeping) = &mut self.keeping else { return };
        let memory = &self.memory;
        let mut clusters: Vec<ClusterId> = faces.iter().map(|(face, _)| ClusterId::of(*face)).collect();
        clusters.dedup();
        clusters.sort_unstable();
        clusters.dedup();
        clusters.retain(|&cluster| !memory.is_spilled(cluster) && keeping.asked.insert(cluster));
        let is_current = |layer| memory.is_current(layer, 0);
        let blocks: Vec<(ClusterId, Vec<Block>)> = within("read kept light", || {
            clusters.into_iter().filter_map(|cluster| Some((cluster, keeping.read(cluster, &is_current)?))).collect()
        });
        if !blocks.is_empty() {
            within("take kept light in", || self.take_blocks(&blocks));
        }
    }

    /// Hands over what changed since it was last, as far as the time of a batch allows.
    pub(super) fn save_some(&mut self) {
        if self.keeping.as_ref().is_some_and(Keeping::is_due) && self.is_as_loaded() {
            within("save", || self.save(Some(A_BATCH)));
        }
    }

    /// Hands over all that changed since it was last.
    pub fn save_all(&mut self) {
        if self.is_as_loaded() {
            if let Some(keeping) = &mut self.keeping {
                keeping.next = 0;
            }
            self.save(None);
        }
    }

    /// Whether lights never were in another state than the scene has them.
    fn is_as_loaded(&self) -> bool {
        self.memory.is_as_loaded()
    }

    /// Goes on with a round, for so long at most.
    fn save(&mut self, most: Option<Duration>) {
        let Some(keeping) = &mut self.keeping else { return };
        let (start, triangles) = (Instant::now(), self.scene.triangles.len() as u32);
        let count = ClusterId::count(triangles);
        while keeping.next < count {
            match most {
                Some(most) if !keeping.store.has_room() || start.elapsed() >= most => {
                    keeping.spent += start.elapsed();
                    return;
                }
                Some(_) => {}
                None => keeping.store.wait_for_room(),
            }
            let cluster = ClusterId(keeping.next);
            keeping.next += 1;
            if self.memory.is_there(cluster) {
                keeping.write(cluster, &self.cache.blocks(cluster, triangles));
            }
        }
        let spent = keeping.spent + start.elapsed();
        keeping.due = Instant::now() + ROUND.max(spent * PAUSE);
        (keeping.next, keeping.spent) = (0, Duration::ZERO);
    }

    /// Hands over the blocks of a cluster that leaves memory; if it is not spilled, it comes back from the store.
    pub(super) fn save_leaving(&mut self, cluster: ClusterId, blocks: &Blocks, is_spilled: bool) {
        if self.is_as_loaded()
            && let Some(keeping) = &mut self.keeping
        {
            keeping.write(cluster, blocks);
            if !is_spilled {
                keeping.asked.remove(&cluster);
            }
        }
    }

    /// Bytes held for what is known of the store.
    pub(super) fn kept_bytes(&self) -> usize {
        self.keeping.as_ref().map_or(0, |keeping| {
            let a_cluster = size_of::<(ClusterId, Box<[u32]>)>() + size_of::<ClusterId>() + 2;
            keeping.kept.capacity().max(keeping.asked.capacity()) * a_cluster
                + keeping.kept.len() * (keeping.keys.direct.len() + 2) * size_of::<u32>()
        })
    }
}

impl Drop for Engine {
    /// Keeps what is not kept yet.
    fn drop(&mut self) {
        if self.keeping.is_some() && !std::thread::panicking() {
            within("save", || self.save_all());
        }
    }
}

impl Keeping {
    /// Whether a round is under way, or the next is due.
    fn is_due(&self) -> bool {
        self.next > 0 || Instant::now() >= self.due
    }

    /// The blocks of a cluster that are kept and fit together; nothing without a shape.
    fn read(&mut self, cluster: ClusterId, is_current: &impl Fn(BlockLayer) -> bool) -> Option<Vec<Block>> {
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
    fn write(&mut self, cluster: ClusterId, blocks: &Blocks) {
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

/// What is there of an earlier run's light, and why not more of it is.
fn said_of(before: &Before, content: &Content) -> Vec<String> {
    let earlier: Vec<Content> = before.notes.iter().filter_map(|note| serde_json::from_slice(note).ok()).collect();
    // The newest of those with the most in common.
    let Some(like) = earlier.iter().rev().max_by_key(|earlier| content.in_common(earlier)) else {
        return vec!["kept light: none yet".to_owned()];
    };
    let there = if before.blocks == 0 {
        "kept light: none of this scene".to_owned()
    } else {
        format!("kept light: {} blocks, {:.1} MiB", before.blocks, before.bytes as f64 / f64::from(1 << 20))
    };
    std::iter::once(there).chain(content.changes(like)).collect()
}
