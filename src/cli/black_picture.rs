//! Why a picture is black, in one line: what is not in view, what does not shine, or what keeps light from what is seen.

use crate::image::tone_mapping;
use crate::pass::Layers;
use crate::scene::camera::View;
use crate::scene::light::{Light, LightKind, LightState, spot_falloff};
use crate::scene::{Display, EmissionSide, FaceId, Scene, TriangleId};
use glam::{Vec3, Vec4};
use std::collections::BTreeMap;

/// Displayed values, of 255, up to which a pixel is black to the eye.
const BLACK: u8 = 8;

/// Share of the pixels with geometry that may be more than black in a black picture: light leaks at the edges of things.
const SPECKS: f64 = 0.005;

/// Share of what is looked at that makes a cause.
const MOST: f64 = 0.5;

/// Pixels that are looked at closely, and triangles of a lamp, at most.
const SAMPLES: usize = 512;

/// Reflectance below which a surface is black.
const NO_REFLECTANCE: f32 = 1.0 / 512.0;

/// Mean radiance, as displayed, of a picture that is well exposed.
const MID_GREY: f32 = 0.18;

/// Largest exposure that can be asked for, stops.
const MOST_STOPS: f32 = 100.0;

/// A finished picture and what is in it.
pub struct Shown<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// The view of it.
    pub view: &'a View,
    /// How it is displayed.
    pub display: Display,
    /// The scene's lights as they are made to be; empty if all are as loaded.
    pub lights: &'a [LightState],
    /// Linear radiance of the written pixels.
    pub combined: &'a [Vec4],
    /// Layers at pixel centres.
    pub layers: &'a Layers,
}

/// What one light is to a point that is seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Relation {
    /// The point is behind the emitting side.
    Behind,
    /// The face seen is turned away from the light.
    TurnedAway,
    /// The light's cone passes by.
    BesideCone,
    /// Nothing but other geometry, or distance, can keep the light away.
    Before,
}

/// A point that is seen.
struct Point {
    face: FaceId,
    position: Vec3,
    /// Unit normal of the side that is seen.
    normal: Vec3,
}

