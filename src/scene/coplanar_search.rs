//! The search for faces that overlap in one plane, and for triangles that are large against the scene: see
//! [`Coplanar`].

use super::coplanar::{Coplanar, Member, Plane};
use super::geometry::repeats;
use super::overlap::overlapping;
use super::union::Union;
use super::{FaceId, Scene, TriangleId};
use rustc_hash::FxHashMap;
use std::cmp::Reverse;

impl Plane {
    fn of(scene: &Scene, triangle: TriangleId) -> Self {
        let [a, b, c] = scene.corners(triangle).map(|p| p.as_dvec3());
        let normal = (b - a).cross(c - a).normalize_or_zero();
        Self { normal, offset: normal.dot((a + b + c) / 3.0) }
    }
}

impl Coplanar {
    /// Finds them.
    #[must_use]
    pub fn find(scene: &Scene) -> Self {
        Self::find_with(scene, &repeats(&scene.triangles))
    }

    /// Finds them where the [repeats] are known.
    pub(super) fn find_with(scene: &Scene, repeats: &[[TriangleId; 2]]) -> Self {
        let pairs = overlapping(scene, repeats);
        let large = large(scene);
        let mut triangles: Vec<TriangleId> = pairs.iter().flatten().copied().chain(large).collect();
        triangles.sort_unstable();
        triangles.dedup();
        if triangles.is_empty() {
            return Self::default();
        }
        let index_of: FxHashMap<TriangleId, u32> = triangles.iter().copied().zip(0..).collect();
        let mut union = Union::new(triangles.len());
        pairs.iter().for_each(|[a, b]| union.join(index_of[a], index_of[b]));
        let roots: Vec<u32> = (0..triangles.len() as u32).map(|k| union.root(k)).collect();
        let areas = patch_areas(scene, &triangles, &roots);
        let (planes, plane_of) = planes(scene, &triangles, &roots);
        let order = order(scene, &triangles, &areas);
        let rank_of: FxHashMap<FaceId, u32> = order.iter().copied().zip(0..).collect();
        let member = |(&triangle, plane): (&TriangleId, u32)| {
            let ranks = [false, true].map(|back| rank_of[&FaceId::new(triangle, back)]);
            let along = scene.geometric_normal(triangle).as_dvec3().dot(planes[plane as usize].normal) > 0.0;
            (triangle, Member { plane, ranks, along })
        };
        let members = triangles.iter().zip(plane_of).map(member).collect();
        Self { planes, members, order }
    }
}

/// Triangles larger than the scene: f32 is too coarse at their corners for what they do in the middle.
fn large(scene: &Scene) -> Vec<TriangleId> {
    let scale = scene.scale();
    if scale >= scene.diagonal() {
        return Vec::new();
    }
    let extent = |[a, b, c]: [glam::Vec3; 3]| (b - a).length().max((c - b).length()).max((a - c).length());
    (0..scene.triangles.len() as u32).map(TriangleId).filter(|&t| extent(scene.corners(t)) > scale).collect()
}

/// The plane of each group's largest triangle, and the index of each triangle's.
fn planes(scene: &Scene, triangles: &[TriangleId], roots: &[u32]) -> (Vec<Plane>, Vec<u32>) {
    let mut largest: FxHashMap<u32, (f32, TriangleId)> = FxHashMap::default();
    for (&triangle, &root) in triangles.iter().zip(roots) {
        let area = scene.area_vector(triangle).length();
        let best = largest.entry(root).or_insert((area, triangle));
        if area > best.0 {
            *best = (area, triangle);
        }
    }
    let (mut planes, mut index_of) = (Vec::new(), FxHashMap::default());
    let of_triangle = roots.iter().map(|root| {
        *index_of.entry(*root).or_insert_with(|| {
            planes.push(Plane::of(scene, largest[root].1));
            planes.len() as u32 - 1
        })
    });
    let of_triangle = of_triangle.collect();
    (planes, of_triangle)
}

/// Area of the patch that each triangle is part of: what is connected to it in its plane, of its material.
fn patch_areas(scene: &Scene, triangles: &[TriangleId], roots: &[u32]) -> Vec<f32> {
    let mut union = Union::new(triangles.len());
    let mut first_at: FxHashMap<(u32, u32, u32, bool), u32> = FxHashMap::default();
    let reference: FxHashMap<u32, glam::Vec3> =
        triangles.iter().zip(roots).map(|(&t, &root)| (root, scene.geometric_normal(t))).collect();
    for (k, (&triangle, &root)) in (0..).zip(triangles.iter().zip(roots)) {
        let material = scene.triangle_materials[triangle.0 as usize].0;
        let along = scene.geometric_normal(triangle).dot(reference[&root]) > 0.0;
        for position in scene.triangles[triangle.0 as usize] {
            union.join(*first_at.entry((root, material, position, along)).or_insert(k), k);
        }
    }
    let mut sums = vec![0.0; triangles.len()];
    for (k, &triangle) in (0..).zip(triangles) {
        sums[union.root(k) as usize] += scene.area_vector(triangle).length();
    }
    (0..triangles.len() as u32).map(|k| sums[union.root(k) as usize]).collect()
}

/// Areas of patches count as alike within a part of a factor of two.
const AREA_STEPS: f32 = 8.0;

/// The faces from the one that all others cover to the one that is always seen.
fn order(scene: &Scene, triangles: &[TriangleId], areas: &[f32]) -> Vec<FaceId> {
    let faces = |(&triangle, &area): (&TriangleId, &f32)| {
        // Rounding does not tell which of two equal patches is the smaller.
        let size = (area.log2() * AREA_STEPS).round() as i32;
        let key = |back| (scene.face_emits(FaceId::new(triangle, back)), !back, Reverse(size), triangle);
        [false, true].map(|back| (key(back), FaceId::new(triangle, back)))
    };
    let mut ranked: Vec<_> = triangles.iter().zip(areas).flat_map(faces).collect();
    ranked.sort_unstable_by_key(|(key, _)| *key);
    ranked.into_iter().map(|(_, face)| face).collect()
}
