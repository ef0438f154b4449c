//! Paths from the eye, many at a time: step by step all of them rather than one after the other. So a step finds its code and tables in
//! the processor's caches, and memory answers for some paths while others are computed.

use super::direct::{DirectLight, Lit};
use super::random::Random;
use super::settings::{Filter, Settings, Transport};
use super::surface::{Bounce, Surface};
use crate::bsdf::Reflectance;
use crate::geom::{Hit, Ray};
use crate::light::context::SceneContext;
use crate::math::combine;
use crate::scene::camera::View;
use crate::scene::footprint::Footprint;
use glam::{Vec2, Vec3};

/// Bounces that every path makes before Russian roulette may end it.
const SURE_BOUNCES: u32 = 3;
/// Largest probability to go on: a path ends even between surfaces that absorb nothing.
const MAX_SURVIVAL: f32 = 0.98;

/// One sample of a pixel.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// Radiance, W·sr⁻¹·m⁻².
    pub radiance: Vec3,
    /// Whether it met geometry.
    pub hit: bool,
    /// Whether that emits.
    pub emits: bool,
    /// Whether an edge runs through the centre of the pixel, so that a rasteriser may show the other side of it. Looked for
    /// with the first sample at the centre.
    pub tied: bool,
}

impl Sample {
    /// A sample that met no geometry, but `radiance` beyond.
    const fn beyond(radiance: Vec3) -> Self {
        Self { radiance, hit: false, emits: false, tied: false }
    }
}

/// Vertices are snapped to this share of a pixel before they are rasterised (8 bits of sub-pixel precision).
const SNAP: f32 = 1.0 / 256.0;
/// Depth across an edge against the distance that makes it a silhouette.
const SILHOUETTE: f32 = 0.01;
/// Cosine between the two sides of an edge below which it is a crease.
const CREASE: f32 = 0.999;

/// A path on its way.
struct Path {
    /// Index of its sample.
    sample: usize,
    /// Seed of its pixel.
    seed: u64,
    /// Where it is.
    hit: Hit,
    surface: Surface,
    /// What of the light at the surface reaches the eye, a number.
    throughput: Vec3,
    /// What [`DirectLight::sample`] returned there.
    bounds: f32,
    /// Where it goes on from there, once that is drawn.
    bounce: Option<Bounce>,
}

/// Traces paths.
pub struct Tracer<'a> {
    context: &'a SceneContext<'a>,
    settings: Settings,
    /// Samples the lights, and holds the shadow rays of the paths.
    direct: DirectLight<'a>,
    paths: Vec<Path>,
    hits: Vec<Option<Hit>>,
    rays: u64,
}

/// The ray through a point of the image.
fn primary(view: &View, point: Vec2) -> Ray {
    let direction = view.direction(point);
    let origin = view.eye + direction * view.near;
    Ray { origin, direction: direction.normalize(), t_max: f32::INFINITY }
}

impl<'a> Tracer<'a> {
    /// A tracer that has traced nothing.
    pub fn new(context: &'a SceneContext<'a>, settings: Settings) -> Self {
        let direct = DirectLight::new(context, settings);
        Self { context, settings, direct, paths: Vec::new(), hits: Vec::new(), rays: 0 }
    }

    /// Rays traced so far.
    pub const fn rays(&self) -> u64 {
        self.rays
    }

    /// Sample `index` of some pixels, told by their indices.
    pub fn pixels(&mut self, view: &View, pixels: &[u32], index: u32, samples: &mut Vec<Sample>) {
        let first = samples.len();
        let points: Vec<(u64, Vec2)> = pixels.iter().map(|&pixel| self.point(view, pixel, index)).collect();
        self.hits.clear();
        for (_, point) in &points {
            let hit = self.closest(&primary(view, *point));
            self.hits.push(hit);
        }
        let hits = std::mem::take(&mut self.hits);
        for (&(seed, point), hit) in points.iter().zip(&hits) {
            let place = (index, samples.len());
            samples.push(match hit {
                Some(hit) => self.begin(view, seed, point, hit, place),
                None => Sample::beyond(self.background(view, point)),
            });
        }
        self.hits = hits;
        for bounces in 0.. {
            self.sample_lights(bounces, index);
            self.add_light(samples);
            if self.paths.is_empty() {
                break;
            }
            self.advance(bounces, index, samples);
            self.paint();
        }
        debug_assert_eq!(samples.len(), first + pixels.len());
    }

