//! Paths from the eye.

use super::surface::{Bounce, Surface};
use super::{Filter, Settings, Transport};
use crate::geom::{Hit, Ray};
use crate::math::{combine, sequence::Sequence};
use crate::scene::camera::View;
use crate::scene::footprint::Footprint;
use crate::shade::light_choice::LightChoice;
use crate::shade::world::World;
use glam::{Vec2, Vec3};
use std::cell::OnceCell;

/// Bounces that every path makes before Russian roulette may end it.
const SURE_BOUNCES: u32 = 3;
/// Largest probability to go on: a path ends even between surfaces that absorb nothing.
const MAX_SURVIVAL: f32 = 0.98;

/// One sample of a pixel.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
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
    /// A sample that met nothing.
    const MISS: Self = Self { radiance: Vec3::ZERO, hit: false, emits: false, tied: false };
}

/// Vertices are snapped to this share of a pixel before they are rasterised (8 bits of sub-pixel precision).
const SNAP: f32 = 1.0 / 256.0;
/// Depth across an edge against the distance that makes it a silhouette.
const SILHOUETTE: f32 = 0.01;
/// Cosine between the two sides of an edge below which it is a crease.
const CREASE: f32 = 0.999;

/// Traces paths one after the other.
pub struct Tracer<'a> {
    pub(super) world: &'a World<'a>,
    pub(super) settings: Settings,
    /// The choice of a light where direct light was last sampled.
    pub(super) choice: LightChoice,
    rays: u64,
}

/// The random numbers of one point of a path.
pub struct Random {
    sequence: Sequence,
    index: u32,
    /// [`Self::choices`], once they are asked for.
    choices: OnceCell<[f32; 4]>,
}

impl Random {
    /// Those of the point after `bounces` on path `index` of the pixel of this seed.
    fn new(seed: u64, bounces: u32, index: u32) -> Self {
        let seed = if bounces == 0 { seed } else { combine(seed, bounces.into()) };
        Self { sequence: Sequence::new(seed), index, choices: OnceCell::new() }
    }

    fn within_pixel(&self) -> Vec2 {
        let [u, v, ..] = self.sequence.point(self.index);
        Vec2::new(u, v)
    }

    /// Chooses a point of the first light (two) and a direction (two): all that most points of a path need.
    fn light_and_direction(&self) -> [f32; 4] {
        self.sequence.point_of_set(self.index, 1)
    }

    /// Chooses a point of the light sampled `k`-th, 1 ≤ k < 4.
    pub(super) fn other_light(&self, k: u32) -> [f32; 2] {
        let [u, v, ..] = self.sequence.point_of_set(self.index, 2 + k);
        [u, v]
    }

    /// Chooses one light of many.
    pub(super) fn pick(&self) -> f32 {
        self.choices()[0]
    }

    /// Chooses a lobe.
    fn lobe(&self) -> f32 {
        self.choices()[1]
    }

    /// Chooses whether the path goes on.
    fn survives(&self) -> f32 {
        self.choices()[2]
    }

    fn choices(&self) -> &[f32; 4] {
        self.choices.get_or_init(|| self.sequence.point_of_set(self.index, 2))
    }
}

/// The ray through a point of the image.
fn primary(view: &View, point: Vec2) -> Ray {
    let direction = view.direction(point);
    let origin = view.eye + direction * view.near;
    Ray { origin, direction: direction.normalize(), t_max: f32::INFINITY }
}

impl<'a> Tracer<'a> {
    /// A tracer that has traced nothing.
    pub fn new(world: &'a World<'a>, settings: Settings) -> Self {
        Self { world, settings, choice: LightChoice::default(), rays: 0 }
    }

    /// Rays traced so far.
    pub const fn rays(&self) -> u64 {
        self.rays
    }

