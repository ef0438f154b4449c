//! Bounding volume hierarchy over the scene's triangles: the only file that names `obvhs`.

use super::{Hit, Ray};
use crate::scene::{Scene, TriangleId};
use glam::Vec3;
use obvhs::BvhBuildParams;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh_from_tris;
use obvhs::ploc::PlocSearchDistance;
use obvhs::ray::RayHit;
use obvhs::rt_triangle::RtTriangle;
use obvhs::triangle::Triangle;
use std::collections::HashSet;
use std::time::Duration;

/// An eight-wide compressed hierarchy with its triangles stored in leaf order.
///
/// Spatial splits list a triangle in several leaves, so there may be more leaf triangles than scene triangles.
pub struct Bvh {
    tree: CwBvh,
    triangles: Vec<RtTriangle>,
    /// Scene triangle of each leaf triangle; the top bit marks a cut-out mask.
    ids: Vec<u32>,
    /// What scene coordinates are multiplied by: a power of two, so that nothing is rounded.
    scale: f32,
}

/// Diagonal of the scene in the hierarchy's own units, at least. obvhs 0.4 starts every ray 0.0001 units late: boxes nearer
/// than that are missed, whatever the size of the scene. Here that is less than f32 resolves.
const DIAGONAL: f32 = 65_536.0;

const MASKED: u32 = 1 << 31;

/// Trace quality is worth more than build time: rays outnumber triangles by far. On Crytek Sponza it builds in 0.6 s.
const fn parameters() -> BvhBuildParams {
    BvhBuildParams {
        ploc_search_distance: PlocSearchDistance::VeryHigh,
        search_depth_threshold: 0,
        ..BvhBuildParams::very_slow_build()
    }
}

impl Bvh {
    /// Builds the hierarchy of all triangles of `scene`.
    #[must_use]
    pub fn build(scene: &Scene) -> Self {
        let unique = without_repeats(scene);
        let scale = (DIAGONAL / scene.diagonal()).log2().ceil().clamp(-120.0, 120.0).exp2();
        let corners: Vec<Triangle> = unique
            .iter()
            .map(|&id| {
                let [a, b, c] = scene.corners(id).map(|p| p * scale);
                Triangle { v0: a.into(), v1: b.into(), v2: c.into() }
            })
            .collect();
        if corners.is_empty() {
            return Self { tree: CwBvh::default(), triangles: Vec::new(), ids: Vec::new(), scale };
        }
        let tree = build_cwbvh_from_tris(&corners, parameters(), &mut Duration::default());
        let triangles = tree.primitive_indices.iter().map(|&i| (&corners[i as usize]).into()).collect();
        let flagged = |i: &u32| {
            let id = unique[*i as usize];
            if scene.material(id).map_d.is_some() { id.0 | MASKED } else { id.0 }
        };
        let ids = tree.primitive_indices.iter().map(flagged).collect();
        Self { tree, triangles, ids, scale }
    }

    /// The closest opaque hit of `ray`, whichever side it comes from.
    #[must_use]
    pub fn closest(&self, scene: &Scene, ray: &Ray) -> Option<Hit> {
        let mut record = RayHit::none();
        let traced = self.to_obvhs(ray);
        let found = self.tree.ray_traverse(traced, &mut record, |r, i| self.intersect(scene, r, i));
        found.then(|| {
            let leaf = record.primitive_id as usize;
            let triangle = TriangleId(self.ids[leaf] & !MASKED);
            let [u, v] = self.triangles[leaf].compute_barycentric(&traced).to_array();
            let back = scene.area_vector(triangle).dot(ray.direction) > 0.0;
            Hit { t: record.t / self.scale, triangle, u, v, back }
        })
    }

    /// Whether anything opaque lies on the segment.
    #[must_use]
    pub fn occluded(&self, scene: &Scene, ray: &Ray) -> bool {
        !self.tree.ray_traverse_miss(self.to_obvhs(ray), |r, i| self.intersect(scene, r, i))
    }

    /// Distance to leaf triangle `index`, infinite on a miss or through a hole of its mask.
    #[inline]
    fn intersect(&self, scene: &Scene, ray: &obvhs::ray::Ray, index: usize) -> f32 {
        let t = self.triangles[index].intersect(ray);
        if self.ids[index] & MASKED != 0 && t < ray.tmax {
            let [u, v] = self.triangles[index].compute_barycentric(ray).to_array();
            if !scene.is_opaque_at(TriangleId(self.ids[index] & !MASKED), u, v) {
                return f32::INFINITY;
            }
        }
        t
    }

    fn to_obvhs(&self, ray: &Ray) -> obvhs::ray::Ray {
        // Adding 0 turns −0 into 0: obvhs 0.4 takes the sign bit for the inverse and the value for the octant, and misses
        // everything where they disagree (tests/direct_light.rs, directional light).
        let direction = ray.direction + Vec3::ZERO;
        obvhs::ray::Ray::new((ray.origin * self.scale).into(), direction.into(), 0.0, ray.t_max * self.scale)
    }
}

/// The triangles without those that repeat an earlier one in place and material: no ray can tell them apart, and the
/// builder takes quadratic time over coincident ones (measured: 12 s for 20,000).
fn without_repeats(scene: &Scene) -> Vec<TriangleId> {
    let mut seen = HashSet::with_capacity(scene.triangles.len());
    let mut is_new = |id: &TriangleId| {
        let mut corners = scene.triangles[id.0 as usize];
        corners.sort_unstable();
        seen.insert((corners, scene.triangle_materials[id.0 as usize]))
    };
    (0..scene.triangles.len() as u32).map(TriangleId).filter(|id| is_new(id)).collect()
}

/// Closest hit by testing every triangle: the yardstick of the tests.
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
