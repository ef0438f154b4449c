//! Triangles in the same place: a ray would meet one or the other as rounding has it.

use super::Hit;
use crate::scene::material::MaterialId;
use crate::scene::{Scene, TriangleId};
use rustc_hash::{FxHashMap, FxHashSet};

/// Triangles on whose back lies another one, facing the other way.
#[derive(Clone, Debug, Default)]
pub struct Twins(FxHashMap<TriangleId, Twin>);

/// The triangle on the back of another.
#[derive(Clone, Copy, Debug)]
struct Twin {
    id: TriangleId,
    /// Which corner of the other one each of its corners is.
    corners: [usize; 3],
}

/// The corners of a triangle as bits of their positions, sorted; alike for all triangles in one place.
type Place = [[u32; 3]; 3];

/// How a triangle lies in its place.
#[derive(Clone, Copy)]
struct Lie {
    place: Place,
    /// Which corner of the triangle each corner of the place is.
    corners: [usize; 3],
}

impl Lie {
    fn new(scene: &Scene, id: TriangleId) -> Self {
        // Adding 0 turns −0 into 0.
        let bits = scene.corners(id).map(|p| p.to_array().map(|c| (c + 0.0).to_bits()));
        let mut corners = [0, 1, 2];
        corners.sort_by_key(|&i| bits[i]);
        Self { place: corners.map(|i| bits[i]), corners }
    }

    /// Which way it faces: opposite ones differ.
    const fn side(&self) -> usize {
        let [a, b, _] = self.corners;
        // 0 1 2, 1 2 0 and 2 0 1 go round as the place does.
        if (a + 1) % 3 == b { 0 } else { 1 }
    }

    /// Which corner of `other`, in the same place, each corner is.
    fn corners_of(&self, other: &Self) -> [usize; 3] {
        let mut corners = [0; 3];
        (0..3).for_each(|i| corners[self.corners[i]] = other.corners[i]);
        corners
    }
}

/// The triangles that rays are tested against, one for each place and material, and the others that are seen from their back.
///
/// No ray can tell triangles of one place, side and material apart, and the builder takes quadratic time over coincident ones
/// (measured: 12 s for 20,000). Of two that face opposite ways each is seen from its front, as the two sides of a lamp are; but where
/// one has a cut-out mask, the other shows through it unless it has the same.
pub fn without_repeats(scene: &Scene) -> (Vec<TriangleId>, Twins) {
    let mut seen: FxHashSet<(Place, usize, MaterialId)> = FxHashSet::default();
    let mut first: FxHashMap<(Place, Option<MaterialId>), TriangleId> = FxHashMap::default();
    let (mut unique, mut twins) = (Vec::with_capacity(scene.triangles.len()), Twins::default());
    for id in (0..scene.triangles.len() as u32).map(TriangleId) {
        let lie = Lie::new(scene, id);
        let material = scene.triangle_materials[id.0 as usize];
        if !seen.insert((lie.place, lie.side(), material)) {
            continue;
        }
        let mask = scene.material(id).map_d.map(|_| material);
        let front = *first.entry((lie.place, mask)).or_insert(id);
        let other = Lie::new(scene, front);
        if other.side() == lie.side() {
            unique.push(id);
        } else {
            twins.0.entry(front).or_insert_with(|| Twin { id, corners: lie.corners_of(&other) });
        }
    }
    (unique, twins)
}

impl Twins {
    /// The same hit, of the triangle in that place that faces the ray.
    #[inline]
    pub fn facing(&self, hit: Hit) -> Hit {
        if !hit.back || self.0.is_empty() {
            return hit;
        }
        let Some(twin) = self.0.get(&hit.triangle) else { return hit };
        let weights = [1.0 - hit.u - hit.v, hit.u, hit.v];
        let [_, u, v] = twin.corners.map(|corner| weights[corner]);
        Hit { triangle: twin.id, u, v, back: false, ..hit }
    }
}
