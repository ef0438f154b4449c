//! Sides of triangles that light may reach: not those inside closed bodies, or around a closed room. They go by pieces: sides that are
//! joined by edges. A piece is lit if random paths from it come to where a light is seen.

use crate::geom::bvh::Bvh;
use crate::geom::{Ray, offset};
use crate::math::combine;
use crate::math::hemisphere::Density;
use crate::math::sequence::Sequence;
use crate::scene::light::{Light, LightKind};
use crate::scene::union::Union;
use crate::scene::{FaceId, Scene, TriangleId};
use glam::Vec3;
use rayon::prelude::*;

/// Paths from all pieces, shared out by area.
const PATHS: f64 = (1 << 18) as f64;
/// Paths from each piece; where there are so many pieces that this would be too many, all count as lit.
const PATHS_A_PIECE: f64 = 64.0;
const MOST_PATHS: f64 = (1 << 22) as f64;

/// Bounces of a path at most.
const BOUNCES: u32 = 16;
/// Share of its paths that light must come along: fewer get through rounding, where bodies touch.
const LEAST_SHARE: f64 = 1e-3;

/// By face, whether light may reach it; of triangles in one place, those that `is_first` leaves out are no neighbours of others.
#[must_use]
pub fn reached(scene: &Scene, bvh: &Bvh, is_first: &[bool], seed: u64) -> Vec<bool> {
    let piece = pieces(scene, is_first);
    let (paths, is_unclear) = paths_of(scene, &piece, is_first);
    let look = Look::new(scene, bvh);
    let lit: Vec<u32> = (0..piece.len() as u32)
        .into_par_iter()
        .map(|face| {
            let sequence = Sequence::new(combine(seed, u64::from(face)));
            (0..paths[face as usize]).filter(|&path| look.finds_light(FaceId(face), &sequence, path)).count() as u32
        })
        .collect();
    let mut sums = vec![(0_u32, 0_u32); piece.len()];
    for ((&piece, lit), paths) in piece.iter().zip(lit).zip(paths) {
        let (all, found) = &mut sums[piece as usize];
        (*all, *found) = (*all + paths, *found + lit);
    }
    let is_lit = |(all, found): (u32, u32)| is_unclear || f64::from(found) > f64::from(all) * LEAST_SHARE;
    piece.iter().map(|&piece| is_lit(sums[piece as usize])).collect()
}

/// The piece of each face, by its least face. Sides go together across edges of two triangles, front with front where these are wound alike.
fn pieces(scene: &Scene, is_first: &[bool]) -> Vec<u32> {
    let mut edges: Vec<(u32, u32, u32, bool)> = Vec::with_capacity(scene.triangles.len() * 3);
    for (triangle, index) in scene.triangles.iter().zip(0..).filter(|&(_, index)| is_first[index as usize]) {
        for i in 0..3 {
            let (a, b) = (triangle[i], triangle[(i + 1) % 3]);
            edges.push((a.min(b), a.max(b), index, a < b));
        }
    }
    edges.par_sort_unstable();
    let mut union = Union::new(scene.triangles.len() * 2);
    for run in edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        if let [(_, _, first, ahead), (_, _, second, other)] = *run {
            let turned = ahead == other;
            for back in [false, true] {
                let face = |triangle, back| FaceId::new(TriangleId(triangle), back).0;
                union.join(face(first, back), face(second, back != turned));
            }
        }
    }
    (0..scene.triangles.len() as u32 * 2).map(|face| union.root(face)).collect()
}

/// How many paths start at each face: those of its piece are shared out by area. And whether these are too few to tell.
fn paths_of(scene: &Scene, piece: &[u32], is_first: &[bool]) -> (Vec<u32>, bool) {
    let area = |face: u32| {
        let counts = is_first[face as usize / 2];
        if counts { f64::from(scene.area_vector(FaceId(face).triangle()).length()) } else { 0.0 }
    };
    let mut areas = vec![0.0; piece.len()];
    piece.iter().zip(0..).for_each(|(&piece, face)| areas[piece as usize] += area(face));
    let all: f64 = areas.iter().sum();
    let pieces = piece.iter().zip(0..).filter(|(piece, face)| **piece == *face && is_first[*face as usize / 2]).count();
    let a_piece = MOST_PATHS / pieces.max(1) as f64;
    if a_piece < PATHS_A_PIECE {
        return (vec![0; piece.len()], true);
    }
    let mut left = vec![f64::NAN; piece.len()];
    let of = |(&piece, face): (&u32, u32)| {
        if !is_first[face as usize / 2] {
            return 0;
        }
        let share = |part: f64, whole: f64| if part < whole { part / whole } else { 1.0 };
        let whole = areas[piece as usize];
        let paths = (share(whole, all) * PATHS).max(PATHS_A_PIECE);
        // What is left over of a path goes to the next face of the piece.
        let left = &mut left[piece as usize];
        let due = if left.is_nan() { 0.5 } else { *left } + paths * share(area(face), whole);
        *left = due.fract();
        due as u32
    };
    (piece.iter().zip(0..).map(of).collect(), false)
}

