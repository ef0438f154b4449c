//! Where the ray through a pixel meets a triangle.

use glam::{DVec3, Vec3};

/// Barycentric weights of the point of a triangle that a ray passes through, edges included; `None` if it misses.
#[must_use]
pub fn weights_inside(corners: [Vec3; 3], eye: Vec3, ray: Vec3) -> Option<[f32; 3]> {
    let volumes = volumes(corners, eye, ray);
    let sum: f64 = volumes.iter().sum();
    let weights = volumes.map(|volume| volume / sum);
    weights.iter().all(|weight| *weight >= 0.0).then(|| weights.map(|weight| weight as f32))
}

/// Barycentric weights of the point of a triangle that a ray passes through, those of the nearest point of the
/// triangle if it just misses.
#[must_use]
pub fn weights_on_ray(corners: [Vec3; 3], eye: Vec3, direction: Vec3) -> Option<[f32; 3]> {
    let volumes = volumes(corners, eye, direction);
    let sum: f64 = volumes.iter().sum();
    let inside = volumes.map(|v| (v / sum).max(0.0));
    let total: f64 = inside.iter().sum();
    (total.is_finite() && total > 0.0).then(|| inside.map(|v| (v / total) as f32))
}

/// Barycentric weights of the point where a ray passes through the plane of a triangle, some of them negative beyond its edges; `None` if
/// it runs along the plane.
#[must_use]
pub fn weights_in_plane(corners: [Vec3; 3], eye: Vec3, ray: Vec3) -> Option<[f32; 3]> {
    let volumes = volumes(corners, eye, ray);
    let sum: f64 = volumes.iter().sum();
    let weights = volumes.map(|volume| (volume / sum) as f32);
    weights.iter().all(|weight| weight.is_finite()).then_some(weights)
}

/// Volumes that a ray spans with the edges of a triangle, each opposite to a corner: in proportion to the barycentric
/// weights of the point where it passes through the plane, exact enough for slivers, and free of the plane's
/// distance.
fn volumes(corners: [Vec3; 3], eye: Vec3, direction: Vec3) -> [f64; 3] {
    let [a, b, c] = corners.map(|p| p.as_dvec3() - eye.as_dvec3());
    let volume = |p: DVec3, q: DVec3| direction.as_dvec3().dot(p.cross(q));
    [volume(b, c), volume(c, a), volume(a, b)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ray_passes_through_the_weighted_point() {
        let corners = [Vec3::new(1.0, 2.0, 9.0), Vec3::new(-3.0, 0.5, 7.0), Vec3::new(0.5, -1.0, 8.0)];
        let eye = Vec3::new(0.3, 0.2, -1.0);
        for weights in [[0.2, 0.3, 0.5], [0.9, 0.05, 0.05], [1.0, 0.0, 0.0]] {
            let point: Vec3 = (0..3).map(|i| corners[i] * weights[i]).sum();
            let found = weights_on_ray(corners, eye, (point - eye) * 0.3).unwrap();
            assert!(found.iter().zip(weights).all(|(a, b)| (a - b).abs() < 1e-5), "{found:?} {weights:?}");
        }
        // Beside it: clamped. Edge-on: no place.
        let beside = weights_on_ray(corners, eye, corners[0] + Vec3::Y - eye).unwrap();
        assert!(beside.iter().all(|w| (0.0..=1.0).contains(w)) && (beside.iter().sum::<f32>() - 1.0).abs() < 1e-6);
        let beyond = corners[0] * 1.2 - corners[1] * 0.1 - corners[2] * 0.1;
        let found = weights_in_plane(corners, eye, beyond - eye).unwrap();
        assert!(found.iter().zip([1.2, -0.1, -0.1]).all(|(a, b)| (a - b).abs() < 1e-5), "{found:?}");
        let edge_on = [Vec3::X, Vec3::X * 2.0, Vec3::X * 3.0];
        assert!(weights_on_ray(edge_on, Vec3::ZERO, Vec3::X).is_none());
        assert!(weights_in_plane(edge_on, Vec3::ZERO, Vec3::X).is_none());
    }
}
