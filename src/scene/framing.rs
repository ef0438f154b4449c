//! A camera and a light for scenes that bring none.

use super::camera::Camera;
use super::light::LightKind;
use glam::Vec3;

/// Vertical field of view of the framing camera, degrees.
const FOV: f32 = 40.0;

/// A camera outside the bounds, three quarters from the front (+z) and a little above, that shows all of them in any
/// image that is not taller than wide.
pub(super) fn camera(lo: Vec3, hi: Vec3) -> Camera {
    let centre = (lo + hi) * 0.5;
    let radius = radius(lo, hi);
    let direction = Vec3::new(0.5, 0.35, 1.0).normalize();
    let distance = radius / (FOV.to_radians() * 0.5).sin();
    Camera { position: centre + direction * distance, look_at: centre, up: Vec3::Y, vertical_fov: FOV }
}

/// A point light up, right and in front of the bounds, twice their radius away, whose irradiance at the centre is π: a
/// white diffuse surface facing it there has radiance 1.
pub(super) fn light(lo: Vec3, hi: Vec3) -> LightKind {
    let distance = 2.0 * radius(lo, hi);
    let position = (lo + hi) * 0.5 + Vec3::new(0.6, 1.0, 0.8).normalize() * distance;
    LightKind::Point { position, intensity: Vec3::splat(std::f32::consts::PI * distance * distance) }
}

/// Radius of the sphere around the bounds; positive even for a single point.
fn radius(lo: Vec3, hi: Vec3) -> f32 {
    ((hi - lo).length() * 0.5).max(1e-6)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::camera::{ImageSize, View};
    use glam::Vec2;

    #[test]
    fn every_corner_of_the_bounds_is_in_the_image() {
        let (lo, hi) = (Vec3::new(-3.0, 10.0, 5.0), Vec3::new(1.0, 11.0, 25.0));
        let size = ImageSize { width: 300, height: 300 };
        let clip = View::new(&camera(lo, hi), size, (hi - lo).length()).clip_from_world(Vec2::ZERO);
        for corner in 0..8 {
            let pick = |axis: usize| if corner >> axis & 1 == 0 { lo[axis] } else { hi[axis] };
            let p = clip * Vec3::new(pick(0), pick(1), pick(2)).extend(1.0);
            assert!(p.w > 0.0 && (p.x / p.w).abs() <= 1.0 && (p.y / p.w).abs() <= 1.0, "{p}");
        }
    }
}
