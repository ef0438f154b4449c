//! Rays against triangles whose distance is that of their plane (`scene::coplanar`).

use super::Ray;
use crate::scene::TriangleId;
use crate::scene::coplanar::{Coplanar, Member};
use glam::DVec3;

/// Planes in the hierarchy's units, and how each leaf triangle takes part.
#[derive(Default)]
pub struct Sheets {
    planes: Vec<(DVec3, f64)>,
    /// By leaf triangle; empty where no triangle takes part.
    members: Vec<Option<Member>>,
}

/// Where a ray meets a plane.
#[derive(Clone, Copy, Debug)]
pub struct OnSheet {
    /// Distance in lengths of the ray's direction: the same to the bit for all triangles of the plane.
    pub t: f32,
    /// Of triangles at that distance the highest counts.
    pub rank: u32,
}

impl Sheets {
    /// Those of the leaf triangles `ids`, `None` where there is none; `scale` is what coordinates are multiplied by.
    pub fn new(coplanar: &Coplanar, ids: impl Iterator<Item = Option<TriangleId>>, scale: f32) -> Self {
        if coplanar.is_empty() {
            return Self::default();
        }
        let members: Vec<Option<Member>> = ids.map(|id| coplanar.member(id?)).collect();
        let count = members.iter().flatten().map(|member| member.plane + 1).max().unwrap_or(0);
        let plane = |index| {
            let plane = coplanar.plane(index);
            (plane.normal, plane.offset * f64::from(scale))
        };
        Self { planes: (0..count).map(plane).collect(), members }
    }

    /// Whether a leaf triangle takes part.
    pub fn has(&self, leaf: usize) -> bool {
        self.members.get(leaf).is_some_and(Option::is_some)
    }

    /// Where a ray, in the hierarchy's units, meets the plane of a leaf triangle that takes part; `None` behind its origin.
    pub fn meet(&self, ray: &Ray, leaf: usize) -> Option<OnSheet> {
        let member = self.members.get(leaf).copied().flatten()?;
        let (normal, offset) = self.planes[member.plane as usize];
        let slope = normal.dot(ray.direction.as_dvec3());
        let t = (offset - normal.dot(ray.origin.as_dvec3())) / slope;
        let is_back = (slope > 0.0) == member.along;
        (t >= 0.0 && t.is_finite()).then(|| OnSheet { t: t as f32, rank: member.ranks[usize::from(is_back)] })
    }
}
