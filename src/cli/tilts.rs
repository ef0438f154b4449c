//! Cameras that look at the main surface of a scene under given angles.

use super::args::Tilt;
use crate::geom::Ray;
use crate::geom::bvh::Bvh;
use crate::scene::camera::{Camera, ImageSize, View};
use crate::scene::{FaceId, Scene};
use glam::{IVec3, Quat, Vec2, Vec3};
use std::collections::HashMap;

impl Tilt {
    /// Name in reports.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Frontal => "frontal",
            Self::Oblique => "oblique",
            Self::Grazing => "grazing",
        }
    }

    /// Angle between the view and the surface's normal, degrees.
    #[must_use]
    pub const fn degrees(self) -> f32 {
        match self {
            Self::Frontal => 20.0,
            Self::Oblique => 55.0,
            Self::Grazing => 80.0,
        }
    }
}

/// The surface that fills most of an image: a point of it near the middle of what is seen of it, and its unit normal towards
/// the eye.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Anchor {
    /// The point.
    pub point: Vec3,
    /// The normal.
    pub normal: Vec3,
}

impl Anchor {
    /// Finds it from the face id + 1 of each pixel of a view. `None` if nothing is seen.
    #[must_use]
    pub fn find(scene: &Scene, view: &View, face_id: &[u32]) -> Option<Self> {
        let planes: Vec<Option<IVec3>> = face_id.iter().map(|&id| plane(scene, id)).collect();
        let mut sums: HashMap<IVec3, (u32, Vec2)> = HashMap::new();
        let width = view.size.width as usize;
        let centre = |pixel: usize| Vec2::new((pixel % width) as f32, (pixel / width) as f32) + 0.5;
        for (pixel, plane) in planes.iter().enumerate().filter_map(|(i, p)| p.map(|p| (i, p))) {
            let sum = sums.entry(plane).or_default();
            *sum = (sum.0 + 1, sum.1 + centre(pixel));
        }
        // Of equals the least, since the order of the map is not fixed.
        let main = sums.iter().max_by_key(|(plane, sum)| (sum.0, plane.to_array()))?;
        let middle = main.1.1 / main.1.0 as f32;
        let of_main = (0..planes.len()).filter(|&pixel| planes[pixel] == Some(*main.0));
        let distance = |pixel: &usize| centre(*pixel).distance_squared(middle);
        let pixel = of_main.min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
        let (normal, corner) = facing(scene, face_id[pixel])?;
        let direction = view.direction(centre(pixel));
        let t = (corner - view.eye).dot(normal) / direction.dot(normal);
        t.is_finite().then(|| Self { point: view.eye + direction * t, normal })
    }

    /// The camera moved so that its view meets the surface at an angle from its normal, as far away as walls allow.
    #[must_use]
    pub fn camera(&self, scene: &Scene, bvh: &Bvh, from: &Camera, tilt: Tilt) -> Camera {
        let eye = from.position - self.point;
        let along = (eye - self.normal * eye.dot(self.normal)).normalize_or(self.normal.any_orthonormal_vector());
        // First the way the camera looks already, then to both sides of it.
        let turns = [0.0_f32, 45.0, -45.0, 90.0, -90.0, 135.0, -135.0, 180.0];
        let mut best: Option<(f32, Vec3)> = None;
        for turn in turns {
            let tangent = Quat::from_axis_angle(self.normal, turn.to_radians()) * along;
            let (sin, cos) = tilt.degrees().to_radians().sin_cos();
            let direction = self.normal * cos + tangent * sin;
            let clear = self.clearance(scene, bvh, direction, eye.length());
            if best.is_none_or(|b| clear > b.0) {
                best = Some((clear, direction));
            }
            if clear > 0.5 * eye.length() {
                break;
            }
        }
        let (distance, direction) = best.unwrap_or((eye.length(), self.normal));
        let up = if direction.dot(from.up.normalize_or(Vec3::Y)).abs() > 0.98 { along } else { from.up };
        Camera { position: self.point + direction * distance, look_at: self.point, up, ..*from }
    }

    /// How far the eye can go in a direction, at most `wanted`: nine tenths of the way to what is hit first.
    fn clearance(&self, scene: &Scene, bvh: &Bvh, direction: Vec3, wanted: f32) -> f32 {
        let origin = self.point + self.normal * (scene.scale() * 1e-5);
        let ray = Ray { origin, direction, t_max: wanted / 0.9 };
        bvh.closest(scene, &ray).map_or(wanted, |hit| (0.9 * hit.t).min(wanted))
    }
}

/// Normal of a face (of an id + 1) towards its side, and one of its corners.
fn facing(scene: &Scene, id: u32) -> Option<(Vec3, Vec3)> {
    let face = FaceId(id.checked_sub(1)?);
    let normal = scene.geometric_normal(face.triangle());
    let normal = if face.is_back() { -normal } else { normal };
    Some((normal, scene.corners(face.triangle())[0]))
}

/// What faces of one plane share: their normal, to about 3°.
fn plane(scene: &Scene, id: u32) -> Option<IVec3> {
    facing(scene, id).map(|(normal, _)| (normal * 20.0).round().as_ivec3())
}

/// A view of a camera whose near plane is the one asked for, else half as far as what is nearest: what a careful program would
/// choose, so that each depth format shows what it can do.
#[must_use]
pub fn view(scene: &Scene, bvh: &Bvh, camera: &Camera, size: ImageSize, near: Option<f32>) -> View {
    const RAYS: u32 = 48;
    let view = scene.view(camera, size);
    let points =
        (0..RAYS).flat_map(|y| (0..RAYS).map(move |x| Vec2::new(x as f32 + 0.5, y as f32 + 0.5) / RAYS as f32));
    let extent = Vec2::new(size.width as f32, size.height as f32);
    // Directions have unit length along the view: distances are depths.
    let depth = |point: Vec2| {
        let ray = Ray { origin: view.eye, direction: view.direction(point * extent), t_max: f32::INFINITY };
        bvh.closest(scene, &ray).map(|hit| hit.t)
    };
    let nearest = points.filter_map(depth).fold(f32::INFINITY, f32::min);
    let careful = if nearest.is_finite() { (0.5 * nearest).max(view.near) } else { view.near };
    View { near: near.unwrap_or(careful), ..view }
}