    /// Sample `index` of a pixel.
    pub fn pixel(&mut self, view: &View, [x, y]: [u32; 2], index: u32) -> Sample {
        let pixel = u64::from(y) * u64::from(view.size.width) + u64::from(x);
        let seed = combine(self.world.seed, pixel);
        // Many points of a pixel filter textures by themselves; a single one does as the colour pass.
        let (offset, width) = match self.settings.filter {
            Filter::Point => (Vec2::splat(0.5), 1.0),
            Filter::Box => (Random::new(seed, 0, index).within_pixel(), 0.0),
        };
        let point = Vec2::new(x as f32, y as f32) + offset;
        let ray = primary(view, point);
        let Some(hit) = self.closest(&ray) else { return Sample::MISS };
        let scene = self.world.scene;
        let footprint = Footprint::of_pixel(scene, view, hit.triangle, point, width);
        let surface = Surface::new(scene, &ray, &hit, &footprint);
        let emitted = scene.emitted_over(hit.face(), hit.u, hit.v, &footprint);
        let radiance = emitted + self.reflected(surface, seed, index);
        let tied = self.settings.filter == Filter::Point && index == 0 && self.is_tied(view, point, &hit);
        Sample { radiance, hit: true, emits: scene.face_emits(hit.face()), tied }
    }

    /// Whether a point of the image lies on an edge as exactly as a rasteriser can tell.
    fn is_tied(&mut self, view: &View, point: Vec2, hit: &Hit) -> bool {
        let scene = self.world.scene;
        let side = |hit: &Hit| scene.geometric_normal(hit.triangle) * if hit.back { -1.0 } else { 1.0 };
        [Vec2::X, Vec2::Y, Vec2::NEG_X, Vec2::NEG_Y].into_iter().any(|offset| {
            self.closest(&primary(view, point + offset * SNAP)).is_none_or(|beside| {
                (beside.t - hit.t).abs() > SILHOUETTE * hit.t || side(&beside).dot(side(hit)) < CREASE
            })
        })
    }

    /// One sample of the radiance that a surface reflects to the eye.
    fn reflected(&mut self, mut surface: Surface, seed: u64, index: u32) -> Vec3 {
        let (mut sum, mut throughput) = (Vec3::ZERO, Vec3::ONE);
        for bounces in 0.. {
            let random = Random::new(seed, bounces, index);
            let [s, t, u, v] = random.light_and_direction();
            sum += throughput * self.direct(&surface, &random, [s, t]);
            if self.settings.transport == Transport::Direct {
                break;
            }
            let Some(bounce) = surface.bounce([u, v], || random.lobe()) else { break };
            let Some(hit) = self.closest(&bounce.ray) else { break };
            let next = self.surface_beyond(&bounce.ray, &hit);
            sum += throughput * bounce.of_source * self.emitted(&surface, &bounce, &hit, next.point - surface.origin);
            throughput *= bounce.of_beyond;
            let survival = survival(throughput, bounces);
            if survival < 1.0 {
                if random.survives() >= survival {
                    break;
                }
                throughput /= survival;
            }
            surface = next;
        }
        sum
    }

    /// The surface that a bounce leads to.
    fn surface_beyond(&self, ray: &Ray, hit: &Hit) -> Surface {
        let surface = Surface::new(self.world.scene, ray, hit, &Footprint::POINT);
        if self.settings.transport == Transport::Method { surface.diffuse() } else { surface }
    }

    /// What is emitted where a bounce ended, `offset` away, as far as sampling the lights from `surface` leaves it.
    fn emitted(&self, surface: &Surface, bounce: &Bounce, hit: &Hit, offset: Vec3) -> Vec3 {
        let scene = self.world.scene;
        if !scene.face_emits(hit.face()) {
            return Vec3::ZERO;
        }
        let share = self.share_of_hit(surface, hit.triangle, offset, bounce.density);
        scene.emitted_at(hit.face(), hit.u, hit.v) * share
    }

    fn closest(&mut self, ray: &Ray) -> Option<Hit> {
        self.rays += 1;
        self.world.bvh.closest(self.world.scene, ray)
    }

    /// Whether anything lies on the ray.
    pub(super) fn occluded(&mut self, ray: &Ray) -> bool {
        self.rays += 1;
        self.world.bvh.occluded(self.world.scene, ray)
    }
}

/// Probability that a path goes on after some bounces; 0 where it carries nothing.
fn survival(throughput: Vec3, bounces: u32) -> f32 {
    let most = throughput.max_element();
    if most > 0.0 && bounces < SURE_BOUNCES { 1.0 } else { most.min(MAX_SURVIVAL) }
}