impl Shown<'_> {
    /// Why the picture is black and what to do; `None` if it is not, or was switched off.
    #[must_use]
    pub fn why_black(&self) -> Option<String> {
        let covered: Vec<usize> = (0..self.combined.len()).filter(|&p| self.layers.face_id[p] != 0).collect();
        if covered.is_empty() {
            // An environment behind is something to see.
            let all_black = (0..self.combined.len()).all(|pixel| self.is_black(pixel));
            return all_black.then(|| self.nothing_in_view());
        }
        let bright = covered.iter().filter(|&&pixel| !self.is_black(pixel)).count();
        if bright as f64 > SPECKS * covered.len() as f64 {
            return None;
        }
        let shining: Vec<Light> = self.shining().collect();
        if shining.is_empty() && self.scene.lights.iter().any(|light| self.power(light).max_element() > 0.0) {
            return None; // Edits of the camera path have switched them off.
        }
        let points: Vec<Point> = evenly(&covered).map(|&pixel| self.point(pixel)).collect();
        let cause = self
            .no_power(&shining)
            .or_else(|| self.black_surfaces(&covered, &points))
            .or_else(|| self.backs_of_lamps(&shining, &points))
            .or_else(|| self.inside_something(&covered, &points))
            .or_else(|| self.too_faint(&covered));
        Some(cause.unwrap_or_else(|| self.in_the_dark(&shining, &points)))
    }

    fn is_black(&self, pixel: usize) -> bool {
        let Display { exposure, tone_mapping } = self.display;
        tone_mapping::display(self.combined[pixel].truncate(), exposure, tone_mapping).into_iter().all(|v| v <= BLACK)
    }

    fn nothing_in_view(&self) -> String {
        let View { eye, forward, .. } = *self.view;
        let corners = self.scene.triangles.iter().flatten().map(|&i| self.scene.positions[i as usize]);
        let depths = || corners.clone().map(|p| (p - eye).dot(forward));
        let in_image = |p: Vec3| {
            let size = self.view.size;
            let inside =
                |at: glam::Vec2| at.min_element() >= 0.0 && at.x < size.width as f32 && at.y < size.height as f32;
            self.view.pixel_of(p).is_some_and(inside)
        };
        let farthest = depths().fold(f32::NEG_INFINITY, f32::max);
        let (how, what) = if farthest <= 0.0 {
            ("all of the scene is behind it", "turn it by look_at")
        } else if corners.clone().any(in_image) {
            ("what is in view is smaller than a pixel or lies beyond its edge", "move it nearer")
        } else {
            ("all of the scene is beside its view", "turn it by look_at")
        };
        format!("the camera sees nothing: {how}; {what}")
    }

    /// Lights with power that are not switched off, where they are.
    fn shining(&self) -> impl Iterator<Item = Light> {
        let state = |i: usize| self.lights.get(i).copied().unwrap_or_default();
        self.scene.lights.iter().enumerate().filter_map(move |(i, light)| {
            let LightState { factor, position } = state(i);
            ((self.power(light) * factor).max_element() > 0.0).then(|| {
                let mut light = light.clone();
                position.into_iter().for_each(|position| light.kind.move_to(position));
                light
            })
        })
    }

    fn power(&self, light: &Light) -> Vec3 {
        match &light.kind {
            LightKind::Point { intensity, .. } | LightKind::Spot { intensity, .. } => *intensity,
            LightKind::Lamp { lamp, .. } => lamp.peak(),
            LightKind::Directional { irradiance, .. } => *irradiance,
            LightKind::Sun { radiance, .. } => *radiance,
            LightKind::Environment(environment) => Vec3::splat(environment.mean_luminance()),
            LightKind::Area { triangles } => {
                triangles.first().map_or(Vec3::ZERO, |&triangle| self.scene.material(triangle).ke)
            }
        }
    }

    fn no_power(&self, shining: &[Light]) -> Option<String> {
        shining.is_empty().then(|| {
            let count = self.scene.lights.len();
            format!("none of the scene's lights ({count}) shines: give them power")
        })
    }

    fn black_surfaces(&self, covered: &[usize], points: &[Point]) -> Option<String> {
        let largest = |rgb: &[f32; 3]| Vec3::from_array(*rgb).max_element();
        let reflects = |&&p: &&usize| largest(&self.layers.kd[p]).max(largest(&self.layers.ks[p])) > NO_REFLECTANCE;
        let reflecting = covered.iter().filter(reflects).count();
        (reflecting as f64 <= SPECKS * covered.len() as f64).then(|| {
            let materials = self.materials(points);
            format!("all that is in view is black ({materials}): give it Kd or Ks")
        })
    }

    /// The materials of most points, for a message.
    fn materials(&self, points: &[Point]) -> String {
        let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
        for point in points {
            *counts.entry(&self.scene.material(point.face.triangle()).name).or_default() += 1;
        }
        let mut names: Vec<(&str, usize)> = counts.into_iter().collect();
        names.sort_by_key(|&(_, count)| std::cmp::Reverse(count));
        let listed: Vec<&str> = names.iter().map(|&(name, _)| name).take(3).collect();
        let more = if names.len() > listed.len() { ", …" } else { "" };
        format!("material {}{more}", listed.join(", "))
    }

    fn backs_of_lamps(&self, shining: &[Light], points: &[Point]) -> Option<String> {
        self.mostly(Relation::Behind, shining, points).then(|| {
            let names: Vec<String> = shining.iter().take(3).map(|light| format!("{:?}", light.name)).collect();
            let lamps = names.join(", ");
            format!(
                "what is in view lies behind the lamps ({lamps}), whose faces emit on their front only; set emit = \"both\" in \
                 the [geometry] of a scene file, or turn the faces over"
            )
        })
    }

    fn inside_something(&self, covered: &[usize], points: &[Point]) -> Option<String> {
        let backs = points.iter().filter(|point| point.face.is_back()).count();
        let enclosed = covered.len() == self.combined.len() && backs == points.len();
        enclosed.then(|| {
            let materials = self.materials(points);
            format!("the camera is inside something: it sees the backs of faces only ({materials}), and no light gets in; move it out")
        })
    }

    fn too_faint(&self, covered: &[usize]) -> Option<String> {
        let radiance = |&pixel: &usize| self.combined[pixel].truncate().max_element();
        let lit = covered.iter().filter(|pixel| radiance(pixel) > 0.0).count();
        if lit as f64 <= MOST * covered.len() as f64 {
            return None;
        }
        let mean = covered.iter().map(|pixel| f64::from(radiance(pixel))).sum::<f64>() / covered.len() as f64;
        let stops = (f64::from(MID_GREY) / mean).log2().round() as f32;
        let exposure = if stops <= MOST_STOPS { format!("--exposure {stops} shows it; ") } else { String::new() };
        Some(format!(
            "the light that arrives is too faint to show: {exposure}lengths are in scene units, so that a scene in centimetres needs \
             10000 times the intensity of one in metres"
        ))
    }

    fn in_the_dark(&self, shining: &[Light], points: &[Point]) -> String {
        let (cause, what) = if self.mostly(Relation::TurnedAway, shining, points) {
            ("all that is in view faces away from the lights", "move the camera to the lit side, or add a light")
        } else if self.mostly(Relation::BesideCone, shining, points) {
            ("what is in view lies outside the cones of the spot lights", "turn them, or widen outer_angle")
        } else {
            (
                "something stands between the lights and what is in view",
                "move the camera or a light, or add a light there",
            )
        };
        format!("{cause}: {what}")
    }

    /// Whether most pairs of a point and a light are related so.
    fn mostly(&self, wanted: Relation, shining: &[Light], points: &[Point]) -> bool {
        let pairs = points.iter().flat_map(|point| shining.iter().map(move |light| self.relation(light, point)));
        let found = pairs.filter(|&relation| relation == wanted).count();
        found as f64 > MOST * (points.len() * shining.len()) as f64
    }

    /// The point that a pixel with geometry shows.
    fn point(&self, pixel: usize) -> Point {
        let face = FaceId(self.layers.face_id[pixel] - 1);
        let front = self.scene.geometric_normal(face.triangle());
        let way = self.view.direction(self.view.size.centre_of(pixel));
        let [corner, ..] = self.scene.corners(face.triangle());
        let distance = front.dot(corner - self.view.eye) / front.dot(way);
        let position = if distance.is_finite() { self.view.eye + way * distance } else { corner };
        Point { face, position, normal: if face.is_back() { -front } else { front } }
    }

    fn relation(&self, light: &Light, point: &Point) -> Relation {
        let turned_away = |to_light: Vec3| {
            if point.normal.dot(to_light) > 0.0 { Relation::Before } else { Relation::TurnedAway }
        };
        match &light.kind {
            LightKind::Point { position, .. } => turned_away(*position - point.position),
            LightKind::Lamp { position, lamp } => {
                let to_light = *position - point.position;
                let lit = lamp.intensity(-to_light.normalize_or_zero()) != Vec3::ZERO;
                if lit { turned_away(to_light) } else { Relation::BesideCone }
            }
            LightKind::Directional { direction, .. } => turned_away(-*direction),
            LightKind::Sun { direction, .. } => turned_away(*direction),
            LightKind::Environment(_) => Relation::Before,
            LightKind::Spot { position, direction, cos_inner, cos_outer, .. } => {
                let to_light = *position - point.position;
                let cosine = -to_light.normalize_or_zero().dot(*direction);
                let lit = spot_falloff(cosine, *cos_inner, *cos_outer) > 0.0;
                if lit { turned_away(to_light) } else { Relation::BesideCone }
            }
            LightKind::Area { triangles } => self.relation_to_lamp(triangles, point, turned_away),
        }
    }

    /// By the lamp's nearest triangle: the others may be hidden by it.
    fn relation_to_lamp(
        &self,
        triangles: &[TriangleId],
        point: &Point,
        turned_away: impl Fn(Vec3) -> Relation,
    ) -> Relation {
        let middle = |triangle: TriangleId| self.scene.corners(triangle).iter().sum::<Vec3>() / 3.0;
        let squared = |triangle: &TriangleId| middle(*triangle).distance_squared(point.position);
        let nearest = evenly(triangles).copied().min_by(|a, b| squared(a).total_cmp(&squared(b)));
        let Some(nearest) = nearest else { return Relation::Before };
        let to_lamp = middle(nearest) - point.position;
        let one_sided = self.scene.emission_side == EmissionSide::Front;
        let behind = self.scene.area_vector(nearest).dot(to_lamp) >= 0.0;
        if one_sided && behind { Relation::Behind } else { turned_away(to_lamp) }
    }
}

