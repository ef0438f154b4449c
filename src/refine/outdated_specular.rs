//! Faces whose S is for another eye than the view's.

use crate::cache::ids::SlotId;
use crate::scene::FaceId;
use glam::Vec3;

/// What is known of S where a new view does not wait for all of it.
#[derive(Debug, Default)]
pub struct OutdatedSpecular {
    /// Glossy faces in view, ascending, with the eye that S was last evaluated for; `None` if for none since the face came into view.
    pub(super) known: Vec<(FaceId, Option<Vec3>)>,
    /// Faces whose S is for another eye, those last whose highlights have changed most.
    pub(super) faces: Vec<FaceId>,
    /// Slots that were evaluated for the present eye.
    pub(super) slots: Vec<SlotId>,
}

impl OutdatedSpecular {
    /// How many faces have S for another eye.
    pub fn len(&self) -> usize {
        self.faces.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.faces.is_empty()
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let Self { known, faces, slots } = self;
        known.capacity() * size_of::<(FaceId, Option<Vec3>)>()
            + faces.capacity() * size_of::<FaceId>()
            + slots.capacity() * size_of::<SlotId>()
    }

    /// Takes the glossy faces of a new view, ascending.
    pub(super) fn replace(&mut self, glossy: impl Iterator<Item = FaceId>) {
        let before = std::mem::take(&mut self.known);
        let mut before = before.into_iter().peekable();
        self.known = glossy
            .map(|face| {
                while before.next_if(|(known, _)| *known < face).is_some() {}
                (face, before.next_if(|(known, _)| *known == face).and_then(|(_, eye)| eye))
            })
            .collect();
        self.faces.clear();
        self.slots.clear();
    }

    /// Notes that S of a face is for an eye; nothing for one that is not glossy.
    pub(super) fn note(&mut self, face: FaceId, eye: Vec3) {
        if let Ok(index) = self.known.binary_search_by_key(&face, |(known, _)| *known) {
            self.known[index].1 = Some(eye);
        }
    }
}
