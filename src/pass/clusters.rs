//! Clusters of neighbouring triangles, so that the visibility pass draws only those that the view frustum may hold.

use super::frustum::{Bounds, Frustum, Place};
use glam::Vec3;
use std::ops::Range;

/// Triangles of a cluster: fewer fit the frustum's edge better, more are quicker to go through.
const SIZE: usize = 128;

/// Triangles that are drawn or left out together, neighbours in the buffer of their order.
struct Cluster {
    first: u32,
    count: u32,
    bounds: Bounds,
}

/// All clusters of a list of triangles, in its order.
#[derive(Default)]
pub(super) struct Clusters(Vec<Cluster>);

impl Clusters {
    /// Those of triangles in drawing order (best along [`curve`]); the first has this number.
    pub(super) fn new(first: u32, triangles: &[[Vec3; 3]]) -> Self {
        let cluster = |(i, chunk): (usize, &[[Vec3; 3]])| Cluster {
            first: first + (i * SIZE) as u32,
            count: chunk.len() as u32,
            bounds: Bounds::of(chunk.iter().flatten().copied()),
        };
        Self(triangles.chunks(SIZE).enumerate().map(cluster).collect())
    }

    /// Where each cluster lies, with the range of its triangles.
    pub(super) fn places(&self, frustum: &Frustum) -> impl Iterator<Item = (Range<usize>, Place)> {
        let range = |cluster: &Cluster| cluster.first as usize..(cluster.first + cluster.count) as usize;
        self.0.iter().map(move |cluster| (range(cluster), frustum.place(&cluster.bounds)))
    }

    /// Draws, as (first triangle, triangles), of everything that may show: first what needs no clipping, then the rest.
    pub(super) fn draws(&self, frustum: &Frustum) -> Vec<(u32, u32)> {
        let places: Vec<Place> = self.0.iter().map(|cluster| frustum.place(&cluster.bounds)).collect();
        let mut draws: Vec<(u32, u32)> = Vec::new();
        for wanted in [Place::Inside, Place::Crossing] {
            for (cluster, _) in self.0.iter().zip(&places).filter(|(_, place)| **place == wanted) {
                match draws.last_mut() {
                    Some((first, count)) if *first + *count == cluster.first => *count += cluster.count,
                    _ => draws.push((cluster.first, cluster.count)),
                }
            }
        }
        draws
    }
}

/// Where a point lies along a curve that fills a box (Morton order), so that neighbours on the curve are near each other.
pub(super) fn curve(point: Vec3, bounds: &Bounds) -> u32 {
    let [x, y, z] = (bounds.share(point) * 1023.0).as_uvec3().to_array();
    spread(x) << 2 | spread(y) << 1 | spread(z)
}

/// The ten low bits of a number, two zeros before each.
const fn spread(bits: u32) -> u32 {
    let bits = (bits & 0x3ff | bits << 16) & 0x0300_00ff;
    let bits = (bits | bits << 8) & 0x0300_f00f;
    let bits = (bits | bits << 4) & 0x030c_30c3;
    (bits | bits << 2) & 0x0924_9249
}
