//! The pixels of a triangle: where the centres of pixels see it.

use crate::scene::camera::View;
use glam::{DVec3, Vec2, Vec3};

/// A pixel whose centre sees a triangle, or would if nothing lay before it.
#[derive(Clone, Copy, Debug)]
pub struct Pixel {
    /// Direction from the eye through its centre, any length.
    pub ray: Vec3,
    /// Barycentric weights of the point of the triangle that it sees.
    pub weights: [f32; 3],
}

/// Slack of a row's ends, pixels: what rounding may take off them.
const SLACK: f32 = 0.01;

/// The pixels of a triangle whose corners all lie beyond the near plane, row by row; `None` for others.
#[must_use]
pub fn pixels_of(view: &View, corners: [Vec3; 3]) -> Option<Vec<Pixel>> {
    let [a, b, c] = corners.map(|corner| view.pixel_of(corner));
    let on_image = [a?, b?, c?];
    let row_of = |y: f32| (y - 0.5).clamp(-1.0, view.size.height as f32);
    let top = on_image.iter().map(|p| row_of(p.y)).fold(f32::INFINITY, f32::min).ceil().max(0.0) as u32;
    let bottom = on_image.iter().map(|p| row_of(p.y)).fold(f32::NEG_INFINITY, f32::max).floor();
    let mut found = Vec::new();
    for row in top..view.size.height {
        if row as f32 > bottom {
            break;
        }
        let y = row as f32 + 0.5;
        let Some([left, right]) = crossed(on_image, y) else { continue };
        let column_of = |x: f32| (x - 0.5).clamp(-1.0, view.size.width as f32);
        let first = column_of(left - SLACK).ceil().max(0.0) as u32;
        let pixels = (first..view.size.width).take_while(|&x| x as f32 <= column_of(right + SLACK));
        found.extend(pixels.filter_map(|x| {
            let ray = view.direction(Vec2::new(x as f32 + 0.5, y));
            Some(Pixel { ray, weights: weights_inside(corners, view.eye, ray)? })
        }));
    }
    Some(found)
}

/// Where a triangle of the image begins and ends on a line of constant y.
fn crossed(corners: [Vec2; 3], y: f32) -> Option<[f32; 2]> {
    let mut ends: Option<[f32; 2]> = None;
    for i in 0..3 {
        let (p, q) = (corners[i], corners[(i + 1) % 3]);
        if (p.y - y) * (q.y - y) > 0.0 || p.y == q.y {
            continue;
        }
        let x = p.x + (q.x - p.x) * ((y - p.y) / (q.y - p.y));
        ends = Some(ends.map_or([x, x], |[left, right]| [left.min(x), right.max(x)]));
    }
    ends
}

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
    use crate::scene::camera::{Camera, ImageSize};

    fn view() -> View {
        let camera =
            Camera { position: Vec3::new(0.2, 0.1, 3.0), look_at: Vec3::ZERO, up: Vec3::Y, vertical_fov: 45.0 };
        View::new(&camera, ImageSize { width: 48, height: 36 }, 4.0)
    }

    #[test]
    fn exactly_the_pixels_whose_rays_pass_through_it() {
        let view = view();
        let triangles = [
            [Vec3::new(-0.5, -0.4, 0.1), Vec3::new(0.6, -0.3, -0.5), Vec3::new(0.1, 0.7, 0.4)],
            [Vec3::new(-9.0, -0.01, 0.0), Vec3::new(9.0, -0.012, 0.3), Vec3::new(0.0, 0.04, -1.0)],
            [Vec3::new(-4.0, 3.0, 0.0), Vec3::new(4.0, 3.0, 0.0), Vec3::new(0.0, 0.5, 0.0)],
        ];
        for corners in triangles {
            let all = (0..view.size.pixels()).map(|pixel| view.direction(view.size.centre_of(pixel)));
            let expected: Vec<Vec3> = all.filter(|&ray| weights_inside(corners, view.eye, ray).is_some()).collect();
            let found = pixels_of(&view, corners).unwrap();
            assert!(!expected.is_empty());
            assert_eq!(found.iter().map(|pixel| pixel.ray).collect::<Vec<_>>(), expected);
            for Pixel { ray, weights } in found {
                let point: Vec3 = corners.iter().zip(weights).map(|(corner, weight)| *corner * weight).sum();
                assert!((point - view.eye).normalize().dot(ray.normalize()) > 1.0 - 1e-6);
            }
        }
    }

    #[test]
    fn behind_the_eye_and_beside_the_image_there_are_none() {
        let view = view();
        let behind = [Vec3::new(0.0, 0.0, 5.0), Vec3::X, Vec3::Y];
        assert!(pixels_of(&view, behind).is_none());
        let beside = [Vec3::new(10.0, 0.0, 0.0), Vec3::new(11.0, 0.0, 0.0), Vec3::new(10.0, 1.0, 0.0)];
        assert!(pixels_of(&view, beside).unwrap().is_empty());
    }

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
        assert!(weights_on_ray([Vec3::X, Vec3::X * 2.0, Vec3::X * 3.0], Vec3::ZERO, Vec3::X).is_none());
    }
}
