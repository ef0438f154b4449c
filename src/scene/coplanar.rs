//! Faces that overlap in one plane: which of them is seen, by the rasteriser and by rays alike.
//!
//! Exporters write both sides of a wall as two faces, lamps in the ceiling's own plane, markings on the road's. Rounding would
//! decide between them, another way at each pixel. Here one rule does: of the faces at a point of the plane the one is seen
//! that emits towards the eye, then one that shows its front, then that of the smaller patch, then the later in the file.
//! Distances to such a plane are computed from the plane, not from the triangles, so that they are equal to the bit and the rule
//! alone decides. So are those to triangles that are large against the scene, whose corners are too far away for it.

use super::ids::{FaceId, TriangleId};
use glam::DVec3;
use rustc_hash::FxHashMap;

/// Points p with normal · p = offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Unit normal.
    pub normal: DVec3,
    /// Distance from the origin along the normal, scene units.
    pub offset: f64,
}

/// How a triangle takes part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Member {
    /// Index of its plane.
    pub plane: u32,
    /// Ranks of its front and its back: of faces in one place the highest is seen.
    pub ranks: [u32; 2],
    /// Whether its front looks along the plane's normal.
    pub along: bool,
}

/// The triangles whose distance is that of a plane.
#[derive(Clone, Debug, Default)]
pub struct Coplanar {
    pub(super) planes: Vec<Plane>,
    pub(super) members: FxHashMap<TriangleId, Member>,
    /// Faces by rank.
    pub(super) order: Vec<FaceId>,
}

impl Coplanar {
    /// Whether there are none, as in most scenes.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.members.is_empty()
    }

    /// How a triangle takes part; `None` if it does not.
    #[must_use]
    pub fn member(&self, triangle: TriangleId) -> Option<Member> {
        self.members.get(&triangle).copied()
    }

    /// A plane by its index.
    #[must_use]
    pub fn plane(&self, index: u32) -> Plane {
        self.planes[index as usize]
    }

    /// The faces by rank: what is drawn later, at equal depth, is seen.
    pub fn by_rank(&self) -> impl Iterator<Item = (FaceId, Member)> + '_ {
        self.order.iter().map(|&face| (face, self.members[&face.triangle()]))
    }
}
