//! Normals of normal maps.

use super::footprint::Footprint;
use super::{Scene, TriangleId};
use glam::{Vec2, Vec3};

impl Scene {
    /// The normal that a normal map has in place of a unit shading `normal` at barycentrics (`u`, `v`) of a triangle, on the side `back`;
    /// itself without a map. The frame is that in which the texture coordinates rise (glTF's own, without given tangents), about the shading
    /// normal; `glsl/include/normals.glsl` follows it.
    #[must_use]
    pub fn mapped_normal(
        &self,
        triangle: TriangleId,
        at: [f32; 2],
        footprint: &Footprint,
        (normal, back): (Vec3, bool),
    ) -> Vec3 {
        let Some(map) = &self.material(triangle).map_normal else { return normal };
        let front = if back { -normal } else { normal };
        let texel = self.filtered(&map.map, triangle, at, footprint);
        let Vec3 { x, y, z } = texel * 2.0 - 1.0;
        let [right, up] = self.rise_of_uv(triangle, front);
        let turned = (right * (x * map.scale) + up * (y * map.scale) + front * z).normalize_or(front);
        if back { -turned } else { turned }
    }

    /// Unit directions across a unit `normal` in which u and v of a triangle rise.
    fn rise_of_uv(&self, triangle: TriangleId, normal: Vec3) -> [Vec3; 2] {
        let [a, b, c] = self.corners(triangle);
        let [ta, tb, tc] = self.uvs[triangle.0 as usize];
        let (edge, other) = (b - a, c - a);
        let (d, e): (Vec2, Vec2) = (tb - ta, tc - ta);
        let area = d.perp_dot(e);
        let rise = (edge * e.y - other * d.y) * area.signum();
        let right = (rise - normal * normal.dot(rise)).normalize_or(normal.any_orthonormal_vector());
        [right, normal.cross(right) * if area < 0.0 { -1.0 } else { 1.0 }]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::material::{Material, MaterialId, NormalMap};
    use crate::scene::texture::{Encoding, Texture, TextureId};

    /// A square in the plane of x and y whose texture leans to the right, mirrored or not.
    fn leaning(mirrored: bool) -> Scene {
        let texel = [218, 128, 218, 255];
        let texture = Texture::encoded("lean".into(), [1, 1], vec![texel], Encoding::Linear);
        let map = Some(NormalMap { map: TextureId(0).into(), scale: 1.0 });
        let side = if mirrored { -1.0 } else { 1.0 };
        Scene {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            triangles: vec![[0, 1, 2]],
            normals: vec![[Vec3::Z; 3]],
            uvs: vec![[Vec2::ZERO, Vec2::X * side, Vec2::Y]],
            triangle_materials: vec![MaterialId(0)],
            materials: vec![Material { map_normal: map, ..Material::grey("leaning") }],
            textures: vec![texture],
            ..Scene::default()
        }
    }

    #[test]
    fn normals_lean_the_way_that_texture_coordinates_rise() {
        for mirrored in [false, true] {
            let scene = leaning(mirrored);
            let normal =
                |front: Vec3, back| scene.mapped_normal(TriangleId(0), [0.3, 0.3], &Footprint::POINT, (front, back));
            let expected = Vec3::new(if mirrored { -1.0 } else { 1.0 }, 0.0, 1.0).normalize();
            assert!(normal(Vec3::Z, false).distance(expected) < 0.01, "{}", normal(Vec3::Z, false));
            assert!(normal(Vec3::NEG_Z, true).distance(-expected) < 0.01);
        }
    }
}
