//! The triangles that rays are tested against: one of those in one place.

use crate::scene::geometry::Geometry;
use crate::scene::material::MaterialId;
use crate::scene::{Scene, TriangleId};
use rustc_hash::{FxHashMap, FxHashSet};

/// One triangle a place, where those in one place that face one way and have one material share it.
///
/// The builder takes quadratic time over coincident ones (measured: 12 s for 20,000).
pub struct Places {
    /// The triangle of each place, ascending as long as none is covered.
    pub triangles: Vec<TriangleId>,
    /// The others, with the index of their place.
    others: Vec<(usize, TriangleId)>,
}

impl Places {
    /// Puts the triangle that is seen in each place: the one of the highest rank.
    pub fn settle(&mut self, scene: &Scene) {
        let rank = |id: TriangleId| scene.coplanar.member(id).map_or(0, |member| member.ranks[0]);
        for &(place, other) in &self.others {
            let seen = &mut self.triangles[place];
            if rank(other) > rank(*seen) {
                *seen = other;
            }
        }
    }

    /// The places of which [`Self::settle`] may change the triangle.
    pub fn shared(&self) -> FxHashSet<usize> {
        self.others.iter().map(|&(place, _)| place).collect()
    }
}

/// The places of a scene's triangles.
pub fn without_repeats(geometry: &Geometry) -> Places {
    type Place = ([u32; 3], bool, MaterialId);
    let mut repeated: Vec<TriangleId> = geometry.repeats.iter().flatten().copied().collect();
    repeated.sort_unstable();
    repeated.dedup();
    let mut first: FxHashMap<Place, TriangleId> = FxHashMap::default();
    let mut covered: Vec<(TriangleId, TriangleId)> = Vec::new();
    for id in repeated {
        let (corners, is_odd) = place(geometry.triangles[id.0 as usize]);
        let first = *first.entry((corners, is_odd, geometry.materials[id.0 as usize])).or_insert(id);
        if first != id {
            covered.push((first, id));
        }
    }
    let mut left_out = covered.iter().map(|&(_, id)| id).peekable();
    let all = (0..geometry.triangles.len() as u32).map(TriangleId);
    let triangles: Vec<TriangleId> = all.filter(|id| left_out.next_if_eq(id).is_none()).collect();
    let place_of = |id: &TriangleId| triangles.partition_point(|other| other < id);
    let others = covered.iter().map(|(first, id)| (place_of(first), *id)).collect();
    Places { triangles, others }
}

/// The corners in ascending order, and whether that turns the triangle over.
fn place(corners: [u32; 3]) -> ([u32; 3], bool) {
    let mut sorted = corners;
    sorted.sort_unstable();
    let [a, b, _] = sorted.map(|c| corners.iter().position(|&corner| corner == c).unwrap_or(0));
    (sorted, (a + 1) % 3 != b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::geometry::repeats;

    #[test]
    fn a_turned_triangle_is_in_the_same_place_the_other_way() {
        assert_eq!(place([4, 9, 7]), place([9, 7, 4]));
        let (forth, back) = (place([4, 9, 7]), place([7, 9, 4]));
        assert_eq!(forth.0, back.0);
        assert_ne!(forth.1, back.1);
    }

    #[test]
    fn a_place_is_shared_by_what_faces_one_way_in_one_material() {
        let triangles = [[0, 1, 2], [3, 4, 5], [1, 2, 0], [1, 0, 2], [0, 1, 2], [2, 0, 1]];
        let materials = [0, 0, 0, 0, 1, 0].map(MaterialId);
        let repeats = repeats(&triangles);
        let geometry = Geometry { positions: &[], triangles: &triangles, materials: &materials, repeats: &repeats };
        let places = without_repeats(&geometry);
        assert_eq!(places.triangles, [0, 1, 3, 4].map(TriangleId));
        assert_eq!(places.others, [(0, TriangleId(2)), (0, TriangleId(5))]);
    }
}
