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

    /// Draws, as (first triangle, triangles), of what lies in the places that are wanted, in their order.
    pub(super) fn draws(&self, frustum: &Frustum, wanted: &[Place]) -> Vec<(u32, u32)> {
        let places: Vec<Place> = self.0.iter().map(|cluster| frustum.place(&cluster.bounds)).collect();
        let mut draws: Vec<(u32, u32)> = Vec::new();
        for wanted in wanted {
            for (cluster, _) in self.0.iter().zip(&places).filter(|(_, place)| *place == wanted) {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::camera::{Camera, ImageSize, View};
    use glam::Vec2;

    /// Small triangles all over the cube from −8 to 8, in the order of the curve.
    fn cloud() -> Vec<[Vec3; 3]> {
        let mut points: Vec<Vec3> = (0..20_000u32)
            .map(|i| {
                let share = |bits: u32| (i.wrapping_mul(2_654_435_761) >> bits & 0xff) as f32 / 16.0 - 8.0;
                Vec3::new(share(0), share(8), share(16))
            })
            .collect();
        let bounds = Bounds::of(points.iter().copied());
        points.sort_by_key(|&p| curve(p, &bounds));
        points.iter().map(|&p| [p, p + Vec3::X * 0.1, p + Vec3::new(0.0, 0.1, 0.05)]).collect()
    }

    fn view(position: Vec3, look_at: Vec3, near: f32) -> View {
        let camera = Camera { position, look_at, up: Vec3::Y, vertical_fov: 50.0 };
        View { near, ..View::new(&camera, ImageSize { width: 96, height: 64 }, 1.0) }
    }

    #[test]
    fn nothing_that_may_show_is_left_out_and_what_is_clipped_comes_last() {
        let triangles = cloud();
        let clusters = Clusters::new(7, &triangles);
        for view in [
            view(Vec3::ZERO, Vec3::new(1.0, 0.3, -0.4), 0.01),
            view(Vec3::ZERO, Vec3::NEG_Z, 3.0),
            view(Vec3::new(0.0, 0.0, 12.0), Vec3::ZERO, 0.1),
            view(Vec3::new(9.0, 2.0, 1.0), Vec3::new(0.0, 6.0, 7.0), 0.1),
        ] {
            let frustum = Frustum::new(&view, Vec2::new(0.4, -0.5));
            let draws = clusters.draws(&frustum, &[Place::Inside, Place::Crossing]);
            let drawn: Vec<usize> = draws.iter().flat_map(|&(f, n)| f as usize - 7..(f + n) as usize - 7).collect();
            let mut once = drawn.clone();
            once.sort_unstable();
            once.dedup();
            assert_eq!(once.len(), drawn.len(), "a triangle is drawn twice");
            assert!(drawn.len() < triangles.len(), "nothing is left out");
            let place = |i: usize| frustum.place_triangle(triangles[i]);
            let left_out = (0..triangles.len()).filter(|i| once.binary_search(i).is_err());
            assert!(left_out.into_iter().all(|i| place(i) == Place::Outside));
            let whole = clusters.places(&frustum).filter(|(_, place)| *place == Place::Inside);
            let unclipped: usize = whole.map(|(range, _)| range.len()).sum();
            assert!(drawn[..unclipped].iter().all(|&i| place(i) == Place::Inside));
        }
    }

    #[test]
    fn the_curve_interleaves_coordinates() {
        let bounds = Bounds::of([Vec3::ZERO, Vec3::splat(1023.0)]);
        let codes = [Vec3::X, Vec3::Y, Vec3::Z, Vec3::X * 2.0, Vec3::splat(1023.0)].map(|p| curve(p, &bounds));
        assert_eq!(codes, [4, 2, 1, 32, (1 << 30) - 1]);
        assert_eq!(curve(Vec3::splat(5.0), &Bounds::of([Vec3::splat(5.0)])), 0, "a box without extent");
    }
}