struct Look<'a> {
    scene: &'a Scene,
    bvh: &'a Bvh,
    sky: bool,
    /// Triangles of area lights.
    emitters: Vec<TriangleId>,
    /// Lights that no ray meets by chance.
    lamps: Vec<&'a Light>,
}

/// A point of a surface that a path has come to.
#[derive(Clone, Copy)]
struct Stop {
    origin: Vec3,
    normal: Vec3,
}

impl<'a> Look<'a> {
    fn new(scene: &'a Scene, bvh: &'a Bvh) -> Self {
        let area =
            |light: &Light| if let LightKind::Area { triangles } = &light.kind { triangles.clone() } else { vec![] };
        let is_met = |light: &&Light| matches!(light.kind, LightKind::Environment(_) | LightKind::Area { .. });
        Self {
            scene,
            bvh,
            sky: scene.lights.iter().any(|light| matches!(light.kind, LightKind::Environment(_))),
            emitters: scene.lights.iter().flat_map(area).collect(),
            lamps: scene.lights.iter().filter(|light| !is_met(light)).collect(),
        }
    }

    /// Whether a random path from a face comes to where a light is seen.
    fn finds_light(&self, face: FaceId, sequence: &Sequence, path: u32) -> bool {
        let [p, q, ..] = sequence.point(path);
        let point = point_of(self.scene.corners(face.triangle()), [p, q]);
        let scale = point.abs().max_element().max(self.scene.scale() * 0.1);
        let mut stop = self.stop(face, point, scale, offset::INSIDE);
        for bounce in 1..=BOUNCES {
            let [u, v, choice, spot] = sequence.point_of_set(path, bounce);
            if self.sees_lamp(stop, choice) || self.sees_emitter(stop, choice, [spot, u]) {
                return true;
            }
            let direction = Density::Cosine.direction(stop.normal, [u, v]);
            let ray = Ray { origin: stop.origin, direction, t_max: f32::INFINITY };
            let Some(hit) = self.bvh.closest(self.scene, &ray) else { return self.sky };
            if self.scene.face_lights(hit.face()) {
                return true;
            }
            let point = hit.position(&ray);
            stop = self.stop(hit.face(), point, offset::scale_of_hit(point, hit.t), offset::HIT);
        }
        false
    }

    fn stop(&self, face: FaceId, point: Vec3, scale: f32, share: f32) -> Stop {
        let front = self.scene.geometric_normal(face.triangle());
        let normal = if face.is_back() { -front } else { front };
        Stop { origin: offset::origin(point, normal, scale, share), normal }
    }

    /// Whether a lamp chosen at random shines there.
    fn sees_lamp(&self, stop: Stop, choice: f32) -> bool {
        let Some(lamp) = chosen(&self.lamps, choice) else { return false };
        let (direction, t_max) = match lamp.kind {
            LightKind::Directional { direction, .. } => (-direction, f32::INFINITY),
            LightKind::Sun { direction, .. } => (direction, f32::INFINITY),
            LightKind::Point { position, .. } | LightKind::Spot { position, .. } | LightKind::Lamp { position, .. } => {
                (position - stop.origin, offset::SHORT_OF_LIGHT)
            }
            LightKind::Environment(_) | LightKind::Area { .. } => return false,
        };
        self.is_free(stop, direction, t_max)
    }

    /// Whether a point of an emissive triangle chosen at random shines there.
    fn sees_emitter(&self, stop: Stop, choice: f32, at: [f32; 2]) -> bool {
        let Some(&triangle) = chosen(&self.emitters, choice) else { return false };
        let direction = point_of(self.scene.corners(triangle), at) - stop.origin;
        let back = self.scene.area_vector(triangle).dot(direction) > 0.0;
        self.scene.face_lights(FaceId::new(triangle, back)) && self.is_free(stop, direction, offset::SHORT_OF_LIGHT)
    }

    fn is_free(&self, stop: Stop, direction: Vec3, t_max: f32) -> bool {
        let ray = Ray { origin: stop.origin, direction, t_max };
        direction.dot(stop.normal) > 0.0 && !self.bvh.occluded(self.scene, &ray)
    }
}

/// An item by a number in [0, 1).
fn chosen<T>(items: &[T], choice: f32) -> Option<&T> {
    items.get(((choice * items.len() as f32) as usize).min(items.len().saturating_sub(1)))
}

/// A point of a triangle by a point of the square [0, 1)², evenly.
fn point_of([a, b, c]: [Vec3; 3], [p, q]: [f32; 2]) -> Vec3 {
    let s = p.sqrt();
    a * (1.0 - s) + b * (s * (1.0 - q)) + c * (s * q)
}
