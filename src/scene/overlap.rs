//! Pairs of triangles that overlap in one plane.

use super::{Scene, TriangleId};
use crate::math::combine;
use glam::{DVec2, DVec3, Vec2};
use rayon::prelude::*;

/// What rounding to f32 moves a sum of few coordinates by, against the largest of them.
const ROUNDING: f64 = 1.0 / (1 << 22) as f64;
/// Cosine of the angle between normals of one plane, at least: small triangles have normals as coarse as their corners.
const PARALLEL: f64 = 0.99;
/// Cells of planes: in slope, and in offset against the scene's scale.
const SLOPES: f64 = 1.0 / 64.0;
const OFFSETS: f64 = 1.0 / 1024.0;
/// Pairs of a cell whose boxes are compared, and of those that are tested exactly, for each triangle in it, at most: a fan of tens of
/// thousands around a corner would take quadratic time. A tile of a floor touches about a dozen others, each pair of which is one test.
const MOST_COMPARED: usize = 512;
const MOST_TESTED: usize = 16;

/// Pairs of triangles that overlap in one plane, exactly or as nearly as rounded coordinates do. Every triangle that does is in
/// one, and those that do so with each other are connected by pairs, unless tens of thousands crowd in one place.
/// `repeats` are those in the place of another.
pub(super) fn overlapping(scene: &Scene, repeats: &[[TriangleId; 2]]) -> Vec<[TriangleId; 2]> {
    let unique = without(repeats, scene.triangles.len());
    let offset_cell = f64::from(scene.scale()) * OFFSETS;
    let cells = |&id: &TriangleId| {
        let flat = Flat::new(scene, id);
        (0..3).flat_map(move |axis| flat.cells(axis, offset_cell)).map(move |cell| (cell, id)).collect::<Vec<_>>()
    };
    let mut in_cells: Vec<(u64, TriangleId)> = unique.par_iter().flat_map_iter(cells).collect();
    in_cells.par_sort_unstable();
    let shared: Vec<&[(u64, TriangleId)]> =
        in_cells.chunk_by(|a, b| a.0 == b.0).filter(|cell| cell.len() > 1).collect();
    let mut pairs = repeats.to_vec();
    pairs.par_extend(shared.par_iter().flat_map_iter(|cell| overlapping_in(scene, cell)));
    pairs
}

/// All triangles but the repeats.
fn without(repeats: &[[TriangleId; 2]], count: usize) -> Vec<TriangleId> {
    let mut left_out = repeats.iter().map(|&[_, later]| later).peekable();
    (0..count as u32).map(TriangleId).filter(|id| left_out.next_if_eq(id).is_none()).collect()
}

/// Those of one cell: swept along an axis.
fn overlapping_in(scene: &Scene, cell: &[(u64, TriangleId)]) -> Vec<[TriangleId; 2]> {
    let first = Flat::new(scene, cell[0].1);
    let axis = first.normal.abs().max_position();
    let mut shadows: Vec<Shadow> = cell.iter().map(|&(_, id)| Shadow::new(scene, id, axis)).collect();
    shadows.sort_unstable_by(|a, b| a.lo.x.total_cmp(&b.lo.x));
    let mut found = Vec::new();
    let (mut compared, mut tested) = (shadows.len() * MOST_COMPARED, shadows.len() * MOST_TESTED);
    for (k, this) in shadows.iter().enumerate() {
        let beside = shadows[k + 1..].iter().take_while(|other| other.lo.x <= this.hi.x).take(compared);
        let near = beside.inspect(|_| compared -= 1).filter(|other| other.lo.y <= this.hi.y && other.hi.y >= this.lo.y);
        let close = near.take(tested).inspect(|_| tested -= 1).filter(|other| !this.is_beside(other));
        found.extend(close.map(|other| [this.id, other.id]).filter(|&[a, b]| overlap(scene, a, b)));
    }
    found
}

/// A triangle as seen along an axis.
struct Shadow {
    corners: [Vec2; 3],
    lo: Vec2,
    hi: Vec2,
    id: TriangleId,
}

impl Shadow {
    fn new(scene: &Scene, id: TriangleId, axis: usize) -> Self {
        let corners @ [a, b, c] = scene.corners(id).map(|p| Vec2::new(p[(axis + 1) % 3], p[(axis + 2) % 3]));
        Self { corners, lo: a.min(b).min(c), hi: a.max(b).max(c), id }
    }

