//! Brute-force path tracer: no cache, no tricks; the yardstick of everything else.
//!
//! So far it computes direct light only (`--direct-only`): emission seen directly, and one shadow ray a light sample.

use crate::geom::{Hit, Ray};
use crate::math::{combine, luminance, sequence::Sequence};
use crate::scene::Scene;
use crate::scene::camera::View;
use crate::scene::footprint::Footprint;
use crate::shade::lights::{Arrival, Source, delta_arrival};
use crate::shade::phong::lobe;
use crate::shade::world::World;
use glam::{Vec2, Vec3, Vec4};
use rayon::prelude::*;
use std::f32::consts::PI;

/// How a pixel is sampled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filter {
    /// At its centre, as a render without `--aa` does.
    Point,
    /// Uniformly over its square.
    Box,
}

/// Running sums of one pixel.
#[derive(Clone, Copy, Debug, Default)]
struct PixelSums {
    sum: Vec3,
    square: Vec3,
    hits: u32,
    emitters: u32,
}

/// An image in the making: sums over passes of one sample a pixel.
pub struct Accumulator {
    pixels: Vec<PixelSums>,
    samples: u32,
}

/// Mean and variance of the mean, pixel by pixel.
#[derive(Clone, Debug, Default)]
pub struct ReferenceImage {
    /// Mean radiance, and the share of the pixel that geometry covers.
    pub mean: Vec<Vec4>,
    /// Variance of the mean, each channel.
    pub variance: Vec<Vec3>,
    /// Whether a pixel counts in comparisons: covered in every sample, and no emitter seen directly.
    pub mask: Vec<bool>,
}

impl Accumulator {
    /// Nothing sampled yet.
    #[must_use]
    pub fn new(view: &View) -> Self {
        Self { pixels: vec![PixelSums::default(); view.size.pixels()], samples: 0 }
    }

    /// Samples taken a pixel.
    #[must_use]
    pub const fn samples(&self) -> u32 {
        self.samples
    }

    /// Takes one more sample a pixel on the current thread pool; the same whatever the number of threads. `stop` is asked
    /// before each row: a pass that it breaks off is left out entirely.
    pub fn pass(&mut self, world: &World<'_>, view: &View, filter: Filter, stop: impl Fn() -> bool + Sync) -> Pass {
        let width = view.size.width as usize;
        let index = self.samples;
        let rows: Vec<Option<Vec<(Sample, u64)>>> = (0..view.size.height as usize)
            .into_par_iter()
            .map(|y| {
                let sample = |x: usize| sample_pixel(world, view, filter, (x, y), index);
                (!stop()).then(|| (0..width).map(sample).collect())
            })
            .collect();
        let Some(rows) = rows.into_iter().collect::<Option<Vec<_>>>() else { return Pass { rays: 0, finished: false } };
        let mut rays = 0;
        for (pixel, (sample, traced)) in self.pixels.iter_mut().zip(rows.into_iter().flatten()) {
            pixel.add(sample);
            rays += traced;
        }
        self.samples += 1;
        Pass { rays, finished: true }
    }

    /// The image so far.
    #[must_use]
    pub fn image(&self) -> ReferenceImage {
        let n = self.samples.max(1) as f32;
        let mean = |p: &PixelSums| (p.sum / n).extend(p.hits as f32 / n);
        let variance = |p: &PixelSums| {
            let m = p.sum / n;
            (p.square / n - m * m).max(Vec3::ZERO) / (n - 1.0).max(1.0)
        };
        let counts = |p: &PixelSums| p.hits == self.samples && p.emitters == 0;
        ReferenceImage {
            mean: self.pixels.iter().map(mean).collect(),
            variance: self.pixels.iter().map(variance).collect(),
            mask: self.pixels.iter().map(counts).collect(),
        }
    }
}

/// What a pass did.
#[derive(Clone, Copy, Debug)]
pub struct Pass {
    /// Rays traced.
    pub rays: u64,
    /// Whether it ran to its end.
    pub finished: bool,
}

/// One sample of a pixel.
#[derive(Clone, Copy, Debug)]
struct Sample {
    radiance: Vec3,
    hit: bool,
    emits: bool,
}

impl PixelSums {
    fn add(&mut self, sample: Sample) {
        self.sum += sample.radiance;
        self.square += sample.radiance * sample.radiance;
        self.hits += u32::from(sample.hit);
        self.emitters += u32::from(sample.emits);
    }
}

