//! Building the tree over the triangles: from where they are alone, so that it can begin before the rest of the scene is there.

use super::places::{Places, without_repeats};
use super::watertight::Corners;
use crate::scene::geometry::Geometry;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::bvh2_to_cwbvh::bvh2_to_cwbvh;
use obvhs::cwbvh::node::CwBvhNode;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use obvhs::splits::split_aabbs_preset;
use obvhs::triangle::Triangle;
use rayon::prelude::*;

/// Diagonal of the scene in the hierarchy's own units, at least. obvhs 0.4 starts every ray 0.0001 units late: boxes nearer
/// than that are missed, whatever the size of the scene. Here that is less than f32 resolves.
/// A large one besides: there is room at the other end of f32, and scenes whose detail is a millionth of them.
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

/// Triangles of a leaf, at most: what the node format holds.
const LEAF: u32 = 3;

/// The triangles that a tree is built from, copied, so that it can be built beside the rest of the loading.
pub struct Primitives {
    places: Places,
    /// In the hierarchy's units.
    corners: Vec<Triangle>,
    scale: f32,
}

/// A tree over triangles, which stand in leaf order.
///
/// Spatial splits list a triangle in several leaves, so there may be more leaf triangles than scene triangles.
pub struct Tree {
    pub(super) nodes: CwBvh,
    /// In the hierarchy's units.
    pub(super) triangles: Vec<Corners>,
    /// Which scene triangles these are.
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
        let nodes = if corners.is_empty() { CwBvh::default() } else { eight_wide(&binary(&corners)) };
        let leaf = |&i: &u32| {
            let Triangle { v0, v1, v2 } = corners[i as usize];
            Corners::new([v0, v1, v2].map(Into::into))
        };
        let triangles = nodes.primitive_indices.par_iter().map(leaf).collect();
        Tree { nodes, triangles, places, scale }
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
    let mut tree = PlocBuilder::with_capacity(boxes.len()).build(SEARCH, &boxes, indices, PRECISION, 0);
    tree.uses_spatial_splits = true;
    ReinsertionOptimizer::default().run(&mut tree, REINSERTED, None);
    tree
}

/// Children of a wide node.
const WIDTH: usize = 8;

/// The eight-wide tree: the subtrees of its root are made on threads of their own.
fn eight_wide(tree: &Bvh2) -> CwBvh {
    /// Fewer leaves are made as quickly on one.
    const FEW: usize = 1 << 12;
    if tree.primitive_indices.len() < FEW {
        return bvh2_to_cwbvh(tree, LEAF, true, false);
    }
    let roots = largest_subtrees(tree);
    let parts: Vec<CwBvh> =
        roots.par_iter().map(|&root| bvh2_to_cwbvh(&subtree(tree, root), LEAF, true, false)).collect();
    let boxes: Vec<Aabb> = roots.iter().map(|&root| *tree.nodes[root].aabb()).collect();
    under_one_root(&boxes, &parts)
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
fn under_one_root(boxes: &[Aabb], parts: &[CwBvh]) -> CwBvh {
    let numbers = (0..parts.len() as u32).collect();
    let over = PlocBuilder::new().build(PlocSearchDistance::VeryHigh, boxes, numbers, PRECISION, 0);
    // One node, with the parts as its leaves, in the order in which rays of each octant want them.
    let leaves = bvh2_to_cwbvh(&over, 1, true, false);
    let mut root = leaves.nodes[0];
    let mut order: Vec<&CwBvh> = Vec::with_capacity(parts.len());
    (root.child_base_idx, root.primitive_base_idx, root.imask) = (1, 0, 0);
    for child in 0..WIDTH {
        if root.child_meta[child] != 0 {
            // The low five bits of a leaf are its first primitive; an inner node has 24 + its place there, and counts as one.
            order.push(&parts[leaves.primitive_indices[(root.child_meta[child] & 0b1_1111) as usize] as usize]);
            root.child_meta[child] = 0b0010_0000 | (24 + child as u8);
            root.imask |= 1 << child;
        }
    }
    // Children of a node stand side by side: first the roots of the parts, then what is below each.
    let (mut tops, mut below, mut primitive_indices) = (vec![root], Vec::new(), Vec::new());
    for part in &order {
        let before = (order.len() + below.len()) as u32;
        let moved = |node: &CwBvhNode| CwBvhNode {
            child_base_idx: node.child_base_idx + before,
            primitive_base_idx: node.primitive_base_idx + primitive_indices.len() as u32,
            ..*node
        };
        tops.push(moved(&part.nodes[0]));
        below.extend(part.nodes[1..].iter().map(moved));
        primitive_indices.extend_from_slice(&part.primitive_indices);
    }
    tops.extend(below);
    CwBvh { nodes: tops, primitive_indices, total_aabb: leaves.total_aabb, ..leaves }
}
