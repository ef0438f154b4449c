//! Lists of indices put into ascending order, each once.

use super::ids::Id;

/// Indices from which on marks are faster than sorting, and words of marks for each of them up to which they are.
const MANY: usize = 128;
const WORDS_AN_INDEX: usize = 4;

/// Puts indices into ascending order, each once.
pub fn ascending<I: Id + Ord>(ids: &mut Vec<I>) {
    let bounds = ids.iter().fold((u32::MAX, 0), |(low, high), id| (low.min(id.number()), high.max(id.number())));
    let words = |(low, high): (u32, u32)| (high - low) as usize / u64::BITS as usize + 1;
    if ids.len() < MANY || words(bounds) > WORDS_AN_INDEX * ids.len() {
        ids.sort_unstable();
        ids.dedup();
    } else {
        by_marks(ids, bounds.0, words(bounds));
    }
}

/// The same of indices from `low` on within so many words of marks.
fn by_marks<I: Id>(ids: &mut Vec<I>, low: u32, words: usize) {
    let mut marks = vec![0_u64; words];
    for id in ids.drain(..) {
        let at = id.number() - low;
        marks[(at / u64::BITS) as usize] |= 1 << (at % u64::BITS);
    }
    for (mut word, first) in marks.into_iter().zip((low..).step_by(u64::BITS as usize)) {
        while word != 0 {
            ids.push(I::new(first + word.trailing_zeros()));
            word &= word - 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::ids::NodeId;
    use super::*;
    use crate::math::mix;

    #[test]
    fn each_index_comes_once_in_order_whether_sorted_or_marked() {
        let lists: [(usize, u32, u32); 6] = [
            (0, 0, 1),
            (1, 7, 1),
            (100, 0, 50),
            (3000, 1_000_003, 2000),
            (500, 0, u32::MAX - 1),
            (200, u32::MAX - 300, 299),
        ];
        for (count, low, range) in lists {
            let mut ids: Vec<NodeId> =
                (0..count as u64).map(|i| NodeId(low + (mix(i) % u64::from(range)) as u32)).collect();
            let expected: Vec<NodeId> =
                ids.iter().copied().collect::<std::collections::BTreeSet<_>>().into_iter().collect();
            ascending(&mut ids);
            assert_eq!(ids, expected, "{count} from {low}");
        }
    }
}
