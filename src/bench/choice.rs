//! What it costs to choose directions and hand out samples, rays left out.

use super::figure::{Figure, Step, cpu_seconds};
use crate::estimate::hemisphere::{Method, gather};
use crate::estimate::light_vector::LightVector;
use crate::math::sequence::Sequence;
use glam::Vec3;
use serde::Serialize;
use std::hint::black_box;

/// Cost of one method.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ChoiceCost {
    /// Its name.
    pub method: &'static str,
    /// CPU nanoseconds a ray.
    pub nanoseconds: Figure,
}

/// Gathers of a timing, and rays that each may take.
const GATHERS: u64 = 64;
const RAYS: u32 = 1024;
/// How often each method is timed, in turn with the others.
const REPETITIONS: u64 = 9;

/// Times all methods in turn, in light that costs nothing: bright on one side, dim on the other.
pub fn measure(step: &Step<'_>) -> Option<Vec<ChoiceCost>> {
    let mut costs = Method::NAMES.map(|_| Vec::new());
    for repetition in 0..REPETITIONS {
        if !step("cost of choosing directions") {
            return None;
        }
        for ((_, method), list) in Method::NAMES.into_iter().zip(&mut costs) {
            list.push(nanoseconds(method, repetition));
        }
    }
    let cost = |((method, _), list)| ChoiceCost { method, nanoseconds: Figure::of(list) };
    Some(Method::NAMES.into_iter().zip(costs).map(cost).collect())
}

/// CPU nanoseconds a ray.
fn nanoseconds(method: Method, repetition: u64) -> f64 {
    let radiance = |_: u32, direction: Vec3| if direction.x > 0.2 { Vec3::ONE } else { Vec3::splat(0.25) };
    let mut rays = 0;
    let seconds = cpu_seconds(|| {
        for seed in 0..GATHERS {
            let mut vector = LightVector::default();
            let sequence = Sequence::new(repetition * GATHERS + seed);
            let sink = |sample| vector.push(Vec3::Z, &sample);
            rays += gather(method, &[Vec3::Z], 0..RAYS, &sequence, radiance, sink).rays;
            black_box(vector);
        }
    });
    seconds * 1e9 / f64::from(rays.max(1))
}
