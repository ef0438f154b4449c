use super::super::{Gloss, Reflectance, SpreadLight};
use super::*;
use crate::math::sequence::Sequence;
use std::f64::consts::PI as PI64;

const ROUGHNESS: [f32; 6] = [0.03, 0.1, 0.25, 0.5, 0.75, 1.0];
const COSINES: [f32; 5] = [1.0, 0.8, 0.5, 0.2, 0.06];

fn eye(cosine: f32) -> Vec3 {
    Vec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine)
}

fn lobe(roughness: f32, f0: f32, cosine: f32) -> GgxLobe {
    GgxLobe::new(Microfacets::new(roughness, Vec3::splat(f0)), Vec3::Z, eye(cosine))
}

/// ∫ f(ω) dω over the sphere, by a grid that is fine about `axis`.
fn integral(axis: Vec3, f: impl Fn(Vec3) -> f32) -> f64 {
    let (rings, turns) = (600, 240);
    let (x, y) = axis.any_orthonormal_pair();
    let mut sum = 0.0;
    for ring in 0..rings {
        let t = (f64::from(ring) + 0.5) / f64::from(rings);
        let (angle, width) = (PI64 * t.powi(5), PI64 * 5.0 * t.powi(4) / f64::from(rings));
        for turn in 0..turns {
            let (sin, cos) = ((f64::from(turn) + 0.5) / f64::from(turns) * 2.0 * PI64).sin_cos();
            let (sine, cosine) = angle.sin_cos();
            let direction = x * (cos * sine) as f32 + y * (sin * sine) as f32 + axis * cosine as f32;
            sum += f64::from(f(direction)) * sine * width * 2.0 * PI64 / f64::from(turns);
        }
    }
    sum
}

fn mirrored(cosine: f32) -> Vec3 {
    eye(cosine) * Vec3::new(-1.0, -1.0, 1.0)
}

/// White metal and white plastic reflect all of even light, in any direction.
#[test]
fn furnace() {
    for roughness in ROUGHNESS {
        for cosine in COSINES {
            let metal = lobe(roughness, 1.0, cosine);
            let found = integral(mirrored(cosine), |l| metal.value(l).x * l.z.max(0.0));
            assert!((found - 1.0).abs() < 0.01, "metal {roughness} {cosine}: {found}");
            assert!((metal.albedo().x - 1.0).abs() < 1e-3);
            let Reflectance { kd, gloss, .. } = Reflectance::metallic_roughness(Vec3::ONE, 0.0, roughness);
            let gloss = gloss.expect("plastic shines");
            let seen = gloss.seen(Vec3::Z, eye(cosine));
            let diffuse = kd.x * gloss.diffuse_out(cosine) / PI;
            let found = integral(mirrored(cosine), |l| {
                (diffuse * gloss.diffuse_in(l.z.max(0.0)) + seen.value(l).x) * l.z.max(0.0)
            });
            assert!((found - 1.0).abs() < 0.01, "plastic {roughness} {cosine}: {found}");
        }
    }
}

/// The albedo that is tabulated is that of the lobe.
#[test]
fn albedo_is_the_integral_of_the_lobe() {
    for roughness in ROUGHNESS {
        for cosine in COSINES {
            for f0 in [0.04, 0.5] {
                let lobe = lobe(roughness, f0, cosine);
                let found = integral(mirrored(cosine), |l| lobe.value(l).x * l.z.max(0.0));
                let error = (found / f64::from(lobe.albedo().x) - 1.0).abs();
                assert!(error < 0.02, "{roughness} {cosine} {f0}: {found} {}", lobe.albedo().x);
            }
        }
    }
}

#[test]
fn light_and_eye_may_change_places() {
    let sequence = Sequence::new(3);
    for i in 0..200 {
        let [u, v, s, t] = sequence.point(i);
        let (a, b) = (around(Vec3::Z, u.max(0.01), v), around(Vec3::Z, s.max(0.01), t));
        for roughness in ROUGHNESS {
            let facets = Microfacets::new(roughness, Vec3::new(0.9, 0.3, 0.04));
            let [there, back] = [(a, b), (b, a)].map(|(eye, light)| GgxLobe::new(facets, Vec3::Z, eye).value(light));
            assert!(
                (there - back).abs().max_element() <= 2e-4 * there.max_element(),
                "{roughness} {a} {b}: {there} {back}"
            );
            let gloss = Gloss::Ggx(facets);
            let [there, back] =
                [(a, b), (b, a)].map(|(eye, light)| gloss.diffuse_out(eye.z) * gloss.diffuse_in(light.z));
            assert!((there - back).abs() < 1e-5 * there);
        }
    }
}

