//! Gathering over hemispheres against closed forms.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use glam::Vec3;
use penombre::estimate::hemisphere::{Gathered, Method, gather};
use penombre::estimate::light_vector::LightVector;
use penombre::math::sequence::Sequence;
use std::f32::consts::PI;
use std::ops::Range;

/// What a gather finds for each of the normals.
fn light(
    method: Method,
    normals: &[Vec3],
    rays: Range<u32>,
    seed: u64,
    field: impl Fn(Vec3) -> f32,
) -> (Vec<LightVector>, Gathered) {
    let mut vectors = vec![LightVector::default(); normals.len()];
    let radiance = |_: u32, direction: Vec3| Vec3::splat(field(direction));
    let gathered = gather(method, normals, rays, &Sequence::new(seed), radiance, |sample| {
        normals.iter().zip(&mut vectors).for_each(|(normal, vector)| vector.push(*normal, &sample));
    });
    (vectors, gathered)
}

#[test]
fn an_even_hemisphere_gives_pi_times_its_radiance() {
    for (_, method) in Method::NAMES {
        for rays in [1, 2, 5, 16, 300] {
            let (vectors, gathered) = light(method, &[Vec3::Z], 0..rays, 3, |_| 2.0);
            assert!(gathered.rays <= rays && vectors[0].samples() == gathered.samples, "{method:?}: {gathered:?}");
            println!("{method:?} {rays} {gathered:?} {}", vectors[0].irradiance().x / (2.0 * PI));
        }
    }
}
