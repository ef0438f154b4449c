//! What the engine draws, by slot.

use crate::scene::FaceId;
use glam::Vec3;

/// A triangle that the engine draws.
#[derive(Clone, Copy, Debug)]
pub struct Drawn {
    /// The face that it is a part of.
    pub face: FaceId,
    /// Splits above it.
    pub level: u8,
    /// Vertices, in the order of the triangle's front.
    pub slots: [u32; 3],
}

/// Positions, scene units, and unit shading normals of slots, on their sides.
#[derive(Clone, Debug, Default)]
pub struct Places(Vec<[Vec3; 2]>);

impl Places {
    /// Room for so many slots.
    #[must_use]
    pub fn new(count: usize) -> Self {
        Self(vec![[Vec3::ZERO; 2]; count])
    }

    /// Notes where a slot is.
    pub fn set(&mut self, slot: u32, position: Vec3, normal: Vec3) {
        self.0[slot as usize] = [position, normal];
    }

    /// Adds a slot; returns its number.
    pub fn push(&mut self, position: Vec3, normal: Vec3) -> u32 {
        self.0.push([position, normal]);
        self.0.len() as u32 - 1
    }

    /// Position of a slot, scene units.
    #[must_use]
    pub fn position(&self, slot: u32) -> Vec3 {
        self.0[slot as usize][0]
    }

    /// Unit shading normal of a slot.
    #[must_use]
    pub fn normal(&self, slot: u32) -> Vec3 {
        self.0[slot as usize][1]
    }
}
