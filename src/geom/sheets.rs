//! Rays against triangles whose distance is that of their plane (`scene::coplanar`).

use super::Ray;
use crate::scene::coplanar::{Coplanar, Member};
use crate::scene::material::MaterialId;
use crate::scene::{Scene, TriangleId};
use glam::DVec3;
use rustc_hash::FxHashMap;

/// The triangles that rays are tested against: of those in one place that face one way the one that is seen. Those with a cut-out
/// mask all stay, but for repeats of one material.
///
/// The builder takes quadratic time over coincident ones (measured: 12 s for 20,000).
pub fn without_repeats(scene: &Scene) -> Vec<TriangleId> {
    type Place = ([u32; 3], bool, Option<MaterialId>);
    let mut seen: FxHashMap<Place, usize> = FxHashMap::default();
    let mut unique: Vec<TriangleId> = Vec::with_capacity(scene.triangles.len());
    let rank = |id: TriangleId| scene.coplanar.member(id).map_or(0, |member| member.ranks[0]);
    for id in (0..scene.triangles.len() as u32).map(TriangleId) {
        let (place, is_odd) = place(scene.triangles[id.0 as usize]);
        let mask = scene.material(id).map_d.map(|_| scene.triangle_materials[id.0 as usize]);
        let slot = *seen.entry((place, is_odd, mask)).or_insert(unique.len());
        match unique.get_mut(slot) {
            Some(other) if rank(id) > rank(*other) => *other = id,
            Some(_) => {}
            None => unique.push(id),
        }
    }
    unique
}

/// The corners in ascending order, and whether that turns the triangle over.
fn place(corners: [u32; 3]) -> ([u32; 3], bool) {
    let mut sorted = corners;
    sorted.sort_unstable();
    let [a, b, _] = sorted.map(|c| corners.iter().position(|&corner| corner == c).unwrap_or(0));
    (sorted, (a + 1) % 3 != b)
}

/// Planes in the hierarchy's units, and how each leaf triangle takes part.
#[derive(Default)]
pub struct Sheets {
    planes: Vec<(DVec3, f64)>,
    /// By leaf triangle; empty where no triangle takes part.
    members: Vec<Option<Member>>,
}

/// Where a ray meets a plane.
#[derive(Clone, Copy, Debug)]
pub struct OnSheet {
    /// Distance in lengths of the ray's direction: the same to the bit for all triangles of the plane.
    pub t: f32,
    /// Of triangles at that distance the highest counts.
    pub rank: u32,
}

impl Sheets {
    /// Those of the leaf triangles `ids`; `scale` is what coordinates are multiplied by.
    pub fn new(coplanar: &Coplanar, ids: impl ExactSizeIterator<Item = TriangleId>, scale: f32) -> Self {
        if coplanar.is_empty() {
            return Self::default();
        }
        let members: Vec<Option<Member>> = ids.map(|id| coplanar.member(id)).collect();
        let count = members.iter().flatten().map(|member| member.plane + 1).max().unwrap_or(0);
        let plane = |index| {
            let plane = coplanar.plane(index);
            (plane.normal, plane.offset * f64::from(scale))
        };
        Self { planes: (0..count).map(plane).collect(), members }
    }

    /// Whether a leaf triangle takes part.
    pub fn has(&self, leaf: usize) -> bool {
        self.members.get(leaf).is_some_and(Option::is_some)
    }

    /// Where a ray, in the hierarchy's units, meets the plane of a leaf triangle that takes part; `None` behind its origin.
    pub fn meet(&self, ray: &Ray, leaf: usize) -> Option<OnSheet> {
        let member = self.members.get(leaf).copied().flatten()?;
        let (normal, offset) = self.planes[member.plane as usize];
        let slope = normal.dot(ray.direction.as_dvec3());
        let t = (offset - normal.dot(ray.origin.as_dvec3())) / slope;
        let is_back = (slope > 0.0) == member.along;
        (t >= 0.0 && t.is_finite()).then(|| OnSheet { t: t as f32, rank: member.ranks[usize::from(is_back)] })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turned_triangle_is_in_the_same_place_the_other_way() {
        assert_eq!(place([4, 9, 7]), place([9, 7, 4]));
        let (forth, back) = (place([4, 9, 7]), place([7, 9, 4]));
        assert_eq!(forth.0, back.0);
        assert_ne!(forth.1, back.1);
    }
}
