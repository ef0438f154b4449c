//! Pairs of triangles that overlap in one plane.

use super::{Scene, TriangleId};
use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;
use rstar::primitives::{GeomWithData, Rectangle};
use rstar::{AABB, RTree};
use rustc_hash::FxHashMap;
use smallvec::SmallVec;

/// What rounding to f32 moves a sum of few coordinates by, against the largest of them.
const ROUNDING: f64 = 1.0 / (1 << 22) as f64;
/// Cosine of the angle between normals of one plane, at least: small triangles have normals as coarse as their corners.
const PARALLEL: f32 = 0.99;
/// Overlaps that one triangle is asked for: enough to find what belongs together, however many lie in one place.
const MOST: usize = 64;

/// Triangles in the box of one that are looked at, together: a fan of 200,000 around a corner would take quadratic time.
const MOST_LOOKED_AT: usize = 1 << 24;
/// The same for each, at least.
const LEAST_LOOKED_AT: usize = 64;
/// The same for each of the largest, on which many others lie.
const LARGE_LOOKS_AT: usize = 1 << 15;
/// These are one in so many.
const LARGE_ONE_IN: usize = 1024;

type Entry = GeomWithData<Rectangle<[f32; 3]>, u32>;

/// Pairs of triangles that overlap in one plane, exactly or as nearly as rounded coordinates do. Every triangle that does is in
/// one, and those that do so with each other are connected by pairs.
pub(super) fn overlapping(scene: &Scene) -> Vec<[TriangleId; 2]> {
    let (unique, mut pairs) = in_one_place(scene);
    let triangles = (0..scene.triangles.len() as u32).into_par_iter().map(TriangleId);
    let large = area_exceeded_by(scene, &unique, unique.len() / LARGE_ONE_IN);
    let facets: Vec<(Vec3, f32)> =
        triangles.map(|t| (scene.geometric_normal(t), scene.area_vector(t).length())).collect();
    let most_near = |area: f32| {
        let most = if area >= large { LARGE_LOOKS_AT } else { MOST_LOOKED_AT / unique.len() };
        most.max(LEAST_LOOKED_AT)
    };
    let tree: RTree<Entry> = RTree::bulk_load(unique.par_iter().map(|&id| entry(scene, id)).collect());
    let found = unique.par_iter().flat_map_iter(|&id| {
        let here = Flat::new(scene, id);
        let (normal, area) = facets[id.0 as usize];
        // Each looks for larger ones: few are in its box, however many lie on a floor.
        let may_overlap = |other: &TriangleId| {
            let (its_normal, its_area) = facets[other.0 as usize];
            (area, id) < (its_area, *other) && normal.dot(its_normal).abs() >= PARALLEL
        };
        let near = tree.locate_in_envelope_intersecting(envelope(scene, id)).take(most_near(area));
        let candidates = near.map(|entry| TriangleId(entry.data)).filter(may_overlap);
        let overlapping = candidates.filter(|&other| here.overlaps(&Flat::new(scene, other))).take(MOST);
        overlapping.map(|other| [id, other]).collect::<SmallVec<[_; 4]>>()
    });
    pairs.extend(found.collect::<Vec<_>>());
    pairs
}

/// The area vector's length of the triangle that so many exceed.
fn area_exceeded_by(scene: &Scene, triangles: &[TriangleId], count: usize) -> f32 {
    let mut areas: Vec<f32> = triangles.iter().map(|&t| scene.area_vector(t).length()).collect();
    let place = areas.len().saturating_sub(count + 1);
    if areas.is_empty() { 0.0 } else { *areas.select_nth_unstable_by(place, f32::total_cmp).1 }
}

/// Triangles, one a place, and the others in its place with it.
fn in_one_place(scene: &Scene) -> (Vec<TriangleId>, Vec<[TriangleId; 2]>) {
    let mut first: FxHashMap<[u32; 3], TriangleId> = FxHashMap::default();
    let (mut unique, mut pairs) = (Vec::with_capacity(scene.triangles.len()), Vec::new());
    for (id, &corners) in (0..).map(TriangleId).zip(&scene.triangles) {
        let mut place = corners;
        place.sort_unstable();
        let other = *first.entry(place).or_insert(id);
        if other == id {
            unique.push(id);
        } else {
            pairs.push([other, id]);
        }
    }
    (unique, pairs)
}

fn envelope(scene: &Scene, id: TriangleId) -> AABB<[f32; 3]> {
    let [a, b, c] = scene.corners(id);
    AABB::from_corners(a.min(b).min(c).to_array(), a.max(b).max(c).to_array())
}

fn entry(scene: &Scene, id: TriangleId) -> Entry {
    GeomWithData::new(Rectangle::from_aabb(envelope(scene, id)), id.0)
}

