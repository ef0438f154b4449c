//! Unoccluded light of polygons of even radiance at a point in closed form: Lambert's sum over edges, clipped to the
//! horizon of any normal \[Lambert\].

use crate::math::luminance;
use crate::math::polygon::{edge_term, edges};
use glam::{DVec3, Vec3};
use smallvec::SmallVec;
use std::borrow::Cow;

/// The unoccluded light of an area source at a point, for any normal there.
#[derive(Clone, Debug)]
pub struct ClosedForm<'a> {
    radiance: Vec3,
    polygons: SmallVec<[ProjectedPolygon<'a>; 4]>,
    /// Terms of the edges of all polygons (unit radiance), sr, in order.
    terms: SmallVec<[DVec3; 24]>,
}

/// A polygon that faces the point.
#[derive(Clone, Debug)]
pub(super) struct ProjectedPolygon<'a> {
    /// From the point to the first corner.
    pub base: DVec3,
    /// All corners relative to the first.
    pub corners: Cow<'a, [DVec3]>,
    /// 1 where the front is seen, −1 for the back.
    pub sign: f64,
    vector: DVec3,
}

impl<'a> ClosedForm<'a> {
    /// Nothing yet of a source of mean `radiance`, W·sr⁻¹·m⁻².
    pub(super) fn new(radiance: Vec3) -> Self {
        Self { radiance, polygons: SmallVec::new(), terms: SmallVec::new() }
    }

    /// Number of edges of its polygons.
    pub(super) fn edge_count(&self) -> usize {
        self.terms.len()
    }

    /// Adds a polygon: see [`ProjectedPolygon`].
    pub(super) fn push(&mut self, base: DVec3, corners: Cow<'a, [DVec3]>, sign: f64) {
        let first = self.terms.len();
        self.terms.extend(edges(&corners).map(|(a, b)| edge_term(base + a, b - a) * sign));
        let vector = self.terms[first..].iter().sum();
        self.polygons.push(ProjectedPolygon { base, corners, sign, vector });
    }

    /// Area-mean radiance of the source, W·sr⁻¹·m⁻².
    #[must_use]
    pub const fn mean_radiance(&self) -> Vec3 {
        self.radiance
    }

    /// The light vector of the whole source, not clipped to any horizon, for its mean radiance's luminance, W·m⁻².
    #[must_use]
    pub fn vector(&self) -> Vec3 {
        let sum: DVec3 = self.polygons.iter().map(|p| p.vector).sum();
        (sum * f64::from(luminance(self.radiance))).as_vec3()
    }

    /// Unit mean direction of the light, and how wide it is, |V|/Φ, as of a cone of even radiance: 1 for a direction, 1/2 for a
    /// hemisphere.
    #[must_use]
    pub fn spread(&self) -> (Vec3, f32) {
        let sum: DVec3 = self.polygons.iter().map(|p| p.vector).sum();
        let length = sum.length();
        if length == 0.0 {
            return (Vec3::Z, 0.5);
        }
        // |V| = π sin²θ and Φ = 2π (1 − cosθ) at the half angle θ.
        let cosine = (1.0 - length / std::f64::consts::PI).max(0.0).sqrt();
        ((sum / length).as_vec3(), (0.5 + 0.5 * cosine) as f32)
    }

    /// Irradiance on a surface of unit `normal` from what lies above its horizon, W·m⁻².
    #[must_use]
    pub fn irradiance(&self, normal: Vec3) -> Vec3 {
        self.radiance * self.form_factor(normal)
    }

    /// The same for radiance 1, sr.
    pub(super) fn form_factor(&self, normal: Vec3) -> f32 {
        let normal = normal.as_dvec3();
        self.polygons().map(|(polygon, terms)| polygon.irradiance(terms, normal)).sum::<f64>() as f32
    }

    /// The polygons that face the point, with the terms of their edges.
    pub(super) fn polygons(&self) -> impl Iterator<Item = (&ProjectedPolygon<'a>, &[DVec3])> {
        self.polygons.iter().scan(&self.terms[..], |terms, polygon| {
            let (own, rest) = terms.split_at(polygon.corners.len());
            *terms = rest;
            Some((polygon, own))
        })
    }
}

impl ProjectedPolygon<'_> {
    /// A cone from the point that holds the polygon: its axis, and the cosine of its half angle (−1 around the point).
    pub(super) fn cone(&self) -> (DVec3, f64) {
        let middle = self.base + self.corners.iter().sum::<DVec3>() / self.corners.len() as f64;
        let Some(axis) = middle.try_normalize() else { return (DVec3::Z, -1.0) };
        let cosine = |&r: &DVec3| (self.base + r).dot(axis) / (self.base + r).length();
        let least = self.corners.iter().map(cosine).fold(1.0, f64::min);
        (axis, if least > 0.0 { least } else { -1.0 })
    }

    /// Irradiance for radiance 1, sr; `terms` are those of the whole edges, reused for edges above the horizon.
    pub(super) fn irradiance(&self, terms: &[DVec3], normal: DVec3) -> f64 {
        let offset = normal.dot(self.base);
        let height = |r: DVec3| offset + normal.dot(r);
        let (lowest, highest) = self
            .corners
            .iter()
            .map(|&r| height(r))
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), h| (lo.min(h), hi.max(h)));
        if highest <= 0.0 {
            return 0.0;
        }
        if lowest >= 0.0 {
            return self.vector.dot(normal).max(0.0);
        }
        let (mut sum, mut setting, mut rising) = (0.0, DVec3::ZERO, DVec3::ZERO);
        let term = |a: DVec3, b: DVec3| (edge_term(self.base + a, b - a) * self.sign).dot(normal);
        for ((a, b), whole) in edges(&self.corners).zip(terms) {
            let (ha, hb) = (height(a), height(b));
            let crossing = a + (b - a) * (ha / (ha - hb));
            match (ha >= 0.0, hb >= 0.0) {
                (true, true) => sum += whole.dot(normal),
                (true, false) => {
                    setting = crossing;
                    sum += term(a, setting);
                }
                (false, true) => {
                    rising = crossing;
                    sum += term(rising, b);
                }
                (false, false) => {}
            }
        }
        // The polygon is convex: one edge along the horizon closes what is left of it.
        (sum + term(setting, rising)).max(0.0)
    }
}
