//! A camera and a light for scenes that bring none.

use super::camera::Camera;
use super::light::LightKind;
use super::subject::Subject;
use super::up_axis::UpAxis;
use glam::Vec3;

/// Vertical field of view of the framing camera, degrees.
const FOV: f32 = 40.0;

/// A camera outside the subject's bounds, three quarters from the front and a little above, that shows all of them in any
/// image that is not taller than wide; on this side of what surrounds them.
pub(super) fn camera(subject: &Subject, up: UpAxis) -> Camera {
    let centre = subject.lo.midpoint(subject.hi);
    let distance = radius(subject) / (FOV.to_radians() * 0.5).sin();
    let position = subject.within(centre + up.direction([0.5, 0.35, 1.0]) * distance);
    Camera { position, look_at: centre, up: up.vector(), vertical_fov: FOV }
}

/// A point light up, right and in front of the subject's bounds, twice their radius away or on this side of what surrounds
/// them, whose irradiance at the centre is π: a white diffuse surface facing it there has radiance 1.
pub(super) fn light(subject: &Subject, up: UpAxis) -> LightKind {
    let centre = subject.lo.midpoint(subject.hi);
    let position = subject.within(centre + up.direction([0.6, 1.0, 0.8]) * 2.0 * radius(subject));
    let squared = position.distance_squared(centre);
    LightKind::Point { position, intensity: Vec3::splat(std::f32::consts::PI * squared) }
}

/// Radius of the sphere around the bounds; positive even for a single point.
fn radius(subject: &Subject) -> f32 {
    ((subject.hi - subject.lo).length() * 0.5).max(1e-6)
}
