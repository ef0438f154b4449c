//! Convex emitters of many triangles: what a point sees of one is its silhouette, a single convex outline.
//!
//! The light vector of a surface is a sum over the edges of its facing triangles; an edge between two of them counts twice, in
//! opposite directions. What is left of a closed convex surface is the loop that parts facing from averted triangles.

use super::facets::{Facet, directed_edges};
use crate::scene::Scene;
use glam::DVec3;
use rustc_hash::FxHashMap;
use smallvec::SmallVec;

/// A closed convex surface, ready for its silhouettes.
#[derive(Clone, Debug)]
pub struct Silhouette {
    /// Unit normals of the triangles, and their planes' distances from the origin along them.
    planes: Vec<(DVec3, f64)>,
    edges: Vec<Edge>,
    corners: Vec<DVec3>,
}

/// An edge, with the triangles to its left and right seen from outside.
#[derive(Clone, Copy, Debug)]
struct Edge {
    ends: [u32; 2],
    sides: [u32; 2],
}

/// Height of a corner over its neighbour's plane, against the length of their edge, that is rounding.
const ROUNDING: f64 = 1e-5;

/// Corners of a silhouette, in order; a sphere of a thousand triangles shows 64.
pub type Loop = SmallVec<[DVec3; 96]>;

impl Silhouette {
    /// Prepares a component; `None` if it is not closed and convex, or faces inwards.
    #[must_use]
    pub fn new(scene: &Scene, facets: &[Facet]) -> Option<Self> {
        let mut left_of: FxHashMap<[u32; 2], u32> = FxHashMap::default();
        for (facet, side) in facets.iter().zip(0..) {
            for edge in directed_edges(scene, facet.id) {
                if left_of.insert(edge, side).is_some() {
                    return None;
                }
            }
        }
        let mut index: FxHashMap<u32, u32> = FxHashMap::default();
        let mut silhouette = Self { planes: Vec::new(), edges: Vec::new(), corners: Vec::new() };
        silhouette.planes.extend(facets.iter().map(|f| (f.normal, f.normal.dot(f.corner))));
        for (facet, left) in facets.iter().zip(0..) {
            for [i, j] in directed_edges(scene, facet.id) {
                let right = *left_of.get(&[j, i])?;
                if !bends_back(facet, &facets[right as usize]) {
                    return None;
                }
                if i < j {
                    let ends = [i, j].map(|position| {
                        *index.entry(position).or_insert_with(|| {
                            silhouette.corners.push(scene.positions[position as usize].as_dvec3());
                            (silhouette.corners.len() - 1) as u32
                        })
                    });
                    silhouette.edges.push(Edge { ends, sides: [left, right] });
                }
            }
        }
        Some(silhouette)
    }

    /// The outline seen from `x`, counter-clockwise; empty from inside. `None` where rounding breaks it into several loops.
    #[must_use]
    pub fn from(&self, x: DVec3) -> Option<Loop> {
        let facing: SmallVec<[bool; 2048]> =
            self.planes.iter().map(|(normal, offset)| normal.dot(x) > *offset).collect();
        let mut next: SmallVec<[[u32; 2]; 96]> = SmallVec::new();
        for Edge { ends: [i, j], sides } in &self.edges {
            match sides.map(|side| facing[side as usize]) {
                [true, false] => next.push([*i, *j]),
                [false, true] => next.push([*j, *i]),
                _ => {}
            }
        }
        next.sort_unstable();
        let Some(&[start, _]) = next.first() else { return Some(Loop::new()) };
        let (mut outline, mut at) = (Loop::new(), start);
        for _ in 0..next.len() {
            outline.push(self.corners[at as usize]);
            at = next[next.binary_search_by_key(&at, |edge| edge[0]).ok()?][1];
            if at == start {
                break;
            }
        }
        (at == start && outline.len() == next.len()).then_some(outline)
    }
}

/// Whether no corner of `other` lies before a facet's plane.
fn bends_back(facet: &Facet, other: &Facet) -> bool {
    let height = |p: DVec3| facet.normal.dot(p - facet.corner);
    let highest = [DVec3::ZERO, other.edges[0], other.edges[1]].map(|e| height(other.corner + e)).into_iter();
    highest.fold(0.0, f64::max) <= ROUNDING * other.squared_radius.sqrt()
}
