//! Names of triangles and of their sides.

/// A triangle of the scene: index into [`super::Scene::triangles`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TriangleId(pub u32);

/// One side of a triangle, the unit that receives light: a wall seen from both sides has two independent faces.
///
/// Packed as `triangle << 1 | side`; side 0 is the counter-clockwise (front) side. On the GPU the id image holds
/// `FaceId + 1`, and 0 where there is no geometry.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct FaceId(pub u32);

impl FaceId {
    /// The face of `triangle` on its front (`back == false`) or back side.
    #[must_use]
    pub const fn new(triangle: TriangleId, back: bool) -> Self {
        Self(triangle.0 << 1 | back as u32)
    }
    /// The triangle this is a side of.
    #[must_use]
    pub const fn triangle(self) -> TriangleId {
        TriangleId(self.0 >> 1)
    }
    /// Whether this is the clockwise side.
    #[must_use]
    pub const fn is_back(self) -> bool {
        self.0 & 1 == 1
    }
}
