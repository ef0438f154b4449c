//! Bounding volume hierarchy over the scene's triangles: the only file that names `obvhs`.

use super::sheets::{Sheets, without_repeats};
use super::watertight::{Corners, Meeting, Shear};
use super::{Hit, Ray};
use crate::scene::{Scene, TriangleId};
use glam::Vec3;
use obvhs::aabb::Aabb;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::bvh2_to_cwbvh::bvh2_to_cwbvh;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use obvhs::ray::RayHit;
use obvhs::splits::split_aabbs_preset;
use obvhs::triangle::Triangle;

/// An eight-wide compressed hierarchy with its triangles stored in leaf order.
///
/// Spatial splits list a triangle in several leaves, so there may be more leaf triangles than scene triangles.
pub struct Bvh {
    tree: CwBvh,
    triangles: Vec<Corners>,
    /// Scene triangle of each leaf triangle; the top bits mark a cut-out mask, and those in `sheets`.
    ids: Vec<u32>,
    /// Leaf triangles whose distance is that of their plane.
    sheets: Sheets,
    /// What scene coordinates are multiplied by: a power of two, so that nothing is rounded.
    scale: f32,
}

/// Diagonal of the scene in the hierarchy's own units, at least. obvhs 0.4 starts every ray 0.0001 units late: boxes nearer
/// than that are missed, whatever the size of the scene. Here that is less than f32 resolves.
/// A large one besides: there is room at the other end of f32, and scenes whose detail is a millionth of them.
const DIAGONAL: f32 = 4_294_967_296.0;

const MASKED: u32 = 1 << 31;
const ON_SHEET: u32 = 1 << 30;
const ID: u32 = ON_SHEET - 1;

/// How much boxes are larger than what they hold, against the largest coordinate: several times the rounding of a box test, so
/// that a ray through an edge that two boxes share misses neither.
const MARGIN: f32 = 1.0 / (1 << 20) as f32;

/// Share of the nodes that a round of reinsertion looks at. All of them take 0.50 and 0.29 s of two cores (Crytek Sponza, the hall)
/// where a tenth takes 0.05 and 0.03 s; rays are as fast within the spread of `bench`.
const REINSERTED: f32 = 0.1;

/// Builds the tree of triangles. On Crytek Sponza it builds in 0.3 s.
fn build_tree(triangles: &[Triangle]) -> CwBvh {
    let mut boxes: Vec<Aabb> = triangles.iter().map(|triangle| triangle.aabb()).collect();
    let mut indices: Vec<u32> = (0..boxes.len() as u32).collect();
    let areas = || boxes.iter().map(Aabb::half_area);
    let (mean, largest) = (areas().sum::<f32>() / boxes.len() as f32, areas().fold(0.0, f32::max));
    split_aabbs_preset(&mut boxes, &mut indices, triangles, mean, largest);
    let reach = |b: &Aabb| b.min.abs().max(b.max.abs()).max_element();
    let margin = boxes.iter().map(reach).fold(DIAGONAL, f32::max) * MARGIN;
    for b in &mut boxes {
        (b.min, b.max) = (b.min - margin, b.max + margin);
    }
    let (search, precision) = (PlocSearchDistance::VeryHigh, SortPrecision::U128);
    let mut tree = PlocBuilder::with_capacity(boxes.len()).build(search, &boxes, indices, precision, 0);
    tree.uses_spatial_splits = true;
    ReinsertionOptimizer::default().run(&mut tree, REINSERTED, None);
    bvh2_to_cwbvh(&tree, 3, true, false)
}

impl Bvh {
    /// Builds the hierarchy of all triangles of `scene`.
    #[must_use]
    pub fn build(scene: &Scene) -> Self {
        let unique = without_repeats(scene);
        let scale = (DIAGONAL / scene.diagonal()).log2().ceil().clamp(-120.0, 120.0).exp2();
        let scaled = |id: TriangleId| scene.corners(id).map(|p| p * scale);
        let corners: Vec<Triangle> = unique
            .iter()
            .map(|&id| {
                let [v0, v1, v2] = scaled(id).map(Into::into);
                Triangle { v0, v1, v2 }
            })
            .collect();
        if corners.is_empty() {
            let (tree, sheets) = (CwBvh::default(), Sheets::default());
            return Self { tree, triangles: Vec::new(), ids: Vec::new(), sheets, scale };
        }
        let tree = build_tree(&corners);
        let triangles = tree.primitive_indices.iter().map(|&i| Corners::new(scaled(unique[i as usize]))).collect();
        let of_leaf = || tree.primitive_indices.iter().map(|&i| unique[i as usize]);
        let sheets = Sheets::new(&scene.coplanar, of_leaf(), scale);
        let flag = |is: bool, bit: u32| if is { bit } else { 0 };
        let flagged = |(leaf, id): (usize, TriangleId)| {
            id.0 | flag(scene.material(id).map_d.is_some(), MASKED) | flag(sheets.has(leaf), ON_SHEET)
        };
        let ids = of_leaf().enumerate().map(flagged).collect();
        Self { tree, triangles, ids, sheets, scale }
    }

