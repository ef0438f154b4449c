//! Building the tree over the triangles: from where they are alone, so that it can begin before the rest of the scene is there.

use super::collapse::{Collapsed, LeafPlaces, collapse};
use super::halves::{halved, is_piled};
use super::places::{Places, without_repeats};
use super::traversal::{Child, Node, WIDTH};
use super::watertight::{Corners, LANES};
use crate::scene::geometry::Geometry;
use glam::Vec3;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use obvhs::splits::split_aabbs_preset;
use obvhs::triangle::Triangle;
use rayon::prelude::*;
use smallvec::SmallVec;

/// Diagonal of the scene in the hierarchy's own units, at least: whatever the size of the scene, areas of boxes stay far from both ends
/// of f32, and so do the products of a box test, however steep the ray (`geom::traversal`). It is large because there are scenes whose
/// detail is a millionth of them.
const DIAGONAL: f32 = 4_294_967_296.0;

/// How much boxes are larger than what they hold, against the largest coordinate: several times the rounding of a box test, so
/// that a ray through an edge that two boxes share misses neither.
const MARGIN: f32 = 1.0 / (1 << 20) as f32;

/// How far neighbours are looked for along the Morton curve (6). Five times as far and codes of 128 bits build twice as long; rays
/// are as fast within the spread of `bench` (docs/notebook/start.md).
const SEARCH: PlocSearchDistance = PlocSearchDistance::Low;
const PRECISION: SortPrecision = SortPrecision::U64;

/// Share of the nodes that a round of reinsertion looks at. All of them take ten times as long, and rays are as fast within the spread
/// of `bench`.
const REINSERTED: f32 = 0.1;

/// The triangles that a tree is built from, copied, so that it can be built beside the rest of the loading.
pub struct Primitives {
    places: Places,
    /// In the hierarchy's units.
    corners: Vec<Triangle>,
    scale: f32,
}

/// A tree over triangles.
///
/// Spatial splits list a triangle in several leaves, so leaves may hold more triangles than the scene.
pub struct Tree {
    pub(super) nodes: Vec<Node>,
    /// The places in each leaf.
    pub(super) leaves: Vec<LeafPlaces>,
    /// The corners of these, in the hierarchy's units.
    pub(super) corners: Vec<Corners>,
    /// Which scene triangles the places hold.
    pub(super) places: Places,
    /// What scene coordinates are multiplied by: a power of two, so that nothing is rounded.
    pub(super) scale: f32,
}

impl Primitives {
    /// Copies what a tree needs.
    #[must_use]
    pub fn of(geometry: &Geometry) -> Self {
        let places = without_repeats(geometry);
        let scale = (DIAGONAL / geometry.diagonal()).log2().ceil().clamp(-120.0, 120.0).exp2();
        let corners = places.triangles.par_iter().map(|&id| {
            let [v0, v1, v2] = geometry.corners(id).map(|p| (p * scale).into());
            Triangle { v0, v1, v2 }
        });
        Self { corners: corners.collect(), places, scale }
    }

    /// Builds the tree, on all threads of the present pool. Which those are makes no difference to it.
    #[must_use]
    pub fn build(self) -> Tree {
        let Self { places, corners, scale } = self;
        let Collapsed { nodes, leaves } =
            if corners.is_empty() { Collapsed::default() } else { eight_wide(&binary(&corners)) };
        let triangle = |&place: &u32| {
            let Triangle { v0, v1, v2 } = corners[place as usize];
            [v0, v1, v2].map(Vec3::from)
        };
        let of_leaf = |leaf: &LeafPlaces| Corners::new(&leaf.iter().map(triangle).collect::<SmallVec<[_; LANES]>>());
        let corners = leaves.par_iter().map(of_leaf).collect();
        Tree { nodes, leaves, corners, places, scale }
    }
}

