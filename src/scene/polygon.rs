//! Cutting polygons into triangles.

use glam::{DVec3, Vec3};

/// Whether a triangle can be drawn: its area is not nil, in exact enough arithmetic.
pub(super) fn has_area(corners: [Vec3; 3]) -> bool {
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    // f32 coordinates differ exactly in f64; the bound keeps squares of areas representable in f32.
    (b - a).cross(c - a).length_squared() > 1e-37
}

/// Cuts a polygon into triangles of its corners, wound alike: a fan from the first corner where that is valid, else by
/// ear clipping in the polygon's plane. `out` is replaced.
pub(super) fn triangulate(points: &[Vec3], out: &mut Vec<[u32; 3]>) {
    fan(points.len(), out);
    if points.len() == 3 {
        return;
    }
    let normal = newell_normal(points);
    let faces_normal = |&[a, b, c]: &[u32; 3]| {
        let [a, b, c] = [a, b, c].map(|i| points[i as usize].as_dvec3());
        (b - a).cross(c - a).dot(normal) >= 0.0
    };
    if normal == DVec3::ZERO || out.iter().all(faces_normal) {
        return;
    }
    clip_ears(points, normal, out);
}

fn fan(corners: usize, out: &mut Vec<[u32; 3]>) {
    out.clear();
    out.extend((1..corners as u32 - 1).map(|i| [0, i, i + 1]));
}

/// Area vector of a polygon (twice the area times the mean normal), independent of where it is cut.
fn newell_normal(points: &[Vec3]) -> DVec3 {
    let origin = points[0].as_dvec3();
    points.windows(2).map(|edge| (edge[0].as_dvec3() - origin).cross(edge[1].as_dvec3() - origin)).sum()
}

/// Ear clipping (`earcut`) of the projection along `normal`. Leaves `out` as it is when nothing comes of it.
fn clip_ears(points: &[Vec3], normal: DVec3, out: &mut Vec<[u32; 3]>) {
    let (u, v) = normal.normalize().any_orthonormal_pair();
    let origin = points[0].as_dvec3();
    let flat = points.iter().map(|p| {
        let p = p.as_dvec3() - origin;
        [p.dot(u), p.dot(v)]
    });
    let mut indices: Vec<u32> = Vec::new();
    earcut::Earcut::new().earcut(flat, &[], &mut indices);
    if indices.len() < 3 {
        return;
    }
    out.clear();
    out.extend(indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]));
    let area: f64 = out.iter().map(|&t| signed_area(points, t, normal)).sum();
    if area < 0.0 {
        out.iter_mut().for_each(|t| t.swap(1, 2));
    }
}

fn signed_area(points: &[Vec3], triangle: [u32; 3], normal: DVec3) -> f64 {
    let [a, b, c] = triangle.map(|i| points[i as usize].as_dvec3());
    (b - a).cross(c - a).dot(normal)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(points: &[Vec3], cut: &[[u32; 3]]) -> f64 {
        cut.iter().map(|&t| signed_area(points, t, DVec3::Z).abs() / 2.0).sum()
    }

    #[test]
    fn concave_polygon_is_covered_once() {
        // An L, its reflex corner opposite the fan's centre: a fan from corner 0 covers area outside.
        let l = [(0.0, 1.0), (0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (1.0, 2.0), (1.0, 1.0)];
        let mut points: Vec<Vec3> = l.iter().map(|&(x, y)| Vec3::new(x, y, 5.0)).collect();
        for turn in 0..6 {
            points.rotate_left(1);
            let mut cut = Vec::new();
            triangulate(&points, &mut cut);
            assert_eq!(cut.len(), 4, "turn {turn}");
            assert!((area(&points, &cut) - 3.0).abs() < 1e-9, "turn {turn}: {cut:?}");
            assert!(cut.iter().all(|&t| signed_area(&points, t, DVec3::Z) >= 0.0), "turn {turn}: winding");
        }
        points.reverse();
        let mut cut = Vec::new();
        triangulate(&points, &mut cut);
        assert!(cut.iter().all(|&t| signed_area(&points, t, DVec3::Z) <= 0.0), "clockwise stays clockwise");
    }

    #[test]
    fn outlines_of_many_corners_keep_their_bays() {
        // A star of 20,000 rays: a fan from any corner covers the bays between them.
        let n = 40_000;
        let corner = |i: u32| {
            let (angle, radius) =
                (std::f64::consts::TAU * f64::from(i) / f64::from(n), if i.is_multiple_of(2) { 1.0 } else { 0.7 });
            Vec3::new((radius * angle.cos()) as f32, (radius * angle.sin()) as f32, 0.0)
        };
        let points: Vec<Vec3> = (0..n).map(corner).collect();
        let mut cut = Vec::new();
        triangulate(&points, &mut cut);
        let expected = newell_normal(&points).z / 2.0;
        assert!((area(&points, &cut) / expected - 1.0).abs() < 1e-9, "{} of {expected}", area(&points, &cut));
    }

    #[test]
    fn convex_quad_keeps_its_first_diagonal() {
        let quad = [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y];
        let mut cut = Vec::new();
        triangulate(&quad, &mut cut);
        assert_eq!(cut, [[0, 1, 2], [0, 2, 3]]);
    }

    #[test]
    fn slivers_count_by_area() {
        assert!(!has_area([Vec3::ZERO, Vec3::X, Vec3::X * 2.0]));
        assert!(has_area([Vec3::ZERO, Vec3::X, Vec3::new(2.0, 1e-7, 0.0)]));
    }
}
