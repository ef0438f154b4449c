//! The physically normalised Phong lobe [FP03 §4.3].

use super::directions::around;
use glam::Vec3;
use std::f32::consts::TAU;

/// Value of the specular lobe without k_s, (s+2)/(2π) max(0, r·ω_r)^s, sr⁻¹.
///
/// `normal`, `to_light` and `to_eye` are unit and point away from the surface; r is `to_light` mirrored at `normal`.
#[must_use]
#[inline]
pub fn lobe(shininess: f32, normal: Vec3, to_light: Vec3, to_eye: Vec3) -> f32 {
    let mirrored = 2.0 * normal.dot(to_light) * normal - to_light;
    let cosine = mirrored.dot(to_eye).clamp(0.0, 1.0);
    if cosine == 0.0 && shininess > 0.0 {
        return 0.0;
    }
    (shininess + 2.0) / TAU * cosine.powf(shininess)
}

/// Density with which [`sample_lobe`] takes a direction in which the lobe has a `value`, both sr⁻¹: (s+1)/(2π) max(0,
/// r·ω)^s.
#[must_use]
#[inline]
pub fn lobe_density(shininess: f32, value: f32) -> f32 {
    value * ((shininess + 1.0) / (shininess + 2.0))
}

/// A unit direction chosen by `u` ∈ [0, 1)² in proportion to the lobe about the mirrored direction to the eye; it may
/// point below the surface.
#[must_use]
pub fn sample_lobe(shininess: f32, normal: Vec3, to_eye: Vec3, [u, v]: [f32; 2]) -> Vec3 {
    let mirrored = 2.0 * normal.dot(to_eye) * normal - to_eye;
    around(mirrored, u.powf((shininess + 1.0).recip()), v)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean of lobe / density over drawn directions is ∫ lobe dω = (s+2)/(s+1), each of them alike.
    #[test]
    fn directions_are_drawn_in_proportion_to_the_lobe() {
        let (normal, to_eye) = (Vec3::Z, Vec3::new(0.6, 0.0, 0.8));
        for shininess in [1.0_f32, 20.0, 700.0] {
            for u in [[0.1, 0.2], [0.5, 0.9], [0.9, 0.4]] {
                let direction = sample_lobe(shininess, normal, to_eye, u);
                let value = lobe(shininess, normal, direction, to_eye);
                let ratio = value / lobe_density(shininess, value);
                assert!(
                    value > 0.0 && (ratio - (shininess + 2.0) / (shininess + 1.0)).abs() < 1e-5,
                    "{shininess}: {ratio}"
                );
                // The share of directions nearer to the axis than this one is 1 − c^(s+1).
                let cosine = direction.dot(Vec3::new(-0.6, 0.0, 0.8));
                assert!((cosine.powf(shininess + 1.0) - u[0]).abs() < 1e-3, "{shininess} {u:?}: {cosine}");
            }
        }
    }

    /// ∫ lobe · max(0, r·ω) dω over the sphere around the mirror direction is 1 whatever the exponent.
    #[test]
    fn lobe_is_normalised_around_its_axis() {
        for shininess in [0.0_f32, 1.0, 10.0, 200.0] {
            let steps = 200_000;
            let mut integral = 0.0_f64;
            for i in 0..steps {
                let cosine = (f64::from(i) + 0.5) / f64::from(steps);
                let angle = cosine.acos() as f32;
                let eye = Vec3::new(angle.sin(), 0.0, angle.cos());
                let value = lobe(shininess, Vec3::Z, Vec3::Z, eye);
                integral += f64::from(value) * cosine * std::f64::consts::TAU / f64::from(steps);
            }
            assert!((integral - 1.0).abs() < 2e-3, "{shininess}: {integral}");
        }
    }
}
