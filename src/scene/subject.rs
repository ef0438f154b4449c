//! What a framing camera shows: the scene without what lies far off and says nothing, and without what surrounds it.
//!
//! Exports bring both: a forgotten triangle kilometres away, a sky dome, a ground that ends at the horizon. Framed with
//! them, the model is a dot, or hidden behind the dome.

use super::Scene;
use super::parts::{self, Part};
use super::up_axis::UpAxis;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Share of the area, at each end of each axis, that need not decide what is framed.
const TAIL: f64 = 0.01;

/// A part further off than this many diagonals of what is framed without it is left out.
const FAR_OFF: f32 = 3.0;

/// Surroundings of the other parts are so many times as large, at least: a dome, and a ground with nothing above it.
const DOME_RATIO: f32 = 4.0;
const GROUND_RATIO: f32 = 30.0;

/// Share of the directions above the horizon that a dome covers, at least, and a mere ground, at most.
const COVERED: f64 = 0.9;
const OPEN: f64 = 0.1;

/// A dome's farthest point against its nearest, as seen from what it surrounds, at most: the sky has no near side. Hollow
/// things with something inside are seldom so round.
const ROUND: f64 = 4.0;

/// Triangles of what is surrounded against those of the surroundings, at least: less is a speck inside a scan.
const SPECK: f64 = 1e-3;

/// Directions in which surroundings are looked for.
const DIRECTIONS: u32 = 256;

/// Sine of the elevation within which a direction is neither up nor down.
const HORIZON: f64 = 0.05;

/// Steps in size below which surroundings are looked for, and parts above one, at most.
const STEPS: usize = 8;
const SURROUNDING_PARTS: usize = 4096;

/// What is framed.
#[derive(Clone, Debug)]
pub(super) struct Subject {
    /// Smallest coordinates.
    pub lo: Vec3,
    /// Largest coordinates.
    pub hi: Vec3,
    /// Parts of the scene.
    pub parts: usize,
    /// Parts that surround the rest.
    pub around: usize,
    /// Parts that lie far off.
    pub far_off: usize,
    /// Corners of the triangles that surround the rest.
    surroundings: Vec<[Vec3; 3]>,
}

impl Subject {
    /// What is to be framed of a scene; `None` without geometry.
    pub(super) fn of(scene: &Scene, up: UpAxis) -> Option<Self> {
        let mut parts = parts::find(scene);
        parts.sort_by(|a, b| b.diagonal().total_cmp(&a.diagonal()));
        let around = surroundings(scene, &parts, up);
        let rest = &parts[around..];
        let ((lo, hi), far_off) = core(rest)?;
        let corners = |part: &Part| -> Vec<[Vec3; 3]> { part.triangles.iter().map(|&t| corners(scene, t)).collect() };
        let surroundings = parts[..around].iter().flat_map(corners).collect();
        Some(Self { lo, hi, parts: parts.len(), around, far_off, surroundings })
    }

    /// Where something goes that is wanted at `place`: nearer to the middle if surroundings would come between.
    pub(super) fn within(&self, place: Vec3) -> Vec3 {
        const THIS_SIDE: f64 = 0.9;
        let middle = self.lo.midpoint(self.hi);
        let way = (place - middle).as_dvec3();
        let nearest = self.surroundings.iter().filter_map(|t| distance(middle.as_dvec3(), way, t)).fold(1.0, f64::min);
        if nearest < 1.0 { middle + (way * nearest * THIS_SIDE).as_vec3() } else { place }
    }

    /// What was left out, for the user; `None` if nothing was.
    pub(super) fn left_out(&self) -> Option<String> {
        let all = self.parts;
        let some = |count: usize, what: &str| (count > 0).then(|| format!("{count} of {all} parts {what}"));
        let one =
            |count: usize, singular: &'static str, plural: &'static str| if count == 1 { singular } else { plural };
        let around = some(self.around, one(self.around, "surrounds the rest", "surround the rest"));
        let far_off = some(self.far_off, one(self.far_off, "lies far off", "lie far off"));
        let said: Vec<String> = around.into_iter().chain(far_off).collect();
        (!said.is_empty()).then(|| format!("{}: left out of the framing", said.join(" and ")))
    }
}

fn corners(scene: &Scene, triangle: u32) -> [Vec3; 3] {
    scene.triangles[triangle as usize].map(|i| scene.positions[i as usize])
}

