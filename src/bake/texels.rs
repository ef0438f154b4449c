//! What a face of a bake is worth: texels of equal area, where a picture has pixels.

use crate::scene::{FaceId, Scene, TriangleId};
use glam::Vec3;

/// Texels that the scene's triangles have in all, unless their size was asked for: as many as a picture has pixels.
const TEXELS: f64 = 524_288.0;
/// Most texels of a face: their sum over 2³² faces fits.
const MOST: f64 = (1 << 24) as f64;

/// Area of a triangle, in double precision: of huge ones single precision knows none.
fn area(scene: &Scene, triangle: TriangleId) -> f64 {
    let [a, b, c] = scene.corners(triangle).map(Vec3::as_dvec3);
    (b - a).cross(c - a).length() * 0.5
}

fn triangles(scene: &Scene) -> impl Iterator<Item = TriangleId> {
    (0..scene.triangles.len() as u32).map(TriangleId)
}

/// Length of a texel's side, scene units, if nobody asks for another; 0 without area.
#[must_use]
pub fn default_side(scene: &Scene) -> f64 {
    let all: f64 = triangles(scene).map(|triangle| area(scene, triangle)).filter(|area| area.is_finite()).sum();
    (all / TEXELS).sqrt()
}

/// The faces that are wanted, ascending, each with its texels: at least one, so that its light is refined.
#[must_use]
pub fn faces(scene: &Scene, wanted: &[bool], side: f64) -> Vec<(FaceId, u32)> {
    let of = |triangle| {
        let texels = (area(scene, triangle) / (side * side)).round();
        // What is not a number counts as the least.
        let texels = if texels >= 1.0 { texels.min(MOST) as u32 } else { 1 };
        [false, true].map(|back| (FaceId::new(triangle, back), texels))
    };
    triangles(scene).flat_map(of).filter(|(face, _)| wanted[face.0 as usize]).collect()
}
