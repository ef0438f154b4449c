//! Cameras.

use super::document::Document;
use super::faults::Faults;
use super::nodes::Placed;
use crate::scene::camera::Camera;
use glam::{DVec3, Vec3};

/// A perspective camera: where it is and which way it looks.
#[derive(Clone, Debug)]
pub(in crate::scene) struct View {
    /// Its name.
    pub name: String,
    position: DVec3,
    forward: DVec3,
    up: DVec3,
    /// Full vertical field of view, degrees.
    vertical_fov: f32,
}

impl View {
    /// The camera of a node, if it has one that can be used; it is called by `number` where it has no name.
    pub(super) fn of(document: &Document, placed: &Placed, number: usize, faults: &mut Faults) -> Option<Self> {
        let node = document.root.nodes.get(placed.node)?;
        let index = node.camera?.value();
        let Some(camera) = document.root.cameras.get(index) else {
            faults.error("cameras", format!("node {}: there is no camera {index}", placed.node));
            return None;
        };
        let Some(perspective) = &camera.perspective else {
            faults.warn("cameras", format!("camera {index} is not a perspective one: it is left out"));
            return None;
        };
        let turned = |axis: DVec3| (placed.frame.matrix3 * axis).normalize_or_zero();
        let (position, forward, up) = (placed.frame.translation, turned(DVec3::NEG_Z), turned(DVec3::Y));
        let yfov = perspective.yfov;
        let has_angle = yfov > 0.0 && yfov < std::f32::consts::PI;
        if !has_angle || !position.as_vec3().is_finite() || forward.cross(up).length() < 1e-6 {
            let message = format!(
                "camera {index} has a yfov of {yfov} rad, or a node without a place or direction: it is left out"
            );
            faults.warn("cameras", message);
            return None;
        }
        let named = [&camera.name, &node.name].into_iter().flatten().find(|name| !name.is_empty());
        let name = named.cloned().unwrap_or_else(|| format!("camera {number}"));
        Some(Self { name, position, forward, up, vertical_fov: yfov.to_degrees() })
    }

    /// With `origin` as the origin.
    pub(super) fn from(&self, origin: DVec3) -> Self {
        Self { position: self.position - origin, ..self.clone() }
    }

    /// The camera; it looks at a point as far away as `middle`.
    pub(in crate::scene) fn towards(&self, middle: Vec3) -> Camera {
        let distance = self.position.distance(middle.as_dvec3()).max(1e-3 * self.position.length()).max(1e-6);
        Camera {
            position: self.position.as_vec3(),
            look_at: (self.position + self.forward * distance).as_vec3(),
            up: self.up.as_vec3(),
            vertical_fov: self.vertical_fov,
        }
    }
}
