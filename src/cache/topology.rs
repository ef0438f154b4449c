//! The hierarchy shared by all meshes: each face is the root of a tree, a node splits into four by its edges' midpoints,
//! always the same way, so that neighbours share vertices (method 3).
//!
//! Leaves on both sides of an edge stay within one level of each other: a leaf's edge has at most one midpoint that finer
//! neighbours use, and is drawn through it.

use super::dynamic::{DrawnId, SlotId};
use super::pixel_vertex::PixelVertex;
use super::pool::Pool;
use super::vertex::VertexId;
use crate::scene::FaceId;
use glam::Vec3;
use rustc_hash::FxHashMap;

/// Index of a node of the hierarchy.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct NodeId(pub u32);

/// Index of an edge of the hierarchy.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct EdgeId(pub u32);

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
    pub parent: Option<NodeId>,
    /// The first of its four children; they are consecutive. A node without is a leaf.
    pub child: Option<NodeId>,
    /// The triangles it is drawn as, if it is a leaf: one, or several through the midpoints on its edges.
    pub drawn: Vec<DrawnId>,
    /// The vertex inside it, if it needed one.
    pub inner: Option<PixelVertex>,
    /// Refinement's view of it.
    pub work: Work,
    /// Its place in the mesh of indirect light.
    pub indirect: IndirectNode,
    next_on_edge: [Option<NodeId>; 3],
}

/// A node in the mesh of indirect light, which is split on its own account.
#[derive(Clone, Copy, Debug)]
pub struct IndirectNode {
    /// Whether indirect light is sampled at the middles of its edges.
    pub split: bool,
    /// Expected square error of interpolating indirect D over it, luminance², as far as noise does not explain it; infinite
    /// while nothing tells.
    pub surplus: f32,
    /// What it may be at most, noise included; infinite while nothing tells.
    pub doubt: f32,
    /// Pixels that it covers.
    pub pixels: f32,
    /// What the importance of each of its corners holds of it.
    pub importance: f32,
    /// Raised whenever its key changes.
    pub version: u32,
    /// Key that it waits in the queue with; 0 if it does not.
    pub queued: f32,
    /// Pixels × square error that the sum over the image holds of it.
    pub accounted: f64,
}

impl Default for IndirectNode {
    fn default() -> Self {
        Self {
            split: false,
            surplus: f32::INFINITY,
            doubt: f32::INFINITY,
            pixels: 0.0,
            importance: 0.0,
            version: 0,
            queued: 0.0,
            accounted: 0.0,
        }
    }
}

/// What refinement knows of a leaf.
#[derive(Clone, Copy, Debug, Default)]
pub struct Work {
    /// Pixels it covers on screen: counted by the GPU, or a share of its parent's until then.
    pub pixels: f32,
    /// Direction from the eye through one of its pixels, if the GPU has counted few.
    pub ray: Option<Vec3>,
    /// Its share of the pixels of its face, by area.
    pub share: f32,
    /// Expected square error of interpolation from its parent's surplus, luminance².
    pub surplus: f32,
    /// How much brighter than it is drawn a highlight between its corners is (specular luminance S), and the share of it
    /// that the highlight covers.
    pub highlight: f32,
    /// See `highlight`.
    pub highlight_share: f32,
    /// Luminance of D in its middle, or in one of its pixels, that rays found other than its corners say; `None` while none were
    /// traced.
    pub mismatch: Option<f32>,
    /// Share of it that the mismatch stands for.
    pub mismatch_share: f32,
    /// Generation of the camera each of whose pixels on it was asked for surprises; 0 if none was.
    pub checked: u32,
    /// How often; 0 if there is no point in asking again.
    pub checks: u32,
    /// Generation of the camera in which it waits for that.
    pub check_queued: u32,
    /// Lights of which its corners did not know the same when it was checked, if that is worth asking again once they do: until then
    /// its children cannot rest on it.
    pub check_open: u32,
    /// Generation of the camera that last saw it.
    pub generation: u32,
    /// Raised whenever its key changes: queued entries of older versions are void.
    pub version: u32,
    /// Pixels, pixels × luminance and pixels × square error that the sums over the image hold of it.
    pub accounted: f64,
    /// See `accounted`.
    pub light: f64,
    /// See `accounted`.
    pub error: f64,
    /// Pixels × square of what it is judged by, while what it hides is unknown.
    pub unseen: f64,
}

/// An edge between two vertices.
#[derive(Clone, Debug)]
struct Edge {
    ends: [VertexId; 2],
    /// Its midpoint, once a node beside it is split.
    midpoint: Option<VertexId>,
    /// Its halves, in the order of `ends`.
    halves: Option<[EdgeId; 2]>,
    /// The edge it is half of.
    parent: Option<EdgeId>,
    /// First leaf beside it, linked through [`Node::next_on_edge`].
    first: Option<NodeId>,
}

