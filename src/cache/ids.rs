//! Typed indices of the cache's arenas: recyclable, so that they name nothing beyond a run (the permanent name of a
//! vertex is its key).

/// An index of an arena or a table.
pub trait Id: Copy + Eq {
    /// The index with this number.
    fn new(number: u32) -> Self;

    /// Its number.
    fn number(self) -> u32;

    /// Its number, to index with.
    fn index(self) -> usize {
        self.number() as usize
    }
}

macro_rules! ids {
    ($($(#[$doc:meta])* $name:ident),* $(,)?) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub struct $name(pub u32);

        impl Id for $name {
            fn new(number: u32) -> Self {
                Self(number)
            }

            fn number(self) -> u32 {
                self.0
            }
        }
    )*};
}

ids! {
    /// A vertex: a place where light is sampled.
    VertexId,
    /// A vertex slot: one shading normal and gloss of a vertex, with the luminance shown there.
    SlotId,
    /// A node of the hierarchy.
    NodeId,
    /// An edge of the hierarchy.
    EdgeId,
    /// A drawn triangle, recycled when it is replaced.
    DrawnId,
}