    /// The closest opaque hit of `ray`, whichever side it comes from.
    #[must_use]
    pub fn closest(&self, scene: &Scene, ray: &Ray) -> Option<Hit> {
        let ray = self.scaled(ray);
        let sheared = Shear::new(ray.origin, ray.direction);
        let mut best: Option<Found> = None;
        self.tree.ray_traverse(to_obvhs(&ray), &mut RayHit::none(), |r, i| {
            let Some(found) = self.intersect(scene, (&ray, &sheared), r.tmax, i) else { return f32::INFINITY };
            // Only triangles of one plane are at the same distance and ranked.
            if best.is_none_or(|b| found.meeting.t < b.meeting.t || found.rank > b.rank) {
                best = Some(found);
            }
            found.meeting.t
        });
        best.map(|Found { leaf, meeting: Meeting { t, u, v }, .. }| {
            let triangle = TriangleId(self.ids[leaf] & ID);
            let back = scene.area_vector(triangle).dot(ray.direction) > 0.0;
            Hit { t: t / self.scale, triangle, u, v, back }
        })
    }

    /// Whether anything opaque lies on the segment.
    #[must_use]
    pub fn occluded(&self, scene: &Scene, ray: &Ray) -> bool {
        let ray = self.scaled(ray);
        let sheared = Shear::new(ray.origin, ray.direction);
        !self.tree.ray_traverse_miss(to_obvhs(&ray), |r, i| {
            let found = self.intersect(scene, (&ray, &sheared), r.tmax, i);
            found.filter(|found| found.meeting.t < r.tmax).map_or(f32::INFINITY, |found| found.meeting.t)
        })
    }

    /// Where the ray meets leaf triangle `leaf` before `t_max`, or there where its plane decides; `None` through a hole of its mask.
    #[inline]
    fn intersect(&self, scene: &Scene, (ray, sheared): (&Ray, &Shear), t_max: f32, leaf: usize) -> Option<Found> {
        let id = self.ids[leaf];
        if id & (MASKED | ON_SHEET) == 0 {
            return self.triangles[leaf].meet(sheared, t_max).map(|meeting| Found { leaf, meeting, rank: 0 });
        }
        let found = if id & ON_SHEET == 0 {
            Found { leaf, meeting: self.triangles[leaf].meet(sheared, t_max)?, rank: 0 }
        } else {
            let plane = self.sheets.meet(ray, leaf).filter(|plane| plane.t <= t_max)?;
            // Within rounding of the plane, which is before the end of the ray or behind its origin for all that is known.
            let meeting = self.triangles[leaf].meet_line(sheared)?;
            Found { leaf, meeting: Meeting { t: plane.t, ..meeting }, rank: plane.rank }
        };
        let Meeting { u, v, .. } = found.meeting;
        if id & MASKED != 0 && !scene.is_opaque_at(TriangleId(id & ID), u, v) {
            return None;
        }
        Some(found)
    }

    /// A ray in the hierarchy's units.
    fn scaled(&self, ray: &Ray) -> Ray {
        Ray { origin: ray.origin * self.scale, direction: ray.direction, t_max: ray.t_max * self.scale }
    }
}

/// Where a ray meets a leaf triangle, and what that counts among others at the same distance.
#[derive(Clone, Copy)]
struct Found {
    leaf: usize,
    meeting: Meeting,
    rank: u32,
}

fn to_obvhs(ray: &Ray) -> obvhs::ray::Ray {
    // Adding 0 turns −0 into 0: obvhs 0.4 takes the sign bit for the inverse and the value for the octant, and misses
    // everything where they disagree (tests/engine/direct.rs, directional light).
    let direction = ray.direction + Vec3::ZERO;
    obvhs::ray::Ray::new(ray.origin.into(), direction.into(), 0.0, ray.t_max)
}

/// Closest hit by testing every triangle: what tests compare with.
#[must_use]
pub fn closest_by_brute_force(scene: &Scene, ray: &Ray) -> Option<Hit> {
    let mut best: Option<Hit> = None;
    for i in 0..scene.triangles.len() {
        let triangle = TriangleId(i as u32);
        let Some((t, u, v)) = intersect_f64(scene.corners(triangle), ray) else { continue };
        if t < best.map_or(ray.t_max, |b| b.t) && scene.is_opaque_at(triangle, u, v) {
            let back = scene.area_vector(triangle).dot(ray.direction) > 0.0;
            best = Some(Hit { t, triangle, u, v, back });
        }
    }
    best
}

/// Möller–Trumbore in double precision.
fn intersect_f64(corners: [Vec3; 3], ray: &Ray) -> Option<(f32, f32, f32)> {
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let (e1, e2) = (b - a, c - a);
    let p = d.cross(e2);
    let det = e1.dot(p);
    if det == 0.0 {
        return None;
    }
    let s = o - a;
    let u = s.dot(p) / det;
    let q = s.cross(e1);
    let v = d.dot(q) / det;
    let t = e2.dot(q) / det;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= 0.0).then_some((t as f32, u as f32, v as f32))
}
