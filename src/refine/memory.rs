//! The memory budget: what the engine holds, what its faces out of view have been written to, and which of them go first.

use crate::cache::block::{BlockLayer, ClusterId};
use crate::cache::bytes::Part;
use crate::cache::pool::map_bytes;
use crate::cache::vertex::VertexName;
use crate::scene::FaceId;
use crate::store::page_file::{Extent, PageFile};
use rustc_hash::FxHashMap;
use std::io;

/// What memory is held for, with the bytes.
pub type HeldParts = [Part; 19];

/// Memory as the log and the window tell it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MemoryStats {
    /// Bytes that may be held; 0 without a limit.
    pub budget: u64,
    /// Bytes that are held: by the engine, and by a renderer for the same slots and triangles.
    pub held: u64,
    /// What these are held for.
    pub parts: HeldParts,
    /// Bytes of places that were given back and wait to be used again.
    pub free: u64,
    /// Faces that were evicted.
    pub evicted: u64,
    /// Splits that were undone.
    pub coarsened: u64,
    /// Clusters of faces that were spilled, and those that were paged in again.
    pub spilled: u64,
    /// See [`Self::spilled`].
    pub paged_in: u64,
    /// Bytes of the page file.
    pub file_bytes: u64,
    /// Whether refinement has stopped for want of memory.
    pub full: bool,
    /// Whether it ever has.
    pub short: bool,
    /// Whether the page file cannot be written: what does not fit in is computed again when it is seen.
    pub cannot_spill: bool,
}

/// Blocks of a cluster on disk.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spilled {
    /// Where they are: shape, direct light by group, indirect light, each after its length.
    extent: Extent,
    /// Faces and splits.
    size: [u32; 2],
    /// The lighting that they are of ([`Memory::relight`]).
    lighting: u32,
}

/// Bytes of a length.
const LENGTH: usize = size_of::<u32>();

/// A block that was read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Block {
    /// What it holds.
    pub layer: BlockLayer,
    /// Its bytes.
    pub bytes: Vec<u8>,
    /// Whether it is of the present lights.
    pub is_current: bool,
}

/// When the light of layers last changed: numbers of lightings.
#[derive(Clone, Debug, Default)]
struct Changed {
    direct: FxHashMap<u32, u32>,
    indirect: u32,
}

/// What there is memory for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Room {
    /// More vertices: leaves can be split.
    pub for_vertices: bool,
    /// Samples of indirect light at vertices that have none.
    pub for_samples: bool,
}

impl Default for Room {
    fn default() -> Self {
        Self { for_vertices: true, for_samples: true }
    }
}

impl Room {
    /// Rays of indirect light at a vertex at most, `most` as long as there is room: without, what lies between vertices is wrong by
    /// more than their noise.
    #[must_use]
    pub const fn most_rays(self, most: u32) -> u32 {
        /// Some 5 % noise.
        const ENOUGH: u32 = 512;
        if self.for_vertices { most } else { ENOUGH }
    }
}

/// The budget, and what was spilled for it.
#[derive(Debug, Default)]
pub struct Memory {
    /// Bytes that may be held, if there is a limit.
    pub(super) budget: Option<usize>,
    /// Views so far, and the last that showed a face of each cluster.
    views: u32,
    seen: Vec<u32>,
    spilled: FxHashMap<ClusterId, Spilled>,
    file: Option<PageFile>,
    lighting: u32,
    changed: Changed,
    /// Base vertices of faces that are gone which still predict others.
    pub(super) predicting: Vec<VertexName>,
    pub(super) room: Room,
    /// Tasks that a batch has room for.
    pub(super) tasks: u64,
    pub(super) stats: MemoryStats,
}

impl Memory {
    /// A budget of so many bytes; what does not fit in goes to the file, or is computed again where there is none.
    #[must_use]
    pub fn limited(budget: usize, file: io::Result<PageFile>) -> Self {
        let mut memory = Self { budget: Some(budget), ..Self::default() };
        memory.stats.cannot_spill = file.is_err();
        memory.file = file.ok();
        memory
    }