/// Nodes and edges.
#[derive(Clone, Debug, Default)]
pub struct Topology {
    /// The nodes.
    pub nodes: Pool<Node>,
    edges: Pool<Edge>,
    base_edges: FxHashMap<[VertexId; 2], EdgeId>,
}

impl Topology {
    /// Adds the root of a face.
    pub fn add_root(&mut self, face: FaceId, corners: [SlotId; 3], vertices: [VertexId; 3]) -> NodeId {
        let edges = [0, 1, 2].map(|i| self.base_edge(vertices[i], vertices[(i + 1) % 3]));
        self.add_node(corners, edges, face, None)
    }

    fn base_edge(&mut self, a: VertexId, b: VertexId) -> EdgeId {
        let ends = if a < b { [a, b] } else { [b, a] };
        if let Some(&edge) = self.base_edges.get(&ends) {
            return edge;
        }
        let edge = self.add_edge(ends, None);
        self.base_edges.insert(ends, edge);
        edge
    }

    fn add_edge(&mut self, ends: [VertexId; 2], parent: Option<EdgeId>) -> EdgeId {
        EdgeId(self.edges.insert(Edge { ends, midpoint: None, halves: None, parent, first: None }))
    }

    fn add_node(&mut self, corners: [SlotId; 3], edges: [EdgeId; 3], face: FaceId, parent: Option<NodeId>) -> NodeId {
        let level = parent.map_or(0, |p| self.nodes[p.0].level + 1);
        let next_on_edge = edges.map(|e| self.edges[e.0].first);
        let node = Node {
            corners,
            edges,
            face,
            level,
            parent,
            child: None,
            drawn: Vec::new(),
            inner: None,
            work: Work::default(),
            indirect: IndirectNode::default(),
            next_on_edge,
        };
        let id = NodeId(self.nodes.insert(node));
        for edge in edges {
            self.edges[edge.0].first = Some(id);
        }
        id
    }

