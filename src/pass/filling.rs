//! The light by which faces are filled, kept for several frames.

use super::light_volume::{LightVolume, Look, Sample};
use super::mesh::LuminanceMesh;
use crate::scene::{FaceId, Scene};

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
    pub(super) fn new(scene: &Scene) -> Self {
        Self { looks: Look::all(scene), volume: None }
    }

    /// Has the next frame go by the light as it is then.
    pub(super) fn forget_light(&mut self) {
        self.volume = None;
    }

    /// The light by which a frame is filled.
    pub(super) fn light(&mut self, extent: f32, mesh: &LuminanceMesh) -> &LightVolume {
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
