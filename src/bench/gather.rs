//! Errors of the hemisphere methods against rays, at places that a camera sees.

use super::Step;
use super::surface::{reflected, seen};
use crate::estimate::hemisphere::{Method, gather};
use crate::estimate::light_vector::LightVector;
use crate::estimate::stratification::Stratification;
use crate::geom::Ray;
use crate::light::context::{SceneContext, ShadingPoint};
use crate::math::{combine, luminance, sequence::Sequence};
use crate::scene::camera::View;
use rayon::prelude::*;
use serde::Serialize;
use std::ops::Range;

/// What a gather ray finds at its hit: light of the first bounce.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Hits {
    /// The same each time, as from a cache.
    Fixed,
    /// One random shadow ray.
    Random,
}

/// All errors measured.
#[derive(Clone, Debug, Serialize)]
pub struct Study {
    /// Places.
    pub points: usize,
    /// Rays a place behind the truth: stratified ones.
    pub truth_rays: u32,
    /// A row for each method, allowance of rays and kind of hits.
    pub errors: Vec<Errors>,
}

/// Errors of one method. They are of the luminance of the irradiance, relative to its mean over all places.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Errors {
    /// Name of the method.
    pub method: &'static str,
    /// What rays find.
    pub hits: Hits,
    /// Rays that a place was allowed.
    pub allowed: u32,
    /// Rays that it took on average.
    pub rays: f64,
    /// Root of the mean square error.
    pub rmse: f64,
    /// Mean error.
    pub bias: f64,
    /// Standard error of `bias`.
    pub bias_error: f64,
    /// What [`Stratification`] expects `rmse` to be after two rounds at each place; only where it is meant to hold.
    pub expected: Option<f64>,
}

const POINTS: u32 = 256;
const TRUTH: u32 = 1 << 14;
/// Rays allowed.
const ALLOWED: [u32; 4] = [16, 64, 256, 1024];
/// Gathers a place and row.
const REPETITIONS: u64 = 2;

/// Measures all rows, on the current thread pool. `None` if it was broken off.
pub fn measure(context: &SceneContext<'_>, view: &View, step: &Step<'_>) -> Option<Study> {
    let sites = seen(context, view, POINTS);
    let mut errors = Vec::new();
    for hits in [Hits::Fixed, Hits::Random] {
        let truths = truths(context, &sites, hits, step)?;
        for (name, method) in Method::NAMES {
            for allowed in ALLOWED {
                if !step(&format!("hemisphere method {name}, {allowed} rays")) {
                    return None;
                }
                errors.push(row(context, &sites, &truths, hits, (name, method), allowed));
            }
        }
    }
    Some(Study { points: sites.len(), truth_rays: TRUTH, errors })
}

/// Luminance of the irradiance at each place.
fn truths(context: &SceneContext<'_>, sites: &[ShadingPoint], hits: Hits, step: &Step<'_>) -> Option<Vec<f64>> {
    let reference_pixels = |shading_point: &ShadingPoint| {
        step("light by very many rays").then(|| {
            let gather = Gather { context, shading_point, hits, method: Method::Stratified };
            let (vector, _) = gather.rays(0..TRUTH, u64::MAX);
            f64::from(luminance(vector.irradiance()))
        })
    };
    sites.par_iter().map(reference_pixels).collect()
}

/// How light is gathered at a place.
struct Gather<'a> {
    context: &'a SceneContext<'a>,
    shading_point: &'a ShadingPoint,
    hits: Hits,
    method: Method,
}

impl Gather<'_> {
    /// What a range of rays finds, and the number of rays that it took.
    fn rays(&self, rays: Range<u32>, seed: u64) -> (LightVector, u32) {
        let Self { context, shading_point, hits, method } = *self;
        let sequence = Sequence::new(combine(combine(context.seed, shading_point.key), seed));
        let mut vector = LightVector::default();
        let radiance = |index, direction| {
            let ray = Ray { origin: shading_point.origin, direction, t_max: f32::INFINITY };
            let [_, _, u, v] = sequence.point(index);
            let [pick, ..] = sequence.point_of_set(index, 1);
            let random = if hits == Hits::Random { [u, v, pick] } else { [0.5; 3] };
            context
                .bvh
                .closest(context.scene, &ray)
                .map_or_else(Default::default, |hit| reflected(context, &hit, random))
        };
        let sink = |sample| vector.push(shading_point.normal, &sample);
        let gathered = gather(method, &[shading_point.normal], rays, &sequence, radiance, sink);
        (vector, gathered.rays)
    }

    /// What so many rays find, stratified ones in two rounds of which `pool` takes note.
    fn trial(&self, allowed: u32, seed: u64, pool: &mut Stratification) -> (LightVector, u32) {
        if self.method != Method::Stratified {
            return self.rays(0..allowed, seed);
        }
        let ((mut vector, first), (more, second)) =
            (self.rays(0..allowed / 2, seed), self.rays(allowed / 2..allowed, seed));
        pool.note(&vector, &more);
        vector.add(&more);
        (vector, first + second)
    }
}

/// One gather: error, independent variance, rays.
type Trial = (f64, f64, u32);

fn row(
    context: &SceneContext<'_>,
    sites: &[ShadingPoint],
    truths: &[f64],
    hits: Hits,
    (name, method): (&'static str, Method),
    allowed: u32,
) -> Errors {
    let at_site = |(shading_point, reference_pixels): (&ShadingPoint, &f64)| {
        let mut pool = Stratification::default();
        let trials: [Trial; REPETITIONS as usize] = std::array::from_fn(|seed| {
            let (vector, rays) = Gather { context, shading_point, hits, method }.trial(allowed, seed as u64, &mut pool);
            let error = f64::from(luminance(vector.irradiance())) - reference_pixels;
            (error, f64::from(vector.independent_variance()), rays)
        });
        (trials, pool)
    };
    let all: Vec<_> = sites.par_iter().zip(truths).map(at_site).collect();
    let mut pool = Stratification::default();
    all.iter().for_each(|(_, noted)| pool.add(noted));
    let trials: Vec<Trial> = all.iter().flat_map(|(trials, _)| *trials).collect();
    let count = trials.len() as f64;
    let mean = |value: fn(&Trial) -> f64| trials.iter().map(value).sum::<f64>() / count;
    let scale = truths.iter().sum::<f64>() / truths.len() as f64;
    let (bias, square) = (mean(|t| t.0), mean(|t| t.0 * t.0));
    let expected =
        (method == Method::Stratified).then(|| (mean(|t| t.1) * f64::from(pool.gain(allowed))).sqrt() / scale);
    Errors {
        method: name,
        hits,
        allowed,
        rays: mean(|t| f64::from(t.2)),
        rmse: square.sqrt() / scale,
        bias: bias / scale,
        bias_error: ((square - bias * bias) / (count - 1.0)).sqrt() / scale,
        expected,
    }
}
