//! From a binary tree to one of eight children a node, by the least expected cost of a ray: after \[Ylitie17 §3.1\], whose leaves are
//! single triangles where these are as many as are tested at once.

use super::traversal::{Child, Node, WIDTH};
use super::watertight::LANES;
use obvhs::bvh2::Bvh2;
use smallvec::SmallVec;

/// What a leaf costs against a node: both are one test of all that they hold.
const LEAF_COST: f32 = 1.0;

/// The primitives of a leaf, each once.
pub type LeafPlaces = SmallVec<[u32; LANES]>;

/// A tree of eight children a node; its root is the first.
#[derive(Default)]
pub struct Collapsed {
    pub nodes: Vec<Node>,
    pub leaves: Vec<LeafPlaces>,
}

/// How each binary node is best made into some children of a wide one.
struct Plan<'a> {
    tree: &'a Bvh2,
    /// Primitives below each binary node.
    sizes: Vec<u32>,
    /// By binary node and number of children less one: how many of these the first half gets, 0 where one is best.
    shares: Vec<[u8; WIDTH]>,
}

/// Least costs as 1, 2 … children at most.
type Costs = [f32; WIDTH];

/// Collapses `tree`.
pub fn collapse(tree: &Bvh2) -> Collapsed {
    let count = tree.nodes.len();
    let mut plan = Plan { tree, sizes: vec![1; count], shares: vec![[0; WIDTH]; count] };
    plan.make();
    let mut made = Collapsed { nodes: vec![Node::new(&[])], leaves: Vec::new() };
    let mut open = vec![(0, 0)];
    while let Some((at, binary)) = open.pop() {
        let mut roots = Vec::with_capacity(WIDTH);
        plan.open(binary, WIDTH, &mut roots);
        let children: Vec<_> = roots
            .into_iter()
            .map(|root| {
                let bounds = tree.nodes[root].aabb();
                (plan.child(root, &mut made, &mut open), [bounds.min, bounds.max].map(Into::into))
            })
            .collect();
        made.nodes[at] = Node::new(&children);
    }
    made
}

impl Plan<'_> {
    /// Makes the plan: for each node once it is made for all below. Without recursion, since boxes in boxes make a chain of nodes as long
    /// as there are triangles.
    fn make(&mut self) {
        let mut order = vec![0];
        let mut next = 0;
        while let Some(&at) = order.get(next) {
            let node = &self.tree.nodes[at];
            if !node.is_leaf() {
                order.extend([node.first_index as usize, node.first_index as usize + 1]);
            }
            next += 1;
        }
        let mut costs = vec![[0.0; WIDTH]; self.tree.nodes.len()];
        for at in order.into_iter().rev() {
            costs[at] = self.costs(at, &costs);
        }
    }

    /// Makes the plan for a binary node, from the costs of its halves.
    fn costs(&mut self, at: usize, below: &[Costs]) -> Costs {
        let node = &self.tree.nodes[at];
        let (area, first) = (node.aabb().half_area(), node.first_index as usize);
        if node.is_leaf() {
            return [area * LEAF_COST; WIDTH];
        }
        let [left, right] = [below[first], below[first + 1]];
        self.sizes[at] = self.sizes[first] + self.sizes[first + 1];
        let mut costs = [0.0; WIDTH];
        for children in 2..=WIDTH {
            let cost = |share: usize| left[share - 1] + right[children - share - 1];
            let share = (1..children).min_by(|&a, &b| cost(a).total_cmp(&cost(b))).unwrap_or(1);
            (costs[children - 1], self.shares[at][children - 1]) = (cost(share), share as u8);
        }
        let alone = if self.is_leaf(at) { LEAF_COST * area } else { area + costs[WIDTH - 1] };
        costs[0] = alone;
        for children in 2..WIDTH {
            if alone <= costs[children - 1] {
                (costs[children - 1], self.shares[at][children - 1]) = (alone, 0);
            }
        }
        costs
    }

    /// Whether a binary node becomes a leaf where it is one child.
    fn is_leaf(&self, at: usize) -> bool {
        self.sizes[at] as usize <= LANES
    }

    /// The binary nodes that become the children of a node made of `at`, `children` at most.
    fn open(&self, at: usize, children: usize, roots: &mut Vec<usize>) {
        let (share, first) = (self.shares[at][children - 1] as usize, self.tree.nodes[at].first_index as usize);
        if share == 0 {
            roots.push(at);
        } else {
            self.open(first, share, roots);
            self.open(first + 1, children - share, roots);
        }
    }

    /// Makes a child of a binary node, a leaf or a node that is still to be filled.
    fn child(&self, root: usize, made: &mut Collapsed, open: &mut Vec<(usize, usize)>) -> Child {
        if self.is_leaf(root) {
            let mut leaf = LeafPlaces::new();
            self.primitives(root, &mut leaf);
            made.leaves.push(leaf);
            return Child::leaf(made.leaves.len() - 1);
        }
        made.nodes.push(Node::new(&[]));
        open.push((made.nodes.len() - 1, root));
        Child::node(made.nodes.len() - 1)
    }

    /// The primitives below a binary node, each once: parts of one that was split may come together.
    fn primitives(&self, at: usize, list: &mut LeafPlaces) {
        let node = &self.tree.nodes[at];
        let first = node.first_index as usize;
        if !node.is_leaf() {
            self.primitives(first, list);
            self.primitives(first + 1, list);
        } else if !list.contains(&self.tree.primitive_indices[first]) {
            list.push(self.tree.primitive_indices[first]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3A;
    use obvhs::aabb::Aabb;
    use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

    /// Unit boxes side by side, one for each of `primitives`.
    fn row(primitives: &[u32]) -> Bvh2 {
        let unit = |x: usize| Aabb::new(Vec3A::X * x as f32, Vec3A::X * x as f32 + Vec3A::ONE);
        let boxes: Vec<Aabb> = (0..primitives.len()).map(unit).collect();
        PlocBuilder::new().build(PlocSearchDistance::Low, &boxes, primitives.to_vec(), SortPrecision::U64, 0)
    }

    #[test]
    fn each_primitive_is_in_a_leaf_and_nodes_are_well_filled() {
        for count in [1, 4, 5, 33, 1000] {
            let made = collapse(&row(&(0..count).collect::<Vec<u32>>()));
            let mut found: Vec<u32> = made.leaves.iter().flatten().copied().collect();
            found.sort_unstable();
            assert!(found.iter().copied().eq(0..count), "{count}: {found:?}");
            assert!(made.leaves.iter().all(|leaf| (1..=LANES).contains(&leaf.len())), "{count}");
            // Every node but the root and every leaf is a child of one node.
            let children = made.nodes.len() - 1 + made.leaves.len();
            assert!(children > (made.nodes.len() - 1) * (WIDTH - 2), "{count}: {} nodes", made.nodes.len());
        }
    }

    #[test]
    fn parts_of_one_primitive_that_come_together_are_one() {
        let made = collapse(&row(&[0; 40]));
        assert!(made.leaves.len() < 40 && made.leaves.iter().all(|leaf| leaf[..] == [0]), "{:?}", made.leaves);
    }
}
