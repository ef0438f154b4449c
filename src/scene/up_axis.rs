//! Which axis of a file points up.

use glam::Vec3;

/// Which axis of a file points up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum UpAxis {
    /// The y axis; the front is +z.
    #[default]
    Y,
    /// The z axis; the front is −y.
    Z,
}

impl UpAxis {
    /// All of them with the names that options use.
    pub const NAMES: [(&'static str, Self); 2] = [("y", Self::Y), ("z", Self::Z)];

    /// The direction up.
    #[must_use]
    pub const fn vector(self) -> Vec3 {
        match self {
            Self::Y => Vec3::Y,
            Self::Z => Vec3::Z,
        }
    }

    /// A direction of the file, from how far it goes right, up and to the front.
    pub(super) fn direction(self, [right, up, front]: [f32; 3]) -> Vec3 {
        let along = match self {
            Self::Y => Vec3::new(right, up, front),
            Self::Z => Vec3::new(right, -front, up),
        };
        along.normalize()
    }
}