    /// Notes which clusters a view shows.
    pub(super) fn see(&mut self, faces: impl Iterator<Item = FaceId>) {
        self.views += 1;
        for face in faces {
            let cluster = ClusterId::of(face).0 as usize;
            if cluster >= self.seen.len() {
                self.seen.resize(cluster + 1, 0);
            }
            self.seen[cluster] = self.views;
        }
    }

    /// Clusters that views have shown and this one does not, those first that were seen longest ago.
    pub(super) fn by_age(&self) -> Vec<ClusterId> {
        let out_of_view = (0..).zip(&self.seen).filter(|&(_, &seen)| seen > 0 && seen < self.views);
        let mut order: Vec<(u32, u32)> = out_of_view.map(|(cluster, &seen)| (seen, cluster)).collect();
        order.sort_unstable();
        order.into_iter().map(|(_, cluster)| ClusterId(cluster)).collect()
    }

    /// Whether there are any such clusters.
    pub(super) fn has_old(&self) -> bool {
        self.seen.iter().any(|&seen| seen > 0 && seen < self.views)
    }

    /// Whether faces of a cluster are there, as far as views have shown them.
    pub(super) fn is_there(&self, cluster: ClusterId) -> bool {
        self.seen.get(cluster.0 as usize).is_some_and(|&seen| seen > 0)
    }

    /// Whether lights never changed.
    pub(super) const fn is_as_loaded(&self) -> bool {
        self.lighting == 0
    }

    /// Notes that nothing of a cluster is there any more.
    pub(super) fn note_gone(&mut self, cluster: ClusterId) {
        if let Some(seen) = self.seen.get_mut(cluster.0 as usize) {
            *seen = 0;
        }
    }

    /// Notes that faces of a cluster are there, in view or not.
    pub(super) fn note_there(&mut self, cluster: ClusterId) {
        let at = cluster.0 as usize;
        if at >= self.seen.len() {
            self.seen.resize(at + 1, 0);
        }
        if self.seen[at] == 0 {
            self.seen[at] = self.views.max(1);
        }
    }

    /// Notes that lights have changed, so that direct light of these groups and indirect light are not what was spilled.
    pub(super) fn relight(&mut self, groups: impl Iterator<Item = usize>) {
        self.lighting += 1;
        self.changed.indirect = self.lighting;
        self.changed.direct.extend(groups.map(|group| (group as u32, self.lighting)));
    }

    /// Whether a layer that was spilled under a lighting is still right.
    pub(super) fn is_current(&self, layer: BlockLayer, lighting: u32) -> bool {
        let changed = match layer {
            BlockLayer::Shape => 0,
            BlockLayer::Direct(group) => self.changed.direct.get(&group).copied().unwrap_or(0),
            BlockLayer::Indirect => self.changed.indirect,
        };
        lighting >= changed
    }

    /// Whether a cluster was spilled.
    pub(super) fn is_spilled(&self, cluster: ClusterId) -> bool {
        self.spilled.contains_key(&cluster)
    }

    /// Splits of faces that were spilled, about.
    pub(super) fn splits_of_spilled(&self, faces: &[FaceId]) -> usize {
        let spilled = faces.iter().filter_map(|&face| self.spilled.get(&ClusterId::of(face)));
        spilled.map(|Spilled { size: [faces, splits], .. }| *splits as usize / (*faces as usize).max(1)).sum()
    }

    /// Writes a cluster's blocks in order of their layers; whether they are kept.
    pub(super) fn spill(&mut self, cluster: ClusterId, blocks: &[&[u8]], size: [u32; 2]) -> bool {
        let Some(file) = &mut self.file else { return false };
        let mut bytes = Vec::with_capacity(blocks.iter().map(|block| block.len() + LENGTH).sum());
        for block in blocks {
            bytes.extend((block.len() as u32).to_le_bytes());
            bytes.extend_from_slice(block);
        }
        match file.write(&bytes) {
            Ok(extent) => {
                self.spilled.insert(cluster, Spilled { extent, size, lighting: self.lighting });
                self.stats.spilled += 1;
                self.stats.file_bytes = file.bytes();
                true
            }
            Err(_) => {
                self.stats.cannot_spill = true;
                false
            }
        }
    }

