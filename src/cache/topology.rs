//! The hierarchy shared by all layers: each face is the root of a tree, a node splits into four by its edges'
//! midpoints, always the same way, so that neighbours share vertices (docs/method/hierarchy-and-vertices.md).
//!
//! Leaves on both sides of an edge stay within one level of each other: a leaf's edge has at most one midpoint that
//! finer neighbours use, and is drawn through it.

use super::ids::{EdgeId, Link, NodeId, SlotId, VertexId};
use super::pool::{Pool, Table, map_bytes};
use crate::scene::FaceId;
use rustc_hash::FxHashMap;

/// Nodes are split this often without asking whether midpoints of f32 positions stay apart.
pub const SAFE_LEVEL: u8 = 16;

/// A triangle of the hierarchy.
#[derive(Clone, Debug)]
pub struct Node {
    /// Its corners, in the order of the face's.
    pub corners: [SlotId; 3],
    /// Its edges; edge i joins corners i and i + 1.
    pub edges: [EdgeId; 3],
    /// The face it lies on.
    pub face: FaceId,
    /// Splits above it.
    pub level: u8,
    /// The node it came from.
    pub parent: Link<NodeId>,
    /// The first of its children.
    pub(super) first_child: Link<NodeId>,
    /// The slot of the vertex inside it, if a pixel was sampled there.
    pub pixel_vertex: Link<SlotId>,
    /// Expected square error of interpolating direct D over it, (W·sr⁻¹·m⁻²)², from the surplus at the midpoints of its
    /// parent's edges: it holds in any view.
    pub direct_surplus: f32,
    /// The error of interpolating indirect D over it.
    pub indirect: IndirectError,
    /// Whether indirect light is sampled at the midpoints of its edges: the indirect layer is split on its own account.
    pub indirect_split: bool,
    next_on_edge: [Link<NodeId>; 3],
}

/// The four children of a node, side by side: at its corners 0, 1, 2, and in the middle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Children {
    pub(super) first: NodeId,
}

impl Children {
    /// All four.
    #[must_use]
    pub fn all(self) -> [NodeId; 4] {
        [0, 1, 2, 3].map(|i| NodeId(self.first.0 + i))
    }

    /// The one whose corners are the midpoints of the parent's edges.
    #[must_use]
    pub const fn middle(self) -> NodeId {
        NodeId(self.first.0 + 3)
    }
}

/// The error of interpolating indirect light over a node.
#[derive(Clone, Copy, Debug)]
pub struct IndirectError {
    /// Expected square error of interpolating indirect D over it, (W·sr⁻¹·m⁻²)², as far as noise does not explain it;
    /// infinite while nothing tells.
    pub surplus: f32,
    /// What it may be at most, noise included; infinite while nothing tells.
    pub doubt: f32,
}

impl Default for IndirectError {
    fn default() -> Self {
        Self { surplus: f32::INFINITY, doubt: f32::INFINITY }
    }
}

/// An edge between two vertices.
#[derive(Clone, Debug)]
pub(super) struct Edge {
    /// One of its ends: the one that its first half begins at.
    end: VertexId,
    /// Its midpoint, once a node beside it is split.
    pub(super) midpoint: Link<VertexId>,
    /// The first of its halves, which are stored side by side.
    pub(super) first_half: Link<EdgeId>,
    /// First leaf beside it, linked through [`Node::next_on_edge`].
    pub(super) first: Link<NodeId>,
}

// There are two edges a leaf and more.
const _: () = assert!(size_of::<Edge>() <= 16);

impl Edge {
    const fn new(end: VertexId) -> Self {
        Self { end, midpoint: Link::NONE, first_half: Link::NONE, first: Link::NONE }
    }

    /// Its halves, if it has any; the first begins at `end`.
    pub(super) fn halves(&self) -> Option<[EdgeId; 2]> {
        self.first_half.get().map(|first| [first, EdgeId(first.0 + 1)])
    }
}