/// Bounds of what most of the area is in, with all that is not far off from it; and the number of parts outside.
fn core(parts: &[Part]) -> Option<((Vec3, Vec3), usize)> {
    let mut inside = vec![true; parts.len()];
    for axis in 0..3 {
        outside_tails(parts, axis, &mut inside);
    }
    if !inside.contains(&true) {
        inside.fill(true);
    }
    let bounds = |inside: &[bool]| {
        let kept = parts.iter().zip(inside).filter(|(_, inside)| **inside).map(|(part, _)| (part.lo, part.hi));
        kept.reduce(|(lo, hi), (l, h)| (lo.min(l), hi.max(h)))
    };
    loop {
        let (lo, hi) = bounds(&inside)?;
        let reach = (hi - lo).length() * FAR_OFF;
        let near = |part: &Part| (part.lo - hi).max(lo - part.hi).max(Vec3::ZERO).length() <= reach;
        let mut grown = false;
        for (part, inside) in parts.iter().zip(&mut inside).filter(|(part, inside)| !**inside && near(part)) {
            *inside = true;
            grown |= part.lo.cmplt(lo).any() || part.hi.cmpgt(hi).any();
        }
        if !grown {
            return Some(((lo, hi), inside.iter().filter(|inside| !**inside).count()));
        }
    }
}

/// Marks the parts that hold the tails of the area along an axis.
fn outside_tails(parts: &[Part], axis: usize, inside: &mut [bool]) {
    let mut order: Vec<usize> = (0..parts.len()).collect();
    order.sort_by(|&a, &b| parts[a].centre()[axis].total_cmp(&parts[b].centre()[axis]));
    let total: f64 = parts.iter().map(|part| part.area).sum();
    let mut sum = 0.0;
    for k in order {
        let before = sum;
        sum += parts[k].area;
        if sum < TAIL * total || before > (1.0 - TAIL) * total {
            inside[k] = false;
        }
    }
}

/// How many of the parts, the largest first, surround all others.
fn surroundings(scene: &Scene, parts: &[Part], up: UpAxis) -> usize {
    let most = parts.len().min(SURROUNDING_PARTS);
    let step = |&k: &usize| parts[k - 1].diagonal() > 2.0 * parts[k].diagonal();
    let around = (1..most).filter(step).take(STEPS).find(|&k| surround(scene, &parts[..k], &parts[k..], up));
    around.unwrap_or(0)
}

/// Whether `outer` parts are a dome about the others, or the ground that they stand on and that ends far away.
fn surround(scene: &Scene, outer: &[Part], inner: &[Part], up: UpAxis) -> bool {
    let Some(((lo, hi), _)) = core(inner) else { return false };
    let ratio = outer.iter().map(Part::diagonal).fold(f32::INFINITY, f32::min) / (hi - lo).length();
    let count = |parts: &[Part]| parts.iter().map(|part| part.triangles.len()).sum::<usize>() as f64;
    let (outer_count, inner_count) = (count(outer), count(inner));
    if ratio < DOME_RATIO || inner_count < SPECK * outer_count {
        return false;
    }
    let triangles: Vec<[Vec3; 3]> = outer.iter().flat_map(|p| &p.triangles).map(|&t| corners(scene, t)).collect();
    let eye = lo.midpoint(hi).as_dvec3();
    let up = up.vector().as_dvec3();
    let seen: Vec<(f64, Option<f64>)> = (0..DIRECTIONS)
        .into_par_iter()
        .map(|i| {
            let direction = direction(i);
            (direction.dot(up), triangles.iter().filter_map(|t| distance(eye, direction, t)).reduce(f64::min))
        })
        .collect();
    let part = |wanted: &dyn Fn(f64) -> bool| -> Vec<Option<f64>> {
        seen.iter().filter(|(rise, _)| wanted(*rise)).map(|&(_, distance)| distance).collect()
    };
    let (above, below) = (part(&|rise| rise > HORIZON), part(&|rise| rise < -HORIZON));
    let covered = |part: &[Option<f64>]| part.iter().flatten().count() as f64 / part.len() as f64;
    let nearest = above.iter().flatten().copied().fold(f64::INFINITY, f64::min);
    let farthest = above.iter().flatten().copied().fold(0.0, f64::max);
    let dome = covered(&above) >= COVERED && farthest <= ROUND * nearest;
    let ground = covered(&above) <= OPEN && covered(&below) >= COVERED;
    dome || (ground && ratio >= GROUND_RATIO && outer_count <= inner_count)
}

/// Direction `i` of [`DIRECTIONS`], spread evenly over the sphere (a Fibonacci lattice).
fn direction(i: u32) -> DVec3 {
    let height = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(DIRECTIONS);
    let (sin, cos) = (f64::from(i) * std::f64::consts::PI * (3.0 - 5.0_f64.sqrt())).sin_cos();
    let radius = (1.0 - height * height).sqrt();
    DVec3::new(radius * cos, height, radius * sin)
}

/// How many times `way` leads from `origin` to a triangle, from either side, by Cramer's rule.
fn distance(origin: DVec3, way: DVec3, corners: &[Vec3; 3]) -> Option<f64> {
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    let (ab, ac, ao) = (b - a, c - a, origin - a);
    let p = way.cross(ac);
    let determinant = ab.dot(p);
    let q = ao.cross(ab);
    let [u, v, t] = [ao.dot(p), way.dot(q), ac.dot(q)].map(|x| x / determinant);
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0).then_some(t)
}
