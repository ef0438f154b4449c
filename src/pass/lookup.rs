//! The trees that pixels descend in update mode `lookup`: a face's drawn triangles by where they lie in it.
//!
//! A node is a face split 1→4 by the midpoints of its edges, as often as its level says. Its drawn triangles are one triangle, or
//! the 2 to 4 that meet finer neighbours at its edges. Which node a drawn triangle belongs to follows from its centroid and its level.

use super::device_array::DeviceArray;
use super::mesh::LuminanceMesh;
use super::shared::{GpuLookupNode, GpuLookupRoot, NONE};
use crate::error::{Error, Result};
use crate::refine::update::{DrawnId, Update};
use crate::scene::{FaceId, Scene, TriangleId};
use crate::vk::Device;
use glam::{DVec3, Vec3};

const EMPTY: GpuLookupNode = GpuLookupNode { child: NONE, stamp: 0, codes: 0, drawn_triangles: [NONE; 4] };

/// What is kept of a drawn triangle.
#[derive(Clone, Copy)]
struct NodeSlot {
    level: u8,
    /// The node that lists it, or `NONE`.
    node: u32,
}

/// The trees of all faces, with their arrays on the device.
pub(super) struct Lookup {
    pub nodes: DeviceArray<GpuLookupNode>,
    pub roots: DeviceArray<GpuLookupRoot>,
    /// Nodes in use and free fours of them, by the first.
    used: u32,
    free: Vec<u32>,
    places: Vec<NodeSlot>,
    corners: Vec<[Vec3; 3]>,
    /// Of the frame that draws what changes now.
    stamp: u32,
}

impl Lookup {
    pub(super) fn new(device: &Device, scene: &Scene) -> Result<Self> {
        let triangles = scene.triangles.len() as u32;
        let mut this = Self {
            nodes: DeviceArray::new(device, "lookup nodes")?,
            roots: DeviceArray::new(device, "lookup roots")?,
            used: 0,
            free: Vec::new(),
            places: Vec::new(),
            corners: (0..triangles).map(|t| scene.corners(TriangleId(t))).collect(),
            stamp: 1,
        };
        this.reset();
        Ok(this)
    }

    /// The trees of a mesh that was drawn without any.
    pub(super) fn of_mesh(
        device: &Device,
        scene: &Scene,
        mesh: &LuminanceMesh,
        level: impl Fn(DrawnId) -> u8,
    ) -> Result<Self> {
        let mut this = Self::new(device, scene)?;
        for id in mesh.drawn() {
            this.place(id).level = level(DrawnId(id));
            this.insert(FaceId(mesh.drawn_triangles.get(id).face), DrawnId(id), mesh)?;
        }
        Ok(this)
    }

    /// Forgets all drawn triangles.
    pub(super) fn reset(&mut self) {
        let faces = 2 * self.corners.len();
        self.roots.replace(vec![GpuLookupRoot { node: NONE, stamp: 0 }; faces]);
        self.nodes.replace(Vec::new());
        self.used = 0;
        self.free.clear();
        self.places.iter_mut().for_each(|place| place.node = NONE);
    }

    /// The stamp of what changed since the last call: what a frame draws.
    pub(super) const fn take_changed(&mut self) -> u32 {
        let stamp = self.stamp;
        self.stamp += 1;
        stamp
    }

    /// Takes changes in that the mesh has already.
    pub(super) fn apply(&mut self, update: &Update, mesh: &LuminanceMesh) -> Result<()> {
        for (id, drawn) in &update.drawn_triangles {
            self.place(id.0).level = drawn.level;
        }
        for patch in &update.patches {
            let [old, new] = [&patch.old, &patch.new]
                .map(|range| update.patch_triangles.get(range.start as usize..range.end as usize).unwrap_or_default());
            if old == new {
                new.iter().for_each(|drawn| self.touch(patch.face, self.places[drawn.0 as usize].node));
                continue;
            }
            old.iter().for_each(|&drawn| self.remove(drawn));
            for &drawn in new {
                self.insert(patch.face, drawn, mesh)?;
            }
        }
        Ok(())
    }

    fn place(&mut self, drawn_id: u32) -> &mut NodeSlot {
        let index = drawn_id as usize;
        if index >= self.places.len() {
            self.places.resize(index + 1, NodeSlot { level: 0, node: NONE });
        }
        &mut self.places[index]
    }

    /// The drawn triangles of a node are to be drawn.
    fn touch(&mut self, face: FaceId, node: u32) {
        if node != NONE {
            self.nodes.set(node, GpuLookupNode { stamp: self.stamp, ..self.nodes.get(node) });
            self.roots.set(face.0, GpuLookupRoot { stamp: self.stamp, ..self.roots.get(face.0) });
        }
    }

    fn remove(&mut self, drawn: DrawnId) {
        let id = std::mem::replace(&mut self.place(drawn.0).node, NONE);
        if id == NONE {
            return;
        }
        let mut node = self.nodes.get(id);
        if let Some(at) = node.drawn_triangles.iter().position(|&listed| listed == drawn.0) {
            // The others move up, their codes with them.
            node.drawn_triangles.copy_within(at + 1.., at);
            node.drawn_triangles[3] = NONE;
            let low = (1u32 << (8 * at)) - 1;
            node.codes = node.codes & low | node.codes >> 8 & !low;
            self.nodes.set(id, node);
        }
    }

