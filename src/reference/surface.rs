//! A surface point as the reflection model sees it: evaluation, and directions drawn by it.

use crate::bsdf::{lobe, lobe_density, sample_diffuse, sample_lobe};
use crate::geom::{Hit, Ray, offset};
use crate::light::arrival::Arrival;
use crate::scene::Scene;
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
    kd: Vec3,
    ks: Vec3,
    /// Diffuse reflectance that stands for the highlight, without unit.
    spread: Vec3,
    shininess: f32,
    /// Whether the highlight shows light straight from the sources only.
    mirror: bool,
    /// Share of directions drawn by the highlight's lobe.
    glossy: f32,
}

/// Phong exponent below which the highlight is drawn with the diffuse lobe: it is about as wide, and at 0 fills the sphere.
const WIDE: f32 = 1.0;

/// How a direction is reflected, without k_d and k_s.
#[derive(Clone, Copy)]
pub struct Response {
    cosine: f32,
    lobe: f32,
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
        let material = scene.material(hit.triangle);
        Self {
            point,
            origin: offset::origin(point, facet, offset::scale_of_hit(point, hit.t), offset::HIT),
            facet,
            normal: scene.shading_normal_at(hit.triangle, hit.u, hit.v, hit.back),
            to_eye: -ray.direction,
            kd: Vec3::ZERO,
            ks: material.phong().ks,
            spread: material.highlight_albedo(),
            shininess: material.phong().shininess,
            mirror: material.phong().mirror,
            glossy: 0.0,
        }
    }

    /// Gives it its diffuse reflectance.
    pub fn paint(&mut self, kd: Vec3) {
        self.kd = kd;
        self.glossy = glossy_share(kd, self.ks, self.shininess);
    }

    /// The same with what goes into the highlight reflected diffusely.
    pub fn paint_diffuse(&mut self, kd: Vec3) {
        (self.kd, self.ks, self.glossy) = (kd + self.spread, Vec3::ZERO, 0.0);
    }

    /// The ray to a light.
    pub fn ray_to(&self, arrival: &Arrival) -> Ray {
        Ray { origin: self.origin, direction: arrival.direction, t_max: arrival.distance * offset::SHORT_OF_LIGHT }
    }

    pub fn response(&self, direction: Vec3) -> Response {
        Response {
            cosine: self.normal.dot(direction).max(0.0),
            lobe: if self.is_glossy() { lobe(self.shininess, self.normal, direction, self.to_eye) } else { 0.0 },
        }
    }

    /// Whether there is a highlight.
    fn is_glossy(&self) -> bool {
        self.ks.max_element() > 0.0
    }

    /// f_r cosθ, sr⁻¹.
    pub fn reflect(&self, response: Response) -> Vec3 {
        (self.kd * FRAC_1_PI + self.ks * response.lobe) * response.cosine
    }

    /// Density with which [`Self::bounce`] draws a direction, sr⁻¹.
    pub fn density(&self, response: Response) -> f32 {
        let of_lobe = lobe_density(self.shininess, response.lobe);
        (1.0 - self.glossy) * FRAC_1_PI * response.cosine + self.glossy * of_lobe
    }

    /// Draws a direction by `u` ∈ [0, 1)²: by the cosine, or by the lobe about the mirrored eye, as `choice` ∈ [0, 1) says, which
    /// is asked for only where there is a choice. `None` where it points into the surface: below the facet, or where nothing is
    /// reflected.
    pub fn bounce(&self, u: [f32; 2], choice: impl Fn() -> f32) -> Option<Bounce> {
        let direction = if self.glossy > 0.0 && choice() < self.glossy {
            sample_lobe(self.shininess, self.normal, self.to_eye, u)
        } else {
            sample_diffuse(self.normal, u)
        };
        let response = self.response(direction);
        let density = self.density(response);
        if self.facet.dot(direction) <= 0.0 || response.cosine <= 0.0 || density <= 0.0 {
            return None;
        }
        let of_source = if self.is_glossy() { self.reflect(response) / density } else { self.kd };
        let diffuse = || self.kd * (response.cosine / (PI * density));
        let of_beyond = if self.mirror { diffuse() } else { of_source };
        let ray = Ray { origin: self.origin, direction, t_max: f32::INFINITY };
        Some(Bounce { ray, density, of_source, of_beyond })
    }
}

/// Share of the highlight in what is reflected, all channels together.
fn glossy_share(kd: Vec3, ks: Vec3, shininess: f32) -> f32 {
    let highlight = ks.element_sum();
    if highlight > 0.0 && shininess >= WIDE { highlight / (highlight + kd.element_sum()) } else { 0.0 }
}
