//! Emission textures that are black over most of a model, as exporters write them for a few small lamps: triangles that show nothing
//! but black emit nothing, and are no part of an area light.

use super::material::{Material, MaterialId, TextureMap};
use super::texture::{Texture, Wrap};
use super::{FaceId, Scene, TriangleId};
use glam::{Vec2, Vec3};

/// Mean radiance of all surfaces below which emission is a detail that lights nothing, W·sr⁻¹·m⁻².
const FAINT: f64 = 1.0 / 64.0;

/// Gives triangles of materials from number `first` on that show a black part of their emission texture a material that does not emit.
pub(super) fn leave_out(scene: &mut Scene, first: usize) {
    let of_material = |(number, material): (usize, &Material)| {
        let map = material.map_ke.filter(|_| number >= first && !material.unlit)?;
        Some((map, Bright::of(scene.texture(&map))))
    };
    let bright: Vec<Option<(TextureMap, Bright)>> = scene.materials.iter().enumerate().map(of_material).collect();
    let mut twins: Vec<Option<MaterialId>> = vec![None; bright.len()];
    for (material, &uvs) in scene.triangle_materials.iter_mut().zip(&scene.uvs) {
        let number = material.0 as usize;
        if bright[number].as_ref().is_none_or(|(map, bright)| bright.is_in(map, uvs)) {
            continue;
        }
        *material = *twins[number].get_or_insert_with(|| {
            let twin = Material { ke: Vec3::ZERO, map_ke: None, ..scene.materials[number].clone() };
            scene.materials.push(twin);
            MaterialId(scene.materials.len() as u32 - 1)
        });
    }
}

/// Whether all that the scene emits is a detail.
pub(super) fn is_faint(scene: &Scene) -> bool {
    let all = (0..scene.triangles.len() as u32).map(TriangleId);
    let [power, area] = all.fold([0.0, 0.0], |[power, sum]: [f64; 2], triangle| {
        let area = f64::from(scene.area_vector(triangle).length());
        let face = FaceId::new(triangle, false);
        let radiance = if scene.face_lights(face) { mean_radiance(scene, face) } else { 0.0 };
        [power + area * f64::from(radiance), sum + area]
    });
    power < FAINT * area
}

/// What a face emits in its brightest channel, the mean of sixteen points spread over it.
fn mean_radiance(scene: &Scene, face: FaceId) -> f32 {
    let middles = [0.125, 0.375, 0.625, 0.875_f32];
    let points = middles.iter().flat_map(|&u| middles.map(|v| if u + v > 1.0 { [1.0 - u, 1.0 - v] } else { [u, v] }));
    points.map(|[u, v]| scene.emitted_at(face, u, v).max_element()).sum::<f32>() / 16.0
}

/// Where an image is not black: how many such texels lie above and left of each.
struct Bright {
    extent: [usize; 2],
    /// A row and a column more than the image has, which are 0.
    sums: Vec<u32>,
}

impl Bright {
    fn of(texture: &Texture) -> Self {
        let [width, height] = texture.extents()[0].map(|n| n as usize);
        let mut sums = vec![0_u32; (width + 1) * (height + 1)];
        for y in 0..height {
            let mut row = 0;
            for x in 0..width {
                let [r, g, b, _] = texture.texels()[y * width + x];
                row += u32::from([r, g, b] != [0; 3]);
                sums[(y + 1) * (width + 1) + x + 1] = sums[y * (width + 1) + x + 1] + row;
            }
        }
        Self { extent: [width, height], sums }
    }

    /// Whether a triangle with these coordinates may show some of it: by the box around it, and by the whole image where that is left.
    fn is_in(&self, map: &TextureMap, uvs: [Vec2; 3]) -> bool {
        let places = uvs.map(|uv| map.place(uv));
        let (lo, hi) =
            places.into_iter().fold((Vec2::INFINITY, Vec2::NEG_INFINITY), |(lo, hi), p| (lo.min(p), hi.max(p)));
        // Repeated images are brought to the one that the box begins in.
        let shift = if map.wrap == [Wrap::Repeat; 2] { lo.floor() } else { Vec2::ZERO };
        let (lo, hi) = (lo - shift, hi - shift);
        let [width, height] = self.extent;
        if !(lo.min_element() >= 0.0 && hi.max_element() <= 1.0) {
            return self.sums.last() != Some(&0);
        }
        // Bilinear look-ups reach a texel further; at the border they reach the other side.
        let reach = |lo: f32, hi: f32, n: usize| {
            let (a, b) = ((lo * n as f32 - 0.5).floor(), (hi * n as f32 - 0.5).floor() + 2.0);
            (a >= 0.0 && b <= n as f32).then_some((a as usize, b as usize))
        };
        let (Some((left, right)), Some((top, bottom))) =
            (reach(lo.x, hi.x, width), reach(1.0 - hi.y, 1.0 - lo.y, height))
        else {
            return self.sums.last() != Some(&0);
        };
        let sum = |x: usize, y: usize| self.sums[y * (width + 1) + x];
        sum(right, bottom) + sum(left, top) != sum(left, bottom) + sum(right, top)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::texture::TextureId;

    #[test]
    fn only_triangles_over_black_are_dark() {
        // One white texel, the third of the second row, of 8 × 8.
        let texel = |i: usize| if i == 10 { [255; 4] } else { [0, 0, 0, 255] };
        let bright = Bright::of(&Texture::new("dot".into(), [8, 8], (0..64).map(texel).collect()));
        let map = TextureMap::from(TextureId(0));
        let around = |u: f32, v: f32, size: f32| [Vec2::new(u, v), Vec2::new(u + size, v), Vec2::new(u, v + size)];
        let dot = Vec2::new(2.5 / 8.0, 1.0 - 1.5 / 8.0);
        assert!(bright.is_in(&map, around(dot.x, dot.y, 0.01)));
        assert!(bright.is_in(&map, around(dot.x - 2.0, dot.y + 5.0, 0.01)), "repeated");
        assert!(bright.is_in(&map, around(dot.x - 0.99 / 8.0, dot.y, 0.01)), "interpolated");
        assert!(
            bright.is_in(&map, around(0.1, 0.1, 2.0)) && bright.is_in(&map, around(0.0, 0.0, 0.1)),
            "at the border"
        );
        assert!(!bright.is_in(&map, around(0.6, 0.2, 0.2)));
        assert!(!bright.is_in(&map, around(dot.x + 1.6 / 8.0, dot.y, 0.01)));
    }
}
