//! Typed indices of the cache's arenas: recyclable, so that they name nothing beyond a run (the permanent name of a
//! vertex is its key).

use std::fmt::{Debug, Formatter};
use std::marker::PhantomData;

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

/// An index or none, in four bytes.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Link<I> {
    /// The index's number, `u32::MAX` for none.
    number: u32,
    id: PhantomData<I>,
}

impl<I> Link<I> {
    /// No index.
    pub const NONE: Self = Self { number: u32::MAX, id: PhantomData };
}

impl<I: Id> Link<I> {
    /// The index, if there is one.
    #[must_use]
    pub fn get(self) -> Option<I> {
        (self.number != u32::MAX).then(|| I::new(self.number))
    }
}

impl<I> Default for Link<I> {
    fn default() -> Self {
        Self::NONE
    }
}

impl<I: Id> From<I> for Link<I> {
    fn from(id: I) -> Self {
        Self { number: id.number(), id: PhantomData }
    }
}

impl<I: Id> From<Option<I>> for Link<I> {
    fn from(id: Option<I>) -> Self {
        id.map_or(Self::NONE, Self::from)
    }
}

impl<I: Id + Debug> Debug for Link<I> {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        self.get().fmt(f)
    }
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
    /// A corner of a drawn triangle or the vertex that it shows all over: `triangle * 4 + place`.
    UseId,
    /// One of the slots that another lies between: `slot * 8 + place`.
    BetweenId,
    /// What a cell has found of a light: `cell * lights + light`.
    CountId,
}