    /// Whether an edge of either has the other beyond it or on it, as neighbours in a mesh have; exact but for the rounding of f64.
    fn is_beside(&self, other: &Self) -> bool {
        self.has_beyond_an_edge(other) || other.has_beyond_an_edge(self)
    }

    fn has_beyond_an_edge(&self, other: &Self) -> bool {
        let [corners, others] = [self, other].map(|shadow| shadow.corners.map(Vec2::as_dvec2));
        (0..3).any(|k| {
            let [from, to, third] = [0, 1, 2].map(|j| corners[(k + j) % 3]);
            let across = (to - from).perp();
            let inside = across.dot(third - from);
            inside != 0.0 && others.iter().all(|&point| inside.signum() * across.dot(point - from) <= 0.0)
        })
    }
}

/// Whether the smaller of two triangles lies in the plane of the other and overlaps it.
fn overlap(scene: &Scene, a: TriangleId, b: TriangleId) -> bool {
    let [a, b] = [a, b].map(|id| Flat::new(scene, id));
    if a.area < b.area { a.overlaps(&b) } else { b.overlaps(&a) }
}

/// A triangle as an element of a plane.
#[derive(Clone, Copy)]
struct Flat {
    corners: [DVec3; 3],
    /// Unit normal, and twice the area.
    normal: DVec3,
    area: f64,
    /// Largest coordinates.
    size: DVec3,
}

impl Flat {
    fn new(scene: &Scene, id: TriangleId) -> Self {
        let corners @ [a, b, c] = scene.corners(id).map(|p| p.as_dvec3());
        let cross = (b - a).cross(c - a);
        let area = cross.length();
        Self { corners, normal: cross / area, area, size: a.abs().max(b.abs()).max(c.abs()) }
    }

    /// Cells of the planes, as p_k + s p_i + t p_j = offset with the axis k, that this may be one of: none unless the normal is
    /// nearly longest along it. Two triangles of one plane share a cell, whatever rounding has done to them, unless one is so thin that
    /// its slope is anything.
    fn cells(self, axis: usize, offset_cell: f64) -> impl Iterator<Item = u64> {
        /// An axis counts as the longest within that.
        const NEARLY: f64 = 0.99;
        let [k, i, j] = [axis, (axis + 1) % 3, (axis + 2) % 3];
        let is_longest = self.normal[k].abs() >= NEARLY * self.normal.abs().max_element();
        let [s, t] = [i, j].map(|other| self.normal[other] / self.normal[k]);
        let [a, b, c] = self.corners;
        let middle = (a + b + c) / 3.0;
        let longest = (b - a).length().max((c - b).length()).max((a - c).length());
        // Rounding of corners against the height of the triangle.
        let slope = self.size.max_element() * ROUNDING * longest / self.area;
        let offset = slope * (middle[i].abs() + middle[j].abs()) + self.size.element_sum() * ROUNDING;
        let range = |x: f64, by: f64, cell: f64| {
            // Cells lie about 0, where most slopes are; never more than two.
            let by = by.min(cell * 0.5);
            let [low, high] = [x - by, x + by].map(|x| (x / cell).round() as i64);
            low..=high
        };
        let places = range(s, slope, SLOPES).flat_map(move |s| range(t, slope, SLOPES).map(move |t| (s, t)));
        let value = middle[k] + s * middle[i] + t * middle[j];
        let cells = places.flat_map(move |(s, t)| range(value, offset, offset_cell).map(move |at| (s, t, at)));
        let name = move |(s, t, at): (i64, i64, i64)| {
            [s, t, at].into_iter().fold(axis as u64, |name, part| combine(name, part as u64))
        };
        cells.filter(move |_| is_longest).map(name)
    }

    /// Whether it overlaps a larger one, in whose plane it lies.
    fn overlaps(&self, large: &Self) -> bool {
        if self.normal.dot(large.normal).abs() < PARALLEL {
            return false;
        }
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
    use crate::scene::geometry::repeats;
    use glam::Vec3;
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
        let mut found: Vec<[u32; 2]> =
            overlapping(&scene, &repeats(&scene.triangles)).into_iter().map(|pair| pair.map(|t| t.0)).collect();
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
