//! Creases: across an edge of the scene where normals differ, faces refine each by itself, and one may have vertices on the edge that
//! the other lacks. In a picture that does not show; a mesh would have T-junctions. Triangles are cut at such vertices, and what they
//! show stays the same.

use super::barycentric;
use super::drawn::{Drawn, Places};
use super::fill::SlotLight;
use crate::scene::Scene;
use glam::Vec3;
use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// An edge of the scene by its ends, the smaller number first.
type Edge = (u32, u32);
/// A vertex on an edge: how far along, as a share of the edge, and its slot. What has the same position is as far along, to the bit.
type Point = (Edge, f64, u32);

/// A corner of a triangle in the making.
#[derive(Clone, Copy)]
struct Corner {
    slot: u32,
    /// Barycentric weights on its face.
    weights: [f64; 3],
}

/// Vertices on the edges of the scene, and those that are made for want of one.
struct Mend<'a> {
    scene: &'a Scene,
    /// Sorted.
    points: Vec<Point>,
    made: FxHashMap<(u32, u32, u32), u32>,
}

/// Cuts triangles at vertices that others have on their edges; made slots come after all others.
pub fn mend(scene: &Scene, drawn: Vec<Drawn>, places: &mut Places, light: &mut SlotLight) -> Vec<Drawn> {
    let corners: Vec<[Corner; 3]> = drawn.par_iter().map(|drawn| corners_of(scene, drawn, places)).collect();
    let mut points: Vec<Point> = Vec::new();
    for (drawn, corners) in drawn.iter().zip(&corners) {
        for corner in corners {
            let on = (0..3).filter(|&k| corner.weights[k] == 0.0);
            points.extend(on.filter_map(|k| {
                let (edge, at) = along(scene, drawn, k, places.position(corner.slot));
                (at > 0.0 && at < 1.0).then_some((edge, at, corner.slot))
            }));
        }
    }
    points.par_sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
    points.dedup_by_key(|(edge, at, _)| (*edge, *at));
    let mut mend = Mend { scene, points, made: FxHashMap::default() };
    let mut mended = Vec::with_capacity(drawn.len());
    for (drawn, corners) in drawn.iter().zip(corners) {
        mend.cut(drawn, corners, places, light, &mut mended);
    }
    mended
}

fn corners_of(scene: &Scene, drawn: &Drawn, places: &Places) -> [Corner; 3] {
    let corners = scene.corners(drawn.face.triangle());
    drawn.slots.map(|slot| Corner { slot, weights: barycentric::weights(corners, places.position(slot)) })
}

/// The edge of the scene that lies opposite to a corner of a face, and how far along it a position is.
fn along(scene: &Scene, drawn: &Drawn, opposite: usize, position: Vec3) -> (Edge, f64) {
    let index = scene.triangles[drawn.face.triangle().0 as usize];
    let [i, j] = [index[(opposite + 1) % 3], index[(opposite + 2) % 3]];
    let edge = (i.min(j), i.max(j));
    let [a, b] = [edge.0, edge.1].map(|end| scene.positions[end as usize].as_dvec3());
    (edge, (position.as_dvec3() - a).dot(b - a) / (b - a).length_squared())
}

impl Mend<'_> {
    /// Cuts a triangle as often as it takes.
    fn cut(
        &mut self,
        drawn: &Drawn,
        corners: [Corner; 3],
        places: &mut Places,
        light: &mut SlotLight,
        out: &mut Vec<Drawn>,
    ) {
        let mut open = vec![corners];
        while let Some(corners) = open.pop() {
            let [a, b, c] = corners;
            match [(a, b, c), (b, c, a), (c, a, b)]
                .into_iter()
                .find_map(|(p, q, r)| Some((p, q, r, self.between(drawn, p, q, places)?)))
            {
                None => out.push(Drawn { slots: corners.map(|corner| corner.slot), ..*drawn }),
                Some((p, q, r, (at, slot))) => {
                    let middle = self.make(drawn, [p, q], (at, slot), places, light);
                    open.extend([[p, middle, r], [middle, q, r]]);
                }
            }
        }
    }

    /// A vertex on the edge between two corners, if that is a part of an edge of the scene: of several the middle one.
    fn between(&self, drawn: &Drawn, p: Corner, q: Corner, places: &Places) -> Option<(f64, u32)> {
        let opposite = (0..3).find(|&k| p.weights[k] == 0.0 && q.weights[k] == 0.0)?;
        let (edge, from) = along(self.scene, drawn, opposite, places.position(p.slot));
        let (_, to) = along(self.scene, drawn, opposite, places.position(q.slot));
        let first = self.points.partition_point(|(e, at, _)| (*e, *at) <= (edge, from.min(to)));
        let last = self.points.partition_point(|(e, at, _)| (*e, *at) < (edge, from.max(to)));
        let inside = self.points.get(first..last)?;
        inside.get(inside.len() / 2).map(|(_, at, slot)| (*at, *slot))
    }

    /// The vertex on the edge between two corners where another face has `slot`: it shows what the edge shows there.
    fn make(
        &mut self,
        drawn: &Drawn,
        [p, q]: [Corner; 2],
        (at, slot): (f64, u32),
        places: &mut Places,
        light: &mut SlotLight,
    ) -> Corner {
        let opposite = (0..3).find(|&k| p.weights[k] == 0.0 && q.weights[k] == 0.0).unwrap_or(0);
        let [from, to] = [p, q].map(|corner| along(self.scene, drawn, opposite, places.position(corner.slot)).1);
        let share = (at - from) / (to - from);
        let weights = [0, 1, 2].map(|k| p.weights[k] + (q.weights[k] - p.weights[k]) * share);
        let mix = |a: Vec3, b: Vec3| a.lerp(b, share as f32);
        let made = *self.made.entry((p.slot.min(q.slot), p.slot.max(q.slot), slot)).or_insert_with(|| {
            let normal = mix(places.normal(p.slot), places.normal(q.slot)).normalize_or(places.normal(p.slot));
            light.weights.push(1.0);
            let [p, q] = [p.slot, q.slot].map(|slot| slot as usize);
            light.layers.iter_mut().for_each(|layer| layer.push(mix(layer[p], layer[q])));
            places.push(places.position(slot), normal)
        });
        Corner { slot: made, weights }
    }
}
