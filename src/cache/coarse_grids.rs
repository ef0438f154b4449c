//! Base vertices by place, in grids of spacings that shrink threefold: how coarser ones around a vertex are found.

use super::ids::VertexId;
use super::pool::{Pool, Table, map_bytes};
use super::vertex::Vertex;
use glam::{IVec3, Vec3};
use rustc_hash::FxHashMap;
use smallvec::SmallVec;

/// Spacings.
pub const LEVELS: usize = 3;
/// The widest spacing against the scene's scale.
const WIDEST: f32 = 1.0 / 24.0;
/// Ratio of one spacing to the next.
const RATIO: f32 = 3.0;
/// Coarser vertices are looked for within so many of their spacings.
const WITHIN: f32 = 2.5;
/// Coarser vertices that predict one.
pub(super) const MOST_PARENTS: usize = 6;
/// Least cosine between normals of vertices that have to do with each other.
const SAME_SIDE: f32 = 0.3;
/// Largest distance from the mean plane of two vertices against their distance.
const FLAT: f32 = 1.0 / 3.0;

/// Base vertices by place, a grid a spacing.
#[derive(Clone, Debug, Default)]
pub struct CoarseGrids {
    /// With their positions: most are too far off to be looked at.
    grids: [FxHashMap<IVec3, Vec<(VertexId, Vec3)>>; LEVELS],
    /// Entries of all cells.
    entries: usize,
    /// How many slots each vertex predicts.
    predicted: Table<VertexId, u32>,
}

/// A vertex near another.
#[derive(Clone, Copy, Debug)]
pub(super) struct Near {
    pub vertex: VertexId,
    /// Position relative to the other.
    pub offset: Vec3,
    pub distance: f32,
}

/// Vertices near one, nearest first.
pub(super) type Neighbours = SmallVec<[Near; MOST_PARENTS]>;

/// Spacing of a level, scene units; `scale` is the scene's.
pub(super) fn spacing(scale: f32, level: usize) -> f32 {
    scale * WIDEST * RATIO.powi(-(level as i32))
}

/// How far coarser vertices are looked for, scene units.
pub(super) fn within(scale: f32, level: usize) -> f32 {
    spacing(scale, level) * WITHIN
}

fn cell(scale: f32, level: usize, position: Vec3) -> IVec3 {
    (position / within(scale, level)).floor().as_ivec3()
}

impl CoarseGrids {
    /// Enters a vertex at `position` into a level and all finer ones.
    pub(super) fn add(&mut self, vertex: VertexId, position: Vec3, from: usize, scale: f32) {
        for level in from..LEVELS {
            self.entries += 1;
            self.grids[level].entry(cell(scale, level, position)).or_default().push((vertex, position));
        }
    }

    /// Takes a vertex at `position` out.
    pub(super) fn remove(&mut self, vertex: VertexId, position: Vec3, scale: f32) {
        for level in 0..LEVELS {
            let Some(list) = self.grids[level].get_mut(&cell(scale, level, position)) else { continue };
            let before = list.len();
            list.retain(|(other, _)| *other != vertex);
            self.entries -= before - list.len();
            if list.is_empty() {
                self.grids[level].remove(&cell(scale, level, position));
            }
        }
    }

    /// Notes that a vertex predicts one slot more, or one less.
    pub(super) fn note_predicts(&mut self, vertex: VertexId, more: bool) {
        let slots = &mut self.predicted[vertex];
        *slots = if more { *slots + 1 } else { slots.saturating_sub(1) };
    }

    /// Whether a vertex predicts any slot.
    pub(super) fn predicts(&self, vertex: VertexId) -> bool {
        self.predicted[vertex] > 0
    }

    /// Bytes held, but for room in the cells' lists.
    pub(super) fn bytes(&self) -> usize {
        let entries = self.entries * size_of::<(VertexId, Vec3)>();
        self.grids.iter().map(map_bytes).sum::<usize>() + entries + self.predicted.bytes()
    }

    /// The nearest vertices of a level or coarser on the same side of the same surface as `here`, nearest first.
    pub(super) fn near(
        &self,
        vertices: &Pool<VertexId, Vertex>,
        here: &Vertex,
        level: usize,
        scale: f32,
    ) -> Neighbours {
        let (centre, within) = (cell(scale, level, here.position), within(scale, level));
        let mut found = Neighbours::new();
        for i in 0..27 {
            let cell = centre + IVec3::new(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
            let others = self.grids[level].get(&cell).into_iter().flatten().copied();
            insert_near(&mut found, others, (vertices, here), within);
        }
        found
    }
}

impl Near {
    fn at(vertex: VertexId, position: Vec3, here: &Vertex) -> Self {
        let offset = position - here.position;
        Self { vertex, offset, distance: offset.length() }
    }

    /// Whether it is on the same side of the same surface as the other.
    fn is_related(&self, here: &Vertex, there: &Vertex) -> bool {
        let normals = here.normal() + there.normal();
        let is_flat = self.offset.dot(normals).abs() * 0.5 <= self.distance * FLAT;
        here.normal().dot(there.normal()) > SAME_SIDE && is_flat
    }

    fn comes_before(&self, other: &Self) -> bool {
        (self.distance, self.vertex) < (other.distance, other.vertex)
    }
}

/// Whether one is among the nearest few.
fn is_wanted(found: &Neighbours, near: &Near) -> bool {
    found.len() < MOST_PARENTS || found.last().is_none_or(|last| near.comes_before(last))
}

/// Adds those of others, with their positions, that are near a vertex, too.
pub(super) fn insert_near(
    found: &mut Neighbours,
    others: impl Iterator<Item = (VertexId, Vec3)>,
    (vertices, here): (&Pool<VertexId, Vertex>, &Vertex),
    within: f32,
) {
    for (vertex, position) in others {
        let near = Near::at(vertex, position, here);
        if near.distance <= within && is_wanted(found, &near) && near.is_related(here, &vertices[vertex]) {
            insert(found, near);
        }
    }
}

/// Keeps the nearest few in order.
fn insert(found: &mut Neighbours, near: Near) {
    let at = found.partition_point(|other| other.comes_before(&near));
    found.truncate(MOST_PARENTS - 1);
    found.insert(at, near);
}
