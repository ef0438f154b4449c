//! What vertices know of one light: a byte each, a word where that does not tell, and more only after very many rays.

use super::ids::{Id, VertexId};
use super::pool::map_bytes;
use super::sparse::{PAGE, Page};
use crate::estimate::visibility::{BYTES, Stored, Visibility};
use rustc_hash::FxHashMap;

/// Visibility by vertex.
#[derive(Clone, Debug, Default)]
pub struct VisibilityTable {
    pages: Vec<Option<Box<Vertices>>>,
    /// Of so many points that no word holds them.
    whole: FxHashMap<VertexId, Visibility>,
    /// Pages, and words that there is room for in them.
    held: [usize; 2],
}

/// What 64 vertices know.
#[derive(Clone, Debug)]
struct Vertices {
    bytes: [u8; PAGE],
    words: Page<u64>,
}

/// Bytes that say where else to look.
const WORD: u8 = BYTES;
const WHOLE: u8 = BYTES + 1;

impl VisibilityTable {
    /// What a vertex knows.
    #[must_use]
    pub fn get(&self, id: VertexId) -> Visibility {
        let Some(Some(page)) = self.pages.get(id.index() / PAGE) else { return Visibility::default() };
        let at = id.index() % PAGE;
        match page.bytes[at] {
            WORD => page.words.get(at).map_or(Visibility::default(), |&word| Visibility::of_word(word)),
            WHOLE => self.whole.get(&id).copied().unwrap_or_default(),
            byte => Visibility::of_byte(byte),
        }
    }

    /// Keeps what a vertex knows.
    pub fn set(&mut self, id: VertexId, visibility: Visibility) {
        let (number, at) = (id.index() / PAGE, id.index() % PAGE);
        if number >= self.pages.len() {
            self.pages.resize_with(number + 1, || None);
        }
        let [pages, room] = &mut self.held;
        let page = self.pages[number].get_or_insert_with(|| {
            *pages += 1;
            Box::new(Vertices { bytes: [0; PAGE], words: Page::default() })
        });
        if page.bytes[at] == WHOLE {
            self.whole.remove(&id);
        }
        page.bytes[at] = match visibility.stored() {
            Stored::Byte(byte) => byte,
            Stored::Word(_) => WORD,
            Stored::Whole => WHOLE,
        };
        match visibility.stored() {
            Stored::Word(word) => {
                let (place, grown) = page.words.entry(at, || word);
                *place = word;
                *room += grown;
            }
            _ => *room -= page.words.remove(at).map_or(0, |(_, given_back)| given_back),
        }
        if page.bytes[at] == WHOLE {
            self.whole.insert(id, visibility);
        }
    }

    /// Forgets what a vertex knows.
    pub fn reset(&mut self, id: VertexId) {
        if matches!(self.pages.get(id.index() / PAGE), Some(Some(_))) {
            self.set(id, Visibility::default());
        }
    }

    /// Bytes held.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let [pages, room] = self.held;
        let table = self.pages.capacity() * size_of::<usize>();
        table + pages * size_of::<Vertices>() + room * size_of::<u64>() + map_bytes(&self.whole)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::visibility::Origin;
    use crate::math::mix;

    /// After so many points, of which some are visible.
    fn sampled(points: u32, seed: u64) -> Visibility {
        let mut visibility = Visibility::default();
        (0..points).for_each(|i| visibility.push(mix(seed + u64::from(i)) & 3 == 0));
        visibility
    }

    #[test]
    fn a_vertex_knows_what_it_was_told_last() {
        let (mut table, mut told) = (VisibilityTable::default(), vec![Visibility::default(); 150]);
        for step in 0..5000_u64 {
            let id = (mix(step) % 150) as usize;
            let visibility = match mix(step + 1_000_000) % 6 {
                0 => sampled(1, step),
                1 | 2 => sampled((mix(step) % 60) as u32, step),
                3 => sampled((mix(step) % 500) as u32, step),
                4 => Visibility::taken_over(Origin::Inferred, (step % 2) as f32),
                _ => Visibility::taken_over(Origin::Deferred, (step % 11) as f32 / 10.0),
            };
            table.set(VertexId(id as u32), visibility);
            told[id] = visibility;
        }
        let same = |(id, told): (usize, &Visibility)| table.get(VertexId(id as u32)) == *told;
        assert!(told.iter().enumerate().all(same) && table.get(VertexId(10_000)) == Visibility::default());
        assert_eq!(table.whole.len(), told.iter().filter(|v| v.stored() == Stored::Whole).count());
        (0..150).for_each(|id| table.reset(VertexId(id)));
        assert!((0..150).all(|id| !table.get(VertexId(id)).is_known()) && table.whole.is_empty());
    }

    /// The mark is eight bytes a vertex and light that is sampled, a byte where it is not.
    #[test]
    fn what_is_known_of_a_light_takes_few_bytes() {
        let vertices = 1 << 14;
        let bytes = |visibility: Visibility| {
            let mut table = VisibilityTable::default();
            (0..vertices).for_each(|id| table.set(VertexId(id), visibility));
            table.bytes() as f32 / vertices as f32
        };
        let guessed = bytes(Visibility::taken_over(Origin::Deferred, 0.3));
        let [one, sixteen] = [1, 16].map(|points| bytes(sampled(points, 1)));
        assert!(guessed < 2.0 && one < 2.0 && sixteen < 10.0, "{guessed} {one} {sixteen}");
    }
}
