//! Light from all around: a picture on the sphere, infinitely far.

use super::arrival::Arrival;
use super::environment_cells::{Cells, Weights};
use super::environment_sums::IrradianceTable;
use super::receiver::Receiver;
use crate::bsdf::Lobe;
use crate::math::luminance;
use crate::math::sequence::Sequence;
use crate::scene::environment::Environment;
use glam::Vec3;
use std::f32::consts::PI;
use std::sync::Arc;

/// An environment, prepared for sampling.
#[derive(Clone, Debug)]
pub struct EnvironmentSource {
    environment: Arc<Environment>,
    cells: Cells,
    /// `None` where the picture is of one colour.
    table: Option<IrradianceTable>,
    /// ∫ L dω, W·m⁻².
    fluence: Vec3,
}

/// Sine of how far below the horizon of a vertex directions are drawn that others of its normals may see.
const BELOW: f32 = 0.4;
/// What the irradiance that is known is less than exact by at most, against itself, and against all light.
const MARGIN: [f32; 2] = [1.02, 1e-3];
/// Directions that a highlight is made of.
const DIRECTIONS: u32 = 48;
/// Width that the picture is filtered over for one of them, against the root of the solid angle that it stands for.
const WIDTH: f32 = 1.5;

impl EnvironmentSource {
    /// Prepares an environment.
    #[must_use]
    pub fn new(environment: &Arc<Environment>) -> Self {
        let picture = &environment.picture;
        let rows = picture.texels().chunks(picture.size()[0] as usize).zip(0..);
        let of_row = |(row, y)| row_sum(row) * picture.solid_angle(y);
        Self {
            cells: Cells::new(environment),
            table: picture.even().is_none().then(|| IrradianceTable::new(picture)),
            fluence: rows.map(of_row).sum(),
            environment: Arc::clone(environment),
        }
    }

    /// What is prepared.
    #[must_use]
    pub fn environment(&self) -> &Environment {
        &self.environment
    }

    /// ∫ L dω over all directions, W·m⁻².
    #[must_use]
    pub const fn fluence(&self) -> Vec3 {
        self.fluence
    }

    /// Unoccluded irradiance on a surface of unit `normal`, W·m⁻²; right to about 0.1 % of the largest.
    #[must_use]
    pub fn irradiance(&self, normal: Vec3) -> Vec3 {
        match (&self.table, self.environment.picture.even()) {
            (Some(table), _) => table.at(self.environment.own(normal)),
            (None, even) => even.unwrap_or_default() * PI,
        }
    }

    /// Luminance of that, W·m⁻²; 0 only where there is no light at all.
    #[must_use]
    pub fn strength(&self, normal: Vec3) -> f32 {
        luminance(self.irradiance(normal)).max(luminance(self.fluence) * 1e-6)
    }

    /// Upper bound of it, W·m⁻².
    #[must_use]
    pub fn bound(&self, normal: Vec3) -> f32 {
        self.strength(normal) * MARGIN[0] + luminance(self.fluence) * MARGIN[1]
    }

    /// Radiance from a unit direction, W·sr⁻¹·m⁻².
    #[must_use]
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        self.environment.radiance(direction)
    }

    /// Prepares sampling for surfaces about a unit `normal`.
    #[must_use]
    pub fn sampler(&self, normal: Vec3) -> EnvironmentSampler<'_> {
        EnvironmentSampler { source: self, weights: self.cells.weights(normal, BELOW) }
    }

    fn sampler_for(&self, normal: Vec3) -> EnvironmentSampler<'_> {
        EnvironmentSampler { source: self, weights: self.cells.weights(normal, 0.0) }
    }

    /// The light that arrives at a surface of unit `normal` from the direction chosen by `u` ∈ [0, 1)².
    #[must_use]
    pub fn sample_for(&self, normal: Vec3, u: [f32; 2]) -> Option<Arrival> {
        self.sampler_for(normal).sample(u)
    }

    /// Density with which [`Self::sample_for`] takes a unit direction, sr⁻¹.
    #[must_use]
    pub fn density_for(&self, normal: Vec3, direction: Vec3) -> f32 {
        let weights = self.cells.weights(normal, 0.0);
        self.cells.density(&self.environment, &weights, self.environment.texel(direction))
    }

    /// Unoccluded highlight ∫ lobe · L cosθ dω, W·sr⁻¹·m⁻²: directions of the lobe, always the same ones, each of which looks the picture up
    /// filtered over what it stands for \[CK07\].
    #[must_use]
    pub fn specular(&self, receiver: &Receiver) -> Vec3 {
        let Receiver { normal, lobe, .. } = *receiver;
        if matches!(lobe, Lobe::Phong(_)) && lobe.exponent() == 0.0 {
            return self.irradiance(normal) / PI;
        }
        let sequence = Sequence::new(1);
        let of_direction = |index| {
            let [u, v, ..] = sequence.point(index);
            let direction = lobe.sample([u, v]);
            let (value, density) = (lobe.value(direction), lobe.density(direction));
            let cosine = normal.dot(direction);
            if cosine <= 0.0 || density <= 0.0 {
                return Vec3::ZERO;
            }
            let width = WIDTH * (DIRECTIONS as f32 * density).sqrt().recip();
            self.environment.seen(direction, width) * (value * cosine / density)
        };
        (0..DIRECTIONS).map(of_direction).sum::<Vec3>() / DIRECTIONS as f32
    }
}

