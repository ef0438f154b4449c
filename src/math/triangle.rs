//! Normals of triangles, and their points nearest to the origin.

use glam::Vec3;

/// Square of a cross product's length within which its root is exact in single precision.
const ROOTED: std::ops::Range<f32> = 1e-30..1e30;

/// Unit normal of the side from which the corners run counter-clockwise (zero for a degenerate triangle).
#[must_use]
#[inline]
pub fn unit_normal(corners: [Vec3; 3]) -> Vec3 {
    // f64: slivers of a dense mesh far from the origin lose all their digits in f32. The length needs none of that.
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    let cross = (b - a).cross(c - a);
    let normal = cross.as_vec3();
    let squared = normal.length_squared();
    if ROOTED.contains(&squared) { normal / squared.sqrt() } else { cross.normalize_or_zero().as_vec3() }
}

/// Barycentric coordinates of the point of a triangle that is nearest to the origin, by the Voronoi regions of its corners
/// and edges. A degenerate triangle counts as its edges.
#[must_use]
pub fn nearest_to_origin([a, b, c]: [Vec3; 3]) -> [f32; 3] {
    let (ab, ac) = (b - a, c - a);
    let normal = ab.cross(ac);
    let squared = normal.length_squared();
    if squared > 0.0 {
        // Areas of the triangles that the origin's projection makes with the edges.
        let [u, v, w] = [(b, c), (c, a), (a, b)].map(|(p, q)| p.cross(q).dot(normal) / squared);
        if u >= 0.0 && v >= 0.0 && w >= 0.0 {
            return [u, v, w];
        }
    }
    let along = |p: Vec3, q: Vec3| {
        let edge = q - p;
        let t = (-p.dot(edge) / edge.length_squared().max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
        (t, (p + edge * t).length_squared())
    };
    let (s, on_ab) = along(a, b);
    let (t, on_bc) = along(b, c);
    let (u, on_ca) = along(c, a);
    if on_ab <= on_bc && on_ab <= on_ca {
        [1.0 - s, s, 0.0]
    } else if on_bc <= on_ca {
        [0.0, 1.0 - t, t]
    } else {
        [u, 0.0, 1.0 - u]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sequence::Sequence;

    /// No point of a fine grid over the triangle is nearer, and the one returned is hardly farther than the grid's best.
    #[test]
    fn is_nearest_among_a_grid() {
        let sequence = Sequence::new(1);
        let corner = |i| Vec3::from_slice(&sequence.point(i)[..3]) - Vec3::splat(0.4);
        for i in 0..300 {
            let t = [corner(3 * i), corner(3 * i + 1), corner(3 * i + 2)];
            let at = |w: [f32; 3]| (t[0] * w[0] + t[1] * w[1] + t[2] * w[2]).length();
            let found = nearest_to_origin(t);
            assert!(found.iter().all(|&w| w >= 0.0) && (found.iter().sum::<f32>() - 1.0).abs() < 1e-4, "{found:?}");
            let n = 60_u16;
            let grid = (0..=n).flat_map(|j| (0..=n - j).map(move |k| (j, k)));
            let best = grid.map(|(j, k)| [j, k, n - j - k].map(|x| f32::from(x) / f32::from(n))).map(at);
            let best = best.fold(f32::INFINITY, f32::min);
            assert!(at(found) < best + 1e-5 && at(found) > best - 0.03, "{} {best}", at(found));
        }
    }

    #[test]
    fn degenerate_triangles_have_a_nearest_point_too() {
        let [a, b] = [Vec3::new(1.0, -1.0, 0.0), Vec3::new(1.0, 3.0, 0.0)];
        assert_eq!(nearest_to_origin([a, b, b]), [0.75, 0.25, 0.0]);
        assert_eq!(nearest_to_origin([a, a, a]).iter().sum::<f32>(), 1.0);
    }
}
