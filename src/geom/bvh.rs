//! Bounding volume hierarchy over the scene's triangles: rays against it.

use super::sheets::Sheets;
use super::tree::{Primitives, Tree};
use super::watertight::{Corners, Meeting, Shear};
use super::{Hit, Ray};
use crate::scene::geometry::repeats;
use crate::scene::{Scene, TriangleId};
use glam::Vec3;
use obvhs::cwbvh::CwBvh;
use obvhs::ray::RayHit;
use rayon::prelude::*;

/// An eight-wide compressed hierarchy with its triangles stored in leaf order.
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

const MASKED: u32 = 1 << 31;
const ON_SHEET: u32 = 1 << 30;
const ID: u32 = ON_SHEET - 1;

impl Bvh {
    /// Builds the hierarchy of all triangles of `scene`.
    #[must_use]
    pub fn build(scene: &Scene) -> Self {
        Self::new(Primitives::of(&scene.geometry(&repeats(&scene.triangles))).build(), scene)
    }

    /// The hierarchy of `scene` with the tree of its triangles.
    #[must_use]
    pub fn new(tree: Tree, scene: &Scene) -> Self {
        let Tree { nodes, mut triangles, mut places, scale } = tree;
        places.settle(scene);
        let shared = places.shared();
        let id = |leaf: usize| places.triangles[nodes.primitive_indices[leaf] as usize];
        for leaf in 0..if shared.is_empty() { 0 } else { triangles.len() } {
            if shared.contains(&(nodes.primitive_indices[leaf] as usize)) {
                triangles[leaf] = Corners::new(scene.corners(id(leaf)).map(|p| p * scale));
            }
        }
        let sheets = Sheets::new(&scene.coplanar, (0..triangles.len()).map(id), scale);
        let flag = |is: bool, bit: u32| if is { bit } else { 0 };
        let flagged = |leaf: usize| {
            let id = id(leaf);
            id.0 | flag(scene.material(id).map_d.is_some(), MASKED) | flag(sheets.has(leaf), ON_SHEET)
        };
        let ids = (0..triangles.len()).into_par_iter().map(flagged).collect();
        Self { tree: nodes, triangles, ids, sheets, scale }
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
