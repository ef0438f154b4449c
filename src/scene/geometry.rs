//! Where the triangles of a scene are: what stands before its textures, lights and planes do.

use super::material::MaterialId;
use super::{Scene, TriangleId};
use glam::Vec3;
use rayon::prelude::*;

/// The triangles of a scene.
#[derive(Clone, Copy, Debug)]
pub struct Geometry<'s> {
    /// Vertex positions, welded by bits, scene units.
    pub positions: &'s [Vec3],
    /// Position indices of every triangle.
    pub triangles: &'s [[u32; 3]],
    /// The material of every triangle.
    pub materials: &'s [MaterialId],
    /// What [`repeats`] finds among them.
    pub repeats: &'s [[TriangleId; 2]],
}

impl Scene {
    /// Where its triangles are; `repeats` is what [`repeats`] finds among them.
    #[must_use]
    pub fn geometry<'s>(&'s self, repeats: &'s [[TriangleId; 2]]) -> Geometry<'s> {
        Geometry {
            positions: &self.positions,
            triangles: &self.triangles,
            materials: &self.triangle_materials,
            repeats,
        }
    }
}

impl Geometry<'_> {
    /// Corner positions of a triangle.
    #[must_use]
    pub fn corners(&self, triangle: TriangleId) -> [Vec3; 3] {
        self.triangles[triangle.0 as usize].map(|i| self.positions[i as usize])
    }

    /// Length of the diagonal of the bounds; 1 without triangles.
    #[must_use]
    pub fn diagonal(&self) -> f32 {
        bounds(self.positions, self.triangles).map_or(1.0, |(lo, hi)| (hi - lo).length().max(f32::MIN_POSITIVE))
    }
}

/// Smallest and largest coordinates of triangles; `None` without any.
pub(super) fn bounds(positions: &[Vec3], triangles: &[[u32; 3]]) -> Option<(Vec3, Vec3)> {
    let none = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let with = |(lo, hi): (Vec3, Vec3), &i: &u32| {
        let p = positions[i as usize];
        (lo.min(p), hi.max(p))
    };
    let found = triangles
        .par_chunks(1 << 14)
        .map(|chunk| chunk.iter().flatten().fold(none, with))
        .reduce(|| none, |a, b| (a.0.min(b.0), a.1.max(b.1)));
    (!triangles.is_empty()).then_some(found)
}

/// Triangles with the corners of an earlier one, in whatever order: each with the first that has them, ascending.
#[must_use]
pub fn repeats(triangles: &[[u32; 3]]) -> Vec<[TriangleId; 2]> {
    let (ends, by_corner) = by_lowest_corner(triangles);
    let ranges = ends.par_windows(2).map(|range| &by_corner[range[0] as usize..range[1] as usize]);
    let mut pairs: Vec<[TriangleId; 2]> =
        ranges.filter(|around| around.len() > 1).flat_map_iter(|around| repeats_around(triangles, around)).collect();
    pairs.par_sort_unstable_by_key(|&[_, later]| later);
    pairs
}

/// The triangles in the order of their lowest corners, and where those of each corner begin.
fn by_lowest_corner(triangles: &[[u32; 3]]) -> (Vec<u32>, Vec<u32>) {
    let lowest = |&[a, b, c]: &[u32; 3]| a.min(b).min(c) as usize;
    let corners = triangles.iter().map(|t| lowest(t) + 1).max().unwrap_or(0);
    let mut starts = vec![0_u32; corners + 2];
    triangles.iter().for_each(|t| starts[lowest(t) + 2] += 1);
    for i in 2..starts.len() {
        starts[i] += starts[i - 1];
    }
    // Now those of corner c start at `starts[c + 1]`, which is moved to their end, the start of the next.
    let mut sorted = vec![0_u32; triangles.len()];
    for (id, triangle) in (0..).zip(triangles) {
        let place = &mut starts[lowest(triangle) + 1];
        sorted[*place as usize] = id;
        *place += 1;
    }
    starts.pop();
    (starts, sorted)
}

/// Of the triangles with one lowest corner.
fn repeats_around(triangles: &[[u32; 3]], around: &[u32]) -> Vec<[TriangleId; 2]> {
    let place = |&id: &u32| {
        let mut corners = triangles[id as usize];
        corners.sort_unstable();
        (corners, id)
    };
    let mut places: Vec<([u32; 3], u32)> = around.iter().map(place).collect();
    places.sort_unstable();
    let of_place = places.chunk_by(|a, b| a.0 == b.0);
    of_place.flat_map(|same| same[1..].iter().map(|later| [same[0].1, later.1].map(TriangleId))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn repeats_are_found_however_they_are_wound() {
        let triangles = [[4, 9, 7], [0, 1, 2], [7, 4, 9], [4, 7, 8], [2, 1, 0], [9, 7, 4], [0, 1, 3]];
        let expected = [[0, 2], [1, 4], [0, 5]].map(|pair: [u32; 2]| pair.map(TriangleId));
        assert_eq!(repeats(&triangles), expected);
        assert!(repeats(&[]).is_empty());
    }

    #[test]
    fn bounds_are_those_of_the_corners_in_use() {
        let positions = [Vec3::ZERO, Vec3::X, Vec3::Y * 2.0, Vec3::splat(9.0)];
        assert_eq!(bounds(&positions, &[[0, 1, 2]]), Some((Vec3::ZERO, Vec3::new(1.0, 2.0, 0.0))));
        assert_eq!(bounds(&positions, &[]), None);
    }
}