    /// The seed of a pixel, and a point of it.
    fn point(&self, view: &View, pixel: u32, index: u32) -> (u64, Vec2) {
        let seed = combine(self.context.seed, pixel.into());
        let offset = match self.settings.filter {
            Filter::Point => Vec2::splat(0.5),
            Filter::Box => Random::new(seed, 0, index).within_pixel(),
        };
        let width = view.size.width;
        (seed, Vec2::new((pixel % width) as f32, (pixel / width) as f32) + offset)
    }

    /// What shows at a point of the image where no geometry is, W·sr⁻¹·m⁻².
    fn background(&self, view: &View, point: Vec2) -> Vec3 {
        let lights = self.context.lights;
        if lights.at_infinity().next().is_none() {
            return Vec3::ZERO;
        }
        let direction = |offset: Vec2| view.direction(point + offset).normalize();
        let middle = direction(Vec2::ZERO);
        let beside = [Vec2::X, Vec2::Y].map(|offset| direction(offset).distance(middle));
        // Many points of a pixel filter by themselves; a single one does as the colour pass.
        let angle = if self.settings.filter == Filter::Point { beside[0].max(beside[1]) } else { 0.0 };
        let seen = |light: usize| lights.sources[light].seen_at_infinity(middle, angle) * lights.factor(light);
        lights.at_infinity().map(seen).sum()
    }

    /// The first hit of a path.
    fn begin(&mut self, view: &View, seed: u64, point: Vec2, hit: &Hit, (index, sample): (u32, usize)) -> Sample {
        let scene = self.context.scene;
        // Many points of a pixel filter textures by themselves; a single one does as the colour pass.
        let width = if self.settings.filter == Filter::Point { 1.0 } else { 0.0 };
        let footprint = Footprint::of_pixel(hit.corners, view, point, width);
        let mut surface = Surface::new(scene, &primary(view, point), hit);
        surface.turn(scene, hit, &footprint);
        surface.paint(&Reflectance::at(scene, hit.triangle, [hit.u, hit.v], &footprint));
        self.paths.push(Path { sample, seed, hit: *hit, surface, throughput: Vec3::ONE, bounds: 0.0, bounce: None });
        let emits = scene.face_emits(hit.face());
        let emitted = || scene.emitted_over(hit.face(), hit.u, hit.v, &footprint) * self.factor(hit);
        let radiance = if emits { emitted() } else { Vec3::ZERO };
        let tied = self.settings.filter == Filter::Point && index == 0 && self.is_tied(view, point, hit);
        Sample { radiance, hit: true, emits, tied }
    }

    /// Whether a point of the image lies on an edge as exactly as a rasteriser can tell.
    fn is_tied(&mut self, view: &View, point: Vec2, hit: &Hit) -> bool {
        [Vec2::X, Vec2::Y, Vec2::NEG_X, Vec2::NEG_Y].into_iter().any(|offset| {
            self.closest(&primary(view, point + offset * SNAP)).is_none_or(|beside| {
                (beside.t - hit.t).abs() > SILHOUETTE * hit.t || beside.facet().dot(hit.facet()) < CREASE
            })
        })
    }

    /// Samples the lights and draws a direction where each path is; those end that have none.
    fn sample_lights(&mut self, bounces: u32, index: u32) {
        self.direct.shadows.clear();
        let mut paths = std::mem::take(&mut self.paths);
        paths.retain_mut(|path| {
            let random = Random::new(path.seed, bounces, index);
            let [s, t, u, v] = random.light_and_direction();
            path.bounds = {
                let Path { surface, sample, throughput, .. } = &*path;
                let lit = Lit { surface, sample: *sample, throughput: *throughput, bounces };
                self.direct.sample(lit, &random, [s, t])
            };
            if self.settings.transport != Transport::Direct {
                path.bounce = path.surface.bounce([u, v], || random.lobe());
            }
            path.bounce.is_some()
        });
        self.paths = paths;
    }