fn sample_pixel(world: &World<'_>, view: &View, filter: Filter, (x, y): (usize, usize), index: u32) -> (Sample, u64) {
    let pixel = (y * view.size.width as usize + x) as u64;
    let sequence = Sequence::new(combine(world.seed, pixel));
    // Many points of a pixel filter textures by themselves; a single one does as the colour pass.
    let (offset, width) = match filter {
        Filter::Point => (Vec2::splat(0.5), 1.0),
        Filter::Box => {
            let [u, v, ..] = sequence.point(index);
            (Vec2::new(u, v), 0.0)
        }
    };
    let point = Vec2::new(x as f32, y as f32) + offset;
    let direction = view.direction(point);
    let ray = Ray { origin: view.eye + direction * view.near, direction: direction.normalize(), t_max: f32::INFINITY };
    match world.bvh.closest(world.scene, &ray) {
        None => (Sample { radiance: Vec3::ZERO, hit: false, emits: false }, 1),
        Some(hit) => {
            let footprint = Footprint::of_pixel(world.scene, view, hit.triangle, point, width);
            let surface = Surface::new(world.scene, &ray, &hit, &footprint);
            let (light, rays) = direct(world, &surface, &sequence, index);
            let emitted = world.scene.emitted_over(hit.face(), hit.u, hit.v, &footprint);
            let emits = world.scene.face_emits(hit.face());
            (Sample { radiance: emitted + light, hit: true, emits }, rays + 1)
        }
    }
}

/// A surface point as the reflection model sees it.
struct Surface {
    point: Vec3,
    origin: Vec3,
    normal: Vec3,
    to_eye: Vec3,
    kd: Vec3,
    ks: Vec3,
    shininess: f32,
}

impl Surface {
    fn new(scene: &Scene, ray: &Ray, hit: &Hit, footprint: &Footprint) -> Self {
        // The point from the barycentrics, not from t: its error follows the triangle's size, not the distance.
        let [a, b, c] = scene.corners(hit.triangle);
        let point = a * (1.0 - hit.u - hit.v) + b * hit.u + c * hit.v;
        let facet = scene.geometric_normal(hit.triangle) * if hit.back { -1.0 } else { 1.0 };
        let material = scene.material(hit.triangle);
        let scale = point.abs().max_element().max(hit.t);
        Self {
            point,
            origin: point + facet * (scale * 4e-6),
            normal: scene.shading_normal_at(hit.triangle, hit.u, hit.v, hit.back),
            to_eye: -ray.direction,
            kd: scene.kd_over(hit.triangle, hit.u, hit.v, footprint),
            ks: material.ks,
            shininess: material.shininess,
        }
    }

    /// Radiance reflected to the eye from one arrival, unoccluded.
    fn reflect(&self, arrival: &Arrival) -> Vec3 {
        let cosine = self.normal.dot(arrival.direction).max(0.0);
        let mut factor = self.kd / PI;
        if self.ks.max_element() > 0.0 {
            factor += self.ks * lobe(self.shininess, self.normal, arrival.direction, self.to_eye);
        }
        factor * arrival.facing * cosine
    }
}

/// Lights of which each sample takes all; above, it draws one by its bound.
const SAMPLE_ALL: usize = 4;

/// One sample of the direct light reflected at a hit.
fn direct(world: &World<'_>, surface: &Surface, sequence: &Sequence, index: u32) -> (Vec3, u64) {
    let sources = &world.lights.sources;
    let mut rays = 0;
    if sources.len() <= SAMPLE_ALL {
        let mut sum = Vec3::ZERO;
        for light in 0..sources.len() {
            let set = 1 + light as u32;
            sum += from_light(world, surface, light, sequence.point_of_set(index, set), &mut rays);
        }
        return (sum, rays);
    }
    let bounds: Vec<f32> = sources.iter().map(|s| s.bound(surface.point, surface.normal)).collect();
    let total: f32 = bounds.iter().sum();
    let [.., pick] = sequence.point(index);
    let mut target = pick * total;
    let chosen = bounds.iter().position(|&bound| {
        let found = bound > 0.0 && target < bound;
        target -= bound;
        found
    });
    // Rounding may run past the end; the last light that can contribute stands in.
    let Some(light) = chosen.or_else(|| bounds.iter().rposition(|&b| b > 0.0)) else { return (Vec3::ZERO, 0) };
    let value = from_light(world, surface, light, sequence.point_of_set(index, 1), &mut rays) * (total / bounds[light]);
    (value, rays)
}

fn from_light(world: &World<'_>, surface: &Surface, light: usize, [u, v, ..]: [f32; 4], rays: &mut u64) -> Vec3 {
    let arrival = match &world.lights.sources[light] {
        Source::Delta(kind) => delta_arrival(kind, surface.point),
        Source::Area(area) => area.at(surface.point).sample(world.scene, [u, v]),
    };
    let Some(arrival) = arrival else { return Vec3::ZERO };
    let value = surface.reflect(&arrival);
    if luminance(value) <= 0.0 {
        return Vec3::ZERO;
    }
    *rays += 1;
    let ray = shadow_ray(surface, &arrival);
    if world.bvh.occluded(world.scene, &ray) { Vec3::ZERO } else { value }
}

fn shadow_ray(surface: &Surface, arrival: &Arrival) -> Ray {
    if arrival.distance.is_infinite() {
        return Ray { origin: surface.origin, direction: arrival.direction, t_max: f32::INFINITY };
    }
    let offset = surface.point + arrival.direction * arrival.distance - surface.origin;
    let length = offset.length();
    Ray { origin: surface.origin, direction: offset / length, t_max: length * (1.0 - 1e-4) }
}
