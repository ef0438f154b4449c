//! Gathering over hemispheres against closed forms.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use glam::{DVec3, Vec3};
use penombre::estimate::hemisphere::{Gathered, Method, Thresholds, gather, gather_as_paper};
use penombre::estimate::light_vector::LightVector;
use penombre::math::polygon::{clip, edge_term, edges};
use penombre::math::sequence::Sequence;
use std::f32::consts::PI;
use std::ops::Range;

const N: Vec3 = Vec3::Z;
/// At 60° to N, the most that facets of one vertex differ by.
const TILTED: Vec3 = Vec3::new(0.866_025_4, 0.0, 0.5);

/// Radiance by direction, and the irradiance that it gives on a surface of a normal.
struct Field {
    name: &'static str,
    radiance: fn(Vec3) -> f32,
    irradiance: fn(Vec3) -> f64,
}

/// Half angle 20° about an axis 35° off N and 32° off `TILTED`: wholly above both horizons.
const DISC_AXIS: Vec3 = Vec3::new(0.506_588_6, 0.258_115, 0.822_636);
const DISC_COSINE: f32 = 0.939_692_6;
/// A window at distance 1: corners, counter-clockwise seen from the origin; partly below the horizon of `TILTED`.
const WINDOW: [[f64; 3]; 4] = [[-0.9, 0.9, 1.0], [0.5, 0.9, 1.0], [0.5, -0.3, 1.0], [-0.9, -0.3, 1.0]];
/// Radiance outside of the disc and the window.
const DIM: f32 = 0.25;

const FIELDS: [Field; 4] = [
    Field { name: "even", radiance: |_| 1.0, irradiance: |_| std::f64::consts::PI },
    // ∫ (1 + a·ω) (n·ω) dω = π + (2π/3) a·n
    Field {
        name: "linear",
        radiance: |d| 1.0 + d.dot(Vec3::new(0.3, -0.5, 0.6)),
        irradiance: |n| std::f64::consts::PI * (1.0 + 2.0 / 3.0 * f64::from(n.dot(Vec3::new(0.3, -0.5, 0.6)))),
    },
    // A disc of half angle α at θ gives π sin²α cosθ.
    Field {
        name: "disc",
        radiance: |d| if d.dot(DISC_AXIS) > DISC_COSINE { 5.0 } else { DIM },
        irradiance: |n| {
            let sine2 = 1.0 - f64::from(DISC_COSINE * DISC_COSINE);
            std::f64::consts::PI * (f64::from(DIM) + f64::from(5.0 - DIM) * sine2 * f64::from(n.dot(DISC_AXIS)))
        },
    },
    Field {
        name: "window",
        radiance: |d| {
            let through = d.z > 0.0 && (-0.9..0.5).contains(&(d.x / d.z)) && (-0.3..0.9).contains(&(d.y / d.z));
            if through { 3.0 } else { DIM }
        },
        irradiance: |n| {
            std::f64::consts::PI * f64::from(DIM) + f64::from(3.0 - DIM) * form_factor(&WINDOW, n.as_dvec3())
        },
    },
];

/// Irradiance from a polygon of radiance 1.
fn form_factor(corners: &[[f64; 3]], normal: DVec3) -> f64 {
    let base = DVec3::from_array(corners[0]);
    let relative: Vec<DVec3> = corners.iter().map(|&c| DVec3::from_array(c) - base).collect();
    let above = clip(base, &relative, normal);
    edges(&above).map(|(a, b)| edge_term(base + a, b - a)).sum::<DVec3>().dot(normal).abs()
}

/// What a gather finds for each of the normals.
fn light(
    method: Method,
    normals: &[Vec3],
    rays: Range<u32>,
    seed: u64,
    radiance: fn(Vec3) -> f32,
) -> (Vec<LightVector>, Gathered) {
    let mut vectors = vec![LightVector::default(); normals.len()];
    let radiance = |_: u32, direction: Vec3| Vec3::splat(radiance(direction));
    let gathered = gather(method, normals, rays, &Sequence::new(seed), radiance, |sample| {
        normals.iter().zip(&mut vectors).for_each(|(normal, vector)| vector.push(*normal, &sample));
    });
    (vectors, gathered)
}

/// Relative errors over many seeds: their mean, its standard error, and the root of their mean square.
struct Errors {
    bias: f64,
    standard_error: f64,
    rms: f64,
}

impl Errors {
    fn of(estimates: impl Iterator<Item = f64>, truth: f64) -> Self {
        let errors: Vec<f64> = estimates.map(|e| e / truth - 1.0).collect();
        let n = errors.len() as f64;
        let bias = errors.iter().sum::<f64>() / n;
        let mean_square = errors.iter().map(|e| e * e).sum::<f64>() / n;
        Self { bias, standard_error: ((mean_square - bias * bias) / (n - 1.0)).sqrt(), rms: mean_square.sqrt() }
    }