/// Some of the items, at most [`SAMPLES`].
fn evenly<T>(items: &[T]) -> impl Iterator<Item = &T> {
    items.iter().step_by(items.len().div_ceil(SAMPLES).max(1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::camera::{Camera, ImageSize};
    use crate::scene::material::{Material, MaterialId};

    const SIZE: ImageSize = ImageSize { width: 4, height: 4 };

    /// A square of 2 × 2 in the plane z = 0 whose front is +z, seen from z = 1 on all pixels, black.
    struct Picture {
        scene: Scene,
        camera: Camera,
        combined: Vec<Vec4>,
        layers: Layers,
        lights: Vec<LightState>,
    }

    impl Picture {
        fn new(light: LightKind) -> Self {
            let positions = [[-1., -1.], [1., -1.], [1., 1.], [-1., 1.]].map(|[x, y]| Vec3::new(x, y, 0.0)).to_vec();
            let scene = Scene {
                positions,
                triangles: vec![[0, 1, 2], [0, 2, 3]],
                triangle_materials: vec![MaterialId(0); 2],
                materials: vec![Material::grey("wall")],
                lights: vec![Light { name: "l".into(), kind: light }],
                ..Scene::default()
            };
            let camera = Camera { position: Vec3::Z, look_at: Vec3::ZERO, up: Vec3::Y, vertical_fov: 60.0 };
            let pixels = SIZE.pixels();
            let layers = Layers {
                kd: vec![[0.8; 3]; pixels],
                ks: vec![[0.0; 3]; pixels],
                face_id: vec![1; pixels],
                ..Layers::default()
            };
            Self { scene, camera, combined: vec![Vec4::ZERO; pixels], layers, lights: Vec::new() }
        }

        fn why(&self) -> String {
            let view = self.scene.view(&self.camera, SIZE);
            let (scene, view, display) = (&self.scene, &view, Display::default());
            let shown =
                Shown { scene, view, display, lights: &self.lights, combined: &self.combined, layers: &self.layers };
            shown.why_black().unwrap_or_default()
        }
    }

    fn point(position: Vec3) -> LightKind {
        LightKind::Point { position, intensity: Vec3::ONE }
    }

    fn contains(picture: &Picture, part: &str) {
        let said = picture.why();
        assert!(said.contains(part), "{part}: {said}");
    }

    #[test]
    fn a_picture_with_light_is_not_black() {
        let mut picture = Picture::new(point(Vec3::Z));
        contains(&picture, "something stands between");
        picture.combined[3] = Vec4::splat(0.1);
        assert_eq!(picture.why(), "");
        picture.layers.face_id.fill(0);
        assert_eq!(picture.why(), "", "the sky shows");
        picture.combined.fill(Vec4::ZERO);
        contains(&picture, "the camera sees nothing");
    }

    #[test]
    fn what_does_not_shine_or_reflect_is_named() {
        let mut picture = Picture::new(LightKind::Point { position: Vec3::Z, intensity: Vec3::ZERO });
        contains(&picture, "none of the scene's lights (1) shines");
        picture = Picture::new(point(Vec3::Z));
        picture.lights = vec![LightState::times(Vec3::ZERO)];
        assert_eq!(picture.why(), "", "it was switched off");
        picture.lights.clear();
        picture.layers.kd.fill([0.0; 3]);
        contains(&picture, "is black (material wall)");
    }

    #[test]
    fn where_lights_are_and_point_is_told_apart() {
        let mut behind = Picture::new(point(-Vec3::Z));
        contains(&behind, "faces away from the lights");
        behind.lights = vec![LightState { position: Some(Vec3::Z), ..LightState::default() }];
        contains(&behind, "something stands between");
        let travels = |direction: Vec3| LightKind::Directional { direction, irradiance: Vec3::ONE };
        contains(&Picture::new(travels(Vec3::Z)), "faces away from the lights");
        contains(&Picture::new(travels(-Vec3::Z)), "something stands between");
        let (position, direction) = (Vec3::Z, Vec3::Z);
        let spot = LightKind::Spot { position, direction, intensity: Vec3::ONE, cos_inner: 0.9, cos_outer: 0.8 };
        contains(&Picture::new(spot), "outside the cones");
    }

    #[test]
    fn lamps_seen_from_behind_are_told_from_lamps_that_are_hidden() {
        let mut picture = Picture::new(LightKind::Area { triangles: vec![TriangleId(2)] });
        let at = |z: f32| [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(|[x, y]| Vec3::new(x, y, z));
        picture.scene.positions.extend(at(2.0));
        picture.scene.triangles.push([4, 5, 6]);
        picture.scene.materials.push(Material { ke: Vec3::ONE, ..Material::grey("lamp") });
        picture.scene.triangle_materials.push(MaterialId(1));
        contains(&picture, "emit = \"both\"");
        picture.scene.emission_side = EmissionSide::Both;
        contains(&picture, "something stands between");
        picture.scene.emission_side = EmissionSide::Front;
        picture.scene.triangles[2] = [4, 6, 5];
        contains(&picture, "something stands between");
    }

    #[test]
    fn light_that_is_too_faint_comes_with_an_exposure() {
        let mut picture = Picture::new(point(Vec3::Z));
        picture.combined.fill(Vec4::splat(0.18 / 1024.0 / 4.0));
        contains(&picture, "--exposure 12 ");
    }

    #[test]
    fn a_camera_that_sees_nothing_says_where_the_scene_is() {
        let mut picture = Picture::new(point(Vec3::Z));
        picture.layers.face_id.fill(0);
        picture.camera.look_at = Vec3::Z * 2.0;
        contains(&picture, "behind it");
        picture.camera.look_at = Vec3::new(3.0, 0.0, 0.9);
        contains(&picture, "beside its view");
        (picture.camera.position, picture.camera.look_at) = (Vec3::Z * 1e4, Vec3::ZERO);
        contains(&picture, "smaller than a pixel");
    }

    #[test]
    fn a_camera_inside_something_is_told() {
        let mut picture = Picture::new(point(Vec3::Z * 9.0));
        picture.layers.face_id.fill(2);
        contains(&picture, "the camera is inside something");
        picture.layers.face_id[0] = 0;
        contains(&picture, "faces away from the lights");
    }
}
