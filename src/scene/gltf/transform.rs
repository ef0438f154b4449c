//! Where nodes put things.

use ::gltf::json::scene::Node;
use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3};

/// The transform of a node against its parent, or what is wrong with it.
pub(super) fn of(node: &Node) -> Result<DAffine3, String> {
    let triple = |v: [f32; 3]| DVec3::from(v.map(f64::from));
    let transform = if let Some(matrix) = node.matrix {
        DAffine3::from_mat4(DMat4::from_cols_array(&matrix.map(f64::from)))
    } else {
        let [x, y, z, w] = node.rotation.map_or([0.0, 0.0, 0.0, 1.0], |rotation| rotation.0.map(f64::from));
        let rotation = DQuat::from_xyzw(x, y, z, w);
        if rotation.length_squared() == 0.0 {
            return Err("its rotation is 0".into());
        }
        let scale = node.scale.map_or(DVec3::ONE, triple);
        DAffine3::from_scale_rotation_translation(
            scale,
            rotation.normalize(),
            node.translation.map_or(DVec3::ZERO, triple),
        )
    };
    if transform.is_finite() { Ok(transform) } else { Err("its transform is not made of finite numbers".into()) }
}

/// What normals are multiplied by, any length: they stay perpendicular to what is stretched, and on its front.
pub(super) fn of_normals(matrix: DMat3) -> DMat3 {
    let [a, b, c] = [matrix.x_axis, matrix.y_axis, matrix.z_axis];
    let cofactors = DMat3::from_cols(b.cross(c), c.cross(a), a.cross(b));
    if turns_over(matrix) { -cofactors } else { cofactors }
}

/// Whether the transform makes left hands of right ones: triangles are wound the other way then.
pub(super) fn turns_over(matrix: DMat3) -> bool {
    matrix.determinant() < 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_stay_perpendicular_and_in_front() {
        for scale in [DVec3::new(2.0, 1.0, 0.25), DVec3::new(-2.0, 1.0, 3.0), DVec3::new(-1.0, -1.0, 1.0)] {
            let matrix =
                DMat3::from_quat(DQuat::from_euler(glam::EulerRot::XYZ, 0.3, -0.8, 1.7)) * DMat3::from_diagonal(scale);
            let (e, f) = (DVec3::new(1.0, 2.0, -0.5), DVec3::new(-0.3, 0.4, 2.0));
            let normal = of_normals(matrix) * e.cross(f);
            let (e, f) = (matrix * e, matrix * f);
            let (e, f) = if turns_over(matrix) { (f, e) } else { (e, f) };
            assert!(normal.normalize().dot(e.cross(f).normalize()) > 1.0 - 1e-12, "{scale}");
        }
    }
}