    /// Adds what of the sampled light is not hidden.
    fn add_light(&mut self, samples: &mut [Sample]) {
        self.rays += self.direct.shadows.len() as u64;
        for shadow in &self.direct.shadows {
            if !self.context.bvh.occluded(self.context.scene, &shadow.ray) {
                samples[shadow.sample].radiance += shadow.light;
            }
        }
    }

    /// Takes each path to where its direction leads; those end that lead nowhere, or by chance.
    fn advance(&mut self, bounces: u32, index: u32, samples: &mut [Sample]) {
        let mut paths = std::mem::take(&mut self.paths);
        let mut hits = std::mem::take(&mut self.hits);
        hits.clear();
        hits.extend(paths.iter().map(|path| path.bounce.as_ref().and_then(|bounce| self.closest(&bounce.ray))));
        let mut of_paths = hits.iter();
        paths.retain_mut(|path| {
            let (Some(found), Some(bounce)) = (of_paths.next(), path.bounce.take()) else { return false };
            let Some(hit) = found else {
                let radiance = self.direct.beyond(&path.surface, path.bounds, &bounce);
                samples[path.sample].radiance += path.throughput * bounce.of_source * radiance;
                return false;
            };
            let next = Surface::new(self.context.scene, &bounce.ray, hit);
            let emitted = self.emitted(path, &bounce, hit, next.point - path.surface.origin);
            samples[path.sample].radiance += path.throughput * bounce.of_source * emitted;
            (path.hit, path.surface) = (*hit, next);
            path.throughput *= bounce.of_beyond;
            let survival = survival(path.throughput, bounces);
            if survival < 1.0 {
                path.throughput /= survival;
                return Random::new(path.seed, bounces, index).survives() < survival;
            }
            true
        });
        (self.paths, self.hits) = (paths, hits);
    }

    /// Looks up the colours of surfaces that bounces lead to: in a loop of its own, so that memory is asked for many at a time.
    fn paint(&mut self) {
        for path in &mut self.paths {
            let Hit { triangle, u, v, .. } = path.hit;
            let reflectance = Reflectance::at(self.context.scene, triangle, [u, v], &Footprint::POINT);
            if self.settings.transport == Transport::Method {
                path.surface.paint_diffuse(&reflectance);
            } else {
                path.surface.turn(self.context.scene, &path.hit, &Footprint::POINT);
                path.surface.paint(&reflectance);
            }
        }
    }

    /// What is emitted where a bounce ended, W·sr⁻¹·m⁻², `offset` away, as far as sampling the lights at the surface
    /// before leaves it.
    fn emitted(&self, from: &Path, bounce: &Bounce, hit: &Hit, offset: Vec3) -> Vec3 {
        let scene = self.context.scene;
        if !scene.face_lights(hit.face()) {
            return Vec3::ZERO;
        }
        let light = self.context.lights.of_triangle(hit.triangle);
        let share = self.direct.share_of_found(&from.surface, from.bounds, light, offset, bounce.density);
        scene.emitted_at(hit.face(), hit.u, hit.v) * self.factor(hit) * share
    }

    /// What the light that a hit is part of counts times now.
    fn factor(&self, hit: &Hit) -> Vec3 {
        let lights = self.context.lights;
        lights.of_triangle(hit.triangle).map_or(Vec3::ONE, |light| lights.factor(light))
    }

    fn closest(&mut self, ray: &Ray) -> Option<Hit> {
        self.rays += 1;
        self.context.bvh.closest(self.context.scene, ray)
    }
}

/// Probability that a path goes on after some bounces; 0 where it carries nothing.
fn survival(throughput: Vec3, bounces: u32) -> f32 {
    let most = throughput.max_element();
    if most > 0.0 && bounces < SURE_BOUNCES { 1.0 } else { most.min(MAX_SURVIVAL) }
}
