//! The parts of a scene: triangles connected by welded positions.

use super::Scene;
use super::union::Union;
use glam::Vec3;

/// A connected part.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Part {
    /// Smallest coordinates.
    pub lo: Vec3,
    /// Largest coordinates.
    pub hi: Vec3,
    /// Area of its triangles, one side.
    pub area: f64,
    /// Its triangles, ascending.
    pub triangles: Vec<u32>,
}

impl Part {
    /// Length of the diagonal of its bounds.
    pub(super) fn diagonal(&self) -> f32 {
        (self.hi - self.lo).length()
    }

    /// The middle of its bounds.
    pub(super) fn centre(&self) -> Vec3 {
        self.lo.midpoint(self.hi)
    }
}

/// The parts in the order of their first triangles.
pub(super) fn find(scene: &Scene) -> Vec<Part> {
    let mut union = Union::new(scene.positions.len());
    for &[a, b, c] in &scene.triangles {
        union.join(a, b);
        union.join(b, c);
    }
    let mut part_of = vec![u32::MAX; scene.positions.len()];
    let mut parts: Vec<Part> = Vec::new();
    for (t, corners) in (0..).zip(&scene.triangles) {
        let slot = &mut part_of[union.root(corners[0]) as usize];
        if *slot == u32::MAX {
            *slot = parts.len() as u32;
            parts.push(Part { lo: Vec3::INFINITY, hi: Vec3::NEG_INFINITY, area: 0.0, triangles: Vec::new() });
        }
        let [a, b, c] = corners.map(|i| scene.positions[i as usize]);
        let part = &mut parts[*slot as usize];
        part.lo = part.lo.min(a).min(b).min(c);
        part.hi = part.hi.max(a).max(b).max(c);
        part.area += f64::from((b - a).cross(c - a).length()) * 0.5;
        part.triangles.push(t);
    }
    parts
}