    fn insert(&mut self, face: FaceId, drawn: DrawnId, mesh: &LuminanceMesh) -> Result<()> {
        let Some(&triangle) = self.corners.get(face.triangle().0 as usize) else {
            return Err(Error::Internal("a patch names a face outside its scene".to_owned()));
        };
        let mut corners = mesh.corners(drawn.0).map(|p| barycentrics(triangle, p));
        let mut centroid = (corners[0] + corners[1] + corners[2]) / 3.0;
        let mut node = self.root(face);
        for _ in 0..self.place(drawn.0).level {
            let child = child_of(centroid);
            node = self.first_child(node) + child as u32;
            centroid = in_child(centroid, child);
            corners = corners.map(|c| in_child(c, child));
        }
        self.prune(node);
        let mut record = self.nodes.get(node);
        let Some(at) = record.drawn_triangles.iter().position(|&listed| listed == NONE) else {
            return Err(Error::Internal("a node has more than four triangles".to_owned()));
        };
        record.drawn_triangles[at] = drawn.0;
        let keep = !(255u32 << (8 * at));
        record.codes = record.codes & keep | code(corners) << (8 * at);
        self.nodes.set(node, record);
        self.place(drawn.0).node = node;
        self.touch(face, node);
        Ok(())
    }

    fn root(&mut self, face: FaceId) -> u32 {
        let known = self.roots.get(face.0);
        if known.node != NONE {
            return known.node;
        }
        let node = self.used;
        self.used += 1;
        self.nodes.set(node, EMPTY);
        self.roots.set(face.0, GpuLookupRoot { node, ..known });
        node
    }

    fn first_child(&mut self, node: u32) -> u32 {
        let record = self.nodes.get(node);
        if record.child != NONE {
            return record.child;
        }
        let child = self.free.pop().unwrap_or_else(|| {
            self.used += 4;
            self.used - 4
        });
        (child..child + 4).for_each(|c| self.nodes.set(c, EMPTY));
        self.nodes.set(node, GpuLookupNode { child, ..record });
        child
    }

    /// A node that gets drawn triangles of its own has no children any more: they were merged.
    fn prune(&mut self, node: u32) {
        let record = self.nodes.get(node);
        if record.child != NONE {
            (record.child..record.child + 4).for_each(|child| self.prune(child));
            self.free.push(record.child);
            self.nodes.set(node, GpuLookupNode { child: NONE, ..record });
        }
    }
}

/// Barycentric coordinates of a point of a triangle's plane.
fn barycentrics([a, b, c]: [Vec3; 3], point: Vec3) -> DVec3 {
    let [a, b, c, p] = [a, b, c, point].map(|v| v.as_dvec3());
    let normal = (b - a).cross(c - a);
    let share = |x: DVec3, y: DVec3| (x - p).cross(y - p).dot(normal) / normal.length_squared();
    DVec3::new(share(b, c), share(c, a), share(a, b))
}

/// The child that a point of a node lies in: that of a corner, or the middle one.
fn child_of(point: DVec3) -> usize {
    (0..3).find(|&i| point[i] >= 0.5).unwrap_or(3)
}

/// A point of a node in a child; the middle child's corners are the middles of the edges opposite to the node's.
fn in_child(point: DVec3, child: usize) -> DVec3 {
    match child {
        3 => DVec3::ONE - 2.0 * point,
        corner => 2.0 * point - DVec3::AXES[corner],
    }
}

/// Where three corners lie in their node, in base 6: corners 0 to 2, the middles of the edges opposite to them 3 to 5.
fn code(corners: [DVec3; 3]) -> u32 {
    let place = |i: usize| if i < 3 { DVec3::AXES[i] } else { (DVec3::ONE - DVec3::AXES[i - 3]) * 0.5 };
    let nearest = |c: DVec3| {
        let distance = |i: &usize| c.distance_squared(place(*i));
        (0..6).min_by(|i, j| distance(i).total_cmp(&distance(j))).unwrap_or(0) as u32
    };
    corners.into_iter().fold(0, |code, corner| 6 * code + nearest(corner))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn children_tile_their_node_and_codes_name_places() {
        let point = DVec3::new(0.3, 0.45, 0.25);
        assert_eq!(child_of(point), 3);
        assert!((in_child(point, 3) - DVec3::new(0.4, 0.1, 0.5)).length() < 1e-12);
        let near_b = DVec3::new(0.2, 0.7, 0.1);
        assert_eq!(child_of(near_b), 1);
        assert!((in_child(near_b, 1) - DVec3::new(0.4, 0.4, 0.2)).length() < 1e-12);
        // Corner a, the middle of the edge opposite to c, corner c.
        assert_eq!(code([DVec3::X, DVec3::new(0.5, 0.5, 0.0), DVec3::Z]), 5 * 6 + 2);
        assert_eq!(code([DVec3::Z; 3]), 2 * 36 + 2 * 6 + 2);
    }

    #[test]
    fn barycentrics_are_exact_at_corners_and_middles() {
        let triangle = [Vec3::new(3.0, -1.0, 7.0), Vec3::new(4.5, 2.0, 7.5), Vec3::new(-2.0, 8.0, 6.0)];
        assert!((barycentrics(triangle, triangle[1]) - DVec3::Y).length() < 1e-12);
        let middle = (triangle[1] + triangle[2]) * 0.5;
        assert!((barycentrics(triangle, middle) - DVec3::new(0.0, 0.5, 0.5)).length() < 1e-7);
    }
}