    /// Those of one of the normals.
    fn measure(method: Method, normals: &[Vec3], which: usize, rays: &Range<u32>, seeds: u64, field: &Field) -> Self {
        let found = |seed| {
            let (vectors, _) = light(method, normals, rays.clone(), seed, field.radiance);
            f64::from(vectors[which].irradiance().x)
        };
        Self::of((0..seeds).map(found), (field.irradiance)(normals[which]))
    }
}

#[test]
fn the_fields_are_what_their_closed_forms_say() {
    // A regular grid of the cosine's square, by no code of the crate.
    let side = 1500;
    for field in &FIELDS {
        let mut sum = 0.0;
        for i in 0..side * side {
            let u = (f64::from(i % side) + 0.5) / f64::from(side);
            let (sin, cos) = ((f64::from(i / side) + 0.5) / f64::from(side) * std::f64::consts::TAU).sin_cos();
            let direction = DVec3::new(u.sqrt() * cos, u.sqrt() * sin, (1.0 - u).sqrt());
            sum += f64::from((field.radiance)(direction.as_vec3()));
        }
        let found = sum / f64::from(side * side) * std::f64::consts::PI;
        assert!((found / (field.irradiance)(N) - 1.0).abs() < 1e-3, "{}: {found}", field.name);
    }
}

#[test]
fn an_even_hemisphere_gives_pi_times_its_radiance() {
    for (method, tolerance) in [(Method::Stratified, 1e-5), (Method::Adaptive, 1e-4), (Method::Paper, 0.15)] {
        for rays in [12, 16, 300, 1024] {
            let (vectors, _) = light(method, &[N], 0..rays, 3, |_| 2.0);
            let found = vectors[0].irradiance().x / (2.0 * PI);
            assert!((found - 1.0).abs() < tolerance, "{method:?} with {rays} rays: {found}");
        }
    }
}

#[test]
fn methods_agree_with_closed_forms_for_one_normal_and_for_two() {
    // The paper's stops by itself, after some 60 rays where light is even.
    for (method, tolerance) in [(Method::Stratified, 0.02), (Method::Adaptive, 0.015), (Method::Paper, 0.25)] {
        for field in &FIELDS {
            for normals in [&[N][..], &[N, TILTED]] {
                for which in 0..normals.len() {
                    let errors = Errors::measure(method, normals, which, &(0..1024), 50, field);
                    let Errors { bias, rms, .. } = errors;
                    let name = field.name;
                    println!("{method:?}, {name}, normal {which} of {}: rms {rms:.4}, bias {bias:.4}", normals.len());
                    assert!(rms < tolerance, "{method:?}, {name}, normal {which} of {}: {rms}", normals.len());
                }
            }
        }
    }
}

/// A mean within 3.5 standard errors of the truth in all 36 tests: chance fails this once in 70 choices of seeds.
#[test]
fn every_round_of_stratified_rays_is_unbiased() {
    for field in &FIELDS[1..] {
        for rays in [0..16, 16..32, 32..64, 5..18] {
            for (normals, which) in [(&[N][..], 0), (&[N, TILTED], 0), (&[N, TILTED], 1)] {
                let errors = Errors::measure(Method::Stratified, normals, which, &rays, 4000, field);
                let Errors { bias, standard_error, .. } = errors;
                let what = format!("{}, {rays:?}, normal {which} of {}", field.name, normals.len());
                // Fine enough to see a bias of 3 %.
                assert!(standard_error < 0.008, "{what}: {standard_error}");
                assert!(bias.abs() < 3.5 * standard_error, "{what}: {bias} ± {standard_error}");
            }
        }
    }
}

#[test]
fn rounds_add_up_to_one_long_gather() {
    let gather = |rays| light(Method::Stratified, &[N, TILTED], rays, 9, FIELDS[2].radiance).0;
    let (mut sum, whole) = (gather(0..16), gather(0..128));
    for round in [16..32, 32..64, 64..128] {
        sum.iter_mut().zip(gather(round)).for_each(|(vector, more)| vector.add(&more));
    }
    for (a, b) in sum.iter().zip(&whole) {
        assert_eq!(a.samples(), b.samples());
        assert!((a.irradiance() / b.irradiance() - 1.0).abs().max_element() < 1e-5);
        assert!((a.vector() - b.vector()).length() < 1e-5 * b.vector().length());
        assert!((a.variance_of_mean() / b.variance_of_mean() - 1.0).abs() < 1e-3);
    }
}

