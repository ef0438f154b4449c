//! Light that outlives the run: what changed is handed to a store now and then, and what an earlier run left there is taken in when a
//! face of its cluster comes into view.
//!
//! Only light of the scene as it was loaded is kept: once lights have been switched, dimmed or moved in a run, no more is.

use super::engine::Engine;
use super::kept_blocks::Keeping;
use super::memory::Block;
use crate::cache::block::{Blocks, ClusterId};
use crate::scene::FaceId;
use crate::scene::content::Content;
use crate::store::{Before, Store};
use crate::trace::within;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Time that a batch may take for saving.
const A_BATCH: Duration = Duration::from_millis(1);

impl Engine {
    /// Keeps light in a store from now on, and begins with what is there of a scene of some content.
    pub fn keep_in(&mut self, store: Arc<Store>, content: &Content) {
        let keeping = Keeping::begin(Arc::clone(&store), content, &self.lights, self.options.hemisphere.name());
        let before = within("open the store", || store.before());
        said_of(&before, content).into_iter().for_each(|line| store.tell(line));
        self.keeping = Some(keeping);
    }

    /// Takes in what is kept of clusters that come into view for the first time.
    pub(super) fn take_kept(&mut self, faces: &[(FaceId, u32)]) {
        let Some(keeping) = &mut self.keeping else { return };
        let memory = &self.memory;
        let mut clusters: Vec<ClusterId> = faces.iter().map(|(face, _)| ClusterId::of(*face)).collect();
        clusters.dedup();
        clusters.sort_unstable();
        clusters.dedup();
        clusters.retain(|&cluster| !memory.is_spilled(cluster) && keeping.ask(cluster));
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
            self.finish_gathering();
            self.keeping.iter_mut().for_each(Keeping::begin_round);
            self.save(None);
        }
    }

    /// Whether lights never were in another state than the scene has them.
    fn is_as_loaded(&self) -> bool {
        self.memory.is_as_loaded()
    }

    /// Goes on with a round, for so long at most.
    fn save(&mut self, most: Option<Duration>) {
        let Some(mut keeping) = self.keeping.take() else { return };
        let (start, triangles) = (Instant::now(), self.scene.triangles.len() as u32);
        loop {
            if most.is_some_and(|most| start.elapsed() >= most || !keeping.has_room()) {
                keeping.pause(start.elapsed());
                break;
            }
            let Some(cluster) = keeping.next_of(ClusterId::count(triangles)) else {
                keeping.end_round(start.elapsed());
                break;
            };
            if self.memory.is_there(cluster) {
                if most.is_none() {
                    keeping.wait_for_room();
                }
                // What is written is all of the cluster.
                self.page_rest_in(cluster);
                keeping.write(cluster, &self.cache.blocks(cluster, triangles));
            }
        }
        self.keeping = Some(keeping);
    }

    /// Hands over the blocks of a cluster that leaves memory; if it is not spilled, it comes back from the store.
    pub(super) fn save_leaving(&mut self, cluster: ClusterId, blocks: &Blocks, is_spilled: bool) {
        if self.is_as_loaded()
            && let Some(keeping) = &mut self.keeping
        {
            keeping.write(cluster, blocks);
            if !is_spilled {
                keeping.forget_asked(cluster);
            }
        }
    }

    /// Bytes held for keeping light.
    pub(super) fn kept_bytes(&self) -> usize {
        self.keeping.as_ref().map_or(0, Keeping::bytes)
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
