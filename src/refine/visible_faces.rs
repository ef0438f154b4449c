//! The faces that a view shows, and how those of the next differ. The pixels of a face that stays in view are sorted
//! among its leaves when that is of use, not when the camera moves.

use super::pixel_lists::Span;
use crate::cache::ids::NodeId;
use crate::scene::FaceId;

/// Bits a word of the set of faces.
const WORD: usize = u64::BITS as usize;

/// A face in view.
#[derive(Clone, Copy, Debug)]
pub struct VisibleFace {
    /// The face.
    pub face: FaceId,
    /// Its root.
    pub root: NodeId,
    /// Its pixels.
    pub pixels: u32,
    /// Where they are listed; `None` if the image is not known.
    pub span: Option<Span>,
    /// The pixels that its leaves were last given; `None` before they were given any.
    given: Option<u32>,
    /// Whether its leaves have those of an earlier view.
    outdated: bool,
}

/// The faces of a view in ascending order.
#[derive(Debug, Default)]
pub struct VisibleFaces {
    faces: Vec<VisibleFace>,
    /// Which they are, a bit for each face of the scene; with the number of those in the words before.
    set: Vec<(u64, u32)>,
    /// Faces whose leaves have the pixels of an earlier view, those last whose number has changed most.
    outdated: Vec<u32>,
    /// How many there are, and their pixels.
    outdated_faces: usize,
    outdated_pixels: u64,
    pixels: u64,
}

/// How two views differ.
#[derive(Debug, Default)]
pub struct FaceChanges {
    /// Roots of faces that went out of view.
    pub hidden: Vec<NodeId>,
    /// Places of the faces that came into view.
    pub revealed: Vec<usize>,
}

impl VisibleFaces {
    /// Takes the faces of another view, in ascending order with their pixels; `root` tells or makes the root of one that was
    /// not in view.
    pub fn replace(&mut self, faces: &[(FaceId, u32)], mut root: impl FnMut(FaceId) -> NodeId) -> FaceChanges {
        let before = std::mem::take(&mut self.faces);
        let mut changes = FaceChanges::default();
        let mut known = before.iter().peekable();
        self.faces.reserve_exact(faces.len());
        for (&(face, pixels), index) in faces.iter().zip(0..) {
            while let Some(gone) = known.next_if(|seen| seen.face < face) {
                changes.hidden.push(gone.root);
            }
            let seen = match known.next_if(|seen| seen.face == face) {
                Some(seen) => VisibleFace { pixels, span: None, outdated: true, ..*seen },
                None => {
                    changes.revealed.push(index);
                    VisibleFace { face, root: root(face), pixels, span: None, given: None, outdated: true }
                }
            };
            self.faces.push(seen);
        }
        changes.hidden.extend(known.map(|seen| seen.root));
        self.note_which();
        self.pixels = faces.iter().map(|(_, pixels)| u64::from(*pixels)).sum();
        (self.outdated_faces, self.outdated_pixels) = (self.faces.len(), self.pixels);
        self.queue_outdated();
        changes
    }

    fn note_which(&mut self) {
        let words = self.faces.last().map_or(0, |seen| seen.face.0 as usize / WORD + 1);
        self.set = vec![(0, 0); words];
        for VisibleFace { face, .. } in &self.faces {
            self.set[face.0 as usize / WORD].0 |= 1 << (face.0 as usize % WORD);
        }
        let mut count = 0;
        for (bits, before) in &mut self.set {
            *before = count;
            count += bits.count_ones();
        }
    }

    fn queue_outdated(&mut self) {
        let change = |face: &VisibleFace| face.pixels.abs_diff(face.given.unwrap_or(0));
        let mut order: Vec<(u32, std::cmp::Reverse<u32>)> =
            self.faces.iter().zip(0..).map(|(face, index)| (change(face), std::cmp::Reverse(index))).collect();
        order.sort_unstable();
        self.outdated = order.into_iter().map(|(_, index)| index.0).collect();
    }