/// Slope of the mean square error of stratified rays: −1 is independent sampling.
#[test]
fn stratified_error_falls_faster_than_that_of_independent_rays() {
    for (field, steepest) in [(&FIELDS[1], -2.0), (&FIELDS[2], -1.35), (&FIELDS[3], -1.3)] {
        let mse = |n| Errors::measure(Method::Stratified, &[N], 0, &(0..n), 300, field).rms.powi(2);
        let slope = (mse(1024) / mse(16)).ln() / 64_f64.ln();
        println!("{}: {slope:.2}", field.name);
        assert!(slope < steepest, "{}: {slope}", field.name);
    }
}

/// Choosing cells by the rays that measure them makes the adaptive method biased; the bias must go with more rays.
#[test]
fn adaptive_bias_vanishes_with_rays_and_its_error_is_less() {
    for field in &FIELDS[2..] {
        let at = |method, n, seeds| Errors::measure(method, &[N], 0, &(0..n), seeds, field);
        let (few, many) = (at(Method::Adaptive, 64, 2000), at(Method::Adaptive, 8192, 100));
        println!("{}: bias {:.4} at 64, {:.5} at 8192", field.name, few.bias, many.bias);
        assert!(few.bias.abs() < 0.03, "{}: {}", field.name, few.bias);
        assert!(many.bias.abs() < 5e-4 + 3.5 * many.standard_error, "{}: {}", field.name, many.bias);
        let (adaptive, stratified) = (at(Method::Adaptive, 2048, 200).rms, at(Method::Stratified, 2048, 200).rms);
        println!("{}: rms {adaptive:.4} adaptive, {stratified:.4} stratified at 2048", field.name);
        assert!(adaptive < 0.65 * stratified, "{}: {adaptive}, {stratified}", field.name);
    }
}

/// Cells that missed what is bright are called homogeneous for ever: the paper's bias is negative, and no number of rays
/// takes it away; a band that calls no cell homogeneous takes most of it.
#[test]
fn the_papers_bias_comes_from_cells_called_homogeneous() {
    let field = &FIELDS[3];
    let truth = (field.irradiance)(N);
    let at = |thresholds: Thresholds, rays: u32, seeds: u64| {
        let found = |seed| {
            let mut vector = LightVector::default();
            let radiance = |_: u32, direction: Vec3| Vec3::splat((field.radiance)(direction));
            let sink = |sample| vector.push(N, &sample);
            gather_as_paper(&thresholds, &[N], 0..rays, &Sequence::new(seed), radiance, sink);
            f64::from(vector.irradiance().x)
        };
        Errors::of((0..seeds).map(found), truth)
    };
    let default = at(Thresholds::default(), 4096, 1000);
    println!("default: bias {:.4} ± {:.4}, rms {:.4}", default.bias, default.standard_error, default.rms);
    assert!(default.bias < -3.5 * default.standard_error, "{} ± {}", default.bias, default.standard_error);
    let never = Thresholds { band: -1.0, homogeneous: 1.0, convergence: 0.0 };
    let limit = at(never, 16_384, 100);
    println!("never homogeneous: bias {:.5} ± {:.5}", limit.bias, limit.standard_error);
    // What is left: cells that found no deviation at first wait behind all others.
    assert!(limit.bias.abs() < 0.3 * default.bias.abs(), "{} ± {}", limit.bias, limit.standard_error);
}

#[test]
fn rays_are_numbered_and_never_more_than_allowed() {
    for (_, method) in Method::NAMES {
        for rays in [0..0, 7..8, 3..5, 10..21, 64..128, 100..1124] {
            let mut asked = Vec::new();
            let mut samples = 0;
            let mut radiance = |index: u32, direction: Vec3| {
                assert!(direction.is_normalized());
                asked.push(index);
                Vec3::splat((FIELDS[2].radiance)(direction))
            };
            let gathered =
                gather(method, &[N, TILTED], rays.clone(), &Sequence::new(1), &mut radiance, |_| samples += 1);
            let expected: Vec<u32> = (rays.start..rays.start + gathered.rays).collect();
            assert_eq!((&asked, samples), (&expected, gathered.samples), "{method:?}");
            assert!(gathered.rays <= rays.end - rays.start && (gathered.rays > 0) != rays.is_empty(), "{method:?}");
            if method == Method::Stratified {
                assert_eq!(gathered.rays, rays.end - rays.start);
            }
        }
        let none = gather(method, &[], 0..8, &Sequence::new(1), |_, _| Vec3::ONE, |_| {});
        assert_eq!(none, Gathered::default());
    }
}
