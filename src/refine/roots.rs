//! Roots of faces with which something is still to be done, in the order in which they were added.

use crate::cache::ids::NodeId;
use rustc_hash::FxHashSet;

/// A list that may be added to faster than it is worked off: its length stays in proportion to the roots in it, however often each is added.
#[derive(Debug, Default)]
pub struct Roots {
    list: Vec<NodeId>,
    /// Length beyond which doubles are taken out: twice what was left the last time, so that each addition costs the same.
    most: usize,
}

impl Roots {
    /// Whether there are none.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Adds roots behind all others; of one that is there already the first place counts.
    pub fn add(&mut self, roots: impl IntoIterator<Item = NodeId>) {
        const FEW: usize = 4096;
        self.list.extend(roots);
        if self.list.len() > self.most.max(FEW) {
            let mut seen = FxHashSet::default();
            self.list.retain(|&root| seen.insert(root));
            self.most = 2 * self.list.len();
        }
    }

    /// Drops roots that are gone.
    pub fn retain(&mut self, is_there: impl Fn(NodeId) -> bool) {
        self.list.retain(|&root| is_there(root));
    }

    /// Takes the first ones, at most so many; the same one may come twice.
    pub fn take(&mut self, most: usize) -> Vec<NodeId> {
        self.list.drain(..most.min(self.list.len())).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_stays_as_long_as_there_are_roots_and_keeps_their_order() {
        let mut roots = Roots::default();
        for turn in 0..1000 {
            roots.add((0..500).map(|root| NodeId((root + 7 * turn) % 5000)));
        }
        assert!((5000..=10_000).contains(&roots.list.len()), "{}", roots.list.len());
        let first = roots.take(3);
        assert_eq!(first, [0, 1, 2].map(NodeId));
        let mut rest = roots.take(usize::MAX);
        assert!(roots.is_empty());
        rest.sort_unstable();
        rest.dedup();
        assert_eq!(rest.len(), 4997, "none is lost");
    }
}
