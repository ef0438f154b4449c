//! Triangles get names of their own: engines recycle ids, and a picture that still shows the triangle which had an id before must
//! not be taken for one that shows the present one.

use crate::refine::update::{DrawnId, Update};
use std::collections::HashMap;

/// Renames the triangles of a sequence of updates: no two of them share an id.
pub fn make_distinct(updates: &mut [Update]) {
    let mut names: HashMap<DrawnId, DrawnId> = HashMap::new();
    let mut next = 0;
    for update in updates {
        let given = std::mem::take(&mut update.patch_triangles);
        let listed = |range: &std::ops::Range<u32>| {
            given.get(range.start as usize..range.end as usize).unwrap_or_default().to_vec()
        };
        let patches: Vec<_> = update.patches.iter().map(|patch| (listed(&patch.old), listed(&patch.new))).collect();
        // What is replaced has its name already; what replaces it may have been given the id of another.
        let named = |drawn: &DrawnId, names: &HashMap<DrawnId, DrawnId>| names.get(drawn).copied().unwrap_or(*drawn);
        let old: Vec<Vec<DrawnId>> =
            patches.iter().map(|(old, _)| old.iter().map(|drawn| named(drawn, &names)).collect()).collect();
        for (id, _) in &mut update.drawn_triangles {
            names.insert(*id, DrawnId(next));
            *id = DrawnId(next);
            next += 1;
        }
        for ((patch, old), (given_old, new)) in update.patches.iter_mut().zip(old).zip(patches) {
            let new: Vec<DrawnId> = new.iter().map(|drawn| named(drawn, &names)).collect();
            // Other values of a triangle that this update defines: its name is the new one.
            let values =
                given_old.len() == new.len() && given_old.iter().map(|l| named(l, &names)).eq(new.iter().copied());
            let old = if values { new.clone() } else { old };
            let start = update.patch_triangles.len() as u32;
            update.patch_triangles.extend(old);
            let middle = update.patch_triangles.len() as u32;
            update.patch_triangles.extend(new);
            let end = update.patch_triangles.len() as u32;
            (patch.old, patch.new) = (start..middle, middle..end);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::refine::update::{DrawnTriangle, Patch, SlotId};
    use crate::scene::FaceId;

    fn update(defined: &[u32], patches: &[(&[u32], &[u32])]) -> Update {
        let mut update = Update::default();
        let drawn = DrawnTriangle { slots: [SlotId(0); 3], face: FaceId(0), level: 0, flat: None };
        update.drawn_triangles = defined.iter().map(|&id| (DrawnId(id), drawn)).collect();
        for (old, new) in patches {
            let start = update.patch_triangles.len() as u32;
            update.patch_triangles.extend(old.iter().chain(*new).map(|&id| DrawnId(id)));
            let (middle, end) = (start + old.len() as u32, update.patch_triangles.len() as u32);
            update.patches.push(Patch { face: FaceId(0), old: start..middle, new: middle..end });
        }
        update
    }

    #[test]
    fn a_recycled_id_becomes_another_name() {
        let mut updates = [
            update(&[7, 8], &[(&[], &[7]), (&[], &[8])]),
            update(&[3, 4], &[(&[7], &[3, 4]), (&[8], &[8])]),
            // 7 is used again; 8 gives way to it.
            update(&[7], &[(&[8], &[7]), (&[3], &[3])]),
        ];
        make_distinct(&mut updates);
        let lists = updates.each_ref().map(|u| u.patch_triangles.iter().map(|l| l.0).collect::<Vec<_>>());
        assert_eq!(lists, [vec![0, 1], vec![0, 2, 3, 1, 1], vec![1, 4, 2, 2]]);
        assert_eq!(updates[2].drawn_triangles[0].0, DrawnId(4));
        assert_eq!((updates[1].patches[1].old.clone(), updates[1].patches[1].new.clone()), (3..4, 4..5));
    }
}
