//! The mesh that a recording builds up, as the host knows it.

use crate::refine::update::{DrawnId, DrawnTriangle, Slot, SlotId, Update};
use crate::scene::FaceId;
use glam::Vec3;

/// A triangle by its id.
#[derive(Clone, Copy, Debug)]
struct Entry {
    triangle: DrawnTriangle,
    /// Whether it is part of the mesh.
    drawn: bool,
    /// The last update with a patch that draws it.
    changed: usize,
}

/// Slots and triangles, what is drawn, and when it last changed.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    slots: Vec<Option<Slot>>,
    drawn_triangles: Vec<Option<Entry>>,
    /// Updates taken in.
    updates: usize,
}

fn put<T: Clone>(items: &mut Vec<Option<T>>, index: u32, value: T) {
    let index = index as usize;
    if index >= items.len() {
        items.resize(index + 1, None);
    }
    items[index] = Some(value);
}

impl Mesh {
    /// Takes an update in. What it names of what was never defined is ignored.
    pub fn apply(&mut self, update: &Update) {
        self.updates += 1;
        update.slots.iter().for_each(|(id, slot)| put(&mut self.slots, id.0, *slot));
        for (id, drawn) in &update.drawn_triangles {
            let known = self.entry(*id).map_or((false, 0), |e| (e.drawn, e.changed));
            put(&mut self.drawn_triangles, id.0, Entry { triangle: *drawn, drawn: known.0, changed: known.1 });
        }
        let listed = |range: &std::ops::Range<u32>| {
            update.patch_triangles.get(range.start as usize..range.end as usize).unwrap_or_default()
        };
        for patch in &update.patches {
            listed(&patch.old).iter().for_each(|&drawn| self.edit(drawn, |entry| entry.drawn = false));
            let now = self.updates;
            listed(&patch.new).iter().for_each(|&drawn| {
                self.edit(drawn, |entry| (entry.drawn, entry.changed) = (true, now));
            });
        }
    }

    fn entry(&self, drawn: DrawnId) -> Option<&Entry> {
        self.drawn_triangles.get(drawn.0 as usize).and_then(Option::as_ref)
    }

    fn edit(&mut self, drawn: DrawnId, edit: impl FnOnce(&mut Entry)) {
        if let Some(Some(entry)) = self.drawn_triangles.get_mut(drawn.0 as usize) {
            edit(entry);
        }
    }

    /// Updates taken in.
    #[must_use]
    pub const fn updates(&self) -> usize {
        self.updates
    }

    /// The face that a triangle lies on.
    #[must_use]
    pub fn face(&self, drawn: DrawnId) -> Option<FaceId> {
        self.entry(drawn).map(|entry| entry.triangle.face)
    }

    /// Whether a triangle is part of the mesh.
    #[must_use]
    pub fn is_drawn(&self, drawn: DrawnId) -> bool {
        self.entry(drawn).is_some_and(|entry| entry.drawn)
    }

    /// Whether a triangle of the mesh is in a patch of an update after number `update`.
    #[must_use]
    pub fn changed_after(&self, drawn: DrawnId, update: usize) -> bool {
        self.entry(drawn).is_some_and(|entry| entry.drawn && entry.changed > update)
    }

    /// The triangles of the mesh, by id, with the contents of their slots.
    pub fn drawn(&self) -> impl Iterator<Item = (DrawnId, DrawnTriangle, [Slot; 3])> {
        let drawn = (0..)
            .zip(&self.drawn_triangles)
            .filter_map(|(id, e)| e.filter(|e| e.drawn).map(|e| (DrawnId(id), e.triangle)));
        drawn.map(|(id, drawn)| (id, drawn, drawn.slots.map(|slot| self.slot(slot))))
    }

    fn slot(&self, id: SlotId) -> Slot {
        let empty = Slot { position: Vec3::ZERO, weight: 0.0, diffuse: Vec3::ZERO, specular: Vec3::ZERO };
        self.slots.get(id.0 as usize).copied().flatten().unwrap_or(empty)
    }

    /// The first ids of slots and triangles that were never used.
    #[must_use]
    pub fn free_ids(&self) -> (SlotId, DrawnId) {
        (SlotId(self.slots.len() as u32), DrawnId(self.drawn_triangles.len() as u32))
    }
}
