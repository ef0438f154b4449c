//! How many rays a CPU second are traced: bare rays by kind, and those of the path tracer.

use super::surface::{arrival, seen};
use super::{Figure, Step, cpu_seconds};
use crate::geom::Ray;
use crate::light::context::SceneContext;
use crate::math::{combine, hemisphere::Density, sequence::Sequence};
use crate::reference::{Accumulator, Filter, Settings, Strategy, Transport};
use crate::scene::camera::{ImageSize, View};
use glam::Vec2;
use serde::Serialize;
use std::hint::black_box;

/// Millions of rays a CPU second of one thread.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Rates {
    /// Closest hits of rays through the pixels of an image, row by row.
    pub camera: Figure,
    /// Closest hits of rays from scattered places in scattered directions.
    pub closest: Figure,
    /// Shadow rays from scattered places to the lights; none where no light reaches any.
    pub shadow: Option<Figure>,
    /// All rays of the path tracer.
    pub path_tracer: Figure,
    /// The path tracer against bare rays, as many closest hits as shadow rays.
    pub path_tracer_share: Figure,
}

/// Rays of a batch.
const RAYS: u32 = 1 << 16;
/// How often each batch is timed, in turn with the others.
const REPETITIONS: usize = 7;

/// Rays to be timed.
struct Batch {
    rays: Vec<Ray>,
    shadow: bool,
}

impl Batch {
    /// Millions of rays a CPU second.
    fn rate(&self, context: &SceneContext<'_>) -> f64 {
        let seconds = cpu_seconds(|| {
            for ray in &self.rays {
                if self.shadow {
                    black_box(context.bvh.occluded(context.scene, ray));
                } else {
                    black_box(context.bvh.closest(context.scene, ray));
                }
            }
        });
        self.rays.len() as f64 / seconds * 1e-6
    }
}

/// Times all kinds of rays in turn.
pub fn measure(context: &SceneContext<'_>, view: &View, step: &Step<'_>) -> Option<Rates> {
    let single = rayon::ThreadPoolBuilder::new().num_threads(1).build().ok()?;
    let [camera, closest, shadow] = batches(context, view);
    let mut rates = [const { Vec::new() }; 5];
    for repetition in 0..REPETITIONS {
        if !step(&format!("ray rates, {} of {REPETITIONS}", repetition + 1)) {
            return None;
        }
        let bare = [&camera, &closest, &shadow].map(|batch| batch.rate(context));
        let traced = single.install(|| path_tracer_rate(context, view));
        let raw = if shadow.rays.is_empty() { bare[1] } else { 2.0 / (bare[1].recip() + bare[2].recip()) };
        for (list, rate) in rates.iter_mut().zip(bare.into_iter().chain([traced, traced / raw])) {
            list.push(rate);
        }
    }
    let [camera, closest, shaded, path_tracer, path_tracer_share] = rates.map(Figure::of);
    let shadow = (!shadow.rays.is_empty()).then_some(shaded);
    Some(Rates { camera, closest, shadow, path_tracer, path_tracer_share })
}

/// Camera rays, scattered ones, shadow rays.
fn batches(context: &SceneContext<'_>, view: &View) -> [Batch; 3] {
    let side = RAYS.isqrt();
    let square = View { size: ImageSize { width: side, height: side }, ..*view };
    let through = |i| {
        let pixel = Vec2::new((i % side) as f32 + 0.5, (i / side) as f32 + 0.5);
        Ray { origin: view.eye, direction: square.direction(pixel).normalize(), t_max: f32::INFINITY }
    };
    let camera = (0..RAYS).map(through).collect();
    let sequence = Sequence::new(combine(context.seed, 1));
    let sites = seen(context, view, RAYS);
    let (mut closest, mut shadow) = (Vec::new(), Vec::new());
    for (index, shading_point) in (0..).zip(&sites) {
        let [u, v, pick, _] = sequence.point(index);
        let direction = Density::Cosine.direction(shading_point.normal, [u, v]);
        closest.push(Ray { origin: shading_point.origin, direction, t_max: f32::INFINITY });
        let arrival = arrival(context, shading_point, [u, v, pick]).map(|(arrival, _)| arrival);
        shadow
            .extend(arrival.filter(|a| a.direction.dot(shading_point.normal) > 0.0).map(|a| shading_point.ray_to(&a)));
    }
    let batch = |rays, shadow| Batch { rays, shadow };
    [batch(camera, false), batch(closest, false), batch(shadow, true)]
}

/// Millions of rays a CPU second of this thread in one sample a pixel.
fn path_tracer_rate(context: &SceneContext<'_>, view: &View) -> f64 {
    let mut accumulator = Accumulator::new(view);
    let settings = Settings { filter: Filter::Box, transport: Transport::Full, strategy: Strategy::Both };
    let mut rays = 0;
    let seconds = cpu_seconds(|| rays = accumulator.pass(context, view, settings, || false).rays);
    rays as f64 / seconds * 1e-6
}