/// A triangle as an element of a plane.
struct Flat {
    corners: [DVec3; 3],
    /// Unit normal.
    normal: DVec3,
    /// Largest coordinates.
    size: DVec3,
}

impl Flat {
    fn new(scene: &Scene, id: TriangleId) -> Self {
        let corners @ [a, b, c] = scene.corners(id).map(|p| p.as_dvec3());
        let normal = (b - a).cross(c - a).normalize_or_zero();
        Self { corners, normal, size: a.abs().max(b.abs()).max(c.abs()) }
    }

    /// Whether it overlaps a larger one, in whose plane it lies.
    fn overlaps(&self, large: &Self) -> bool {
        let size = large.size.max(self.size) * ROUNDING;
        let off = |p: &DVec3| (*p - large.corners[0]).dot(large.normal).abs();
        let within = large.normal.abs().dot(size);
        self.corners.iter().all(|p| off(p) <= within) && overlap_in_plane(large, self, size.element_sum())
    }
}

/// Whether two triangles of a plane overlap by more than `margin`: no edge of either separates them.
fn overlap_in_plane(a: &Flat, b: &Flat, margin: f64) -> bool {
    let (u, v) = a.normal.any_orthonormal_pair();
    let flat = |t: &Flat| t.corners.map(|p| DVec2::new((p - a.corners[0]).dot(u), (p - a.corners[0]).dot(v)));
    let (p, q) = (flat(a), flat(b));
    let separates = |from: &[DVec2; 3], other: &[DVec2; 3], i: usize| {
        let across = (from[(i + 1) % 3] - from[i]).perp().normalize_or_zero();
        // The triangle itself lies on one side of its edge.
        let inside = across.dot(from[(i + 2) % 3] - from[i]).signum();
        other.iter().all(|&point| inside * across.dot(point - from[i]) <= margin)
    };
    (0..3).all(|i| !separates(&p, &q, i) && !separates(&q, &p, i))
}

#[cfg(test)]
mod tests {
    use super::*;
    fn pairs(triangles: &[[Vec3; 3]]) -> Vec<[u32; 2]> {
        let mut scene = Scene::default();
        for corners in triangles {
            let index = |p: &Vec3| scene.positions.iter().position(|q| q == p);
            let found: Vec<Option<usize>> = corners.iter().map(index).collect();
            let corners = found.iter().zip(corners).map(|(found, p)| {
                found.unwrap_or_else(|| {
                    scene.positions.push(*p);
                    scene.positions.len() - 1
                }) as u32
            });
            let corners: Vec<u32> = corners.collect();
            scene.triangles.push([corners[0], corners[1], corners[2]]);
        }
        let mut found: Vec<[u32; 2]> = overlapping(&scene).into_iter().map(|pair| pair.map(|t| t.0)).collect();
        found.iter_mut().for_each(|pair| pair.sort_unstable());
        found.sort_unstable();
        found
    }

    /// A quad that leans, cut along one diagonal or the other.
    fn quad(other_diagonal: bool) -> [[Vec3; 3]; 2] {
        let turn = glam::Quat::from_rotation_x(0.7) * glam::Quat::from_rotation_z(0.3);
        let [a, b, c, d] = [(0.0, 0.0), (3.0, 0.1), (2.9, 2.0), (-0.2, 2.2)].map(|(x, y)| turn * Vec3::new(x, y, 5.0));
        if other_diagonal { [[a, b, d], [b, c, d]] } else { [[a, b, c], [a, c, d]] }
    }

    #[test]
    fn neighbours_do_not_overlap() {
        assert!(pairs(&quad(false)).is_empty());
        let shift = Vec3::Z * 0.01;
        let [a, b] = quad(false);
        assert!(pairs(&[a, b, a.map(|p| p + shift), b.map(|p| p + shift)]).is_empty(), "planes a little apart");
    }

    #[test]
    fn the_same_quad_overlaps_however_it_is_cut_and_wound() {
        let ([a, b], [c, d]) = (quad(false), quad(true));
        assert_eq!(pairs(&[a, b, c, d]), [[0, 2], [0, 3], [1, 2], [1, 3]]);
        let [p, q, r] = a;
        assert_eq!(pairs(&[a, [r, q, p]]), [[0, 1]]);
        assert_eq!(pairs(&[a, b, c.map(|p| p + (a[1] - a[0]) * 2.0)]), [[0u32; 2]; 0], "beside it");
    }

    #[test]
    fn many_in_one_place_are_found_quickly() {
        let [a, b] = quad(false);
        let many: Vec<[Vec3; 3]> = (0..5_000).map(|_| a).chain([b]).collect();
        assert_eq!(pairs(&many).len(), 4_999);
    }
}
