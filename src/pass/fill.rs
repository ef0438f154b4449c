//! Light for faces that came into view and of which nothing is drawn yet: they show what surfaces around them do that look the same
//! way, so that none is black beside lit ones until their own light comes.
//!
//! Guessed at the corners of the faces, not in the image [Gortler96]: what is near in the image may lie far behind, and the same corner
//! gets the same light in the next image.

use super::filling::Filling;
use super::light_volume::LightVolume;
use super::plan::Visible;
use super::renderer::Renderer;
use super::shared::GpuSlot;
use crate::scene::{FaceId, Scene};
use glam::Vec3;

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
        let filling = self.filling.get_or_insert_with(|| Filling::new(scene));
        let volume = filling.light(self.extent, &self.mesh);
        let filled: Vec<_> = uncovered.iter().filter_map(|&face| Some((face, corners(volume, scene, face)?))).collect();
        let count = filled.len();
        self.mesh.fill(filled.into_iter());
        count
    }
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
