//! Light that outlives a run: clusters that an earlier run has kept are taken in when their faces come into view; those that have
//! changed since they were last saved are handed out.

use super::engine::Engine;
use super::memory::Block;
use crate::cache::block::{BlockLayer, ClusterId};

/// Blocks of an earlier run.
pub trait Kept: Send + Sync {
    /// Whether there are any of a cluster.
    fn has(&self, cluster: ClusterId) -> bool;

    /// The blocks of a cluster, as far as they are of the present scene.
    fn read(&mut self, cluster: ClusterId) -> Vec<(BlockLayer, Vec<u8>)>;
}

impl Engine {
    /// Has faces that come into view begin with what an earlier run has kept of them.
    pub fn resume(&mut self, kept: Box<dyn Kept>) {
        self.memory.kept = Some(kept);
    }

    /// Hands out the clusters whose light may have changed since the last call: those that were in view since, in memory or spilled.
    /// Nothing once the lights are not the scene's any more: what is kept is of these.
    pub fn save(&mut self, mut keep: impl FnMut(ClusterId, Vec<(BlockLayer, Vec<u8>)>)) {
        if self.memory.has_relit() {
            return;
        }
        self.finish_gathering();
        let triangles = self.scene.triangles.len() as u32;
        for cluster in self.memory.take_unsaved() {
            let spilled = self.memory.peek(cluster);
            let blocks = spilled.unwrap_or_else(|| {
                let blocks = self.cache.blocks(cluster, triangles);
                let shape = (BlockLayer::Shape, blocks.shape);
                let direct =
                    (0..).map(BlockLayer::Direct).zip(blocks.direct).filter_map(|(layer, block)| Some((layer, block?)));
                let indirect = blocks.indirect.map(|block| (BlockLayer::Indirect, block));
                let all = [shape].into_iter().chain(direct).chain(indirect);
                all.map(|(layer, bytes)| Block { layer, bytes, is_current: true }).collect()
            });
            let current = blocks.into_iter().filter(|block| block.is_current && !block.bytes.is_empty());
            let current: Vec<(BlockLayer, Vec<u8>)> = current.map(|block| (block.layer, block.bytes)).collect();
            if !current.is_empty() {
                keep(cluster, current);
            }
        }
    }
}
