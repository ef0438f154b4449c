//! What updates add up to, as the host keeps it: the whole drawn mesh, or the levels of its triangles alone.

use super::update::{DrawnId, DrawnTriangle, Patch, Slot, SlotId, Update};
use crate::error::{Error, Result};
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
pub struct HostMesh {
    slots: Vec<Option<Slot>>,
    drawn_triangles: Vec<Option<Entry>>,
    /// Updates taken in.
    updates: usize,
}

/// Writes an item by its index; `empty` stands where none was written.
fn put<T: Clone>(items: &mut Vec<T>, index: u32, value: T, empty: T) {
    let index = index as usize;
    if index >= items.len() {
        items.resize(index + 1, empty);
    }
    items[index] = value;
}

impl HostMesh {
    /// Takes an update in: slots, then drawn triangles, then patches, in their order.
    ///
    /// # Errors [`Error::Internal`] for an update that contradicts the mesh: what a patch replaces must be drawn,
    /// what it draws must be defined, on the patch's face, and not drawn.
    pub fn apply(&mut self, update: &Update) -> Result<()> {
        self.updates += 1;
        update.slots.iter().for_each(|(id, slot)| put(&mut self.slots, id.0, Some(*slot), None));
        for (id, triangle) in &update.drawn_triangles {
            let known = self.entry(*id).map_or((false, 0), |e| (e.drawn, e.changed));
            let entry = Entry { triangle: *triangle, drawn: known.0, changed: known.1 };
            put(&mut self.drawn_triangles, id.0, Some(entry), None);
        }
        for patch in &update.patches {
            update.listed(&patch.old).iter().try_for_each(|&id| self.remove(id))?;
            update.listed(&patch.new).iter().try_for_each(|&id| self.draw(id, patch.face))?;
        }
        Ok(())
    }

    fn remove(&mut self, id: DrawnId) -> Result<()> {
        let entry = self.drawn_triangles.get_mut(id.0 as usize).and_then(Option::as_mut).filter(|entry| entry.drawn);
        let entry = entry.ok_or_else(|| Error::Internal(format!("{id:?} is replaced but was not drawn")))?;
        entry.drawn = false;
        Ok(())
    }

    fn draw(&mut self, id: DrawnId, face: FaceId) -> Result<()> {
        let now = self.updates;
        let entry = self.drawn_triangles.get_mut(id.0 as usize).and_then(Option::as_mut);
        let entry = entry.filter(|entry| !entry.drawn && entry.triangle.face == face);
        let fault =
            || Error::Internal(format!("{id:?} is drawn twice, on another face than its patch's, or not defined"));
        let entry = entry.ok_or_else(fault)?;
        (entry.drawn, entry.changed) = (true, now);
        Ok(())
    }

    fn entry(&self, id: DrawnId) -> Option<&Entry> {
        self.drawn_triangles.get(id.0 as usize).and_then(Option::as_ref)
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

    /// A triangle by its id, drawn or not; `None` if it was never defined.
    #[must_use]
    pub fn triangle(&self, id: DrawnId) -> Option<DrawnTriangle> {
        self.entry(id).map(|entry| entry.triangle)
    }

    /// The slots that were written, by id.
    pub fn slots(&self) -> impl Iterator<Item = (SlotId, Slot)> {
        (0..).zip(&self.slots).filter_map(|(id, slot)| slot.map(|slot| (SlotId(id), slot)))
    }

    /// Contents of a slot; black, at the origin and without weight if it was never written.
    #[must_use]
    pub fn slot(&self, id: SlotId) -> Slot {
        let empty = Slot {
            position: Vec3::ZERO,
            weight: 0.0,
            diffuse: Vec3::ZERO,
            specular: Vec3::ZERO,
            light_vector: glam::Vec4::ZERO,
        };
        self.slots.get(id.0 as usize).copied().flatten().unwrap_or(empty)
    }

    /// An update that draws all of it where nothing is drawn, of the view and with the totals of another.
    #[must_use]
    pub fn whole(&self, of: &Update) -> Update {
        let mut whole =
            Update { generation: of.generation, sequence: of.sequence, stats: of.stats, ..Update::default() };
        whole.slots = self.slots().collect();
        for ((id, triangle, _), end) in self.drawn().zip(1..) {
            whole.drawn_triangles.push((id, triangle));
            whole.patch_triangles.push(id);
            whole.patches.push(Patch { face: triangle.face, old: end - 1..end - 1, new: end - 1..end });
        }
        whole
    }

    /// The first ids of slots and triangles that were never used.
    #[must_use]
    pub fn free_ids(&self) -> (SlotId, DrawnId) {
        (SlotId(self.slots.len() as u32), DrawnId(self.drawn_triangles.len() as u32))
    }
}

/// The level of each drawn triangle (how often its face was split to get it): a byte a triangle, where the mesh
/// itself is not needed.
#[derive(Clone, Debug, Default)]
pub struct Levels(Vec<u8>);

impl Levels {
    /// Takes an update in.
    pub fn apply(&mut self, update: &Update) {
        update.drawn_triangles.iter().for_each(|(id, drawn)| put(&mut self.0, id.0, drawn.level, 0));
    }