    /// The leaves beside an edge.
    pub fn beside(&self, edge: EdgeId) -> impl Iterator<Item = NodeId> + '_ {
        std::iter::successors(self.edges[edge.0].first, move |id| {
            let node = &self.nodes[id.0];
            let at = node.edges.iter().position(|&e| e == edge)?;
            node.next_on_edge[at]
        })
    }

    /// The midpoint of an edge, if a node beside it has been split.
    #[must_use]
    pub fn midpoint(&self, edge: EdgeId) -> Option<VertexId> {
        self.edges[edge.0].midpoint
    }

    /// The ends of an edge.
    #[must_use]
    pub fn ends(&self, edge: EdgeId) -> [VertexId; 2] {
        self.edges[edge.0].ends
    }

    /// Notes the midpoint of an edge.
    pub fn set_midpoint(&mut self, edge: EdgeId, vertex: VertexId) {
        self.edges[edge.0].midpoint = Some(vertex);
    }

    /// Coarser leaves beside a leaf, which must be split before it.
    #[must_use]
    pub fn coarser_neighbours(&self, node: NodeId) -> Vec<NodeId> {
        let parents = self.nodes[node.0].edges.iter().filter_map(|e| self.edges[e.0].parent);
        parents.flat_map(|edge| self.beside(edge)).collect()
    }

    /// Splits a leaf whose edges' midpoints are set; `middles[i]` is the slot in the middle of edge i. Returns the first
    /// child: at corners 0, 1, 2, and in the middle.
    pub fn split(&mut self, id: NodeId, middles: [SlotId; 3], vertex_of: impl Fn(SlotId) -> VertexId) -> NodeId {
        let node = &self.nodes[id.0];
        let (corners, edges, face) = (node.corners, node.edges, node.face);
        self.leave_edges(id);
        let inner = [0, 1, 2].map(|i| {
            // Cuts corner i off: joins the middles of the edges that meet there.
            self.add_edge([vertex_of(middles[i]), vertex_of(middles[(i + 2) % 3])], None)
        });
        let half =
            |topology: &mut Self, edge: usize, corner: usize| topology.half(edges[edge], vertex_of(corners[corner]));
        let mut children = Vec::with_capacity(4);
        for corner in 0..3 {
            let before = (corner + 2) % 3;
            // The corner keeps its place among the child's corners, so that orientation and order stay.
            let mut slots = [middles[corner]; 3];
            let mut sides = [inner[corner]; 3];
            slots[corner] = corners[corner];
            slots[(corner + 1) % 3] = middles[corner];
            slots[before] = middles[before];
            sides[corner] = half(self, corner, corner);
            sides[(corner + 1) % 3] = inner[corner];
            sides[before] = half(self, before, corner);
            children.push(self.add_node(slots, sides, face, Some(id)));
        }
        // Corners of the middle child: middles 0, 1, 2; its edge i joins middles i and i + 1 and cuts corner i + 1 off.
        let sides = [inner[1], inner[2], inner[0]];
        children.push(self.add_node(middles, sides, face, Some(id)));
        debug_assert!(children.windows(2).all(|w| w[1].0 == w[0].0 + 1), "children are consecutive");
        self.nodes[id.0].child = Some(children[0]);
        children[0]
    }

    /// The half of an edge at one of its ends.
    fn half(&mut self, edge: EdgeId, end: VertexId) -> EdgeId {
        let Edge { ends, midpoint, halves, .. } = self.edges[edge.0].clone();
        let halves = halves.unwrap_or_else(|| {
            let middle = midpoint.unwrap_or(ends[0]);
            let halves = ends.map(|e| self.add_edge([e, middle], Some(edge)));
            self.edges[edge.0].halves = Some(halves);
            halves
        });
        halves[usize::from(ends[0] != end)]
    }

    /// Takes a node that is no leaf any more off the lists of its edges.
    fn leave_edges(&mut self, id: NodeId) {
        for at in 0..3 {
            let edge = self.nodes[id.0].edges[at];
            let next = self.nodes[id.0].next_on_edge[at];
            let previous = self.beside(edge).find(|n| self.nodes[n.0].next_on(edge) == Some(id));
            match previous {
                Some(previous) => {
                    let node = &mut self.nodes[previous.0];
                    if let Some(place) = node.edges.iter().position(|&e| e == edge) {
                        node.next_on_edge[place] = next;
                    }
                }
                None => self.edges[edge.0].first = next,
            }
        }
    }

    /// The leaf of the mesh of indirect light that a leaf is part of.
    #[must_use]
    pub fn indirect_leaf(&self, leaf: NodeId) -> NodeId {
        let coarse = |id: &NodeId| self.nodes[id.0].parent.filter(|p| !self.nodes[p.0].indirect.split);
        std::iter::successors(Some(leaf), coarse).last().unwrap_or(leaf)
    }

    /// The leaves of a tree in the mesh of indirect light, depth first.
    pub fn indirect_leaves(&self, root: NodeId, out: &mut Vec<NodeId>) {
        match self.nodes[root.0].child.filter(|_| self.nodes[root.0].indirect.split) {
            None => out.push(root),
            Some(first) => (0..4).for_each(|i| self.indirect_leaves(NodeId(first.0 + i), out)),
        }
    }

    /// The leaves of a tree, depth first.
    pub fn leaves(&self, root: NodeId, out: &mut Vec<NodeId>) {
        match self.nodes[root.0].child {
            None => out.push(root),
            Some(first) => (0..4).for_each(|i| self.leaves(NodeId(first.0 + i), out)),
        }
    }

    /// Bytes held.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.nodes.bytes() + self.edges.bytes() + self.base_edges.capacity() * 24
    }

    /// Checks the structure: shared midpoints, orientation of halves, neighbours within one level.
    ///
    /// # Panics
    /// If a rule is broken (debug builds and tests call it).
    pub fn validate(&self, vertex_of: impl Fn(SlotId) -> VertexId) {
        for i in 0..self.nodes.end() {
            let node = &self.nodes[i];
            for (at, &edge) in node.edges.iter().enumerate() {
                let mut ends = [vertex_of(node.corners[at]), vertex_of(node.corners[(at + 1) % 3])];
                let mut known = self.edges[edge.0].ends;
                ends.sort_unstable();
                known.sort_unstable();
                assert_eq!(ends, known, "node {i}: edge {at} joins its corners");
                let listed = self.beside(edge).any(|n| n.0 == i);
                assert_eq!(listed, node.child.is_none(), "node {i}: exactly leaves are listed beside their edges");
                assert!(
                    node.child.is_none() || self.edges[edge.0].midpoint.is_some(),
                    "node {i}: split through midpoints"
                );
                if node.child.is_none() {
                    let finer = self.edges[edge.0].halves.iter().flatten();
                    let deepest = finer.filter(|h| self.edges[h.0].midpoint.is_some()).count();
                    assert_eq!(deepest, 0, "node {i}: a neighbour is two levels finer");
                }
            }
        }
    }
}

impl Node {
    fn next_on(&self, edge: EdgeId) -> Option<NodeId> {
        self.edges.iter().position(|&e| e == edge).and_then(|at| self.next_on_edge[at])
    }
}
