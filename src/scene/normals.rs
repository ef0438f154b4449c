//! Shading normals at the corners of triangles.

use glam::Vec3;
use rayon::prelude::*;

/// Around a vertex of more facets than this nothing is smoothed: the work grows with their square.
const MOST_FACETS: usize = 1024;

/// Completes `given` (zero where a file has none, any length): unit, on the front side of their triangle, and where they
/// lack the geometric normal or, with `smooth_angle` (degrees), the angle-weighted mean of the facets at the position
/// whose normals are within it. Answers how many given normals pointed to the back and were turned.
pub(super) fn complete(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    given: &mut [[Vec3; 3]],
    smooth_angle: Option<f32>,
) -> usize {
    let geometric: Vec<Vec3> =
        triangles.par_iter().map(|t| geometric_normal(t.map(|i| positions[i as usize]))).collect();
    let smooth = smooth_angle.filter(|_| given.iter().flatten().any(|n| *n == Vec3::ZERO));
    let facets = smooth.map(|angle| Facets::new(positions, triangles, &geometric, angle));
    given
        .par_iter_mut()
        .enumerate()
        .map(|(t, normals)| {
            let front = geometric[t];
            let mut turned = 0;
            for (corner, normal) in normals.iter_mut().enumerate() {
                // f64: squares of short or long vectors leave the range of f32.
                let unit = normal.as_dvec3().normalize_or_zero().as_vec3();
                *normal = if unit == Vec3::ZERO {
                    facets.as_ref().map_or(front, |f| f.mean(triangles[t][corner], front))
                } else if unit.dot(front) < 0.0 {
                    turned += 1;
                    -unit
                } else {
                    unit
                };
            }
            turned
        })
        .sum()
}

fn geometric_normal(corners: [Vec3; 3]) -> Vec3 {
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    (b - a).cross(c - a).normalize_or_zero().as_vec3()
}

/// The facets around each position.
struct Facets {
    /// Range of each position in `around`.
    starts: Vec<u32>,
    /// Unit normal times the facet's angle at the position.
    around: Vec<Vec3>,
    cos_limit: f32,
}

impl Facets {
    fn new(positions: &[Vec3], triangles: &[[u32; 3]], geometric: &[Vec3], angle: f32) -> Self {
        let mut starts = vec![0_u32; positions.len() + 1];
        triangles.iter().flatten().for_each(|&i| starts[i as usize + 1] += 1);
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        let mut next = starts.clone();
        let mut around = vec![Vec3::ZERO; triangles.len() * 3];
        for (triangle, &normal) in triangles.iter().zip(geometric) {
            let corners = triangle.map(|i| positions[i as usize]);
            for k in 0..3 {
                let [a, b, c] = [0, 1, 2].map(|j| corners[(k + j) % 3]);
                let slot = &mut next[triangle[k] as usize];
                around[*slot as usize] = normal * (b - a).angle_between(c - a);
                *slot += 1;
            }
        }
        Self { starts, around, cos_limit: angle.to_radians().cos() }
    }

    /// Mean of the facets at `position` that are within the angle of `front`.
    fn mean(&self, position: u32, front: Vec3) -> Vec3 {
        let range = self.starts[position as usize] as usize..self.starts[position as usize + 1] as usize;
        if range.len() > MOST_FACETS {
            return front;
        }
        let near = |w: &&Vec3| w.dot(front) >= self.cos_limit * w.length() - 1e-6;
        let mean = self.around[range].iter().filter(near).sum::<Vec3>().normalize_or(front);
        // The mean of facets within 90° may still lie behind a sliver.
        if mean.dot(front) > 0.0 { mean } else { front }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A roof: two facets that meet at 60° over the edge (0, 1).
    fn roof() -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let (s, c) = 30_f32.to_radians().sin_cos();
        let positions = vec![Vec3::ZERO, Vec3::Y, Vec3::new(-c, 0.0, -s), Vec3::new(c, 0.0, -s)];
        (positions, vec![[0, 1, 2], [1, 0, 3]])
    }

    #[test]
    fn smoothing_respects_its_angle() {
        let (positions, triangles) = roof();
        let at = |angle| {
            let mut normals = vec![[Vec3::ZERO; 3]; 2];
            complete(&positions, &triangles, &mut normals, angle);
            normals
        };
        let flat = at(None);
        assert!((flat[0][0].dot(flat[1][1]) - 0.5).abs() < 1e-6);
        assert_eq!(at(Some(59.0)), flat);
        let smooth = at(Some(61.0));
        // Both facets have the same angle at each end only by symmetry of the pair of ends.
        assert!(smooth[0][0].dot(smooth[1][1]) > 0.999_999, "one normal at a shared position");
        assert!((smooth[0][0].z - 1.0).abs() < 1e-6, "{}", smooth[0][0]);
        assert_eq!(smooth[0][2], flat[0][2], "an unshared corner stays flat");
    }

    #[test]
    fn given_normals_are_unit_and_in_front() {
        let (positions, triangles) = roof();
        let front = geometric_normal(triangles[0].map(|i| positions[i as usize]));
        let mut normals = vec![[front * 1e-30, -front * 1e30, Vec3::ZERO], [Vec3::ZERO; 3]];
        let turned = complete(&positions, &triangles, &mut normals, None);
        assert_eq!(turned, 1);
        assert!(normals[0].iter().all(|n| n.distance(front) < 1e-6), "{normals:?}");
    }
}