    /// Bytes held.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let set = self.set.capacity() * size_of::<(u64, u32)>();
        self.faces.capacity() * size_of::<VisibleFace>() + set + self.outdated.capacity() * size_of::<u32>()
    }

    /// Where the pixels of each face are listed.
    pub fn set_spans(&mut self, spans: Vec<Span>) {
        self.faces.iter_mut().zip(spans).for_each(|(face, span)| face.span = Some(span));
    }

    /// Place of a face in the list.
    #[must_use]
    pub fn index_of(&self, face: FaceId) -> Option<usize> {
        let &(bits, before) = self.set.get(face.0 as usize / WORD)?;
        let bit = 1 << (face.0 as usize % WORD);
        (bits & bit != 0).then(|| before as usize + (bits & (bit - 1)).count_ones() as usize)
    }

    /// The faces.
    #[must_use]
    pub fn all(&self) -> &[VisibleFace] {
        &self.faces
    }

    /// Their roots.
    pub fn roots(&self) -> impl Iterator<Item = NodeId> + '_ {
        self.faces.iter().map(|face| face.root)
    }

    /// Place of a face in the list if its leaves have the pixels of an earlier view.
    #[must_use]
    pub fn outdated_index(&self, face: FaceId) -> Option<usize> {
        self.index_of(face).filter(|&index| self.faces[index].outdated)
    }

    /// Whether a view shows the same faces in as many pixels each.
    #[must_use]
    pub fn are(&self, faces: &[(FaceId, u32)]) -> bool {
        self.faces.len() == faces.len()
            && self.faces.iter().zip(faces).all(|(seen, &(face, pixels))| (seen.face, seen.pixels) == (face, pixels))
    }

    /// Whether so few pixels belong to faces whose leaves have those of an earlier view that sums over leaves tell of
    /// this one.
    #[must_use]
    pub const fn are_current(&self) -> bool {
        /// One pixel in so many.
        const FEW: u64 = 20;
        self.outdated_pixels * FEW <= self.pixels
    }

    /// Whether no leaf has the pixels of an earlier view.
    #[must_use]
    pub const fn all_are_current(&self) -> bool {
        self.outdated_faces == 0
    }

    /// Share of the pixels that faces have.
    #[must_use]
    pub fn share_of(&self, indices: &[usize]) -> f64 {
        let pixels: u64 = indices.iter().map(|&index| u64::from(self.faces[index].pixels)).sum();
        pixels as f64 / self.pixels.max(1) as f64
    }

    /// The place of the next face to bring up to date.
    pub fn next_outdated(&mut self) -> Option<usize> {
        while let Some(index) = self.outdated.pop() {
            if self.faces[index as usize].outdated {
                return Some(index as usize);
            }
        }
        None
    }

    /// Notes that the leaves of a face have been given its pixels.
    pub fn note_given(&mut self, index: usize) {
        let face = &mut self.faces[index];
        if std::mem::replace(&mut face.outdated, false) {
            self.outdated_faces -= 1;
            self.outdated_pixels -= u64::from(face.pixels);
        }
        face.given = Some(face.pixels);
    }

    /// Roots in view, whose leaves have their pixels.
    #[cfg(test)]
    pub fn of_roots(roots: &[NodeId]) -> Self {
        let mut faces = Self::default();
        let ids: Vec<(FaceId, u32)> = (0..roots.len() as u32).map(|index| (FaceId(2 * index), 1)).collect();
        faces.replace(&ids, |face| roots[face.0 as usize / 2]);
        (0..roots.len()).for_each(|index| faces.note_given(index));
        faces
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn root(face: FaceId) -> NodeId {
        NodeId(100 + face.0)
    }

    fn faces(of: &[(u32, u32)]) -> Vec<(FaceId, u32)> {
        of.iter().map(|&(face, pixels)| (FaceId(face), pixels)).collect()
    }

    #[test]
    fn what_came_and_went_is_told() {
        let mut view = VisibleFaces::default();
        let first = view.replace(&faces(&[(1, 10), (4, 5), (9, 0)]), root);
        assert_eq!((first.hidden, first.revealed), (vec![], vec![0, 1, 2]));
        let second = view.replace(&faces(&[(0, 1), (4, 8), (7, 2)]), root);
        assert_eq!((second.hidden, second.revealed), ([1, 9].map(|f| root(FaceId(f))).to_vec(), vec![0, 2]));
        assert_eq!(
            [0, 1, 4, 7, 9, 50].map(|f| view.index_of(FaceId(f))),
            [Some(0), None, Some(1), Some(2), None, None]
        );
        assert_eq!(view.roots().collect::<Vec<_>>(), [0, 4, 7].map(|f| root(FaceId(f))));
        let third = view.replace(&faces(&[]), root);
        assert_eq!((third.hidden.len(), view.index_of(FaceId(4))), (3, None));
    }

    #[test]
    fn faces_are_brought_up_to_date_by_how_much_has_changed() {
        let mut view = VisibleFaces::default();
        view.replace(&faces(&[(1, 10), (4, 50), (9, 0)]), root);
        assert!(!view.are_current());
        let order: Vec<usize> = std::iter::from_fn(|| {
            let index = view.next_outdated()?;
            view.note_given(index);
            Some(index)
        })
        .collect();
        assert_eq!(order, [1, 0, 2]);
        assert!(view.all_are_current());
        view.replace(&faces(&[(1, 40), (4, 51), (8, 9)]), root);
        assert_eq!(view.outdated_index(FaceId(4)), Some(1));
        assert_eq!(view.next_outdated(), Some(0), "by 30, where others changed by 1 and 9");
        view.note_given(0);
        view.note_given(2);
        assert_eq!((view.next_outdated(), view.outdated_index(FaceId(8))), (Some(1), None));
        view.note_given(1);
        assert!(view.are_current() && view.next_outdated().is_none());
        assert!(view.are(&faces(&[(1, 40), (4, 51), (8, 9)])) && !view.are(&faces(&[(1, 40), (4, 50), (8, 9)])));
    }
}