/// Nodes and edges.
#[derive(Clone, Debug, Default)]
pub struct Topology {
    /// The nodes.
    pub nodes: Pool<NodeId, Node>,
    pub(super) edges: Pool<EdgeId, Edge>,
    pub(super) base_edges: FxHashMap<[VertexId; 2], EdgeId>,
}

impl Topology {
    /// Bytes of an edge.
    pub(super) const EDGE: usize = size_of::<Edge>();

    /// Adds the root of a face.
    pub fn add_root(&mut self, face: FaceId, corners: [SlotId; 3], vertices: [VertexId; 3]) -> NodeId {
        let edges = [0, 1, 2].map(|i| self.base_edge(vertices[i], vertices[(i + 1) % 3]));
        let root = self.nodes.insert(Node::new(corners, edges, face, Link::NONE, 0));
        self.join_edges(root);
        root
    }

    fn base_edge(&mut self, a: VertexId, b: VertexId) -> EdgeId {
        let ends = if a < b { [a, b] } else { [b, a] };
        if let Some(&edge) = self.base_edges.get(&ends) {
            return edge;
        }
        let edge = self.edges.insert(Edge::new(ends[0]));
        self.base_edges.insert(ends, edge);
        edge
    }

    /// Lists a new leaf beside its edges.
    pub(super) fn join_edges(&mut self, id: NodeId) {
        let edges = self.nodes[id].edges;
        self.nodes[id].next_on_edge = edges.map(|edge| self.edges[edge].first);
        edges.iter().for_each(|&edge| self.edges[edge].first = id.into());
    }

