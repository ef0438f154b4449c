//! The normalised Phong lobe [FP03 §4.3].

use glam::Vec3;

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
    (shininess + 2.0) / std::f32::consts::TAU * cosine.powf(shininess)
}

#[cfg(test)]
mod tests {
    use super::*;

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
