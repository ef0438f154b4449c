//! Small scenes and caches built by hand, for unit tests.

use super::ids::{NodeId, SlotId};
use super::indirect_layer::Round;
use super::slot::Luminance;
use super::split::Split;
use super::store::Cache;
use super::weld::Weld;
use crate::estimate::hemisphere::Sample;
use crate::estimate::light_vector::LightVector;
use crate::scene::material::{Material, MaterialId};
use crate::scene::{FaceId, Scene, TriangleId};
use glam::{Vec2, Vec3};
use std::f32::consts::PI;
use std::sync::Arc;

/// A scene with the roots of the front faces of its triangles.
pub struct Rooted {
    pub scene: Scene,
    pub cache: Cache,
    pub roots: Vec<NodeId>,
}

/// Flat triangles of reflectance 0.8 between positions.
pub fn scene_of(positions: &[Vec3], triangles: &[[u32; 3]]) -> Scene {
    let mut scene = Scene {
        positions: positions.to_vec(),
        triangles: triangles.to_vec(),
        materials: vec![Material::grey("grey")],
        uvs: vec![[Vec2::ZERO; 3]; triangles.len()],
        triangle_materials: vec![MaterialId(0); triangles.len()],
        ..Scene::default()
    };
    scene.normals = (0..triangles.len() as u32).map(|t| [scene.geometric_normal(TriangleId(t)); 3]).collect();
    scene
}

/// A unit square on the floor, seen from above, of two triangles that share the diagonal from corner 0 to corner 2.
pub fn square() -> Rooted {
    rooted(scene_of(&[Vec3::ZERO, Vec3::Z, Vec3::new(1.0, 0.0, 1.0), Vec3::X], &[[0, 1, 2], [0, 2, 3]]))
}

/// A triangle on the floor, seen from above, with another beyond each of its edges, in their order.
pub fn star() -> Rooted {
    let [a, b, c] = [Vec3::ZERO, Vec3::Z, Vec3::new(0.9, 0.0, 0.3)];
    let positions = [a, b, c, a + b - c, b + c - a, c + a - b];
    rooted(scene_of(&positions, &[[0, 1, 2], [1, 0, 3], [2, 1, 4], [0, 2, 5]]))
}

/// The cache of a scene without lights, with its front faces.
pub fn rooted(scene: Scene) -> Rooted {
    let (mut cache, mut weld) = (Cache::new(&Arc::new(scene.clone()), 0), Weld::new(&scene));
    let faces = (0..scene.triangles.len() as u32).map(|t| FaceId::new(TriangleId(t), false));
    let roots = faces.map(|face| cache.root(&scene, &mut weld, face)).collect();
    Rooted { scene, cache, roots }
}

impl Rooted {
    /// Splits a leaf, its coarser neighbours before it.
    pub fn split(&mut self, leaf: NodeId) -> Split {
        while let Some(&coarser) = self.cache.topology.coarser_neighbours(leaf).first() {
            self.split(coarser);
        }
        self.cache.split(leaf)
    }

    /// All leaves.
    pub fn leaves(&self) -> Vec<NodeId> {
        let mut leaves = Vec::new();
        self.roots.iter().for_each(|&root| self.cache.topology.leaves(root, &mut leaves));
        leaves
    }

    /// Where a slot lies.
    pub fn position(&self, slot: SlotId) -> Vec3 {
        self.cache.vertices[self.cache.slots[slot].vertex].position
    }

    /// Has every slot show direct light of this diffuse luminance, without noise.
    pub fn show_direct(&mut self, diffuse: impl Fn(Vec3) -> f32) {
        for slot in self.cache.slots.ids() {
            let light = known(diffuse(self.position(slot)), 0.0);
            self.cache.slots[slot].set_direct(light);
        }
    }

    /// Has the vertex of a slot gather rays that find these diffuse luminances.
    pub fn gather(&mut self, slot: SlotId, found: &[f32]) {
        let vertex = self.cache.slots[slot].vertex;
        let position = self.cache.vertices[vertex].position;
        let round = Round { vertex, position, rays: found.len() as u32, sums: 1 };
        let sum = gathered(self.cache.slots[slot].normal(), found);
        self.cache.indirect.add(round, &[(slot, sum)]);
    }
}

/// Grey light of a diffuse luminance, with the variance of it.
pub fn known(diffuse: f32, variance: f32) -> Luminance {
    Luminance { diffuse: Vec3::splat(diffuse), variance, known: true, ..Luminance::default() }
}

/// What rays along a normal sum up to, each of which finds a diffuse luminance D: its mean irradiance is π times their mean.
pub fn gathered(normal: Vec3, found: &[f32]) -> LightVector {
    let mut sum = LightVector::default();
    for &diffuse in found {
        sum.push(normal, &Sample { direction: normal, radiance: Vec3::splat(diffuse), weight: PI });
    }
    sum
}