/// Sum over a row in double precision.
fn row_sum(row: &[Vec3]) -> Vec3 {
    row.iter().map(|texel| texel.as_dvec3()).sum::<glam::DVec3>().as_vec3()
}

/// Sampling of an environment from one place.
#[derive(Clone, Debug)]
pub struct EnvironmentSampler<'a> {
    source: &'a EnvironmentSource,
    weights: Weights,
}

impl EnvironmentSampler<'_> {
    /// The light that arrives from the direction chosen by `u` ∈ [0, 1)², which may lie below the surface.
    #[must_use]
    pub fn sample(&self, u: [f32; 2]) -> Option<Arrival> {
        let Self { source, weights } = self;
        let drawn = source.cells.draw(&source.environment, weights, u)?;
        let [x, y] = drawn.texel;
        let picture = &source.environment.picture;
        let radiance = picture.texels()[(y * picture.size()[0] + x) as usize];
        let measure = drawn.density.recip();
        Some(Arrival { direction: drawn.direction, distance: f32::INFINITY, facing: radiance * measure, measure })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::Gloss;
    use crate::scene::environment::Picture;
    use glam::DVec3;

    /// A picture of odd size with a bright texel, hung askew.
    fn source() -> EnvironmentSource {
        let texel = |i: u32| Vec3::from_slice(&Sequence::new(9).point(i)[..3]) * if i == 800 { 3e3 } else { 1.0 };
        let picture = Picture::new([71, 33], (0..71 * 33).map(texel).collect());
        let up = Vec3::new(0.3, 0.9, -0.2).normalize();
        EnvironmentSource::new(&Arc::new(Environment::new(Arc::new(picture), up, 0.7)))
    }

    #[test]
    fn the_mean_over_samples_is_the_irradiance() {
        let source = source();
        for (normal, sequence) in [Vec3::Y, Vec3::NEG_Z, Vec3::new(0.6, -0.64, 0.48)].into_iter().zip(0..) {
            let n = 1 << 14;
            let (sequence, exact) = (Sequence::new(sequence), source.irradiance(normal));
            let [for_surface, for_vertex] = [false, true].map(|wide| {
                let sampler = if wide { source.sampler(normal) } else { source.sampler_for(normal) };
                let value = |i| {
                    let [u, v, ..] = sequence.point(i);
                    sampler.sample([u, v]).map_or(DVec3::ZERO, |arrival| arrival.irradiance(normal).as_dvec3())
                };
                ((0..n).map(value).sum::<DVec3>() / f64::from(n)).as_vec3()
            });
            for found in [for_surface, for_vertex] {
                assert!((found / exact - 1.0).abs().max_element() < 4e-3, "{normal}: {found} {exact}");
            }
            assert!(source.bound(normal) >= luminance(exact));
        }
    }

    /// Directions are drawn with the density that is told of them, which is 1 altogether.
    #[test]
    fn densities_are_those_of_what_is_drawn() {
        let source = source();
        let normal = Vec3::new(0.0, 0.8, 0.6);
        let mut inverse = 0.0_f64;
        let n = 1 << 14;
        for i in 0..n {
            let [u, v, ..] = Sequence::new(2).point(i);
            let arrival = source.sample_for(normal, [u, v]).expect("light");
            let density = source.density_for(normal, arrival.direction);
            assert!((density * arrival.measure - 1.0).abs() < 1e-3, "{i}: {density} {}", arrival.measure);
            inverse += f64::from(arrival.direction.dot(normal) > 0.0) * f64::from(arrival.measure);
        }
        // The mean of 1 / density is the solid angle.
        let hemisphere = inverse / f64::from(n) / (2.0 * std::f64::consts::PI);
        assert!((hemisphere - 1.0).abs() < 0.02, "{hemisphere}");
    }

    #[test]
    fn highlights_of_an_even_picture_are_even() {
        let picture = Arc::new(Picture::constant(Vec3::new(1.0, 2.0, 3.0)));
        let source = EnvironmentSource::new(&Arc::new(Environment::new(picture, Vec3::Y, 0.0)));
        for shininess in [0.0, 5.0, 400.0] {
            let lobe = Gloss::Phong { shininess, mirror: false }.seen(Vec3::Y, Vec3::Y);
            let receiver = Receiver { x: Vec3::ZERO, normal: Vec3::Y, to_eye: Vec3::Y, lobe };
            // ∫ lobe cosθ dω is 1 along the normal.
            let found = source.specular(&receiver) / Vec3::new(1.0, 2.0, 3.0);
            assert!((found - 1.0).abs().max_element() < 0.01, "{shininess}: {found}");
        }
    }
}
