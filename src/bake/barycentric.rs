//! Where a vertex of the hierarchy lies on its face.

use glam::{DVec3, Vec3};

/// Splits halve barycentric weights: those of vertices down to this level are multiples of the same power of two. Positions of finer ones
/// are too coarse to tell.
const FINEST: f64 = (1 << 16) as f64;

/// Barycentric weights of a vertex at the corners of its face. The position is rounded, but the weights are dyadic: along an edge they
/// are the same seen from both of its triangles.
#[must_use]
pub fn weights(corners: [Vec3; 3], position: Vec3) -> [f64; 3] {
    if let Some(corner) = corners.iter().position(|corner| *corner == position) {
        return [0, 1, 2].map(|i| f64::from(u8::from(i == corner)));
    }
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    let x = position.as_dvec3();
    let n = (b - a).cross(c - a);
    let weight = |p: DVec3, q: DVec3| {
        let weight = (q - p).cross(x - p).dot(n) / n.length_squared();
        (weight * FINEST).round() / FINEST
    };
    let [u, v] = [weight(c, a), weight(a, b)].map(|w| if w.is_finite() { w.clamp(0.0, 1.0) } else { 1.0 / 3.0 });
    let scale = 1.0 / (u + v).max(1.0);
    let [u, v] = [u * scale, v * scale];
    [1.0 - u - v, u, v]
}

/// What corners with these values show there.
#[must_use]
pub fn interpolate<const N: usize>(weights: [f64; 3], corners: [[f32; N]; 3]) -> [f32; N] {
    std::array::from_fn(|i| {
        let [a, b, c] = corners.map(|corner| f64::from(corner[i]));
        (a * weights[0] + b * weights[1] + c * weights[2]) as f32
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_edge_has_the_same_weights_from_both_sides() {
        let [a, b] = [Vec3::new(0.1, 0.7, -3.0), Vec3::new(5.3, -2.1, 0.9)];
        let [c, d] = [Vec3::new(2.0, 4.0, 1.0), Vec3::new(-3.0, 0.2, 7.0)];
        let middle = (a + b) * 0.5;
        let quarter = (a + middle) * 0.5;
        for (x, share) in [(a, 1.0), (b, 0.0), (middle, 0.5), (quarter, 0.75)] {
            assert_eq!(weights([a, b, c], x), [share, 1.0 - share, 0.0]);
            assert_eq!(weights([b, a, d], x), [1.0 - share, share, 0.0]);
        }
        assert_eq!(interpolate([0.75, 0.25, 0.0], [[4.0], [8.0], [f32::MAX]]), [5.0]);
    }

    #[test]
    fn a_triangle_without_area_has_weights() {
        let w = weights([Vec3::ZERO, Vec3::X, Vec3::X * 2.0], Vec3::X * 0.5);
        assert!(w.iter().all(|w| (0.0..=1.0).contains(w)) && (w.iter().sum::<f64>() - 1.0).abs() < 1e-12, "{w:?}");
    }
}