    /// All that were ever defined, with their levels.
    pub fn all(&self) -> impl Iterator<Item = (DrawnId, u8)> + '_ {
        (0..).map(DrawnId).zip(self.0.iter().copied())
    }

    /// Level of a triangle; 0 if it was never defined.
    #[must_use]
    pub fn of(&self, id: DrawnId) -> u8 {
        self.0.get(id.0 as usize).copied().unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An update that defines triangles of level 1 on face 0 and has one patch.
    fn update(generation: u32, defined: &[u32], old: &[u32], new: &[u32]) -> Update {
        let triangle = DrawnTriangle { slots: [SlotId(0); 3], face: FaceId(0), level: 1, flat: None };
        let (middle, end) = (old.len() as u32, (old.len() + new.len()) as u32);
        Update {
            generation,
            drawn_triangles: defined.iter().map(|&id| (DrawnId(id), triangle)).collect(),
            patches: vec![Patch { face: FaceId(0), old: 0..middle, new: middle..end }],
            patch_triangles: old.iter().chain(new).map(|&id| DrawnId(id)).collect(),
            ..Update::default()
        }
    }

    fn drawn(mesh: &HostMesh) -> Vec<u32> {
        mesh.drawn().map(|(id, ..)| id.0).collect()
    }

    #[test]
    fn patches_replace_what_is_drawn_and_a_new_view_adds_to_it() {
        let mut mesh = HostMesh::default();
        mesh.apply(&update(1, &[0], &[], &[0])).expect("drawn first");
        mesh.apply(&update(1, &[1, 2], &[0], &[1, 2])).expect("split");
        assert_eq!((drawn(&mesh), mesh.updates()), (vec![1, 2], 2));
        assert!(mesh.changed_after(DrawnId(1), 1) && !mesh.changed_after(DrawnId(1), 2));
        mesh.apply(&update(1, &[], &[1], &[1])).expect("new values");
        assert!(mesh.changed_after(DrawnId(1), 2) && !mesh.changed_after(DrawnId(2), 2));
        mesh.apply(&update(2, &[3], &[], &[3])).expect("another view");
        assert_eq!(drawn(&mesh), [1, 2, 3]);
        assert_eq!(mesh.free_ids(), (SlotId(0), DrawnId(4)));
    }

    #[test]
    fn the_whole_mesh_is_an_update_that_draws_it() {
        let (mut mesh, mut copy) = (HostMesh::default(), HostMesh::default());
        mesh.apply(&update(1, &[0, 5], &[], &[0, 5])).expect("drawn first");
        mesh.apply(&update(1, &[1, 2], &[0], &[1, 2])).expect("split");
        let whole = mesh.whole(&update(3, &[], &[], &[]));
        assert_eq!((whole.generation, whole.patches.len()), (3, 3));
        copy.apply(&whole).expect("drawn where nothing was");
        assert_eq!(drawn(&copy), drawn(&mesh));
    }

    #[test]
    fn contradictions_are_named() {
        let mut mesh = HostMesh::default();
        mesh.apply(&update(1, &[0], &[], &[0])).expect("drawn first");
        let fault = |update: &Update| mesh.clone().apply(update).map_err(|e| e.to_string()).expect_err("contradiction");
        assert!(fault(&update(1, &[1], &[1], &[])).contains("replaced but was not drawn"));
        assert!(fault(&update(1, &[], &[], &[0])).contains("drawn twice"));
        assert!(fault(&update(1, &[], &[0], &[7])).contains("not defined"));
        let mut elsewhere = update(1, &[1], &[0], &[1]);
        elsewhere.patches[0].face = FaceId(3);
        assert!(fault(&elsewhere).contains("another face"));
    }

    #[test]
    fn levels_are_kept_by_id() {
        let mut levels = Levels::default();
        levels.apply(&update(1, &[4], &[], &[4]));
        assert_eq!([0, 4, 9].map(|id| levels.of(DrawnId(id))), [0, 1, 0]);
    }
}