    /// The leaves beside an edge.
    pub fn beside(&self, edge: EdgeId) -> impl Iterator<Item = NodeId> + '_ {
        std::iter::successors(self.edges[edge].first.get(), move |id| {
            let node = &self.nodes[*id];
            let at = node.edges.iter().position(|&e| e == edge)?;
            node.next_on_edge[at].get()
        })
    }

    /// The midpoint of an edge, if a node beside it has been split.
    #[must_use]
    pub fn midpoint(&self, edge: EdgeId) -> Option<VertexId> {
        self.edges[edge].midpoint.get()
    }

    /// Notes the midpoint of an edge.
    pub fn set_midpoint(&mut self, edge: EdgeId, vertex: VertexId) {
        self.edges[edge].midpoint = vertex.into();
    }

    /// Coarser leaves beside a leaf, which must be split before it.
    #[must_use]
    pub fn coarser_neighbours(&self, node: NodeId) -> Vec<NodeId> {
        let Some(parent) = self.nodes[node].parent.get() else { return Vec::new() };
        // A child at corner i has halves of the edges that meet there; the one in the middle has none.
        let place = self.children(parent).position(|child| child == node).filter(|&place| place < 3);
        let whole = place.into_iter().flat_map(|place| (0..3).filter(move |&at| at != (place + 1) % 3));
        whole.flat_map(|at| self.beside(self.nodes[parent].edges[at])).collect()
    }

    /// Whether a node is a leaf beside one that is two levels finer, as it may be when its face is new.
    #[must_use]
    pub fn is_beside_much_finer(&self, node: NodeId) -> bool {
        let halves = self.nodes[node].edges.iter().filter_map(|edge| self.edges[*edge].halves()).flatten();
        self.is_leaf(node) && halves.into_iter().any(|half| self.edges[half].midpoint.get().is_some())
    }

    /// Splits a leaf whose edges' midpoints are set; `middles[i]` is the slot in the middle of edge i.
    pub fn split(&mut self, id: NodeId, middles: [SlotId; 3], vertex_of: impl Fn(SlotId) -> VertexId) -> Children {
        let Node { corners, edges, face, level, .. } = self.nodes[id];
        self.leave_edges(id);
        let inner = [0, 1, 2].map(|i| {
            // Cuts corner i off: joins the middles of the edges that meet there.
            self.edges.insert(Edge::new(vertex_of(middles[i])))
        });
        let at_corner = [0, 1, 2].map(|corner| {
            let before = (corner + 2) % 3;
            // The corner keeps its place among the child's corners, so that orientation and order stay.
            let mut slots = [middles[corner]; 3];
            let mut sides = [inner[corner]; 3];
            slots[corner] = corners[corner];
            slots[(corner + 1) % 3] = middles[corner];
            slots[before] = middles[before];
            sides[corner] = self.half(edges[corner], [corner, (corner + 1) % 3].map(|end| vertex_of(corners[end])));
            sides[(corner + 1) % 3] = inner[corner];
            sides[before] = self.half(edges[before], [corner, before].map(|end| vertex_of(corners[end])));
            (slots, sides)
        });
        // Corners of the middle child: middles 0, 1, 2; its edge i joins middles i and i + 1 and cuts corner i + 1 off.
        let in_the_middle = (middles, [inner[1], inner[2], inner[0]]);
        let [a, b, c] = at_corner;
        let child = |(slots, sides)| Node::new(slots, sides, face, id.into(), level + 1);
        let children = Children { first: self.nodes.insert_four([a, b, c, in_the_middle].map(child)) };
        children.all().into_iter().for_each(|child| self.join_edges(child));
        self.nodes[id].first_child = children.first.into();
        children
    }

    /// The half of an edge at the first of its ends.
    fn half(&mut self, edge: EdgeId, [end, other]: [VertexId; 2]) -> EdgeId {
        let first = self.edges[edge].end;
        let halves = self.edges[edge].halves().unwrap_or_else(|| {
            let ends = if end == first { [end, other] } else { [other, end] };
            let first = self.edges.insert_two(ends.map(Edge::new));
            self.edges[edge].first_half = first.into();
            [first, EdgeId(first.0 + 1)]
        });
        halves[usize::from(first != end)]
    }

    /// Takes a node that is no leaf any more off the lists of its edges.
    pub(super) fn leave_edges(&mut self, id: NodeId) {
        for at in 0..3 {
            let edge = self.nodes[id].edges[at];
            let next = self.nodes[id].next_on_edge[at];
            let previous = self.beside(edge).find(|n| self.nodes[*n].next_on(edge) == Some(id));
            match previous {
                Some(previous) => {
                    let node = &mut self.nodes[previous];
                    if let Some(place) = node.edges.iter().position(|&e| e == edge) {
                        node.next_on_edge[place] = next;
                    }
                }
                None => self.edges[edge].first = next,
            }
        }
    }

    /// The leaf of the indirect layer that a leaf is part of.
    #[must_use]
    pub fn indirect_leaf(&self, leaf: NodeId) -> NodeId {
        let coarse = |id: &NodeId| self.nodes[*id].parent.get().filter(|p| !self.nodes[*p].indirect_split);
        std::iter::successors(Some(leaf), coarse).last().unwrap_or(leaf)
    }

    /// All nodes above some, those above several several times, as long as these do not follow each other.
    pub fn above(&self, nodes: &[NodeId]) -> Vec<NodeId> {
        let (mut above, mut last) = (Vec::new(), None);
        for &node in nodes {
            let up = |id: &NodeId| self.nodes[*id].parent.get();
            let parent = up(&node);
            if parent != last {
                above.extend(std::iter::successors(parent, up));
                last = parent;
            }
        }
        above
    }

    /// The leaves of a tree in the indirect layer, depth first.
    pub fn indirect_leaves(&self, root: NodeId, out: &mut Vec<NodeId>) {
        match self.nodes[root].children().filter(|_| self.nodes[root].indirect_split) {
            None => out.push(root),
            Some(children) => children.all().into_iter().for_each(|child| self.indirect_leaves(child, out)),
        }
    }

    /// The leaves of a tree, depth first.
    pub fn leaves(&self, root: NodeId, out: &mut Vec<NodeId>) {
        match self.nodes[root].children() {
            None => out.push(root),
            Some(children) => children.all().into_iter().for_each(|child| self.leaves(child, out)),
        }
    }

    /// Whether a node is a leaf.
    #[must_use]
    pub fn is_leaf(&self, id: NodeId) -> bool {
        self.nodes[id].is_leaf()
    }

    /// The children of a node; none of a leaf.
    pub fn children(&self, id: NodeId) -> impl Iterator<Item = NodeId> + use<> {
        self.nodes[id].children().into_iter().flat_map(Children::all)
    }

    /// The slots in the middle of a split node's edges: the corners of its middle child.
    #[must_use]
    pub fn middles(&self, id: NodeId) -> Option<[SlotId; 3]> {
        self.nodes[id].children().map(|children| self.nodes[children.middle()].corners)
    }

    /// Bytes held for edges.
    #[must_use]
    pub fn edge_bytes(&self) -> usize {
        self.edges.bytes() + map_bytes(&self.base_edges)
    }

    /// Checks the structure: shared midpoints, orientation of halves, neighbours within one level.
    ///
    /// # Panics
    /// If a rule is broken (debug builds and tests call it).
    pub fn validate(&self, vertex_of: impl Fn(SlotId) -> VertexId) {
        let mut ends_of = Table::<EdgeId, Option<[VertexId; 2]>>::default();
        for id in self.nodes.ids() {
            let (i, node) = (id.0, &self.nodes[id]);
            for (at, &edge) in node.edges.iter().enumerate() {
                let mut ends = [vertex_of(node.corners[at]), vertex_of(node.corners[(at + 1) % 3])];
                ends.sort_unstable();
                assert_eq!(
                    *ends_of[edge].get_or_insert(ends),
                    ends,
                    "node {i}: edge {at} joins the same corners for all"
                );
                assert!(ends.contains(&self.edges[edge].end), "node {i}: edge {at} joins its corners");
                let listed = self.beside(edge).any(|n| n.0 == i);
                assert_eq!(listed, node.is_leaf(), "node {i}: exactly leaves are listed beside their edges");
                assert!(node.is_leaf() || self.midpoint(edge).is_some(), "node {i}: split through midpoints");
                if node.is_leaf() {
                    let finer = self.edges[edge].halves().into_iter().flatten();
                    let deepest = finer.filter(|&half| self.midpoint(half).is_some()).count();
                    assert_eq!(deepest, 0, "node {i}: a neighbour is two levels finer");
                }
            }
        }
    }
}

