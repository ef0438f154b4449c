//! A surface point as the reflection model sees it: evaluation, and directions drawn by it.

use crate::bsdf::{Gloss, Lobe, Reflectance, sample_diffuse};
use crate::geom::{Hit, Ray, offset};
use crate::light::arrival::Arrival;
use crate::scene::Scene;
use crate::scene::footprint::Footprint;
use glam::Vec3;
use std::f32::consts::{FRAC_1_PI, PI};

/// The point that a ray hit, with the material there.
pub struct Surface {
    /// The point itself, scene units.
    pub point: Vec3,
    /// Where rays start and light is evaluated: a little off the facet. Rounding would put half of the points of a lamp's back
    /// in front of it, where it fills the hemisphere.
    pub origin: Vec3,
    /// Unit normal of the triangle, on the side that was hit.
    facet: Vec3,
    /// Unit shading normal on that side.
    pub normal: Vec3,
    to_eye: Vec3,
    /// Diffuse reflectance towards the eye.
    kd: Vec3,
    ks: Vec3,
    /// The highlight.
    shine: Option<Shine>,
    /// Share of directions drawn by the highlight's lobe.
    glossy: f32,
}

/// A highlight, and as the eye sees it.
struct Shine {
    gloss: Gloss,
    lobe: Lobe,
}

/// Phong exponent below which the highlight is drawn with the diffuse lobe: it is about as wide, and at 0 fills the sphere.
const WIDE: f32 = 1.0;

/// How a direction is reflected, without k_d and k_s.
#[derive(Clone, Copy)]
pub struct Response {
    direction: Vec3,
    cosine: f32,
    /// What the diffuse part counts times.
    diffuse: f32,
    lobe: Vec3,
}

/// A direction to follow.
pub struct Bounce {
    pub ray: Ray,
    /// Density with which it was drawn, sr⁻¹.
    pub density: f32,
    /// f_r cosθ / density, a number, for light of a source that the ray hits.
    pub of_source: Vec3,
    /// The same for light that comes from beyond.
    pub of_beyond: Vec3,
}

impl Surface {
    /// The surface before [`Self::paint`].
    pub fn new(scene: &Scene, ray: &Ray, hit: &Hit) -> Self {
        let (point, facet) = (hit.position(ray), hit.facet());
        Self {
            point,
            origin: offset::origin(point, facet, offset::scale_of_hit(point, hit.t), offset::HIT),
            facet,
            normal: scene.shading_normal_at(hit.triangle, hit.u, hit.v, hit.back),
            to_eye: -ray.direction,
            kd: Vec3::ZERO,
            ks: Vec3::ZERO,
            shine: None,
            glossy: 0.0,
        }
    }

    /// Turns its shading normal as a normal map says.
    pub fn turn(&mut self, scene: &Scene, hit: &Hit, footprint: &Footprint) {
        self.normal = scene.mapped_normal(hit.triangle, [hit.u, hit.v], footprint, (self.normal, hit.back));
    }

    /// Gives it what it reflects.
    pub fn paint(&mut self, reflectance: &Reflectance) {
        let (normal, to_eye) = (self.normal, self.to_eye);
        self.ks = reflectance.ks;
        self.shine = reflectance.gloss.map(|gloss| Shine { gloss, lobe: gloss.seen(normal, to_eye) });
        let seen = self.shine.as_ref().map_or(1.0, |shine| shine.gloss.diffuse_out(normal.dot(to_eye)));
        self.kd = reflectance.kd * seen;
        self.glossy = self.shine.as_ref().map_or(0.0, |shine| glossy_share(self.kd, self.ks, &shine.lobe));
    }

    /// The same with what goes into the highlight reflected diffusely.
    pub fn paint_diffuse(&mut self, reflectance: &Reflectance) {
        (self.kd, self.ks, self.glossy, self.shine) = (reflectance.albedo(), Vec3::ZERO, 0.0, None);
    }

    /// The ray to a light.
    pub fn ray_to(&self, arrival: &Arrival) -> Ray {
        Ray { origin: self.origin, direction: arrival.direction, t_max: arrival.distance * offset::SHORT_OF_LIGHT }
    }

    pub fn response(&self, direction: Vec3) -> Response {
        let cosine = self.normal.dot(direction).max(0.0);
        let Some(Shine { gloss, lobe }) = &self.shine else {
            return Response { direction, cosine, diffuse: 1.0, lobe: Vec3::ZERO };
        };
        Response { direction, cosine, diffuse: gloss.diffuse_in(cosine), lobe: lobe.value(direction) }
    }

    /// f_r cosθ, sr⁻¹.
    pub fn reflect(&self, response: Response) -> Vec3 {
        (self.kd * (FRAC_1_PI * response.diffuse) + self.ks * response.lobe) * response.cosine
    }

    /// Density with which [`Self::bounce`] draws a direction, sr⁻¹.
    pub fn density(&self, response: Response) -> f32 {
        let of_lobe = match &self.shine {
            Some(shine) if self.glossy > 0.0 => shine.lobe.density(response.direction),
            _ => 0.0,
        };
        (1.0 - self.glossy) * FRAC_1_PI * response.cosine + self.glossy * of_lobe
    }

    /// Draws a direction by `u` ∈ [0, 1)²: by the cosine, or by the lobe about the mirrored eye, as `choice` ∈ [0, 1) says, which
    /// is asked for only where there is a choice. `None` where it points into the surface: below the facet, or where nothing is
    /// reflected.
    pub fn bounce(&self, u: [f32; 2], choice: impl Fn() -> f32) -> Option<Bounce> {
        let direction = match &self.shine {
            Some(shine) if self.glossy > 0.0 && choice() < self.glossy => shine.lobe.sample(u),
            _ => sample_diffuse(self.normal, u),
        };
        let response = self.response(direction);
        let density = self.density(response);
        if self.facet.dot(direction) <= 0.0 || response.cosine <= 0.0 || density <= 0.0 {
            return None;
        }
        let of_source = if self.shine.is_some() { self.reflect(response) / density } else { self.kd };
        let diffuse = || self.kd * (response.cosine / (PI * density));
        let mirror = self.shine.as_ref().is_some_and(|shine| shine.gloss.is_mirror());
        let of_beyond = if mirror { diffuse() } else { of_source };
        let ray = Ray { origin: self.origin, direction, t_max: f32::INFINITY };
        Some(Bounce { ray, density, of_source, of_beyond })
    }
}

/// Share of the highlight in what is reflected, all channels together.
fn glossy_share(kd: Vec3, ks: Vec3, lobe: &Lobe) -> f32 {
    let highlight = match lobe {
        Lobe::Phong(_) if lobe.exponent() < WIDE => 0.0,
        Lobe::Phong(_) => ks.element_sum(),
        Lobe::Ggx(ggx) => (ks * ggx.albedo()).element_sum(),
    };
    if highlight > 0.0 { highlight / (highlight + kd.element_sum()) } else { 0.0 }
}
