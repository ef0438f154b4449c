//! Faces whose distance is that of their plane, in drawing order.

use super::shared::GpuCoplanarFace;
use crate::scene::coplanar::Member;
use crate::scene::{FaceId, Scene};

/// Those of a scene, in ascending rank: of faces at equal depth the last is seen.
pub(super) fn faces(scene: &Scene) -> Vec<GpuCoplanarFace> {
    let gpu = |(face, Member { plane, along, .. }): (FaceId, Member)| {
        let plane = scene.coplanar.plane(plane);
        GpuCoplanarFace {
            normal: plane.normal.as_vec3().to_array(),
            offset: plane.offset as f32,
            face: face.0,
            towards: if along == face.is_back() { -1.0 } else { 1.0 },
        }
    };
    scene.coplanar.by_rank().map(gpu).collect()
}