impl Node {
    fn new(corners: [SlotId; 3], edges: [EdgeId; 3], face: FaceId, parent: Link<NodeId>, level: u8) -> Self {
        Self {
            corners,
            edges,
            face,
            level,
            parent,
            first_child: Link::NONE,
            pixel_vertex: Link::NONE,
            direct_surplus: 0.0,
            indirect: IndirectError::default(),
            indirect_split: false,
            next_on_edge: [Link::NONE; 3],
        }
    }

    /// Its children; none of a leaf.
    #[must_use]
    pub fn children(&self) -> Option<Children> {
        self.first_child.get().map(|first| Children { first })
    }

    /// Whether it is a leaf.
    #[must_use]
    pub fn is_leaf(&self) -> bool {
        self.first_child.get().is_none()
    }

    fn next_on(&self, edge: EdgeId) -> Option<NodeId> {
        self.edges.iter().position(|&e| e == edge).and_then(|at| self.next_on_edge[at].get())
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::{Rooted, square};
    use super::*;
    use glam::Vec3;

    /// A square whose corner 0 is refined until leaves of this level are there.
    fn refined(level: u8) -> Rooted {
        let mut square = square();
        for _ in 0..level {
            let at_corner = |leaf: &NodeId| square.cache.corner_positions(*leaf).contains(&Vec3::ZERO);
            let finest =
                square.leaves().into_iter().filter(at_corner).max_by_key(|&l| square.cache.topology.nodes[l].level);
            square.split(finest.expect("a leaf at the corner"));
        }
        square
    }

    #[test]
    fn neighbours_stay_within_one_level_and_edges_within_one_midpoint() {
        let square = refined(7);
        square.cache.validate();
        let topology = &square.cache.topology;
        let levels: Vec<u8> = square.leaves().iter().map(|&leaf| topology.nodes[leaf].level).collect();
        assert_eq!((levels.iter().max(), levels.iter().min()), (Some(&7), Some(&1)), "coarse far from the corner");
    }

    #[test]
    #[should_panic(expected = "two levels finer")]
    fn a_neighbour_left_too_coarse_is_found() {
        let mut square = square();
        let children = square.split(square.roots[0]).children.all();
        // Child 0 lies at the diagonal, whose other side stays whole.
        square.cache.split(children[0]);
        square.cache.validate();
    }

    #[test]
    fn children_have_the_parents_area_order_and_face() {
        let mut square = square();
        let root = square.roots[0];
        let split = square.split(root);
        let topology = &square.cache.topology;
        let corners = topology.nodes[root].corners;
        for (at, child) in topology.children(root).take(3).enumerate() {
            assert_eq!(topology.nodes[child].corners[at], corners[at], "it keeps its place");
        }
        assert_eq!(topology.middles(root), Some(split.middles));
        let area = |[a, b, c]: [Vec3; 3]| (b - a).cross(c - a).y;
        let whole = area(square.cache.corner_positions(root));
        for child in topology.children(root) {
            assert_eq!(area(square.cache.corner_positions(child)), whole / 4.0);
            assert_eq!((topology.nodes[child].level, topology.nodes[child].parent.get()), (1, Some(root)));
        }
        assert!(!topology.is_leaf(root) && topology.children(root).all(|child| topology.is_leaf(child)));
    }

    #[test]
    fn both_sides_of_an_edge_use_the_same_halves() {
        let mut square = square();
        let diagonal = square.cache.topology.nodes[square.roots[0]].edges[2];
        assert_eq!(square.cache.topology.beside(diagonal).count(), 2);
        square.split(square.roots[0]);
        let topology = &square.cache.topology;
        assert_eq!(
            topology.beside(diagonal).collect::<Vec<_>>(),
            [square.roots[1]],
            "a split node is no leaf beside it"
        );
        square.split(square.roots[1]);
        let topology = &square.cache.topology;
        assert_eq!(topology.beside(diagonal).count(), 0);
        let corners = [0, 2].map(|corner| topology.nodes[square.roots[0]].corners[corner]);
        let ends = corners.map(|slot| square.cache.slots[slot].vertex);
        for half in topology.edges[diagonal].halves().expect("split") {
            assert!(ends.contains(&topology.edges[half].end), "from an end to the middle");
            assert_eq!(topology.beside(half).count(), 2, "a child of either side");
        }
    }

    #[test]
    fn the_indirect_layer_is_coarser_than_the_hierarchy() {
        let mut square = refined(3);
        let root = square.roots[0];
        let deepest = |s: &Rooted| s.leaves().into_iter().max_by_key(|&leaf| s.cache.topology.nodes[leaf].level);
        let leaf = deepest(&square).expect("leaves");
        let root = if square.cache.topology.indirect_leaf(leaf) == root { root } else { square.roots[1] };
        let listed = |s: &Rooted| {
            let mut leaves = Vec::new();
            s.cache.topology.indirect_leaves(root, &mut leaves);
            leaves
        };
        assert_eq!((listed(&square), square.cache.topology.indirect_leaf(leaf)), (vec![root], root));
        square.cache.topology.nodes[root].indirect_split = true;
        let children: Vec<NodeId> = square.cache.topology.children(root).collect();
        assert_eq!(listed(&square), children);
        assert!(children.contains(&square.cache.topology.indirect_leaf(leaf)));
    }
}