/// A binary tree of triangles: large ones split, clustered along the Morton curve, and some nodes moved to better places.
fn binary(triangles: &[Triangle]) -> Bvh2 {
    let mut boxes: Vec<Aabb> = triangles.par_iter().map(|triangle| triangle.aabb()).collect();
    let mut indices: Vec<u32> = (0..boxes.len() as u32).collect();
    let areas = || boxes.iter().map(Aabb::half_area);
    let (mean, largest) = (areas().sum::<f32>() / boxes.len() as f32, areas().fold(0.0, f32::max));
    split_aabbs_preset(&mut boxes, &mut indices, triangles, mean, largest);
    let reach = |b: &Aabb| b.min.abs().max(b.max.abs()).max_element();
    let margin = boxes.iter().map(reach).fold(DIAGONAL, f32::max) * MARGIN;
    for b in &mut boxes {
        (b.min, b.max) = (b.min - margin, b.max + margin);
    }
    if is_piled(&boxes) {
        return halved(&boxes, indices);
    }
    let mut tree = PlocBuilder::with_capacity(boxes.len()).build(SEARCH, &boxes, indices, PRECISION, 0);
    tree.uses_spatial_splits = true;
    ReinsertionOptimizer::default().run(&mut tree, REINSERTED, None);
    tree
}

/// The eight-wide tree: the subtrees of its root are made on threads of their own.
fn eight_wide(tree: &Bvh2) -> Collapsed {
    /// Fewer leaves are made as quickly on one.
    const FEW: usize = 1 << 12;
    if tree.primitive_indices.len() < FEW {
        return collapse(tree);
    }
    let roots = largest_subtrees(tree);
    let parts: Vec<Collapsed> = roots.par_iter().map(|&root| collapse(&subtree(tree, root))).collect();
    let boxes: Vec<Aabb> = roots.iter().map(|&root| *tree.nodes[root].aabb()).collect();
    under_one_root(&boxes, parts)
}

/// The nodes below the root of an eight-wide tree: of those so far the one with the largest box gives way to its children.
fn largest_subtrees(tree: &Bvh2) -> Vec<usize> {
    let mut roots = vec![0];
    while roots.len() < WIDTH {
        let inner = roots.iter().enumerate().filter(|&(_, &root)| !tree.nodes[root].is_leaf());
        let area = |root: usize| tree.nodes[root].aabb().half_area();
        let Some((at, _)) = inner.max_by(|a, b| area(*a.1).total_cmp(&area(*b.1))) else { break };
        let first = tree.nodes[roots.swap_remove(at)].first_index as usize;
        roots.extend([first, first + 1]);
    }
    roots
}

/// The tree below a node, by itself: nodes and primitives in the order of a walk.
fn subtree(tree: &Bvh2, root: usize) -> Bvh2 {
    let mut nodes = vec![tree.nodes[root]];
    let mut primitive_indices = Vec::new();
    let mut open = vec![0];
    while let Some(at) = open.pop() {
        let old = nodes[at].first_index as usize;
        if nodes[at].is_leaf() {
            nodes[at].first_index = primitive_indices.len() as u32;
            primitive_indices.push(tree.primitive_indices[old]);
        } else {
            let first = nodes.len();
            nodes[at].first_index = first as u32;
            nodes.extend([tree.nodes[old], tree.nodes[old + 1]]);
            open.extend([first + 1, first]);
        }
    }
    Bvh2 {
        nodes,
        primitive_indices,
        uses_spatial_splits: tree.uses_spatial_splits,
        max_depth: tree.max_depth,
        ..Bvh2::default()
    }
}

/// Puts trees under one root; `boxes` are theirs.
fn under_one_root(boxes: &[Aabb], parts: Vec<Collapsed>) -> Collapsed {
    let (mut children, mut all) = (Vec::new(), Collapsed { nodes: vec![Node::new(&[])], leaves: Vec::new() });
    for (bounds, part) in boxes.iter().zip(parts) {
        let (nodes, leaves) = (all.nodes.len(), all.leaves.len());
        children.push((Child::node(nodes), [bounds.min, bounds.max].map(Vec3::from)));
        all.nodes.extend(part.nodes.iter().map(|node| node.moved(nodes, leaves)));
        all.leaves.extend(part.leaves);
    }
    all.nodes[0] = Node::new(&children);
    all
}
