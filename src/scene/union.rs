//! Disjoint sets.

/// Disjoint sets of the numbers from 0; the smallest member is the root.
pub(super) struct Union {
    parent: Vec<u32>,
}

impl Union {
    /// `count` sets of one number each.
    pub(super) fn new(count: u32) -> Self {
        Self { parent: (0..count).collect() }
    }

    /// The smallest number of the set of `k`.
    pub(super) fn root(&mut self, mut k: u32) -> u32 {
        while self.parent[k as usize] != k {
            let above = self.parent[self.parent[k as usize] as usize];
            self.parent[k as usize] = above;
            k = above;
        }
        k
    }

    /// Makes one set of those of `a` and `b`.
    pub(super) fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.parent[a.max(b) as usize] = a.min(b);
    }
}
