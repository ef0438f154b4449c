//! Bounding volume hierarchy over the scene's triangles: rays against it.

use super::sheets::Sheets;
use super::traversal::{self, Node};
use super::tree::{Primitives, Tree};
use super::watertight::{Corners, LANES, Meeting, Meetings, Shear};
use super::{Hit, Ray};
use crate::scene::geometry::repeats;
use crate::scene::{Scene, TriangleId};
use glam::Vec3;
use rayon::prelude::*;
use smallvec::SmallVec;
use wide::i32x4;

/// An eight-wide hierarchy with its triangles stored by leaf.
pub struct Bvh {
    nodes: Vec<Node>,
    leaves: Vec<Leaf>,
    /// Leaf triangles whose distance is that of their plane.
    sheets: Sheets,
    /// What scene coordinates are multiplied by: a power of two, so that nothing is rounded.
    scale: f32,
}

/// The triangles of a leaf: three lines of the processor's caches.
#[repr(C, align(64))]
struct Leaf {
    corners: Corners,
    /// Scene triangles; the top bits mark those in `sheets`, and a cut-out mask.
    ids: [u32; LANES],
}

const ON_SHEET: u32 = 1 << 31;
const MASKED: u32 = 1 << 30;
const ID: u32 = MASKED - 1;

impl Bvh {
    /// Builds the hierarchy of all triangles of `scene`.
    #[must_use]
    pub fn build(scene: &Scene) -> Self {
        Self::new(Primitives::of(&scene.geometry(&repeats(&scene.triangles))).build(), scene)
    }

    /// The hierarchy of `scene` with the tree of its triangles.
    #[must_use]
    pub fn new(tree: Tree, scene: &Scene) -> Self {
        let Tree { nodes, leaves, mut corners, mut places, scale } = tree;
        places.settle(scene);
        let id = |place: u32| places.triangles[place as usize];
        let shared = places.shared();
        for (leaf, corners) in leaves.iter().zip(&mut corners).take(if shared.is_empty() { 0 } else { leaves.len() }) {
            if leaf.iter().any(|&place| shared.contains(&(place as usize))) {
                let scaled = |&place: &u32| scene.corners(id(place)).map(|p| p * scale);
                *corners = Corners::new(&leaf.iter().map(scaled).collect::<SmallVec<[_; LANES]>>());
            }
        }
        let of_lanes = leaves.iter().flat_map(|leaf| (0..LANES).map(|lane| leaf.get(lane).map(|&place| id(place))));
        let sheets = Sheets::new(&scene.coplanar, of_lanes, scale);
        let flag = |is: bool, bit: u32| if is { bit } else { 0 };
        let flagged = |leaf: usize, lane: usize| {
            let Some(id) = leaves[leaf].get(lane).map(|&place| id(place)) else { return 0 };
            let on_sheet = sheets.has(leaf * LANES + lane);
            id.0 | flag(scene.material(id).map_d.is_some(), MASKED) | flag(on_sheet, ON_SHEET)
        };
        let whole = |(index, corners)| Leaf { corners, ids: std::array::from_fn(|lane| flagged(index, lane)) };
        let leaves = corners.into_par_iter().enumerate().map(whole).collect();
        Self { nodes, leaves, sheets, scale }
    }

    /// The closest opaque hit of `ray`, whichever side it comes from.
    #[must_use]
    pub fn closest(&self, scene: &Scene, ray: &Ray) -> Option<Hit> {
        let ray = self.scaled(ray);
        let sheared = Shear::new(ray.origin, ray.direction);
        let mut best: Option<Found> = None;
        traversal::closest(&self.nodes, &ray, |leaf, mut t_max| {
            let (meetings, lanes) = self.leaves[leaf].meet(&sheared, t_max);
            for lane in bits(lanes) {
                let Some(found) = self.found(scene, &ray, (leaf, lane), &meetings, t_max) else { continue };
                t_max = t_max.min(found.meeting.t);
                // Only triangles of one plane are at the same distance and ranked.
                if best.is_none_or(|b| found.meeting.t < b.meeting.t || found.rank > b.rank) {
                    best = Some(found);
                }
            }
            t_max
        });
        best.map(|Found { leaf, lane, meeting: Meeting { t, u, v, back }, .. }| {
            // The scale is a power of two, and so is this.
            let unit = self.scale.recip();
            let Leaf { corners, ids } = &self.leaves[leaf];
            let [a, b, c] = corners.of_lane(lane);
            let corners = [a * unit, b * unit, c * unit];
            Hit { t: t * unit, triangle: TriangleId(ids[lane % LANES] & ID), u, v, back, corners }
        })
    }

    /// Whether anything opaque lies on the segment.
    #[must_use]
    pub fn occluded(&self, scene: &Scene, ray: &Ray) -> bool {
        let ray = self.scaled(ray);
        let sheared = Shear::new(ray.origin, ray.direction);
        traversal::any(&self.nodes, &ray, |leaf| {
            let (meetings, lanes) = self.leaves[leaf].meet(&sheared, ray.t_max);
            bits(lanes).any(|lane| {
                let found = self.found(scene, &ray, (leaf, lane), &meetings, ray.t_max);
                found.is_some_and(|found| found.meeting.t < ray.t_max)
            })
        })
    }

    /// Where the ray meets a triangle before `t_max`, or there where its plane decides; `None` through a hole of its mask.
    #[inline(always)]
    fn found(
        &self,
        scene: &Scene,
        ray: &Ray,
        (leaf, lane): (usize, usize),
        meetings: &Meetings,
        t_max: f32,
    ) -> Option<Found> {
        let id = self.leaves[leaf].ids[lane % LANES];
        let mut found = Found { leaf, lane, meeting: meetings.of_lane(lane), rank: 0 };
        if id & ON_SHEET != 0 {
            let plane = self.sheets.meet(ray, leaf * LANES + lane).filter(|plane| plane.t <= t_max)?;
            (found.meeting.t, found.rank) = (plane.t, plane.rank);
        } else if found.meeting.t >= t_max {
            return None;
        }
        let Meeting { u, v, .. } = found.meeting;
        (id & MASKED == 0 || scene.is_opaque_at(TriangleId(id & ID), u, v)).then_some(found)
    }

    /// A ray in the hierarchy's units.
    fn scaled(&self, ray: &Ray) -> Ray {
        Ray { origin: ray.origin * self.scale, direction: ray.direction, t_max: ray.t_max * self.scale }
    }
}

impl Leaf {
    /// Where the ray meets the triangles, and the lanes of those before `t_max`. Of a triangle whose plane decides, any place on the
    /// ray's line will do: it is within rounding of the plane, which is before the end of the ray or behind its origin for all
    /// that is known.
    #[inline(always)]
    fn meet(&self, ray: &Shear, t_max: f32) -> (Meetings, u32) {
        let meetings = self.corners.meet(ray);
        let on_sheets = i32x4::new(self.ids.map(u32::cast_signed)).to_bitmask();
        (meetings, meetings.within(t_max) | meetings.inside() & on_sheets)
    }
}

/// The places of the bits that are set.
#[inline(always)]
fn bits(mut mask: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let bit = mask.trailing_zeros() as usize;
        (mask != 0).then(|| {
            mask &= mask - 1;
            bit
        })
    })
}

/// Where a ray meets a triangle, and what that counts among others at the same distance.
#[derive(Clone, Copy)]
struct Found {
    leaf: usize,
    lane: usize,
    meeting: Meeting,
    rank: u32,
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
            best = Some(Hit { t, triangle, u, v, back, corners: scene.corners(triangle) });
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