    /// Forgets what was spilled of a cluster: all of it is in memory.
    pub(super) fn forget_spilled(&mut self, cluster: ClusterId) {
        if let Some((Spilled { extent, .. }, file)) = self.spilled.remove(&cluster).zip(self.file.as_mut()) {
            file.forget(extent);
        }
    }

    /// A cluster's blocks from the disk, where they stay, each with whether its layer is still right; `None` if they cannot be read.
    pub(super) fn page_in(&mut self, cluster: ClusterId) -> Option<Vec<Block>> {
        let Spilled { extent, lighting, .. } = *self.spilled.get(&cluster)?;
        let bytes = self.file.as_ref()?.read(extent);
        self.stats.cannot_spill |= bytes.is_err();
        let bytes = bytes.ok()?;
        self.stats.paged_in += 1;
        let (mut rest, mut found) = (bytes.as_slice(), Vec::new());
        while let Some((length, after)) = rest.split_first_chunk::<LENGTH>() {
            let (block, after) = after.split_at_checked(u32::from_le_bytes(*length) as usize)?;
            found.push(block.to_vec());
            rest = after;
        }
        let groups = found.len().saturating_sub(2) as u32;
        let direct = (0..groups).map(BlockLayer::Direct);
        let layers = [BlockLayer::Shape].into_iter().chain(direct).chain([BlockLayer::Indirect]);
        let block = |(layer, bytes)| Block { layer, bytes, is_current: self.is_current(layer, lighting) };
        Some(layers.zip(found).map(block).collect())
    }

    /// Bytes held for all this.
    pub(super) fn bytes(&self) -> usize {
        let predicting = self.predicting.len() * size_of::<VertexName>();
        self.seen.len() * size_of::<u32>() + map_bytes(&self.spilled) + predicting
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::TriangleId;

    fn face(triangle: u32) -> FaceId {
        FaceId::new(TriangleId(triangle), false)
    }

    #[test]
    fn what_was_seen_longest_ago_goes_first_and_what_is_seen_not_at_all() {
        let mut memory = Memory::default();
        memory.see([0, 64, 128].map(face).into_iter());
        memory.see([64, 200].map(face).into_iter());
        memory.see([200].map(face).into_iter());
        assert_eq!(memory.by_age(), [0, 128, 64].map(|t| ClusterId::of(face(t))));
        memory.note_gone(ClusterId::of(face(0)));
        assert_eq!(memory.by_age(), [128, 64].map(|t| ClusterId::of(face(t))));
        memory.note_there(ClusterId::of(face(0)));
        memory.see(std::iter::empty());
        assert_eq!(memory.by_age().len(), 4);
    }

    #[test]
    fn spilled_blocks_come_back_with_what_has_become_of_their_light() {
        let file = PageFile::create(&std::env::temp_dir()).expect("a folder for temporary files");
        let mut memory = Memory::limited(1, Ok(file));
        let cluster = ClusterId(3);
        assert!(memory.spill(cluster, &[b"shape", b"first", b"", b"indirect"], [3, 5]));
        memory.relight([1].into_iter());
        let blocks = memory.page_in(cluster).expect("it was spilled");
        let found: Vec<(BlockLayer, &[u8], bool)> =
            blocks.iter().map(|block| (block.layer, block.bytes.as_slice(), block.is_current)).collect();
        let [first, second] = [0, 1].map(BlockLayer::Direct);
        assert_eq!(
            found,
            [
                (BlockLayer::Shape, &b"shape"[..], true),
                (first, b"first", true),
                (second, b"", false),
                (BlockLayer::Indirect, b"indirect", false)
            ]
        );
        memory.forget_spilled(cluster);
        assert!(!memory.is_spilled(cluster) && memory.page_in(cluster).is_none());
    }

    #[test]
    fn without_a_file_nothing_is_kept() {
        let mut memory = Memory::limited(1, Err(io::Error::other("no file")));
        assert!(!memory.spill(ClusterId(0), &[b"shape"], [1, 0]) && !memory.is_spilled(ClusterId(0)));
    }
}
