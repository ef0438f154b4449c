//! Light for faces that came into view and of which nothing is drawn yet: they show what surfaces around them do that look the same
//! way, so that none is black beside lit ones until their own light comes.
//!
//! Guessed at the corners of the faces, not in the image [Gortler96]: what is near in the image may lie far behind, and the same corner
//! gets the same light in the next image.

use super::light_volume::{LightVolume, Look, Sample};
use super::mesh::LuminanceMesh;
use super::plan::Visible;
use super::renderer::Renderer;
use super::shared::GpuSlot;
use crate::scene::{FaceId, Scene};
use glam::Vec3;

/// Frames that one volume fills, unless many triangles come in: light changes little from one to the next, and making a volume takes several
/// milliseconds.
const FRAMES: u32 = 8;
/// A volume is made anew when so many more triangles are drawn, as a share of those that it was made of.
const MORE: f32 = 0.125;

/// What faces are filled by.
pub(super) struct Filling {
    /// By triangle.
    looks: Vec<Look>,
    volume: Option<Volume>,
}

struct Volume {
    light: LightVolume,
    /// Drawn triangles that it was made of.
    triangles: u32,
    /// Frames that it still serves.
    frames: u32,
}

impl Filling {
    /// Has the next frame go by the light as it is then.
    pub(super) fn forget_light(&mut self) {
        self.volume = None;
    }

    fn light(&mut self, extent: f32, mesh: &LuminanceMesh) -> &LightVolume {
        let triangles = mesh.drawn_triangles.len() as u32;
        let serves = |volume: &Volume| volume.frames > 0 && triangles as f32 <= volume.triangles as f32 * (1.0 + MORE);
        let kept = self.volume.take().filter(serves);
        let mut volume = kept.unwrap_or_else(|| {
            let light = LightVolume::new(extent, samples(mesh, &self.looks));
            Volume { light, triangles, frames: FRAMES }
        });
        volume.frames -= 1;
        &self.volume.insert(volume).light
    }
}

impl Renderer {
    /// Fills each visible face of which nothing is drawn yet with light of what is drawn; the next frame shows it, if it draws all and
    /// nothing changes before. `scene` is the one that was loaded. Returns how many are filled: none if nothing is lit. Costs next to nothing
    /// where all faces are drawn.
    pub fn fill_faces(&mut self, scene: &Scene) -> usize {
        let visible = Visible { faces: &self.visible, by_id: &self.scene.by_id };
        let uncovered: Vec<FaceId> = visible.uncovered(&self.mesh).collect();
        if uncovered.is_empty() {
            return 0;
        }
        let filling = self.filling.get_or_insert_with(|| Filling { looks: Look::all(scene), volume: None });
        let volume = filling.light(self.extent, &self.mesh);
        let filled: Vec<_> = uncovered.iter().filter_map(|&face| Some((face, corners(volume, scene, face)?))).collect();
        let count = filled.len();
        self.mesh.fill(filled.into_iter());
        count
    }
}

/// Drawn triangles that a volume is made of, about: more take milliseconds, with corners scattered in memory.
const SAMPLES: usize = 1 << 15;

/// What drawn triangles show at one of their corners each.
fn samples(mesh: &LuminanceMesh, looks: &[Look]) -> impl Iterator<Item = Sample> {
    mesh.drawn().step_by(mesh.drawn_triangles.len() as usize / SAMPLES + 1).map(|id| {
        let drawn = mesh.drawn_triangles.get(id);
        let (slot, look) = (mesh.slots.get(drawn.slots[0]), looks[drawn.triangle().0 as usize]);
        Sample {
            position: slot.position,
            direction: look.direction(FaceId(drawn.face)),
            diffuse: slot.diffuse,
            specular: look.glossy.then_some(slot.specular),
            weight: slot.weight,
        }
    })
}

/// The corners of a face with the light to be expected there.
fn corners(volume: &LightVolume, scene: &Scene, face: FaceId) -> Option<[GpuSlot; 3]> {
    let front = scene.area_vector(face.triangle());
    let normal = if face.is_back() { -front } else { front };
    let is_glossy = scene.material(face.triangle()).is_glossy();
    let [a, b, c] = scene.corners(face.triangle()).map(|position| {
        let light = volume.at(position, normal)?;
        let specular = if is_glossy { light.specular } else { Vec3::ZERO };
        Some(GpuSlot { position, weight: 1.0, diffuse: light.diffuse, specular })
    });
    Some([a?, b?, c?])
}
