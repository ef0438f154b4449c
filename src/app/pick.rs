//! What is seen at a place of the image.

use crate::math::triangle::unit_normal;
use crate::scene::camera::View;
use crate::scene::{FaceId, Scene};
use glam::Vec2;
use glam::Vec3;

/// Pixel and image coordinates of a place in shares of width and height.
fn pixel_at(view: &View, place: Vec2) -> (usize, Vec2) {
    let (width, height) = (view.size.width, view.size.height);
    let x = ((place.x * width as f32) as u32).min(width - 1);
    let y = ((place.y * height as f32) as u32).min(height - 1);
    (y as usize * width as usize + x as usize, Vec2::new(x as f32 + 0.5, y as f32 + 0.5))
}

/// The point seen at a place of the image whose faces plus 1 are `face_ids`; `None` where there is none.
#[must_use]
pub fn point_at(scene: &Scene, view: &View, face_ids: &[u32], place: Vec2) -> Option<Vec3> {
    let (pixel, centre) = pixel_at(view, place);
    let face = FaceId(face_ids.get(pixel)?.checked_sub(1)?);
    let corners = scene.corners(face.triangle());
    let (direction, normal) = (view.direction(centre), unit_normal(corners));
    let distance = (corners[0] - view.eye).dot(normal) / direction.dot(normal);
    (distance.is_finite() && distance > 0.0).then(|| view.eye + direction * distance)
}

/// A point at a distance along the view in the direction of a place of the image.
#[must_use]
pub fn point_towards(view: &View, place: Vec2, distance: f32) -> Vec3 {
    view.eye + view.direction(pixel_at(view, place).1) * distance
}

/// A point as far ahead as another, where the image moves by so many pixels.
#[must_use]
pub fn moved_across(view: &View, point: Vec3, pixels: Vec2) -> Vec3 {
    let ahead = (point - view.eye).dot(view.forward);
    let half = Vec2::new(view.size.width as f32, view.size.height as f32) * 0.5;
    let shares = pixels / half;
    point + (view.right * shares.x + view.down * shares.y) * ahead
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::camera::{Camera, ImageSize};

    #[test]
    fn the_point_lies_on_the_face_and_shows_at_the_place() {
        let scene = Scene {
            positions: vec![Vec3::new(-9.0, -9.0, -1.0), Vec3::new(9.0, -9.0, -3.0), Vec3::new(0.0, 20.0, -2.0)],
            triangles: vec![[0, 1, 2]],
            ..Scene::default()
        };
        let camera = Camera { position: Vec3::Z * 4.0, look_at: Vec3::ZERO, up: Vec3::Y, vertical_fov: 50.0 };
        let size = ImageSize { width: 8, height: 6 };
        let view = View::new(&camera, size, 0.1);
        let mut faces = vec![1; size.pixels()];
        faces[0] = 0;
        let point = point_at(&scene, &view, &faces, Vec2::new(0.8, 0.3)).unwrap();
        let corners = scene.corners(FaceId(0).triangle());
        assert!((point - corners[0]).dot(unit_normal(corners)).abs() < 1e-4);
        assert!(view.pixel_of(point).unwrap().distance(Vec2::new(6.5, 1.5)) < 1e-3);
        assert_eq!(point_at(&scene, &view, &faces, Vec2::ZERO), None, "nothing is seen there");
        assert!(point_at(&scene, &view, &faces, Vec2::ONE).is_some(), "the last pixel");
        assert_eq!(point_at(&scene, &view, &[], Vec2::ONE), None, "before the first frame");
        let across = moved_across(&view, point, Vec2::new(-3.0, 2.0));
        assert!(view.pixel_of(across).unwrap().distance(Vec2::new(3.5, 3.5)) < 1e-3 && (across - point).z.abs() < 1e-6);
        assert!((point_towards(&view, Vec2::splat(0.5), 2.0).z - 2.0).abs() < 1e-5);
    }
}