/// Density is one of directions, and of those that are drawn: both sides give the mean of some functions.
#[test]
fn directions_are_drawn_with_their_density() {
    let sequence = Sequence::new(5);
    let points = 1 << 14;
    for roughness in ROUGHNESS {
        for cosine in [1.0, 0.6, 0.2] {
            let lobe = lobe(roughness, 0.7, cosine);
            let whole = integral(mirrored(cosine), |l| lobe.density(l));
            assert!((whole - 1.0).abs() < 0.01, "{roughness} {cosine}: {whole}");
            let tilted = Vec3::new(-0.6, 0.3, 0.2).normalize();
            let drawn = (0..points).map(|i| {
                let [u, v, ..] = sequence.point(i);
                lobe.sample([u, v]).dot(tilted)
            });
            let (drawn, expected) =
                (drawn.sum::<f32>() / points as f32, integral(mirrored(cosine), |l| lobe.density(l) * l.dot(tilted)));
            assert!((f64::from(drawn) - expected).abs() < 0.005, "{roughness} {cosine}: {drawn} {expected}");
        }
    }
}

/// A square lamp in the lobe: the transformed cosine against the lobe itself.
#[test]
fn transformed_cosines_find_lamps() {
    let (mut worst, mut sum, mut count) = (0.0_f64, 0.0, 0);
    for roughness in [0.05, 0.1, 0.25, 0.5, 0.75, 1.0] {
        for cosine in [1.0, 0.8, 0.5, 0.25] {
            for turned in [0.0, 0.15, 0.4] {
                let lobe = lobe(roughness, 1.0, cosine);
                let mut middle = (mirrored(cosine) + Vec3::Y * turned).normalize() * 2.0;
                middle.z = middle.z.max(0.6);
                let (x, y) = middle.normalize().any_orthonormal_pair();
                let half = 0.5;
                let corners = [x + y, y - x, -x - y, x - y].map(|c| (middle + c * half).as_dvec3());
                let relative = corners.map(|c| c - corners[0]);
                let found = lobe.transformed_cosine().over_polygon(corners[0], &relative).abs();
                let inside = |l: Vec3| {
                    let distance = middle.length_squared() / l.dot(middle);
                    let offset = l * distance - middle;
                    distance > 0.0 && offset.dot(x).abs() <= half && offset.dot(y).abs() <= half
                };
                let once = |l: Vec3| {
                    let again = lobe.again * (1.0 - lobe.facets.row.albedo(l.z.max(0.0)).whole);
                    if l.z > 0.0 && inside(l) { (lobe.value(l) - again).x * l.z } else { 0.0 }
                };
                let expected = integral(mirrored(cosine), once);
                let found = found * f64::from(lobe.albedo_once().x);
                let error = (found - expected).abs() / expected.max(0.05);
                (worst, sum, count) = (worst.max(error), sum + error, count + 1);
            }
        }
    }
    let mean = sum / f64::from(count);
    // The worst are seen at 75° by surfaces of medium roughness, off the lobe.
    assert!(mean < 0.03 && worst < 0.45, "mean {mean}, worst {worst}");
}

/// Even light, and light from one direction.
#[test]
fn spread_light_tends_to_both_ends() {
    for roughness in [0.2, 0.5, 1.0] {
        for cosine in [1.0, 0.6, 0.3] {
            let lobe = lobe(roughness, 0.5, cosine);
            let even = SpreadLight { axis: Vec3::Z, concentration: 0.5 };
            let found = even.in_ggx_lobe(&lobe).x * PI;
            assert!((found / lobe.albedo().x - 1.0).abs() < 0.02, "{roughness} {cosine}: {found}");
            for axis in [mirrored(cosine), Vec3::new(0.3, 0.4, 0.8).normalize()] {
                let narrow = SpreadLight { axis, concentration: 1.0 };
                let (found, exact) = (narrow.in_ggx_lobe(&lobe).x, lobe.value(axis).x);
                assert!((found / exact - 1.0).abs() < 0.02, "{roughness} {cosine}: {found} {exact}");
            }
        }
    }
}

/// A facet that reflects nothing of a colour at normal incidence makes no number that is none.
#[test]
fn pure_colours_stay_finite() {
    for roughness in ROUGHNESS {
        for concentration in [0.0, 0.3, 0.5, 0.7, 1.0] {
            let facets = Microfacets::new(roughness, Vec3::X);
            let lobe = GgxLobe::new(facets, Vec3::Z, Vec3::Z);
            for axis in [Vec3::Z, Vec3::new(0.6, 0.0, 0.8), Vec3::X] {
                let found = SpreadLight { axis, concentration }.in_ggx_lobe(&lobe);
                assert!(found.is_finite() && found.min_element() >= 0.0, "{roughness} {concentration} {axis}: {found}");
            }
        }
    }
}
